// The contact force that is held over a step, between bodies that exchange values only between steps.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

#include "compliance.hpp"
#include "held_contact.hpp"
#include "spring.hpp"
#include "spring_support.hpp"

using spring::Compliance;
using spring::HeldContact;
using spring::TipMessage;
using spring_test::numbers;
using spring_test::pi;

namespace {

constexpr double m_tip = 0.3, m_top = 1.1;  // [kg]
constexpr double v = -0.8;                  // of the tip, which arrives [m/s]

struct FreeMass {
  double mass, x, v;
  void step(double H, double force) {
    x += H * (v + H * force / (2.0 * mass));
    v += H * force / mass;
  }
};

/// What a free mass answers to 1 N held over H: at the end of that step, and a step later.
std::array<double, 2> response(double mass, double H) { return {H * H / (2 * mass), 3 * H * H / (2 * mass)}; }

/// Two free masses, stepped as a tool does that reads all outputs before it sets inputs.
struct Collision {
  FreeMass tip, top;
  double H;
  HeldContact contact;
  TipMessage seen;

  Collision(const Compliance& law, double gap, double H)
      : tip{m_tip, gap, v}, top{m_top, 0.0, 0.0}, H(H), contact(law, m_top) {
    seen = message(H);
    contact.begin(seen, H, top.x, predict());
  }
  /// A free mass has the velocity ahead that it has now.
  TipMessage message(double size) const {
    const auto [r1, r2] = response(m_tip, size);
    return {tip.x, tip.v, tip.v, r1, r2};
  }
  HeldContact::Top predict() const {
    return [top = top, H = H](double force) mutable {
      FreeMass trial = top;
      trial.step(H, -force);
      return trial.x;
    };
  }
  void step() {
    const double force = contact.force();
    tip.step(H, force);
    top.step(H, -force);
    contact.advance(seen, H, top.x, predict());
    seen = message(H);
  }
  /// With the tip as it arrives.
  double energy() const {
    return 0.5 * tip.mass * tip.v * tip.v + 0.5 * top.mass * top.v * top.v + contact.energy(top.x, tip.x);
  }
};

}  // namespace

class HeldContactRebound : public testing::TestWithParam<std::tuple<double, double>> {};

// Momentum and energy leave one way to part: with the velocities of an elastic collision, whatever the step.
TEST_P(HeldContactRebound, IsElasticAtAnyStep) {
  const auto [exponent, omegaH] = GetParam();
  const Compliance law(1e6, exponent);
  const double mu = m_tip * m_top / (m_tip + m_top);
  const double depth = std::pow((exponent + 1) * mu * v * v / 2 / 1e6, 1 / (exponent + 1));
  const double H = omegaH * depth / -v;  // depth/|v|: about 1/ω
  Collision c(law, 0.37 * H * -v, H);
  const double before = c.energy();
  int touching = 0, steps = 0;
  for (; steps < 10 || c.contact.force() > 0.0; ++steps) {
    ASSERT_LT(steps, 1000);
    touching += c.contact.force() > 0.0;
    c.step();
    EXPECT_NEAR(c.contact.state().tip, c.tip.x, 1e-14 * (1 + std::abs(c.tip.x)));
    EXPECT_NEAR(c.energy(), before, 1e-11 * before) << steps;
  }
  EXPECT_GT(touching, 0);
  EXPECT_NEAR(c.tip.v, v * (m_tip - m_top) / (m_tip + m_top), 1e-11);
  EXPECT_NEAR(c.top.v, v * 2 * m_tip / (m_tip + m_top), 1e-11);
}

INSTANTIATE_TEST_SUITE_P(Laws, HeldContactRebound,
                         testing::Combine(testing::Values(1.0, 1.5, 3.0), testing::Values(0.1, 1.0, 10.0, 1000.0)));

