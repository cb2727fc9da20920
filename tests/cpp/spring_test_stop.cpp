// The foundation inside: Signorini's condition with restitution, rest and release.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "spring.hpp"
#include "spring_support.hpp"

using namespace spring_test;

// Free fall g from h: impacts at t₁ = √(2h/g) and then after flights 2vₖ/g, vₖ = eᵏ g t₁; all are over at
// t₁ (1 + e)/(1 − e). Compared at many times with the parabola of the flight it must be in.
TEST(SpringStop, BouncesFollowTheGeometricSeries) {
  const double g = 9.81, h = 0.8, e = 0.5, m = 1.6, t1 = std::sqrt(2 * h / g), zeno = t1 * (1 + e) / (1 - e);
  for (const double H : {1e-3, 0.0371, 0.2}) {
    Parameters p = ball(h, 0.0, e);
    p.mass = m;
    Spring s(p);
    double impulses = 0.0;
    for (int i = 1; i * H < zeno + 0.5; ++i) {
      s.step(H, weight(m * g), (i - 1) * H);
      impulses += s.stop_impulse();
      const double t = i * H;
      double start = -t1, speed = g * t1, momentum = 0.0;  // of the flight that began at `start`
      int impacts = 0;
      while (t >= start + 2 * speed / g && speed > 1e-6) {
        start += 2 * speed / g;
        momentum += m * speed * (1 + e);
        speed *= e;
        ++impacts;
      }
      if (speed <= 1e-6) break;  // so close to the end that rounding decides which flight it is
      const double tau = t - start;
      ASSERT_NEAR(s.displacement(), speed * tau - g / 2 * tau * tau, 1e-13) << "t = " << t;
      ASSERT_NEAR(s.velocity(), speed - g * tau, 1e-12) << "t = " << t;
      ASSERT_NEAR(impulses, momentum, 1e-12) << "t = " << t;
      ASSERT_EQ(s.impacts(), impacts) << "t = " << t;
      ASSERT_NEAR(s.last_impact(), impacts > 0 ? start : -1.0, 1e-12) << "t = " << t;
      ASSERT_FALSE(s.seated());
    }
  }
}

// It comes to rest at the end of the series, not before and not long after: the bounces that are cut short would have
// risen less than the tolerance of y, which takes √(8·tol/g)/(1 − e) < 1e-6 s.
TEST(SpringStop, ImpactsThatDieOutEndSeated) {
  const double m = 100.0, g = 10.0, h = 1.0, e = 0.5, zeno = std::sqrt(2 * h / g) * (1 + e) / (1 - e);
  Parameters p = ball(h, 0.0, e);
  p.mass = m;
  Spring before(p), after(p);
  before.step(zeno - 1e-6, weight(m * g));
  EXPECT_FALSE(before.seated());
  after.step(zeno + 1e-6, weight(m * g));
  EXPECT_TRUE(after.seated());
  EXPECT_EQ(after.displacement(), 0.0);
  EXPECT_EQ(after.velocity(), 0.0);
  EXPECT_EQ(after.acceleration(), 0.0);
  // All of the potential energy m g h is lost in impacts; the impulses sum to m v₁(1 + e)/(1 − e).
  EXPECT_NEAR(after.impact_loss(), m * g * h, m * 1e-12);
  const double cut = std::sqrt(2 * g * 1e-14);  // speed that rises to the tolerance
  EXPECT_NEAR(after.stop_impulse(), m * std::sqrt(2 * g * h) * (1 + e) / (1 - e), m * cut * (1 + e) / (1 - e));
  after.step(0.25, weight(m * g));
  EXPECT_TRUE(after.seated());
  EXPECT_NEAR(after.stop_force(), m * g, m * 1e-14);
  EXPECT_EQ(after.stop_impulse(), 0.0);
  EXPECT_EQ(after.displacement_integral(), 0.0);
  EXPECT_EQ(after.displacement_integral_2(), 0.0);
}

// In one step that holds all of it: ∫N + impulses balance the weight, m Δz = Σ J + ∫N − m g t.
TEST(SpringStop, MomentumBalanceOverAStepWithInfinitelyManyImpacts) {
  Spring s(ball(1.0, 0.0, 0.9));
  const double H = 12.0;  // Zeno time 8.5
  s.step(H, weight(10.0));
  EXPECT_TRUE(s.seated());
  EXPECT_NEAR(s.stop_impulse() + s.stop_force() * H, 10.0 * H, 1e-10);
}

