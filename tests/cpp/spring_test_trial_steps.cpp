// Steps that are tried, of which the last may be the step itself.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "spring.hpp"
#include "spring_support.hpp"
#include "trial_steps.hpp"

using namespace spring_test;
using spring::TrialSteps;

namespace {

constexpr double H = 0.01;

Parameters hardening() { return duffing(40.0, 900.0, 0.1); }

Inputs pressed(double force) {
  Inputs inputs = weight(0.25);
  inputs.contact_force[0] = force;
  return inputs;
}

}  // namespace

TEST(TrialSteps, TheLastIsTheStepToTheBit) {
  Spring s(hardening()), other(hardening());
  TrialSteps trials(s);
  for (int i = 0; i < 50; ++i) {
    const double force = std::sin(0.3 * i);
    const auto before = numbers(s.state());
    trials.begin(H, pressed(0.0));
    trials.displacement_under(force + 1.0);
    const double reached = trials.displacement_under(force);
    EXPECT_EQ(numbers(s.state()), before);
    s.observe(pressed(7.0));  // what outputs refer to has no part in it
    ASSERT_TRUE(trials.adopt(H, pressed(force)));
    other.step(H, pressed(force));
    EXPECT_EQ(numbers(s.state()), numbers(other.state()));
    EXPECT_EQ(s.displacement(), reached);
  }
}

TEST(TrialSteps, OneOfAnotherStepIsNotAdopted) {
  Spring s(hardening());
  TrialSteps trials(s);
  EXPECT_FALSE(trials.adopt(H, Inputs{}));
  trials.begin(H, pressed(0.0));
  trials.displacement_under(1.0);
  trials.displacement_under(2.0);
  const auto start = s.state();
  Inputs steeper = pressed(2.0);
  steeper.external_force[1] = 1e-3;
  EXPECT_FALSE(trials.adopt(H, pressed(1.0)));
  EXPECT_FALSE(trials.adopt(H, steeper));
  EXPECT_FALSE(trials.adopt(std::nextafter(H, 1.0), pressed(2.0)));
  s.apply_impulse(1e-9);
  EXPECT_FALSE(trials.adopt(H, pressed(2.0)));
  EXPECT_GT(s.velocity(), 0.0);
  s.restore(start);
  EXPECT_TRUE(trials.adopt(H, pressed(2.0)));
  EXPECT_FALSE(trials.adopt(H, pressed(2.0)));  // it is made
}

// The time of an impact is that of the step.
TEST(TrialSteps, AnImpactIsNotAdopted) {
  Parameters p = hardening();
  p.stop_enabled = true;
  p.stop_position = 0.05;
  Spring s(p);
  TrialSteps trials(s);
  trials.begin(1.0, Inputs{});
  trials.displacement_under(2.0);
  EXPECT_FALSE(trials.adopt(1.0, pressed(2.0)));
  EXPECT_EQ(s.impacts(), 0);
}

TEST(TrialSteps, AStepThatCannotBeMadeHasNoEnd) {
  Parameters p;
  p.cubic_stiffness = -1.0;  // beyond 1 m it runs away
  Spring s(p);
  TrialSteps trials(s);
  trials.begin(10.0, Inputs{});
  EXPECT_TRUE(std::isnan(trials.displacement_under(1e3)));
  EXPECT_NE(trials.failure().find("the top has run away"), std::string::npos);
  EXPECT_FALSE(trials.adopt(10.0, pressed(1e3)));
  EXPECT_FALSE(std::isnan(trials.displacement_under(1e-3)));
}