// Where the depth hardly changes over a step the force is the law's own, to the last digits.
TEST(HeldContact, OverAVeryShortStepTheForceIsThatOfTheLaw) {
  const double H = 1e-10, force = 1e6 * std::pow(0.01 - v * H / 2, 1.5);
  EXPECT_NEAR(Collision(Compliance(1e6, 1.5), -0.01, H).contact.force(), force, 1e-13 * force);
}

// p = 1: δ = |v|/ω sin ωt, ω² = λ/μ. The force held at the discrete gradient is the midpoint rule: second order.
TEST(HeldContact, IsOfSecondOrderWhereTheStepResolvesTheContact) {
  const double lambda = 1e4, omega = std::sqrt(lambda * (1 / m_tip + 1 / m_top));
  std::array<double, 2> errors{};
  for (const int k : {0, 1}) {
    const int steps = 50 << k;
    Collision c(Compliance(lambda, 1.0), 0.0, 0.8 * pi / omega / steps);
    for (int i = 1; i <= steps; ++i) {
      c.step();
      const double exact = -v / omega * std::sin(omega * c.H * i);
      errors[k] = std::max(errors[k], std::abs(c.top.x - c.tip.x - exact));
    }
  }
  EXPECT_NEAR(errors[0] / errors[1], 4.0, 0.1);
  EXPECT_LT(errors[0], 1e-3 * -v / omega);
}

// Damped, nothing is lost but what dissipated() says, at any step; and with small ones the masses part as Hunt and
// Crossley's law has it: v/χ − ln(1 + χv)/χ² of the approach is the same before and after.
TEST(HeldContact, DampingIsBookedAtAnyStepAndRightAtSmallOnes) {
  const double chi = 0.7, omega = std::sqrt(1e4 * (1 / m_tip + 1 / m_top));
  const Compliance law(1e4, 1.0, chi);
  const auto invariant = [chi](double speed) { return speed / chi - std::log1p(chi * speed) / (chi * chi); };
  std::array<double, 3> errors{};
  for (std::size_t k = 0; k < 3; ++k) {
    Collision c(law, 0.0, k == 0 ? 100.0 / omega : pi / omega / (100.0 * static_cast<double>(k)));
    const double before = c.energy();
    double lost = 0.0;
    for (int i = 0; i < 10 || c.contact.force() > 0.0; ++i) {
      ASSERT_LT(i, 1000);
      c.step();
      EXPECT_GE(c.contact.dissipated(), lost);
      lost = c.contact.dissipated();
      EXPECT_NEAR(c.energy() + lost, before, 1e-12 * before);
    }
    EXPECT_GT(lost, 0.0);
    errors[k] = std::abs(invariant(c.top.v - c.tip.v) - invariant(-v));
  }
  EXPECT_LT(errors[2], 1e-3 * invariant(-v));
  EXPECT_NEAR(errors[1] / errors[2], 4.0, 1.0);
}

// The same of a damper c beside λ, and its restitution e^{−(π−2φ) tan φ}, sin φ = c/2√(λμ) (Schwager & Pöschel 2007).
TEST(HeldContact, KelvinVoigtIsBookedAtAnyStepAndRightAtSmallOnes) {
  const double mu = m_tip * m_top / (m_tip + m_top), omega = std::sqrt(1e4 / mu), phi = std::asin(0.2);
  const Compliance law(1e4, 1.0, 0.0, 0.4 * mu * omega);
  std::array<double, 3> errors{};
  for (std::size_t k = 0; k < 3; ++k) {
    Collision c(law, 0.0, k == 0 ? 100.0 / omega : pi / omega / (100.0 * static_cast<double>(k)));
    const double before = c.energy();
    double lost = 0.0;
    for (int i = 0; i < 10 || c.contact.force() > 0.0 || c.top.x > c.tip.x; ++i) {
      ASSERT_LT(i, 2000);
      c.step();
      EXPECT_GE(c.contact.force(), 0.0);
      EXPECT_GE(c.contact.dissipated(), lost);
      lost = c.contact.dissipated();
      EXPECT_NEAR(c.energy() + lost, before, 1e-12 * before);
    }
    errors[k] = std::abs(c.tip.v - c.top.v + v * std::exp(-(pi - 2 * phi) * std::tan(phi)));
  }
  EXPECT_LT(errors[2], 1e-3 * -v);
  EXPECT_LT(errors[2], errors[1]);
}

