// What the beam says of its tip two steps ahead.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "beam.hpp"
#include "beam_testing.hpp"

namespace beam {
namespace {

using testing::frequencies;
using testing::general_beam;
using testing::outputs;
using testing::variants;

/// Into motion, under forces that change.
void stir(Beam& b) {
  for (const double force : {0.0, 2.0, -1.0, 0.7}) b.step(0.011, {force, 0.0, 0.0}, 0.3);
}

// The steps are linear in the forces: the sum of forecast and responses is where they lead.
TEST(BeamForecast, WithTheResponsesItIsWhereTheTipGoesUnderAnyForces) {
  for (const Parameters& p : variants()) {
    for (const double H : {1e-3, 0.05, 2.0}) {
      const auto b = make_beam(p);
      stir(*b);
      const Beam::TipResponse r = b->tip_response(H);
      const double w = b->forecast(H), u = b->tip_displacement(), C1 = 3.0, C2 = -1.7;
      const double largest = std::abs(u) + std::abs(2 * H * w) + std::abs(r[0]) + std::abs(r[1]);
      b->step(H, {C1, 0.0, 0.0}, 0.3);
      b->step(H, {C2, 0.0, 0.0}, 0.3);
      EXPECT_NEAR(b->tip_displacement(), u + 2 * H * w + C1 * r[1] + C2 * r[0], 1e-12 * largest) << H;
    }
  }
}

// It is linear: without a tip force its rate is that of the tip's velocity over the same steps, a tip force adds what
// an impulse of the same number adds to the forecast, and the rate of a load what a load of the same number does.
TEST(BeamForecast, ItsRateIsThatOfTheMotion) {
  for (const Parameters& p : variants()) {
    for (const double H : {1e-3, 0.05, 2.0}) {
      const auto b = make_beam(p);
      stir(*b);
      const double v = b->tip_velocity(), w = b->forecast(H), C = -1.7, impulse = 0.2;
      b->set_forces(0.0, 0.3);
      const double rate = b->forecast_rate(H, {});
      const auto free = make_beam(p), struck = make_beam(p);
      for (Beam* other : {free.get(), struck.get()}) stir(*other);
      for (int i = 0; i < 2; ++i) free->step(H, {}, 0.3);
      const double by_velocity = (free->tip_velocity() - v) / (2 * H);
      EXPECT_NEAR(rate, by_velocity, 1e-12 * (std::abs(v) + std::abs(free->tip_velocity())) / H) << H;

      struck->apply_tip_impulse(impulse);
      const double by_force = C * (struck->forecast(H) - w) / impulse;
      b->set_forces(C, 0.3);
      EXPECT_NEAR(b->forecast_rate(H, {}) - rate, by_force, 1e-11 * (std::abs(rate) + std::abs(by_force))) << H;

      b->set_forces(0.0, 0.3);
      for (std::size_t i = 0; i < Loads::count; ++i) {
        const auto under = [&, i](double value) {
          Loads loads;
          loads.set(i, {value, 0.0, 0.0});
          struck->set_forces(0.0, loads);
          return struck->forecast(H);
        };
        Loads::Values rates{};
        rates[i] = 3.0;
        const double one = under(-0.7), other = under(2.3);
        EXPECT_NEAR(b->forecast_rate(H, rates) - rate, other - one,
                    1e-11 * (std::abs(rate) + std::abs(one) + std::abs(other)))
            << H << " " << Loads::names[i];
      }
    }
  }
}

// Short steps see the tip's mass alone: r = H²/2m, 3H²/2m up to (ωH)².
TEST(BeamForecast, ResponsesToShortStepsAreThoseOfTheTipMass) {
  const auto b = make_beam(general_beam(25));
  const double H = 1e-3 / frequencies(general_beam(25)).back();
  const Beam::TipResponse r = b->tip_response(H);
  EXPECT_NEAR(r[0] * 2 * b->tip_mass() / (H * H), 1.0, 1e-6);
  EXPECT_NEAR(r[1] * 2 * b->tip_mass() / (3 * H * H), 1.0, 1e-6);
}

TEST(BeamForecast, LeavesNoTrace) {
  for (const Parameters& p : variants()) {
    const auto b = make_beam(p), untouched = make_beam(p);
    stir(*b);
    stir(*untouched);
    b->forecast(0.02);
    b->forecast_rate(0.02, {1.0});
    b->tip_response(0.03);
    EXPECT_EQ(outputs(*b), outputs(*untouched));
    stir(*b);
    stir(*untouched);
    EXPECT_EQ(outputs(*b), outputs(*untouched));
  }
}

}  // namespace
}  // namespace beam