// e = 1: nothing is lost, over 1000 impacts of a nonlinear spring on the foundation.
TEST(SpringStop, ElasticImpactsConserveEnergy) {
  Parameters p;
  p.linear_stiffness = 3.0;
  p.cubic_stiffness = -0.2;
  p.velocity = -0.3;
  p.stop_enabled = true;
  p.stop_position = -0.015;
  Spring s(p);
  const double before = energy(s);
  int impacts = 0;
  double worst = 0.0;
  for (int i = 0; i < 30000; ++i) {
    s.step(4e-3, Inputs{});
    impacts += s.stop_impulse() > 0.0;
    worst = std::max(worst, std::abs(energy(s) - before));
  }
  EXPECT_GE(impacts, 60);
  EXPECT_LT(worst, 30000 * 4e-15 * before);
  EXPECT_EQ(s.impact_loss(), 0.0);
}

// What an impact takes away is ½ m (1 − e²) z², counted once.
TEST(SpringStop, LedgerOfALossyImpact) {
  Parameters p = ball(0.1, -2.0, 0.3);
  p.linear_stiffness = 40.0;
  p.damping = 0.5;
  p.mass = 0.7;
  Spring s(p);
  const double before = energy(s);
  s.step(0.2, Inputs{});
  EXPECT_GT(s.stop_impulse(), 0.0);
  EXPECT_GT(s.impact_loss(), 0.5);
  EXPECT_NEAR(energy(s) + s.dissipated_energy() + s.impact_loss(), before, 1e-12 * before);
}

// Held down by −10 N while C pulls up with 50 t: N = 10 − 50 t, off at 0.2 s, then y = 50 τ³/6.
TEST(SpringStop, LeavesWhenTheForceTurns) {
  Inputs inputs = weight(10.0);
  inputs.contact_force[1] = -50.0;
  Spring s(ball(0.0, 0.0, 0.5));
  s.step(1.0, inputs);
  const double tau = 0.8;
  EXPECT_FALSE(s.seated());
  EXPECT_NEAR(s.displacement(), 50 * tau * tau * tau / 6, 1e-14);
  EXPECT_NEAR(s.velocity(), 50 * tau * tau / 2, 4e-14);
  EXPECT_NEAR(s.stop_force(), 1.0, 1e-15);  // ∫₀^0.2 (10 − 50 t) dt
  EXPECT_EQ(s.stop_impulse(), 0.0);

  // The same where a spring pulls with 1000 N, so that N is what large forces leave.
  Parameters p = ball(-1.0, 0.0, 0.5);
  p.stop_position = -1.0;
  p.linear_stiffness = 1000.0;
  inputs.external_force[0] -= 1000.0;
  Spring early(p);
  EXPECT_NEAR(early.step_to_event(1.0, inputs, 0.0, true).size, 0.2, 1e-13);
  EXPECT_NEAR(early.stop_force(), 5.0, 1e-11);  // the mean up to there
  EXPECT_FALSE(early.seated());
  EXPECT_NEAR(early.acceleration(), 0.0, 1e-11);
  early.strike(0.2);  // nothing strikes where it leaves, though N is 0 to rounding
  EXPECT_FALSE(early.seated());
}

// Falls for T, then lies at 0: ∫y = ⅔hT, ∫∫y = 5/12 hT² + ⅔hT (1 − T).
TEST(SpringStop, IntegralsGoOnWhileItIsSeated) {
  const double h = 0.8, T = 0.4;
  Spring s(ball(h, 0.0, 0.0));
  s.step(1.0, weight(2 * h / T / T));
  EXPECT_TRUE(s.seated());
  EXPECT_NEAR(s.displacement_integral(), 2.0 / 3.0 * h * T, 1e-13);
  EXPECT_NEAR(s.displacement_integral_2(), 5.0 / 12.0 * h * T * T + 2.0 / 3.0 * h * T * (1 - T), 1e-13);
}

