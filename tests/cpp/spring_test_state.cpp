// Parameters, inputs, states, impulses, escape.
#include <gtest/gtest.h>

#include <cmath>
#include <initializer_list>
#include <limits>
#include <string>
#include <vector>

#include "spring.hpp"
#include "spring_support.hpp"

using namespace spring_test;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// What is said of parameters that are refused.
std::string refusal(const Parameters& p) {
  try {
    Spring s(p);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "nothing was refused";
}

void expect(const std::string& message, std::initializer_list<const char*> parts) {
  for (const char* part : parts) EXPECT_NE(message.find(part), std::string::npos) << message;
}

Parameters softening() { return duffing(3.0, -0.2); }

const double hilltop = std::sqrt(3.0 / 0.2);
const double hilltop_energy = 9.0 / (4 * 0.2);  // k1²/4|k2|

/// Everything switched on: a stop, and normal compliance with a moving tip.
Parameters everything() {
  Parameters p = softening();
  p.displacement = -0.01;
  p.velocity = -0.4;
  p.damping = 0.1;
  p.contact_law = ContactLaw::normal_compliance;
  p.compliance_stiffness = 1e4;
  p.compliance_exponent = 1.5;
  p.stop_enabled = true;
  p.stop_position = -0.015;
  p.restitution = 0.5;
  return p;
}

/// What a step says that cannot be completed; the state must be as before.
std::string failure(Spring& spring, double size, const Inputs& inputs = {}) {
  const auto before = spring.state();
  try {
    spring.step(size, inputs);
  } catch (const spring::StepFailure& error) {
    EXPECT_EQ(numbers(spring.state()), numbers(before));
    return error.what();
  }
  return "the step was completed";
}

}  // namespace

TEST(SpringParameters, RefusalsNameParameterValueAndWhatIsAllowed) {
  Parameters p;
  p.stop_enabled = true;
  p.stop_position = 0.1;
  expect(refusal(p), {"displacement = 0", "stop_position = 0.1"});
  // No potential well: every motion would escape.
  p = softening();
  for (const double k1 : {0.0, -1.0}) {
    p.linear_stiffness = k1;
    expect(refusal(p), {"cubic_stiffness = -0.2", "linear_stiffness > 0"});
  }
  p = softening();
  p.displacement = 3.872;  // the hilltop is at 3.87298
  EXPECT_NO_THROW(Spring{p});
  p.displacement = -3.874;
  expect(refusal(p), {"displacement = -3.874", "3.87298"});
}

// The coupling repeats steps and compares with ==.
TEST(SpringState, RepeatedStepsAreBitIdentical) {
  for (const Parameters& p : {softening(), everything()}) {
    Spring s(p);
    Inputs inputs;
    inputs.contact_force = {0.3, -2.0, 11.0};
    inputs.tip_displacement = {-0.012, 0.05, 0.0};
    s.step(1e-3, inputs);
    s.apply_impulse(-0.01);
    const auto start = s.state();
    s.step(3e-2, inputs);
    const auto once = s.state();

    // Other sizes and forces in between, on the same object.
    for (const double size : {0.2, 1e-7, 5e-3}) {
      Inputs other;
      other.contact_force[0] = 10.0 * size;
      s.step(size, other);
    }
    s.restore(start);
    EXPECT_EQ(numbers(s.state()), numbers(start));
    s.step(3e-2, inputs);
    EXPECT_EQ(numbers(s.state()), numbers(once));

    // On another object, fresh or with a history.
    Spring fresh(p), used(p);
    used.step(0.13, inputs);
    for (Spring* other : {&fresh, &used}) {
      other->restore(start);
      other->step(3e-2, inputs);
      EXPECT_EQ(numbers(other->state()), numbers(once));
      EXPECT_EQ(other->acceleration(), s.acceleration());
      EXPECT_EQ(other->reaction(), s.reaction());
    }
  }
}

TEST(SpringState, ImpulseChangesTheVelocityByJOverM) {
  Parameters p = softening();
  p.mass = 2.0;
  p.velocity = 0.25;
  Spring s(p);
  s.apply_impulse(-1.5);
  EXPECT_EQ(s.velocity(), -0.5);
  EXPECT_EQ(s.kinetic_energy(), 0.25);
  EXPECT_EQ(s.displacement(), 0.0);
}

// ÿ = (−C + N + f_s − α_s ẏ − k1 y − k2 y³)/m at the end of the step, and of what observe() was given.
TEST(SpringState, AccelerationFollowsTheInputs) {
  Parameters p = softening();
  p.damping = 0.7;
  p.displacement = 0.5;
  p.velocity = -0.3;
  Spring s(p);
  Inputs inputs;
  inputs.contact_force = {1.0, 2.0, 6.0};
  inputs.foundation_force[0] = 0.5;
  inputs.external_force[0] = 0.25;
  const auto expected = [&](double force) {
    const double y = s.displacement(), z = s.velocity();
    return force - 0.7 * z - 3.0 * y + 0.2 * y * y * y;
  };
  s.observe(inputs);
  EXPECT_NEAR(s.acceleration(), expected(-0.25), 4 * epsilon);
  s.step(0.1, inputs);
  EXPECT_NEAR(s.acceleration(), expected(-1.0 - 0.2 - 0.03 + 0.75), 4 * epsilon);
}