// Steps of a size that nobody has announced: forces have done other work than the law's. The energy of the pair, with
// what the contact owes, stays to rounding; of sizes alike less than a fifth of it is owed when the masses have parted.
TEST(HeldContact, EnergyStaysWhereTheStepSizeChanges) {
  for (const double chi : {0.0, 0.7}) {
    for (const double factor : {0.05, 0.5, 0.9, 1.1, 2.0, 20.0}) {
      for (int change = 1; change < 6; ++change) {
        const double H = 2e-4;
        Collision c(Compliance(1e6, 1.5, chi), -0.37 * H * v, H);
        const double before = c.energy(), all = 0.5 * m_tip * v * v;
        int steps = 0;
        for (double lost = 0.0; steps < 10 || c.contact.force() > 0.0; ++steps) {
          ASSERT_LT(steps, 1000);
          if (steps == change) c.H = factor * H;
          c.step();
          EXPECT_GE(c.contact.dissipated(), lost);
          lost = c.contact.dissipated();
          EXPECT_NEAR(c.energy() + lost, before, 1e-13 * all) << factor << ' ' << change << ' ' << steps;
        }
        const bool alike = 0.5 <= factor && factor <= 2.0;
        if (chi == 0.0 && alike) {
          EXPECT_NEAR(c.contact.state().debt, 0.0, 0.2 * all) << factor << ' ' << change;
        }
      }
    }
  }
}

// The same with another size in each step.
TEST(HeldContact, EnergyStaysWhereTheStepSizeAlwaysChanges) {
  Collision c(Compliance(1e6, 1.5), 0.0, 2e-4);
  const double before = c.energy();
  for (int i = 0; i < 200; ++i) {
    c.H = 2e-4 * (1.0 + 0.5 * std::sin(i));
    c.step();
    EXPECT_NEAR(c.energy(), before, 1e-13) << i;
  }
}

// A tool with nothing to pass on before its first step: the tip makes that and the next one under the force that was
// sent without a message, 0. What the contact has not taken from the bodies it owes, and takes then.
TEST(HeldContact, WithoutAMessageAtTheStartTheEnergyStays) {
  const double H = 1e-4, before = 0.5 * m_tip * v * v;
  Collision c(Compliance(1e6, 1.5), 0.0, H);
  c.tip.step(H, 0.0);
  c.contact.take_over(0.0, H, c.top.x, 0.0);
  c.seen = c.message(H);
  EXPECT_TRUE(c.contact.held());
  EXPECT_FALSE(c.contact.started());
  for (int i = 0; i < 100; ++i) {
    EXPECT_NEAR(c.energy(), before, 1e-13 * before) << i;
    c.step();
  }
  EXPECT_GT(c.tip.v, 0.0);
  EXPECT_NEAR(c.contact.state().debt, 0.0, 1e-13 * before);
}

// The tip alone has made the first step without the force: that shows in the third, and from then on the energy is
// again what it was.
TEST(HeldContact, AFirstForceThatTheTipDidNotMeetIsFoundOut) {
  Collision c(Compliance(1e6, 1.5), 0.0, 1e-4);
  const double before = c.energy(), force = c.contact.force();
  c.step();
  c.tip.x -= c.H * c.H * force / (2.0 * m_tip);
  c.tip.v -= c.H * force / m_tip;
  c.seen = c.message(c.H);
  EXPECT_FALSE(c.contact.first_force_missed(c.seen));
  c.step();
  EXPECT_TRUE(c.contact.first_force_missed(c.seen));
  for (int i = 0; i < 20; ++i) {
    c.step();
    EXPECT_FALSE(c.contact.first_force_missed(c.seen));
    EXPECT_NEAR(c.energy(), before, 1e-13 * before) << i;
  }
}