// N ≥ 0 touches below 0 for a moment: seen although both ends of the step have N > 0.
// N = (τ − c)² − ε: off at c − √ε, so it leaves, lands softly and is seated again: ∫(N − 0) + J − 0 = Σ of forces.
TEST(SpringStop, AShortReleaseWithinOneStepCounts) {
  const double dip = 1e-4;
  for (const double c : {0.5, 0.43}) {
    Inputs inputs;
    inputs.contact_force = {c * c - dip, -2.0 * c, 2.0};
    Spring s(ball(0.0, 0.0, 0.0));
    s.step(1.0, inputs);
    EXPECT_TRUE(s.seated());
    // While off: y = 2·√ε·τ³/6 − τ⁴/12 (force 2√ε τ − τ²), back at τ = 4√ε with −m z = Σ force·dt.
    const double off = 4 * std::sqrt(dip), force = std::sqrt(dip) * off * off - off * off * off / 3;
    EXPECT_NEAR(s.stop_impulse(), -force, 1e-9 * std::abs(force));
    EXPECT_NEAR(s.stop_force() + s.stop_impulse(), (std::pow(1 - c, 3) + std::pow(c, 3)) / 3 - dip, 1e-13);
  }
}

// A parabola with its lowest point δ below the stop, well inside one step: m(1 + e)√(2aδ), or nothing when above.
TEST(SpringStop, AGrazingImpactWithinOneStepCounts) {
  const double a = 6.0, half = 0.43;
  for (const double dip : {1e-4, 1e-8, 1e-11, -1e-11, -1e-4}) {
    Spring s(ball(a * half * half / 2 - dip, -a * half, 1.0));
    s.step(1.0, weight(-a));
    const double impulse = dip > 0 ? 2.0 * std::sqrt(2 * a * dip) : 0.0;
    EXPECT_NEAR(s.stop_impulse(), impulse, impulse * (1e-8 + 4e-16 / std::abs(dip))) << dip;
  }
}

// From rest, under −a + b τ: within the first internal step, of 1/8, the top is δ below the stop about τ = 2a/b = 1/12.
TEST(SpringStop, AGrazingImpactAfterAStartAtRestCounts) {
  const double a = 6.0, b = 24.0 * a, dip = 1e-9;
  Spring s(ball(2.0 / 3.0 * a * a * a / (b * b) - dip, 0.0, 1.0));
  Inputs inputs = weight(a);
  inputs.external_force[1] = b;
  s.step(1.0, inputs);
  EXPECT_NEAR(s.stop_impulse(), 2.0 * std::sqrt(2 * a * dip), 1e-3 * std::sqrt(a * dip));
}

// A top that falls at 1 m/s leaves the tip 0.1 mm above the stop, which it then strikes within the same internal step.
TEST(SpringStop, TheEarlierOfTwoEventsInOneInternalStepCounts) {
  Parameters p = ball(0.1, -1.0, 1.0);
  p.contact_law = ContactLaw::normal_compliance;
  p.compliance_stiffness = 1e-9;
  p.compliance_exponent = 1.0;
  Spring s(p);
  Inputs inputs;
  inputs.tip_displacement[0] = 1e-4;
  EXPECT_NEAR(s.step_to_event(1.0, inputs, 0.0, true).size, 0.0999, 1e-9);
  EXPECT_EQ(s.impacts(), 0);
  // One that turns 0.1 mm above the stop, at 0.5625 s, and meets a tip that comes down, at 0.6 s.
  p.displacement = 3.0 * 0.5625 * 0.5625 + 1e-4;
  p.velocity = -6.0 * 0.5625;
  inputs = weight(-6.0);
  const double met = 3.0 * 0.0375 * 0.0375 + 1e-4;
  inputs.tip_displacement = {1.0, (met - 1.0) / 0.6, 0.0};
  EXPECT_NEAR(Spring(p).step_to_event(1.0, inputs, 0.0, true).size, 0.6, 1e-12);
}