// With 1e-6 of the hilltop's energy missing the motion turns back; its period (4K/ω) is many times the small one.
TEST(SpringEscape, JustBelowTheHilltopRuns) {
  const double amplitude = hilltop * (1.0 - 1e-6);
  const Duffing exact(3.0, -0.2, amplitude);
  Parameters p = softening();
  p.velocity = exact.velocity(0.75 * exact.period());  // through y = 0, upward
  Spring s(p);
  double highest = 0.0;
  const int steps = static_cast<int>(0.5 * exact.period() / 0.01);
  for (int i = 0; i < steps; ++i) {
    s.step(0.01, Inputs{});
    highest = std::max(highest, s.displacement());
  }
  EXPECT_LT(highest, hilltop);
  EXPECT_GT(highest, hilltop * (1.0 - 1e-5));
  EXPECT_LT(s.displacement(), 0.1);  // on its way back
  EXPECT_LT(s.velocity(), 0.0);
}

// With 10 % more energy than the hilltop's the top gets away: it reaches infinity at T = ∫dy/√(2(E − V)). Steps up to
// there are made; then the state stays, and what is said names the hilltop and the time.
TEST(SpringEscape, BeyondTheHilltopItRunsAway) {
  const double E = 1.1 * hilltop_energy;
  // y = tan x: the integrand is smooth and ends at a finite value.
  const auto integrand = [E](double x) {
    const double s = std::sin(x), c = std::cos(x);
    return 1.0 / std::sqrt(2.0 * (E * c * c * c * c - 1.5 * s * s * c * c + 0.05 * s * s * s * s));
  };
  double T = 0.0;
  constexpr int n = 20000;  // Simpson: error below 1e-12
  const double end = std::acos(0.0);
  for (int i = 0; i <= n; ++i)
    T += integrand(end * i / n) * (i == 0 || i == n ? 1.0 : i % 2 != 0 ? 4.0 : 2.0) * end / n / 3.0;

  for (const double sign : {1.0, -1.0}) {
    Parameters p = softening();
    p.velocity = sign * std::sqrt(2.0 * E);
    Spring s(p);
    double t = 0.0;
    bool escaped = false;
    for (int i = 0; i < 400 && !escaped; ++i) {
      const auto before = s.state();
      try {
        s.step(0.02, Inputs{});
        t += 0.02;
      } catch (const spring::StepFailure& failure) {
        escaped = true;
        const std::string text = failure.what();
        EXPECT_NEAR(t + std::stod(text.substr(text.find("fails after ") + 12)), T, 1e-9);
        EXPECT_EQ(numbers(s.state()), numbers(before));
        expect(failure.what(), {"run away, past its hilltop |y - unloaded| = 3.87298", "a step of 0.02 s fails after"});
      }
    }
    EXPECT_TRUE(escaped);
    EXPECT_GT(std::abs(s.displacement()), hilltop);
  }
}

// E = ½ z² + V(y) + y (the load is −1 N) is constant also past the hilltop, from where the load brings the top back.
TEST(SpringEscape, ALoadBringsItBack) {
  Parameters p;
  p.linear_stiffness = 1.0;
  p.cubic_stiffness = -1.0;
  p.displacement = 0.99;
  p.velocity = 0.1;
  Spring s(p);
  s.step(0.2, {});
  Inputs inputs;
  inputs.external_force[0] = -1.0;
  const double before = energy(s) + s.displacement();
  double highest = 0.0;
  while (s.velocity() > -1.0) {
    s.step(0.01, inputs);
    highest = std::max(highest, s.displacement());
    EXPECT_NEAR(energy(s) + s.displacement(), before, 1e-12);
  }
  EXPECT_NEAR(highest, 1.015, 1e-3);
}

// A force that pushes it over, within one long step; a hardening spring takes the same force.
TEST(SpringEscape, AForceCanPushItOver) {
  Inputs inputs;
  inputs.external_force[0] = 20.0;
  Spring s(softening());
  EXPECT_THROW(s.step(2.0, inputs), spring::StepFailure);
  Parameters p = softening();
  p.cubic_stiffness = 0.2;
  Spring hardening(p);
  EXPECT_NO_THROW(hardening.step(2.0, inputs));
}

// Whatever pulls harder than the spring pushes brings it back from there: E = ½mz² + V(y) + C y is constant.
TEST(SpringEscape, WhatPullsHarderHoldsItPastTheHilltop) {
  for (const bool contact : {true, false}) {
    Parameters p = softening();
    p.displacement = 0.99 * hilltop;
    p.velocity = 2.0;
    Inputs inputs;
    (contact ? inputs.contact_force : inputs.external_force)[0] = contact ? 20.0 : -20.0;
    Spring s(p);
    const double before = energy(s) + 20.0 * s.displacement();
    double highest = 0.0;
    while (s.velocity() > -2.0) {
      s.step(0.01, inputs);
      highest = std::max(highest, s.displacement());
    }
    EXPECT_NEAR(highest, 0.99 * hilltop + 0.1, 0.01);  // z²/2a
    EXPECT_NEAR(energy(s) + 20.0 * s.displacement(), before, 1e-12 * before);
  }
}

