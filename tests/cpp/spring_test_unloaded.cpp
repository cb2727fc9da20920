// Where the spring is without force: the motion of one that is moved with all that it meets is the same motion.
#include <gtest/gtest.h>

#include <cmath>

#include "held_contact.hpp"
#include "spring.hpp"
#include "spring_support.hpp"

using namespace spring_test;

namespace {

constexpr double raised = 0.375;  // exact in binary, as the heights below

Parameters moved(Parameters p) {
  p.unloaded += raised;
  p.displacement += raised;
  p.stop_position += raised;
  return p;
}

struct ShiftedCase {
  const char* name;
  double cubic_stiffness, damping, exponent, compliance_damping;
  bool compliant, stop;
};

class ShiftedSpring : public testing::TestWithParam<ShiftedCase> {};

// A driven spring beside one that is higher by `raised`, with the stop and the tip. y is then rounded at 0.4 m instead
// of 0.02 m, by 6e-17 m; over some periods of a motion whose impacts and contacts carry that on it stays below 1e-12 m.
TEST_P(ShiftedSpring, MotionIsShiftedWithAllThatItMeets) {
  const ShiftedCase& c = GetParam();
  Parameters p;
  p.mass = 0.5;
  p.linear_stiffness = 40.0;
  p.cubic_stiffness = c.cubic_stiffness;
  p.damping = c.damping;
  p.displacement = 0.015625;
  p.velocity = -0.5;
  p.contact_law = c.compliant ? ContactLaw::normal_compliance : ContactLaw::external;
  p.compliance_exponent = c.exponent;
  p.compliance_damping = c.compliance_damping;
  p.stop_enabled = c.stop;
  p.stop_position = -0.03125;
  p.restitution = 0.5;
  // How many of the impacts that die out are counted goes by the tolerance of y: the same for both.
  p.relative_tolerance = 1e-15;
  p.absolute_tolerance = 1e-13;
  Spring s(p), high(moved(p));
  const double start = s.potential_energy();
  EXPECT_DOUBLE_EQ(high.potential_energy(), start);
  const double H = 0.01;
  double reached = 0.0;
  for (int i = 0; i < 300; ++i) {
    Inputs inputs;
    inputs.external_force = {3.0 * std::sin(0.05 * i) - 1.0, 1.0, -2.0};
    inputs.tip_displacement = {0.02 * std::cos(0.07 * i), 0.1, 0.0};
    s.step(H, inputs, i * H);
    inputs.tip_displacement[0] += raised;
    high.step(H, inputs, i * H);
    reached = std::max(reached, std::abs(s.displacement()));
    EXPECT_NEAR(high.displacement() - raised, s.displacement(), 1e-12) << c.name << ", step " << i;
    EXPECT_NEAR(high.velocity(), s.velocity(), 1e-10);
    EXPECT_NEAR(high.acceleration(), s.acceleration(), 1e-8);
    EXPECT_NEAR(high.jerk(0.0, 0.0), s.jerk(0.0, 0.0), 1e-6);
    EXPECT_NEAR(high.displacement_integral() - raised * H, s.displacement_integral(), 1e-13);
    EXPECT_NEAR(high.potential_energy(), s.potential_energy(), 1e-11);
    EXPECT_NEAR(high.spring_force(), s.spring_force(), 1e-9);
    EXPECT_NEAR(high.dissipated_energy(), s.dissipated_energy(), 1e-11);
    EXPECT_NEAR(high.contact_energy(), s.contact_energy(), 1e-10);
    EXPECT_NEAR(high.load_work(), s.load_work(), 1e-11);
    EXPECT_NEAR(high.stop_force(), s.stop_force(), 1e-8);
    EXPECT_EQ(high.seated(), s.seated());
  }
  EXPECT_EQ(high.impacts(), s.impacts());
  EXPECT_GT(reached, 0.015);
  EXPECT_GE(s.impacts(), c.stop ? 4 : 0);
}

INSTANTIATE_TEST_SUITE_P(Flights, ShiftedSpring,
                         testing::Values(ShiftedCase{"series", 900.0, 0.0, 3.0, 0.0, false, false},
                                         ShiftedCase{"softening", -100.0, 0.2, 3.0, 0.0, false, false},
                                         ShiftedCase{"decay", 900.0, 2000.0, 3.0, 0.0, false, false},
                                         ShiftedCase{"stop", 900.0, 0.1, 3.0, 0.0, false, true},
                                         ShiftedCase{"contact", 900.0, 0.0, 2.0, 0.5, true, false},
                                         ShiftedCase{"power by IDA", 900.0, 0.0, 1.5, 0.0, true, true}));

// Forces of the preload k1 x + k2 x³, x = −y₀, and of a load that holds it, to the bit: nothing moves.
TEST(UnloadedSpring, PreloadedSpringIsAtRestUnderItsForce) {
  Parameters p;
  p.linear_stiffness = 40.0;
  p.cubic_stiffness = 256.0;
  p.unloaded = 0.125;
  const double preload = -(40.0 * 0.125 + 256.0 * 0.125 * 0.125 * 0.125);  // −5.5 N
  Inputs inputs;
  inputs.external_force[0] = preload;
  Spring s(p);
  EXPECT_EQ(s.spring_force(), preload);
  EXPECT_EQ(s.potential_energy(), 40.0 / 2 * 0.015625 + 256.0 / 4 * 0.015625 * 0.015625);
  s.step(0.1, inputs);
  EXPECT_EQ(s.displacement(), 0.0);
  EXPECT_EQ(s.velocity(), 0.0);

  p.unloaded = -0.125;  // a stop carries the same force
  p.stop_enabled = true;
  p.stop_position = 0.0;
  Spring pressed(p);
  pressed.step(0.1, Inputs{});
  EXPECT_TRUE(pressed.seated());
  EXPECT_EQ(pressed.stop_force(), -preload);
}

// The hilltop of a softening spring is as far from where it is unloaded, and so is where it may start.
TEST(UnloadedSpring, HilltopIsAroundIt) {
  Parameters p;
  p.linear_stiffness = 4.0;
  p.cubic_stiffness = -1.0;  // hilltop 2 m
  p.unloaded = -3.0;
  p.displacement = -1.5;
  const double V = 4.0 / 2 * 2.25 - 1.0 / 4 * 2.25 * 2.25;
  EXPECT_DOUBLE_EQ(Spring(p).potential_energy(), V);
  p.displacement = 0.0;
  EXPECT_THROW(Spring{p}, std::invalid_argument);
}

}  // namespace