// y = (τ − a)²(τ − b)² − δ comes down on the stop twice, near a and b: in one step the first is seen, too. From there
// it rises above the second.
TEST(SpringStop, TheFirstOfTwoGrazingImpactsCounts) {
  const double dip = 1e-6, b = 0.8;
  for (const double a : {0.05, 0.1, 0.2, 0.3}) {
    const double sum = a + b, product = a * b;
    Inputs inputs;
    inputs.external_force = {2 * sum * sum + 4 * product, -12 * sum, 24.0};
    Spring whole(ball(product * product - dip, -2 * sum * product, 1.0));
    whole.step(1.0, inputs);
    EXPECT_EQ(whole.impacts(), 1);
    EXPECT_NEAR(whole.last_impact(), a - std::sqrt(dip) / (b - a), 1e-5);
    // The same from below, against a tip.
    Parameters p = ball(dip - product * product, 2 * sum * product, 1.0);
    p.stop_enabled = false;
    p.contact_law = ContactLaw::normal_compliance;
    p.compliance_stiffness = 1e-9;
    for (double& force : inputs.external_force) force = -force;
    EXPECT_NEAR(Spring(p).step_to_event(1.0, inputs, 0.0, true).size, a - std::sqrt(dip) / (b - a), 1e-5);
  }
}

// Starting on the stop: pressed it stays, lifted it goes; an impulse into the stop rebounds at once. The input N is for
// a master that applies Signorini itself; with the stop inside it is not read.
TEST(SpringStop, StartOnTheStop) {
  Spring pressed(ball(0.0, 0.0, 0.5));
  Inputs with_foundation = weight(2.0);
  with_foundation.foundation_force[0] = 5.0;
  pressed.step(0.1, with_foundation);
  EXPECT_TRUE(pressed.seated());
  EXPECT_EQ(pressed.stop_force(), 2.0);
  Spring lifted(ball(0.0, 0.0, 0.5));
  lifted.step(0.1, weight(-2.0));
  EXPECT_FALSE(lifted.seated());
  EXPECT_NEAR(lifted.displacement(), 0.01, 1e-16);
  EXPECT_EQ(lifted.stop_force(), 0.0);

  pressed.apply_impulse(-3.0);
  pressed.step(0.01, weight(2.0));
  EXPECT_FALSE(pressed.seated());
  EXPECT_NEAR(pressed.velocity(), 1.5 - 0.02, 1e-15);
  EXPECT_NEAR(pressed.stop_impulse(), 4.5, 1e-15);
  EXPECT_NEAR(pressed.impact_loss(), 4.5 - 1.125, 1e-15);
  Spring pushed(ball(0.0, 0.0, 0.5));
  pushed.step(0.1, weight(2.0));
  pushed.apply_impulse(1.0);
  EXPECT_FALSE(pushed.seated());
  pushed.step(0.1, weight(2.0));
  EXPECT_NEAR(pushed.displacement(), 0.1 - 0.01, 1e-15);
}

// A plastic impact under a force that lifts: at rest for an instant, then off with a/γ (t − (1 − e^{−γt})/γ), γ =
// α_s/m.
TEST(SpringStop, PlasticImpactUnderALiftingForce) {
  const double a = 0.07, rate = 11.5, gap = 1e-5, v = 2.0;
  Parameters p = ball(gap, -v, 0.0);
  p.damping = rate;
  Spring s(p);
  s.step(1e-3, weight(-a));
  // Down: −(v + a/γ)(1 − e^{−γt})/γ + a t/γ = −gap, so v t to first order; two Newton steps give t to rounding.
  double t = gap / v;
  for (int i = 0; i < 4; ++i) {
    const double decay = std::exp(-rate * t);
    t += (gap - (v + a / rate) * (1 - decay) / rate + a * t / rate) / ((v + a / rate) * decay - a / rate);
  }
  const double tau = 1e-3 - t;
  EXPECT_NEAR(s.displacement(), a / rate * (tau + std::expm1(-rate * tau) / rate), 1e-16);  // absolute tolerance 1e-14
  EXPECT_NEAR(s.velocity(), -a / rate * std::expm1(-rate * tau), 1e-15);
  EXPECT_FALSE(s.seated());
}

