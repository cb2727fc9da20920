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
      const std::array<double, 3> r = b->tip_response(H);
      const Beam::Forecast ahead = b->forecast(H);
      const double u = b->tip_displacement(), v = b->tip_velocity(), C1 = 3.0, C2 = -1.7;
      const double largest = std::abs(u) + std::abs(2 * H * ahead.velocity) + std::abs(r[0]) + std::abs(r[1]);
      const auto struck = make_beam(p);
      stir(*struck);
      struck->apply_tip_impulse(0.2);
      EXPECT_NEAR(struck->forecast(H).velocity, ahead.velocity + 0.2 * r[2],
                  1e-12 * (std::abs(ahead.velocity) + std::abs(r[2])));
      b->step(H, {C1, 0.0, 0.0}, 0.3);
      b->step(H, {C2, 0.0, 0.0}, 0.3);
      EXPECT_NEAR(b->tip_displacement(), u + 2 * H * ahead.velocity + C1 * r[1] + C2 * r[0], 1e-12 * largest) << H;
      const auto free = make_beam(p);
      stir(*free);
      for (int i = 0; i < 2; ++i) free->step(H, {}, 0.3);
      EXPECT_NEAR(free->tip_velocity(), v + 2 * H * ahead.acceleration,
                  1e-13 * (std::abs(v) + std::abs(free->tip_velocity())));
    }
  }
}

// It is linear in the load, exactly.
TEST(BeamForecast, DependsOnTheLoadAsItSays) {
  for (const Parameters& p : variants()) {
    const double H = 0.05;
    const auto b = make_beam(p);
    stir(*b);
    for (std::size_t i = 0; i < Loads::count; ++i) {
      const auto under = [&](double value) {
        Loads loads;
        loads.set(i, {value, 0.0, 0.0});
        b->set_forces(0.0, loads);
        return b->forecast(H);
      };
      const Beam::Forecast per_load = b->forecast_per_load(H, i), one = under(-0.7), other = under(2.3);
      EXPECT_NEAR(other.velocity - one.velocity, 3.0 * per_load.velocity,
                  1e-12 * (std::abs(one.velocity) + std::abs(other.velocity)));
      EXPECT_NEAR(other.acceleration - one.acceleration, 3.0 * per_load.acceleration,
                  1e-12 * (std::abs(one.acceleration) + std::abs(other.acceleration)));
    }
  }
}

// Short steps see the tip's mass alone: r = H²/2m, 3H²/2m up to (ωH)².
TEST(BeamForecast, ResponsesToShortStepsAreThoseOfTheTipMass) {
  const auto b = make_beam(general_beam(25));
  const double H = 1e-3 / frequencies(general_beam(25)).back();
  const std::array<double, 3> r = b->tip_response(H);
  EXPECT_NEAR(r[0] * 2 * b->tip_mass() / (H * H), 1.0, 1e-6);
  EXPECT_NEAR(r[1] * 2 * b->tip_mass() / (3 * H * H), 1.0, 1e-6);
}

TEST(BeamForecast, LeavesNoTrace) {
  for (const Parameters& p : variants()) {
    const auto b = make_beam(p), untouched = make_beam(p);
    stir(*b);
    stir(*untouched);
    b->forecast(0.02);
    b->forecast_per_load(0.02, Loads::distributed);
    b->tip_response(0.03);
    EXPECT_EQ(outputs(*b), outputs(*untouched));
    stir(*b);
    stir(*untouched);
    EXPECT_EQ(outputs(*b), outputs(*untouched));
  }
}

}  // namespace
}  // namespace beam