// With impacts on the foundation inside a step the top's place at its end is no longer smooth in the force.
TEST(HeldContact, EnergyIsConservedThroughImpactsOfTheTop) {
  const double H = 2e-3;
  spring::Parameters p;
  p.mass = 0.2;
  p.linear_stiffness = 30.0;
  p.stop_enabled = true;
  p.stop_position = -2e-4;
  spring::Spring top(p);
  FreeMass tip{m_tip, 0.0, v};
  const auto predict = [&] {
    const spring::Spring::State state = top.state();
    return [&top, state, H](double force) {
      spring::Inputs inputs;
      inputs.contact_force[0] = force;
      top.step(H, inputs);
      const double y = top.displacement();
      top.restore(state);
      return y;
    };
  };
  HeldContact contact(Compliance(1e7, 1.5), p.mass);
  const double g = 5.0;     // presses the tip down: it comes again and again
  const auto ahead = [&] {  // u(t+2H) = u + 2H (v − gH)
    const auto [r1, r2] = response(m_tip, H);
    return TipMessage{tip.x, tip.v, tip.v - g * H, r1, r2};
  };
  TipMessage seen = ahead();
  contact.begin(seen, H, 0.0, predict());
  double impulses = 0.0;
  for (int i = 0; i < 100; ++i) {
    spring::Inputs inputs;
    inputs.contact_force[0] = contact.force();
    tip.step(H, contact.force());
    tip.v -= g * H;
    tip.x -= g * H * H / 2;
    top.step(H, inputs);
    impulses += top.stop_impulse();
    contact.advance(seen, H, top.displacement(), predict());
    seen = ahead();
    const double energy = 0.5 * tip.mass * tip.v * tip.v + tip.mass * g * tip.x + top.kinetic_energy() +
                          top.potential_energy() + contact.energy(top.displacement(), tip.x);
    EXPECT_NEAR(energy, 0.5 * m_tip * v * v, 1e-11 * 0.5 * m_tip * v * v) << i;
  }
  EXPECT_GT(impulses, 0.0);
}

// Unknown under any force: there is none. Unknown above some force only: the one sought lies below.
TEST(HeldContact, WhereTheTopGoesMayBeUnknown) {
  constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  Collision c(Compliance(1e6, 1.5), 0.0, 1e-3);
  const double force = c.contact.force();
  EXPECT_GT(force, 0.0);
  Collision limited(Compliance(1e6, 1.5), 0.5, 1e-3);
  EXPECT_EQ(limited.contact.force(), 0.0);
  limited.contact.begin(c.seen, c.H, 0.0,
                        [top = c.predict(), force](double C) { return C > 1.01 * force ? unknown : top(C); });
  EXPECT_NEAR(limited.contact.force(), force, 1e-12 * force);
  c.contact.advance(c.seen, c.H, c.top.x, [](double) { return unknown; });
  EXPECT_FALSE(std::isfinite(c.contact.force()));
}

// Where the top goes is all but affine in the force, which hardly changes its slope from step to step: one trial tells
// the force, the second is the step. Where there is no contact the first is.
TEST(HeldContact, AForceTakesTwoTrials) {
  Collision c(Compliance(1e6, 1.5), 1e-2, 1e-4);
  int trials = 0;
  for (int touching = 0; touching < 3 || c.contact.force() > 0.0;) {
    const double force = c.contact.force();
    c.tip.step(c.H, force);
    c.top.step(c.H, -force);
    trials = 0;
    c.contact.advance(c.seen, c.H, c.top.x, [&trials, top = c.predict()](double C) {
      ++trials;
      return top(C);
    });
    c.seen = c.message(c.H);
    touching += c.contact.force() > 0.0;
    EXPECT_LE(trials, c.contact.force() > 0.0 ? 2 : 1);
  }
}