// What is due at an impact is done at once: without a rebound the top stays where it is pressed down, by the tip here,
// and goes where it is lifted.
TEST(SpringStop, AStrikeKnowsWhatActs) {
  for (const bool pressed : {true, false}) {
    Parameters p = ball(0.0, -1.0, 0.0);
    p.stop_position = -0.01;
    p.contact_law = pressed ? ContactLaw::normal_compliance : ContactLaw::external;
    p.compliance_exponent = 1.0;
    Inputs inputs = weight(-1.0);
    inputs.tip_displacement[0] = -0.015;
    p.displacement = p.stop_position + 1e-3;
    Spring s(p);
    const double t = s.step_to_event(1.0, inputs, 3.0, true).size;
    EXPECT_LT(s.velocity(), 0.0);
    s.strike(3.0 + t);
    EXPECT_EQ(s.velocity(), 0.0);
    EXPECT_EQ(s.seated(), pressed);
    EXPECT_EQ(s.impacts(), 1);
    EXPECT_EQ(s.last_impact(), 3.0 + t);
  }
}

// Both laws: seated under a tip that presses with λ δ^p and lifts off with v: N = λ(−u)₊^p + k φ.
TEST(SpringStop, SeatedUnderTheTip) {
  Parameters p = ball(0.0, 0.0, 0.0);
  p.contact_law = ContactLaw::normal_compliance;
  p.compliance_stiffness = 1e5;
  p.compliance_exponent = 1.5;
  p.stop_position = -0.01;
  p.displacement = -0.01;
  p.linear_stiffness = 300.0;  // pulls up with 3 N
  Spring s(p);
  Inputs inputs;
  inputs.tip_displacement[0] = -0.02;
  inputs.tip_displacement[1] = 0.04;
  s.observe(inputs);
  EXPECT_NEAR(s.reaction(), 1e5 * std::pow(0.01, 1.5), 1e-10);
  s.step(0.1, inputs);
  EXPECT_TRUE(s.seated());
  // Mean of λ δ^1.5 − 3 with δ from 0.01 to 0.006.
  const double mean = 1e5 * (std::pow(0.01, 2.5) - std::pow(0.006, 2.5)) / (2.5 * 0.04) / 0.1 - 3.0;
  EXPECT_NEAR(s.stop_force(), mean, 1e-12 * mean);
  EXPECT_NEAR(s.contact_energy(), 1e5 * std::pow(0.006, 2.5) / 2.5, 1e-15);
  // λ δ^1.5 = 3 at δ = 9.65e-4: it leaves 0.1258 s later and then follows the tip.
  inputs.tip_displacement[0] = -0.016;
  s.step(0.1258, inputs);
  EXPECT_TRUE(s.seated());
  inputs.tip_displacement[0] += 0.04 * 0.1258;
  s.step(0.02, inputs);
  EXPECT_FALSE(s.seated());
  const double from = 0.006 - 0.04 * 0.1258, to = std::pow(3e-5, 2.0 / 3.0);  // depths while N > 0
  const double held = 1e5 * (std::pow(from, 2.5) - std::pow(to, 2.5)) / (2.5 * 0.04) - 3.0 * (from - to) / 0.04;
  EXPECT_NEAR(s.stop_force() * 0.02, held, 1e-9 * held);
  EXPECT_GT(s.displacement(), -0.01);
}

// A tip that comes down on a seated top, turns and leaves within one step: N = k φ + λ δ₊^p (1 + χ δ̇)₊, against sums
// over many instants. With χ = 8 s/m damping leaves no force once the tip leaves faster than 0.125 m/s.
TEST(SpringStop, SeatedUnderATipThatComesAndGoes) {
  for (const double exponent : {1.0, 1.5, 3.0}) {
    for (const double damping : {0.0, 8.0}) {
      Parameters p = ball(0.0, 0.0, 0.0);
      p.contact_law = ContactLaw::normal_compliance;
      p.compliance_stiffness = 1e3;
      p.compliance_exponent = exponent;
      p.compliance_damping = damping;
      p.stop_position = p.displacement = -0.01;
      p.linear_stiffness = -300.0;  // presses with 3 N
      Spring s(p);
      Inputs inputs;
      inputs.tip_displacement = {-0.009, -0.2, 2.0};
      const double H = 0.25;
      s.step(H, inputs);
      long double force = 0.0L, lost = 0.0L;
      constexpr int n = 400000;
      for (int i = 0; i < n; ++i) {
        const long double t = (i + 0.5L) * H / n, depth = -0.001L + 0.2L * t - t * t, rate = 0.2L - 2.0L * t;
        if (depth <= 0.0L) continue;
        const long double elastic = 1e3L * std::pow(depth, static_cast<long double>(exponent));
        const long double factor = std::max(0.0L, 1.0L + damping * rate);
        force += elastic * factor / n;
        lost += elastic * (factor - 1.0L) * rate * H / n;
      }
      EXPECT_TRUE(s.seated());
      EXPECT_NEAR(s.stop_force(), 3.0 + static_cast<double>(force), 1e-9 * static_cast<double>(force));
      EXPECT_NEAR(s.dissipated_energy(), static_cast<double>(lost), 1e-9 * static_cast<double>(lost));
    }
  }
}

