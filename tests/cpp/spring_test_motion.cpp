// The free motion against exact solutions.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <vector>

#include "spring.hpp"
#include "spring_support.hpp"

using namespace spring_test;

struct DuffingCase {
  double k1, k2, amplitude, period;
};

class DuffingTest : public testing::TestWithParam<DuffingCase> {};

// Periods by an independent quadrature of the energy integral.
TEST_P(DuffingTest, PeriodOfTheReference) {
  const auto& c = GetParam();
  EXPECT_NEAR(Duffing(c.k1, c.k2, c.amplitude).period(), c.period, 4 * epsilon * c.period);
}

// Two periods in restarted macro steps of any size. Allowed: 2e-12 of the amplitude per radian of the motion for IDA
// (asked for less than 3e-14 per internal step), and 4e-15 per macro step, its rounding; both add up at worst linearly.
TEST_P(DuffingTest, FollowsEllipticFunctionsOverTwoPeriods) {
  const auto& c = GetParam();
  const Duffing exact(c.k1, c.k2, c.amplitude);
  for (const double H : {1e-3, 4e-3, 2e-2, 1e-1}) {
    Spring s(duffing(c.k1, c.k2, c.amplitude, 0.0));
    const int steps = static_cast<int>(2 * exact.period() / H);
    double error_y = 0.0, error_z = 0.0;
    for (int i = 1; i <= steps; ++i) {
      s.step(H, Inputs{});
      error_y = std::max(error_y, std::abs(s.displacement() - exact.displacement(i * H)));
      error_z = std::max(error_z, std::abs(s.velocity() - exact.velocity(i * H)));
    }
    const double bound = 2e-12 * exact.omega * steps * H + 4e-15 * steps;
    EXPECT_LT(error_y, bound * c.amplitude) << "H = " << H;
    EXPECT_LT(error_z, bound * c.amplitude * exact.omega) << "H = " << H;
  }
}