// A top on a stiff spring, √(k/m)·H = 0.3 … 100, on a tip that is held: each force is the one that does the law's work.
TEST(HeldContact, EnergyIsConservedOnAStiffSpring) {
  for (const double omegaH : {0.3, 3.0, 10.0, 32.0, 100.0}) {
    const double H = omegaH / 100.0;
    spring::Parameters p;
    p.linear_stiffness = 1e4;
    p.displacement = 0.02;
    spring::Spring top(p);
    const TipMessage seen{1e-4, 0.0, 0.0, 1e-12, 1e-12};
    long trials = 0;
    const auto predict = [&] {
      const spring::Spring::State state = top.state();
      return [&top, &trials, state, H](double force) {
        ++trials;
        spring::Inputs inputs;
        inputs.contact_force[0] = force;
        top.step(H, inputs);
        const double y = top.displacement();
        top.restore(state);
        return y;
      };
    };
    HeldContact contact(Compliance(1e4, 1.0), p.mass);
    const auto energy = [&] {
      return top.kinetic_energy() + top.potential_energy() + contact.energy(top.displacement());
    };
    contact.begin(seen, H, top.displacement(), predict());
    const double before = energy();
    const int steps = omegaH < 10.0 ? 100 : 10;
    for (int i = 0; i < steps; ++i) {
      spring::Inputs inputs;
      inputs.contact_force[0] = contact.force();
      top.step(H, inputs);
      contact.advance(seen, H, top.displacement(), predict());
      EXPECT_NEAR(energy(), before, 1e-7 * before) << omegaH;  // IDA's over 100 … 1000 rad
    }
    EXPECT_LT(trials, 9 * (steps + 1)) << omegaH;
  }
}

TEST(HeldContact, AForceOutOfRangeIsNoForce) {
  Collision c(Compliance(1e6, 1.5), 0.0, 1e-3);
  const double force = c.contact.force();
  c.contact.begin({-1e300, 0.0, 0.0, 1e-6, 0.0}, c.H, 0.0, c.predict());
  EXPECT_FALSE(std::isfinite(c.contact.force()));
  const auto state = c.contact.state();
  for (const double number : numbers(state)) EXPECT_TRUE(std::isfinite(number));  // what is saved is finite
  c.contact.begin(c.seen, c.H, 0.0, c.predict());
  EXPECT_NEAR(c.contact.force(), force, 1e-12 * force);
  c.contact.restore(state);
  EXPECT_EQ(numbers(c.contact.state()), numbers(state));
  EXPECT_FALSE(std::isfinite(c.contact.force()));
}

TEST(HeldContact, ATipThatLeavesTheRangeIsNoForce) {
  Collision c(Compliance(1e6, 1.5), 0.0, 1e3);
  c.contact.begin({1e300, 0.0, 1e306, 1e-6, 0.0}, c.H, 0.0, c.predict());
  EXPECT_FALSE(std::isfinite(c.contact.force()));
}

TEST(HeldContact, ARestoredStateGoesOnBitByBit) {
  Collision c(Compliance(1e6, 1.5), 1e-4, 1e-3);
  for (int i = 0; i < 2; ++i) c.step();
  const auto state = c.contact.state();
  Collision other(Compliance(1e6, 1.5), 0.3, 1e-3);
  other.contact.restore(state);
  other.tip = c.tip;
  other.top = c.top;
  other.seen = c.seen;
  for (int i = 0; i < 5; ++i) {
    c.step();
    other.step();
    EXPECT_EQ(numbers(c.contact.state()), numbers(other.contact.state()));
  }
  EXPECT_GT(c.tip.v, 0.0);  // the collision was among these steps
}