// A stop at the lower hilltop is met before the spring can fall over it; the upper hilltop stays open.
TEST(SpringEscape, AStopAtTheHilltopHoldsTheTop) {
  Parameters p = softening();
  p.stop_enabled = true;
  p.stop_position = -hilltop;
  p.velocity = -1.1 * std::sqrt(2.0 * hilltop_energy);
  p.restitution = 0.5;
  Spring s(p);
  const double before = energy(s);
  double impulses = 0.0;
  for (int i = 0; i < 40 && s.velocity() < 0.0; ++i) {
    s.step(0.1, Inputs{});
    impulses += s.stop_impulse();
  }
  EXPECT_GT(impulses, 0.0);
  EXPECT_NEAR(energy(s) + s.impact_loss(), before, 1e-11 * before);
  p.displacement = -hilltop;  // rests there: unstable, but held
  p.velocity = 0.0;
  Inputs weight;
  weight.external_force[0] = -1.0;
  Spring resting(p);
  resting.step(1.0, weight);
  EXPECT_TRUE(resting.seated());
  p.displacement = 0.0;
  p.velocity = 1.1 * std::sqrt(2.0 * hilltop_energy);
  Spring upward(p);
  EXPECT_THROW(upward.step(8.0, Inputs{}), spring::StepFailure);
}

// ω = 1e6 rad/s over 1000 s is 1.6e8 periods, hours of internal steps; over 0.1 ms it is 16.
TEST(SpringStep, WorkIsBounded) {
  Parameters p;
  p.linear_stiffness = 1e12;
  p.displacement = 1e-3;
  Spring s(p);
  expect(failure(s, 1e3), {"1000 s fails", "spans too much", "smaller step size"});
  s.step(1e-4, {});
  EXPECT_NEAR(s.displacement(), 1e-3 * std::cos(100.0), 1e-12);
  // Also where events, not the motion, are what is many: a bounce lasts 4 us.
  Parameters bouncing;
  bouncing.linear_stiffness = 0.0;
  bouncing.displacement = 1e-5;
  bouncing.stop_enabled = true;
  bouncing.stop_position = 0.0;
  Inputs pressed;
  pressed.external_force[0] = -5e6;
  Spring b(bouncing);
  expect(failure(b, 1.0, pressed), {"1 s fails", "spans too much", "smaller step size"});
}

// y = z₀(1 − e^{−γτ})/γ over 50/γ, which no Taylor polynomial of the start resolves: y and its integrals.
TEST(SpringStep, IntegralsOfAMotionThatDampingRules) {
  const double rate = 50.0, z = 2.0, decayed = -std::expm1(-rate);
  Parameters p;
  p.linear_stiffness = 0.0;
  p.damping = rate;
  p.velocity = z;
  Spring s(p);
  s.step(1.0, {});
  EXPECT_NEAR(s.displacement(), z / rate * decayed, 1e-12);
  EXPECT_NEAR(s.displacement_integral(), z / rate * (1.0 - decayed / rate), 1e-12);
  EXPECT_NEAR(s.displacement_integral_2(), z / rate * (0.5 - 1.0 / rate + decayed / rate / rate), 1e-12);
}

TEST(SpringStep, TooSmallAStepSaysSo) {
  Spring s(softening());
  s.step(1e-99, {});
  expect(failure(s, 1e-300), {"a step of 1e-300 s is too small", "at least 1e-100 s"});
}

// Finite numbers whose results are not: the motion, its energy, the force of the law inside.
TEST(SpringStep, ResultsThatAreNotFiniteAreRefused) {
  Inputs force;
  force.external_force[0] = 1e300;
  Parameters p;
  p.cubic_stiffness = 1.0;
  Spring hardening(p);
  expect(failure(hardening, 1.0, force), {"range of floating-point numbers"});
  Parameters heavy;
  heavy.mass = 1e300;
  heavy.velocity = 1e10;
  Spring planet(heavy);
  expect(failure(planet, 1e-3), {"range of floating-point numbers", "smaller inputs"});  // ½ m z²
  Parameters stiff;
  stiff.mass = 1e250;
  stiff.linear_stiffness = 1e200;
  stiff.displacement = 1e60;
  Spring bent(stiff);
  expect(failure(bent, 1e-3), {"range of floating-point numbers"});  // ½ k y²
  Parameters hard = stiff;
  hard.linear_stiffness = 0.0;
  hard.contact_law = ContactLaw::normal_compliance;
  hard.compliance_stiffness = 1e200;
  hard.compliance_exponent = 1.0;
  Spring squeezed(hard);
  expect(failure(squeezed, 1e-3), {"range of floating-point numbers"});  // ½ λ δ²
  Spring pressed(everything());
  Inputs tip;
  tip.tip_displacement = {-1e300, 0.0, 0.0};
  expect(failure(pressed, 1e-3, tip), {"range of floating-point numbers"});  // λ δ^p
}