// One macro step of the size the coupling uses: y to the last bits, z to 1e-13 (the coupling solves for both).
TEST(Spring, LocalErrorOfOneStep) {
  Parameters p = duffing(3.0, -0.2, 0.0, 0.0);
  const Duffing exact(3.0, -0.2, 0.5);
  for (const double H : {1e-3, 4e-3}) {
    for (const double t : {0.1, 0.9, 1.7, 2.3}) {
      p.displacement = exact.displacement(t);
      p.velocity = exact.velocity(t);
      Spring s(p);
      s.step(H, Inputs{});
      // The reference itself carries the rounding of its argument: 2 ulp of 1.
      EXPECT_NEAR(s.displacement(), exact.displacement(t + H), 1e-15) << "H = " << H << ", t = " << t;
      EXPECT_NEAR(s.velocity(), exact.velocity(t + H), 1e-14) << "H = " << H << ", t = " << t;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(SofteningAndHardening, DuffingTest,
                         testing::Values(DuffingCase{3, -0.2, 0.5, 3.650498199690303},
                                         DuffingCase{3, -0.2, 1, 3.722052589119156},
                                         DuffingCase{150, 67, 0.5, 0.4928601810860745},
                                         DuffingCase{150, 67, 1, 0.4445955910654296}));

// Under a constant force, with the dissipated energy D = E(0) − E(t) + F (y − y(0)) of the exact motion.
TEST(Spring, DampedOscillatorAndItsDissipation) {
  const LinearOscillator exact{2.0, 3.0, 50.0, 7.0, 0.2, -1.0};
  const auto energy_of = [&](double t) {
    const double y = exact.displacement(t), z = exact.velocity(t);
    return exact.m / 2 * z * z + exact.k / 2 * y * y - exact.F * y;
  };
  for (const double H : {1e-3, 1e-2, 1e-1, 2.0}) {
    Parameters p = duffing(exact.k, 0.0, exact.y0, exact.z0);
    p.mass = exact.m;
    p.damping = exact.c;
    Spring s(p);
    Inputs inputs;
    inputs.external_force[0] = exact.F;
    const int steps = static_cast<int>(std::lround(2.0 / H));
    for (int i = 1; i <= steps; ++i) {
      s.step(H, inputs);
      // 1e-12 of the motion's size (0.4 m, 2 m/s, 4 J), the tolerance of y and z.
      ASSERT_NEAR(s.displacement(), exact.displacement(i * H), 4e-13) << "H = " << H << ", step " << i;
      ASSERT_NEAR(s.velocity(), exact.velocity(i * H), 2e-12) << "H = " << H << ", step " << i;
      ASSERT_NEAR(s.dissipated_energy(), energy_of(0.0) - energy_of(i * H), 4e-12) << "H = " << H << ", step " << i;
    }
  }
}

// m ÿ + c ẏ + k y = 0 with c² ≫ 4mk: rates r₁ ≈ −k/c, r₂ ≈ −c/m; the step is 1e5 times the fast time constant.
TEST(Spring, OverdampedStiffSpring) {
  Parameters p = duffing(10.0, 0.0, 0.1, 2.0);
  p.damping = 1e6;
  Spring s(p);
  const double r2 = -(p.damping + std::sqrt(p.damping * p.damping - 40.0)) / 2, r1 = 10.0 / r2;
  const double b = (p.velocity - r1 * p.displacement) / (r2 - r1), a = p.displacement - b;
  for (int i = 1; i <= 10; ++i) {
    s.step(0.1, Inputs{});
    EXPECT_NEAR(s.displacement(), a * std::exp(r1 * 0.1 * i) + b * std::exp(r2 * 0.1 * i), 1e-12 * p.displacement);
  }
  // ½ m z² is lost in the first microseconds, then ½ k y² slowly.
  EXPECT_NEAR(s.dissipated_energy(), 2.0 + 0.05 - energy(s), 1e-11);
}

// A free mass: y, ẏ and both integrals are polynomials, which the Taylor polynomial of the start holds exactly.
TEST(Spring, FreeMassUnderPolynomialForceIsExact) {
  Parameters p = duffing(0.0, 0.0, 0.3, -0.7);
  p.mass = 2.5;
  Inputs inputs;
  inputs.contact_force = {1.5, -40.0, 900.0};
  inputs.foundation_force = {0.25, 3.0, -100.0};
  inputs.external_force[0] = -2.0;
  const double f0 = -3.25 / 2.5, f1 = 43.0 / 2.5, f2 = -1000.0 / 2.5;
  for (const double t : {1e-4, 1e-2, 0.5}) {
    Spring s(p);
    s.step(t, inputs);
    const auto sum = [t](std::initializer_list<double> terms) {  // Σ termₖ tᵏ/k!
      double value = 0.0, factor = 1.0, k = 0.0;
      for (double term : terms) {
        value += term * factor;
        factor *= t / ++k;
      }
      return value;
    };
    const double scale = 0.3 + 0.7 * t + 3 * t * t + 20 * t * t * t;
    EXPECT_NEAR(s.displacement(), sum({0.3, -0.7, f0, f1, f2}), 4 * epsilon * scale);
    EXPECT_NEAR(s.velocity(), sum({-0.7, f0, f1, f2}), 4 * epsilon * (0.7 + 1.3 * t + 9 * t * t + 67 * t * t * t));
    EXPECT_NEAR(s.displacement_integral(), sum({0, 0.3, -0.7, f0, f1, f2}), 4 * epsilon * scale * t);
    EXPECT_NEAR(s.displacement_integral_2(), sum({0, 0, 0.3, -0.7, f0, f1, f2}), 4 * epsilon * scale * t * t);
    EXPECT_NEAR(s.acceleration(), sum({f0, f1, f2}), 4 * epsilon * (1.3 + 18 * t + 200 * t * t));
    EXPECT_LE(s.internal_steps(), 5);  // nothing left for IDA to resolve
  }
}

// m ÿ + k y = F₀ + F₁t + F₂t²/2: particular solution (F₀ − mF₂/k)/k + F₁t/k + F₂t²/2k, plus a free oscillation.
TEST(Spring, OscillatorUnderQuadraticForceWithIntegrals) {
  const double k = 30.0, w = std::sqrt(k), F0 = 2.0, F1 = -5.0, F2 = 80.0, y0 = 0.04, z0 = 0.6;
  const double p0 = (F0 - F2 / k) / k, p1 = F1 / k, p2 = F2 / k, a = y0 - p0, b = (z0 - p1) / w;
  Inputs inputs;
  inputs.external_force = {F0, F1, F2};
  for (const double H : {1e-3, 1e-2, 0.1, 0.4}) {
    Spring s(duffing(k, 0.0, y0, z0));
    const double start = energy(s);
    s.step(H, inputs);
    EXPECT_NEAR(s.load_work(), energy(s) - start, 1e-12);
    const double c = std::cos(w * H), sn = std::sin(w * H), vers = 2 * std::pow(std::sin(w * H / 2), 2);
    // 1e-12 of what y, ẏ have in size, the tolerance; the integrals to the same of H y, H² y.
    const double size = 0.15;
    EXPECT_NEAR(s.displacement(), p0 + p1 * H + p2 * H * H / 2 + a * c + b * sn, 1e-12 * size);
    EXPECT_NEAR(s.velocity(), p1 + p2 * H + w * (b * c - a * sn), 1e-12 * size * w);
    EXPECT_NEAR(s.displacement_integral(), p0 * H + p1 * H * H / 2 + p2 * H * H * H / 6 + (a * sn + b * vers) / w,
                1e-12 * size * H);
    EXPECT_NEAR(s.displacement_integral_2(),
                p0 * H * H / 2 + p1 * H * H * H / 6 + p2 * std::pow(H, 4) / 24 + (a * vers + b * (w * H - sn)) / k,
                1e-12 * size * H * H);
  }
}

// E + D − work of the forces is constant; all terms have their own way through the integrator. Damped, hardening,
// driven.
TEST(Spring, EnergyBalance) {
  Parameters p = duffing(150.0, 67.0, 0.4, 1.0);
  p.damping = 0.8;
  p.mass = 1.7;
  for (const double H : {1e-3, 4e-3, 2e-2}) {
    Spring s(p);
    const double start = energy(s);
    double work = 0.0, worst = 0.0;
    for (int i = 0; i < 1000; ++i) {
      Inputs inputs;
      inputs.contact_force[0] = 20.0 * std::sin(0.37 * i);
      const double before = s.displacement();
      s.step(H, inputs);
      work -= inputs.contact_force[0] * (s.displacement() - before);
      worst = std::max(worst, std::abs(energy(s) + s.dissipated_energy() - work - start));
    }
    // 1000 steps, each with 1e-14 of the energy (15 J at the start).
    EXPECT_LT(worst, 1e-11 * start) << "H = " << H;
  }
}

// No force that depends on y: an unstable spring (k1 < 0 = k2) and a hardening one without linear part run as well.
TEST(Spring, UnstableAndPurelyCubicSprings) {
  Spring inverted(duffing(-4.0, 0.0, 0.01, 0.0));
  inverted.step(1.0, Inputs{});
  EXPECT_NEAR(inverted.displacement(), 0.01 * std::cosh(2.0), 1e-13);
  Spring cubic(duffing(0.0, 8.0, 0.5, 0.0));
  const double before = energy(cubic);
  for (int i = 0; i < 100; ++i) cubic.step(0.02, Inputs{});
  EXPECT_NEAR(energy(cubic), before, 100 * 4e-14 * before);  // 4e-14 per step
}

// Looser tolerances are honoured, not ignored: fewer steps, errors within them.
TEST(Spring, TolerancesControlCostAndError) {
  const Duffing exact(150.0, 67.0, 1.0);
  long steps_before = 1000000;
  for (const double tolerance : {1e-12, 1e-9, 1e-6, 1e-3}) {
    Parameters p = duffing(150.0, 67.0, 1.0, 0.0);
    p.relative_tolerance = tolerance;
    p.absolute_tolerance = tolerance / 100;
    Spring s(p);
    s.step(0.2, Inputs{});  // 4 rad, several parts at any tolerance
    EXPECT_NEAR(s.displacement(), exact.displacement(0.2), 2 * tolerance);
    EXPECT_LT(s.internal_steps(), steps_before);
    steps_before = s.internal_steps();
  }
}

// Event location by bisection asks for ever smaller steps.
TEST(Spring, VerySmallSteps) {
  for (const double H : {1e-9, 1e-15, 1e-30, 1e-100}) {
    Spring s(duffing(3.0, -0.2, -0.01, -0.3));
    Inputs inputs;
    inputs.contact_force = {5.0, 1.0, 1.0};
    s.step(H, inputs);
    EXPECT_NEAR(s.displacement(), -0.01 - 0.3 * H, 2 * epsilon * 0.01);
    EXPECT_NEAR(s.displacement_integral(), -0.01 * H, 1e-7 * H);
  }
}

// From rest, where the first coefficients of the motion are 0, so that what the spring or the contact adds comes late
// in the series: m = 1, y = x = 0 under F = F₀ + F₁t + F₂t²/2. The reference is Picard's iteration on the polynomial
// ∫∫(F − k2 y³ − λ y^p), in which every coefficient that is left out would be missing.
TEST(Spring, ForcesThatActLateInTheSeriesCount) {
  using Powers = std::vector<long double>;
  constexpr std::size_t order = 120;
  const auto times = [](const Powers& a, const Powers& b) {
    Powers product(order, 0.0L);
    for (std::size_t i = 0; i < order; ++i)
      for (std::size_t j = 0; i + j < order; ++j) product[i + j] += a[i] * b[j];
    return product;
  };
  for (const spring::Polynomial& F : {spring::Polynomial{1, 0, 0}, {0, 2, 0}, {0, 0, 5}, {1, -1, 2}}) {
    for (const int p : {0, 2, 3, 4}) {  // 0: a cubic spring without contact
      Parameters parameters = p == 0 ? duffing(0.0, 2.0) : compliant(2.0, p);
      if (p > 0) parameters.linear_stiffness = 0.0;
      Powers y(order, 0.0L);
      for (std::size_t iteration = 0; iteration < order / 2; ++iteration) {
        Powers power = y;
        for (int i = 1; i < (p == 0 ? 3 : p); ++i) power = times(power, y);
        for (std::size_t k = 0; k + 2 < order; ++k) {
          const long double force = k < 2 ? F[k] : k == 2 ? F[2] / 2 : 0.0;
          y[k + 2] = (force - 2.0L * power[k]) / static_cast<long double>((k + 1) * (k + 2));
        }
      }
      Inputs inputs;
      inputs.external_force = F;
      Spring s(parameters);
      s.step(1.0, inputs);
      long double expected = 0.0L;
      for (const long double c : y) expected += c;
      EXPECT_NEAR(s.displacement(), static_cast<double>(expected), 1e-12) << "p = " << p << ", F = " << F[0] << F[1];
    }
  }
}

// The coupling finds C by a secant iteration on y(H; C): no jumps above rounding for nearby C. Against a line through
// 200 values of C; over a wide range the internal step sequence may change, by no more than the tolerance.
TEST(Spring, DisplacementDependsSmoothlyOnTheForce) {
  struct Case {
    double k1, k2, y, z, H, force;
  };
  for (const Case& c : {Case{3, -0.2, -0.0087, -0.25, 1e-3, 0.3}, Case{3, -0.2, -0.0087, -0.25, 4e-3, 300.0},
                        Case{150, 67, 0.05, 1.0, 4e-3, 50.0}, Case{3, -0.2, 0.5, 0.3, 0.1, 1.0}}) {
    for (const double range : {1e-10, 1e-6}) {
      Spring s(duffing(c.k1, c.k2, c.y, c.z));
      const auto start = s.state();
      std::vector<double> y, z;
      for (int i = 0; i < 200; ++i) {
        Inputs inputs;
        inputs.contact_force[0] = c.force * (1.0 + range * (i / 99.5 - 1.0));
        s.restore(start);
        s.step(c.H, inputs);
        y.push_back(s.displacement());
        z.push_back(s.velocity());
      }
      EXPECT_LT(roughness(y), 2 * epsilon * std::abs(c.y)) << "H = " << c.H << ", range " << range;
      EXPECT_LT(roughness(z), 2 * epsilon * std::max(std::abs(c.z), std::abs(z.back())))
          << "H = " << c.H << ", range " << range;
    }
  }
}