// N = λ δ^p − F with F through three points of λ δ^p, δ linear: it is 0 there and nowhere else, as the third derivative
// keeps its sign. It rises at first, is below 0 from 1/50 to 3/50 of the step, then above it to the end.
TEST(SpringStop, ADipOfTheHoldingForceSoonAfterTheStartCounts) {
  for (const double exponent : {1.5, 2.5, 3.0, 4.0, 5.5}) {
    for (const double damping : {0.0, 0.5}) {
      const double H = 0.5, speed = exponent < 2.0 ? -0.01 : 0.01;  // so that the third derivative is above 0
      Parameters p = ball(0.0, 0.0, 0.0);
      p.linear_stiffness = 0.0;
      p.contact_law = ContactLaw::normal_compliance;
      p.compliance_stiffness = 1e4 / std::pow(0.05, exponent);
      p.compliance_exponent = exponent;
      p.compliance_damping = damping;
      const auto contact = [&](double s) {
        return p.compliance_stiffness * std::pow(0.05 + speed * H * s, exponent) * (1.0 + damping * speed);
      };
      const double a = -0.005, b = 0.02, c = 0.06;
      const double first = (contact(b) - contact(a)) / (b - a), second = (contact(c) - contact(b)) / (c - b);
      const double bend = (second - first) / (c - a);
      Inputs inputs;
      inputs.tip_displacement = {-0.05, -speed, 0.0};
      inputs.external_force = {contact(a) - a * first + a * b * bend, (first - (a + b) * bend) / H, 2 * bend / H / H};
      Spring s(p);
      const auto left = s.step_to_event(H, inputs, 0.0, true);
      EXPECT_TRUE(left.event);
      // N falls there with a rate of some 1e-5 N over the step; rounding is 1e-12 N.
      EXPECT_NEAR(left.size, b * H, 1e-6 * H) << exponent;
      EXPECT_FALSE(s.seated());
    }
  }
}

// N'' of a linear law, damped, is linear in time where δ is not 0: N turns twice, from 0.48 on it is below 0.
TEST(SpringStop, ADipUnderALinearDampedLawCounts) {
  Parameters p = ball(0.0, 0.0, 0.0);
  p.contact_law = ContactLaw::normal_compliance;
  p.compliance_stiffness = 1.0;
  p.compliance_exponent = 1.0;
  p.compliance_damping = 1.2250728094276986;
  Inputs inputs;
  inputs.tip_displacement = {-0.03146783808047604, 0.054194832698953199, -0.038117771045798055};
  inputs.external_force = {0.029377476138549179, -0.049382741135356366, 0.032450429881421106};
  Spring s(p);
  const double left = s.step_to_event(1.0, inputs, 0.0, true).size;
  EXPECT_GT(left, 0.4);
  EXPECT_LT(left, 0.489);  // where N is -2.4e-9
}

// y is what the motion says, whatever the distance of a stop that is never reached.
TEST(SpringStop, ADistantStopDoesNotQuantiseTheDisplacement) {
  for (const double amplitude : {1e-3, 1e-9}) {
    Parameters p;
    p.displacement = amplitude;
    for (const double stop : {-1.0, -1e9, -1e20}) {
      p.stop_enabled = false;
      Spring alone(p);
      p.stop_enabled = true;
      p.stop_position = stop;
      Spring above(p);
      for (int i = 0; i < 20; ++i) {
        alone.step(0.1, Inputs{});
        above.step(0.1, Inputs{});
        EXPECT_NEAR(above.displacement(), alone.displacement(), 1e-14 * amplitude) << stop;
        EXPECT_NEAR(above.displacement_integral(), alone.displacement_integral(), 1e-14 * amplitude) << stop;
      }
    }
  }
}
