// Normal compliance inside: C = λ (y − u_tip)₊^p against closed forms.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "spring.hpp"
#include "spring_support.hpp"

using namespace spring_test;

// What an integrator sees beyond the opening: λ δ^p itself where p is an integer, else its odd part; and the slopes.
TEST(SpringCompliance, TheLawGoesOnSmoothlyBeyondTheOpening) {
  for (const double exponent : {1.0, 1.5, 2.0, 3.0, 4.0}) {
    const spring::Compliance law(50.0, exponent, 0.8);
    const double h = 1e-6, power = std::pow(0.1, exponent);
    EXPECT_NEAR(law.continued(-0.1, 0.0).force, std::fmod(exponent, 2.0) == 0.0 ? 50.0 * power : -50.0 * power, 1e-14);
    const double difference = (law.continued(h - 0.1, 0.3).force - law.continued(-h - 0.1, 0.3).force) / (2 * h);
    EXPECT_NEAR(law.slopes(-0.1, 0.3).force_by_depth, difference, 1e-7) << exponent;
  }
}

// p = 1 in contact: two springs in parallel, m ÿ + (k + λ) y = λ (u₀ + v t).
TEST(SpringCompliance, LinearLawIsASecondSpring) {
  const double k = 10.0, lambda = 200.0, u0 = -0.05, v = -0.02;
  Parameters p = compliant(lambda, 1.0);
  p.linear_stiffness = k;
  p.displacement = 0.01;
  p.velocity = 0.1;
  const double w = std::sqrt(k + lambda), p0 = lambda * u0 / (k + lambda), p1 = lambda * v / (k + lambda);
  const double a = p.displacement - p0, b = (p.velocity - p1) / w;
  for (const double H : {1e-3, 2e-2}) {
    Spring s(p);
    for (int i = 1; i * H <= 0.04 + 1e-9; ++i) {
      Inputs inputs;
      inputs.tip_displacement[0] = u0 + v * (i - 1) * H;
      inputs.tip_displacement[1] = v;
      s.step(H, inputs);
      const double t = i * H;
      const double y = p0 + p1 * t + a * std::cos(w * t) + b * std::sin(w * t);
      EXPECT_NEAR(s.displacement(), y, 1e-13) << "t = " << t;  // 1e-12 × 0.06 m, the tolerance
      EXPECT_NEAR(s.reaction(), lambda * (y - u0 - v * t), lambda * 1e-13);
      EXPECT_NEAR(s.contact_energy(), s.reaction() * s.reaction() / (2 * lambda), 1e-15);
      EXPECT_NEAR(s.acceleration(), -k * s.displacement() - s.reaction(), 1e-13);
    }
  }
}

TEST(SpringCompliance, TipIsExtrapolated) {
  Parameters p = compliant(1e3, 1.0);
  p.linear_stiffness = 0.0;
  p.mass = 1e12;  // stays
  p.compliance_damping = 0.5;
  for (const bool curved : {false, true}) {
    Spring s(p);
    Inputs inputs;
    inputs.tip_displacement = {-0.1, curved ? 0.3 : -0.2, curved ? 2.0 : 0.0};
    s.observe(inputs);
    EXPECT_NEAR(s.reaction(), 100.0 * (curved ? 0.85 : 1.1), 1e-12);
    s.step(0.1, inputs);
    const double depth = curved ? 0.1 - 0.03 - 0.01 : 0.1 + 0.02, rate = curved ? -0.5 : 0.2;
    EXPECT_NEAR(s.tip()[0], -depth, 1e-16);
    EXPECT_DOUBLE_EQ(s.tip()[1], -rate);
    EXPECT_EQ(s.tip()[2], inputs.tip_displacement[2]);
    EXPECT_NEAR(s.reaction(), 1e3 * depth * (1 + 0.5 * rate), 1e3 * 1e-9);  // the mass has moved by λδt²/2m
  }
}

// Where a step ended at a contact event the depth is taken for 0, unless the tip is elsewhere by then.
TEST(SpringCompliance, ATipThatJumpsAtAnEventIsSeen) {
  Parameters p = compliant(50.0, 1.5);
  p.velocity = 1.0;
  Spring met(p);
  Inputs inputs;
  inputs.tip_displacement[0] = 0.05;
  EXPECT_TRUE(met.step_to_event(1.0, inputs, 0.0, true).event);
  p.displacement = met.displacement();
  p.velocity = met.velocity();
  Spring fresh(p);
  inputs.tip_displacement[0] = -0.1;
  for (Spring* s : {&met, &fresh}) s->step(0.1, inputs);
  EXPECT_NEAR(met.displacement(), fresh.displacement(), 1e-14);
}

// p = 1 about a tip at rest: half periods π/√(k+λ) above and π/√k below. The kink is met twice per period.
TEST(SpringCompliance, PeriodOfABilinearOscillator) {
  const double k = 25.0, lambda = 1e4;
  Parameters p = compliant(lambda, 1.0);
  p.linear_stiffness = k;
  p.velocity = 0.7;
  const double period = pi / std::sqrt(k) + pi / std::sqrt(k + lambda);
  for (const int steps : {7, 100, 1000}) {
    Spring s(p);
    for (int i = 0; i < 3 * steps; ++i) s.step(period / steps, Inputs{});
    // 1e-12 of what z and y reach for each of the 19 radians of the motion.
    EXPECT_NEAR(s.velocity(), 0.7, 2e-11 * 0.7) << steps;
    EXPECT_NEAR(s.displacement(), 0.0, 2e-11 * 0.7 / std::sqrt(k)) << steps;
  }
}

// A free mass thrown against the tip: by energy it comes back with the speed it had, after
//     T = 2 (δ/v) √π Γ(1 + 1/(p+1)) / Γ(1/2 + 1/(p+1)),    δ = ((p+1) m v² / 2λ)^{1/(p+1)}     (p = 3/2: Hertz, 2.943
//     δ/v).
class Rebound : public testing::TestWithParam<std::tuple<double, double>> {};

TEST_P(Rebound, TimeAndSpeed) {
  const auto [lambda, exponent] = GetParam();
  const double v = 0.5, gap = 0.013, r = 1.0 / (exponent + 1.0), mass = 1.3;
  Parameters p = compliant(lambda, exponent);
  p.linear_stiffness = 0.0;
  p.mass = mass;
  p.displacement = -gap;
  p.velocity = v;
  const double depth = std::pow((exponent + 1.0) * mass * v * v / (2 * lambda), r);
  const double duration = 2 * depth / v * std::sqrt(pi) * std::tgamma(1.0 + r) / std::tgamma(0.5 + r);
  const double end = 2 * gap / v + duration + 0.01;
  for (const int steps : {1, 10, 777}) {
    Spring s(p);
    for (int i = 0; i < steps; ++i) s.step(end / steps, Inputs{});
    EXPECT_NEAR(s.velocity(), -v, 1e-11 * v) << steps;
    EXPECT_NEAR(s.displacement(), -gap - 0.01 * v, 1e-12 * (0.1 + depth)) << steps;
    EXPECT_EQ(s.reaction(), 0.0);
  }
}

INSTANTIATE_TEST_SUITE_P(Laws, Rebound,
                         testing::Combine(testing::Values(1e2, 1e4, 1e8, 1e12),
                                          testing::Values(1.0, 1.5, 2.0, 2.2, 3.0)));

// The tip passes through the top's position and back within one step: the touch must not be stepped over.
// Parabola u = d − v τ + a τ²/2 that dips δ below y: for p = 1 and a heavy mass the impulse is λ ∫(y − u)₊ = λ (2/3) δ
// · 2√(2δ/a).
TEST(SpringCompliance, AShortTouchWithinOneStepCounts) {
  for (const double dip : {1e-4, 1e-6, 1e-8}) {
    Parameters p = compliant(1e6, 1.0);
    p.linear_stiffness = 0.0;
    p.mass = 1e6;
    Spring s(p);
    const double a = 8.0, half = 0.37;  // lowest at τ = 0.37
    Inputs inputs;
    inputs.tip_displacement = {a * half * half / 2 - dip, -a * half, a};
    s.step(1.0, inputs);
    const double impulse = 1e6 * (4.0 / 3.0) * dip * std::sqrt(2 * dip / a);
    // The mass gives way by (λ/m)·(duration²); the parabola's start rounds at 1e-16 m; z is good to 1e-14 m/s.
    EXPECT_NEAR(-s.velocity() * 1e6, impulse, impulse * (8 * dip / a + 4e-16 / dip) + 1e6 * 1e-14) << dip;
  }
}

// Undamped, p = 1.5, λ = 1e6, against a tip at rest: E_spring + E_contact is constant through 100 contacts.
TEST(SpringCompliance, EnergyIsConserved) {
  Parameters p = compliant(1e6, 1.5);
  p.linear_stiffness = 150.0;
  p.cubic_stiffness = 67.0;
  p.velocity = -0.5;
  Spring s(p);
  const double before = energy(s);
  double worst = 0.0;
  long contacts = 0;
  bool touching = false;
  for (int i = 0; i < 26000; ++i) {
    s.step(1e-3, Inputs{});
    worst = std::max(worst, std::abs(energy(s) - before));
    contacts += s.reaction() > 0.0 && !touching;
    touching = s.reaction() > 0.0;
  }
  EXPECT_GE(contacts, 90);
  EXPECT_LT(worst, 26000 * 6e-14 * before);  // IDA is asked for 3e-14 of z per internal step
}

// A free mass against a tip at rest, m δ̈ = −λ δ^p (1 + χ δ̇): v dv/(1 + χv) = −(λ/m) δ^p dδ, so that
// v/χ − ln(1 + χv)/χ² is the same on arrival and on leaving, whatever λ and p.
class DampedRebound : public testing::TestWithParam<std::tuple<double, double, double>> {};

TEST_P(DampedRebound, SpeedAndDissipation) {
  const auto [lambda, exponent, chi] = GetParam();
  const double v = 0.5, gap = 0.013, mass = 1.3;
  Parameters p = compliant(lambda, exponent);
  p.compliance_damping = chi;
  p.linear_stiffness = 0.0;
  p.mass = mass;
  p.displacement = -gap;
  p.velocity = v;
  const auto invariant = [chi](double speed) { return speed / chi - std::log1p(chi * speed) / (chi * chi); };
  double slow = -std::min(v, (1.0 - 1e-15) / chi), fast = 0.0;  // of the leaving speed
  for (int i = 0; i < 200; ++i) {
    const double middle = (slow + fast) / 2;
    (invariant(middle) > invariant(v) ? slow : fast) = middle;
  }
  const double depth = std::pow((exponent + 1.0) * mass * v * v / (2 * lambda), 1.0 / (exponent + 1.0));
  const double end = gap / v + 40.0 * depth / v * (1.0 + chi * v);
  for (const int steps : {1, 10, 777}) {
    Spring s(p);
    for (int i = 0; i < steps; ++i) {
      s.step(end / steps, Inputs{});
      ASSERT_NEAR(energy(s) + s.dissipated_energy(), mass / 2 * v * v,
                  1e-11 * mass * v * v);  // as the speed of Rebound
    }
    EXPECT_EQ(s.reaction(), 0.0);
    EXPECT_NEAR(s.velocity(), slow, 1e-10 * v) << steps;
    EXPECT_GT(s.dissipated_energy(), 0.0);
  }
}

INSTANTIATE_TEST_SUITE_P(Laws, DampedRebound,
                         testing::Combine(testing::Values(1e2, 1e6), testing::Values(1.0, 1.5, 2.2, 3.0),
                                          testing::Values(0.01, 0.5, 20.0)));

// A free mass against a tip at rest under C = (λδ + cδ̇)₊: a damped oscillator until C = 0 at ω_d t = π − 2φ, sin φ = ζ,
// where it has −v e^{−(π−2φ) tan φ} (Schwager & Pöschel 2007); then it goes on at that speed.
TEST(SpringCompliance, KelvinVoigtPartsWithItsRestitution) {
  const double lambda = 1e4, v = 0.5, gap = 0.013, mass = 1.3, omega = std::sqrt(lambda / mass);
  for (const double zeta : {1e-3, 0.1, 0.5, 0.9}) {
    Parameters p = compliant(lambda, 1.0);
    p.contact_law = spring::ContactLaw::kelvin_voigt;
    p.contact_damping = 2.0 * zeta * mass * omega;
    p.compliance_damping = 7.0;  // of the other law
    p.linear_stiffness = 0.0;
    p.mass = mass;
    p.displacement = -gap;
    p.velocity = v;
    const double phi = std::asin(zeta), fast = omega * std::cos(phi), e = std::exp(-(pi - 2 * phi) * std::tan(phi));
    const double pulls = (pi - 2 * phi) / fast, depth = v / fast * e * std::sin(2 * phi), end = gap / v + 2 * pulls;
    for (const int steps : {1, 10, 77}) {
      Spring s(p);
      for (int i = 0; i < steps; ++i) {
        s.step(end / steps, Inputs{});
        EXPECT_GE(s.reaction(), 0.0);
        ASSERT_NEAR(energy(s) + s.dissipated_energy(), mass / 2 * v * v, 1e-11 * mass * v * v);
      }
      EXPECT_NEAR(s.velocity(), -v * e, 1e-10 * v) << zeta << ' ' << steps;
      EXPECT_NEAR(s.displacement(), depth - v * e * pulls, 1e-10 * gap) << zeta << ' ' << steps;
    }
  }
}

// The tip leaves, so fast from some time on that a damper would pull: no force then, though they overlap, and never an
// adhesion. Against classical Runge–Kutta steps in extended precision.
class NeverPulls : public testing::TestWithParam<spring::ContactLaw> {};

TEST_P(NeverPulls, Damping) {
  const bool voigt = GetParam() == spring::ContactLaw::kelvin_voigt;
  const double lambda = 1e4, chi = 2.0, c = 20.0, k = 30.0;
  Parameters p = compliant(lambda, 1.5);
  p.contact_law = GetParam();
  p.compliance_damping = chi;
  p.contact_damping = c;
  p.linear_stiffness = k;
  p.displacement = 0.02;
  const spring::Polynomial tip{0.0, 0.3, 40.0};  // δ̇ = −1/χ soon after the start
  Inputs inputs;
  inputs.tip_displacement = tip;
  long double y = p.displacement, z = 0.0, lost = 0.0;
  constexpr int n = 400'000;
  const long double H = 0.03, h = H / n;
  struct Rates {
    long double z, a, power;
  };
  const auto rates = [&](long double t, long double u, long double w) -> Rates {
    const long double depth = u - (tip[0] + t * (tip[1] + t * tip[2] / 2)), rate = w - (tip[1] + t * tip[2]);
    const long double elastic = depth > 0 ? lambda * depth * std::sqrt(depth) : 0.0L;
    const long double damped = voigt ? elastic + c * rate : elastic * (1 + chi * rate);
    const long double force = depth > 0 ? std::max(0.0L, damped) : 0.0L;
    return {w, -k * u - force, (force - elastic) * rate};
  };
  bool slack = false;
  for (int i = 0; i < n; ++i) {
    const long double t = i * h;
    const Rates a = rates(t, y, z), b = rates(t + h / 2, y + h / 2 * a.z, z + h / 2 * a.a);
    const Rates c = rates(t + h / 2, y + h / 2 * b.z, z + h / 2 * b.a), d = rates(t + h, y + h * c.z, z + h * c.a);
    y += h / 6 * (a.z + 2 * b.z + 2 * c.z + d.z);
    z += h / 6 * (a.a + 2 * b.a + 2 * c.a + d.a);
    lost += h / 6 * (a.power + 2 * b.power + 2 * c.power + d.power);
    const long double then = t + h, overlap = y - (tip[0] + then * (tip[1] + then * tip[2] / 2));
    slack = slack || (overlap > 0 && rates(then, y, z).a == -k * y);
  }
  EXPECT_TRUE(slack);
  for (const int steps : {1, 30}) {
    Spring s(p);
    for (int i = 0; i < steps; ++i) {
      const double t = 0.03 / steps * i;
      inputs.tip_displacement = {tip[0] + t * (tip[1] + t * tip[2] / 2), tip[1] + t * tip[2], tip[2]};
      s.step(0.03 / steps, inputs);
      EXPECT_GE(s.reaction(), 0.0);
    }
    EXPECT_NEAR(s.displacement(), static_cast<double>(y), 1e-12 * 0.02);
    EXPECT_NEAR(s.velocity(), static_cast<double>(z), 1e-11);
    EXPECT_NEAR(s.dissipated_energy(), static_cast<double>(lost), 1e-10 * static_cast<double>(lost));
  }
}

INSTANTIATE_TEST_SUITE_P(Laws, NeverPulls,
                         testing::Values(spring::ContactLaw::normal_compliance, spring::ContactLaw::kelvin_voigt));

// ÿ = F − 4 y^p (1 + χ ẏ) from rest, F = 10 t or 5 t²: nothing moves at the start, so that tolerances of the start's
// motion are those of nothing, which took 15,000 steps of IDA. References: Runge–Kutta of order 8 in extended
// precision.
TEST(SpringCompliance, AForceThatBeginsAtZeroTakesAFewHundredInternalSteps) {
  struct Case {
    double p, chi;
    spring::Polynomial force;
    double y;
  };
  for (const Case& c :
       {Case{1.5, 0.0, {0, 0, 10}, 0.3980066824889011}, Case{1.5, 0.01, {0, 10, 0}, 1.440449704243077},
        Case{7.0, 0.1, {0, 10, 0}, 1.4100149420749672}, Case{2.0, 2.0, {0, 0, 10}, 0.3957237220579116}}) {
    Parameters p = compliant(4.0, c.p);
    p.linear_stiffness = 0.0;
    p.compliance_damping = c.chi;
    Inputs inputs;
    inputs.external_force = c.force;
    Spring s(p);
    s.step(1.0, inputs);
    EXPECT_NEAR(s.displacement(), c.y, 1e-12 * c.y + 1e-14) << "p = " << c.p;
    EXPECT_LT(s.internal_steps(), 2000) << "p = " << c.p;
  }
}

// Seated under a tip that comes down at v: C = λ δ^p (1 + χ v), which takes χ v λ δ^{p+1}/(p+1).
TEST(SpringCompliance, DampingOfASeatedTop) {
  Parameters p = compliant(1e5, 1.5);
  p.compliance_damping = 3.0;
  p.stop_enabled = true;
  p.stop_position = 0.0;
  const double v = 0.2, depth = v * 0.05;
  for (const int steps : {1, 20}) {
    Spring s(p);
    Inputs inputs;
    inputs.tip_displacement[1] = -v;
    for (int i = 0; i < steps; ++i) {
      inputs.tip_displacement[0] = -depth * i / steps;
      s.step(0.05 / steps, inputs);
    }
    EXPECT_TRUE(s.seated());
    EXPECT_NEAR(s.reaction(), 1e5 * std::pow(depth, 1.5) * (1 + 3.0 * v), 1e-11);
    const double lost = 3.0 * v * 1e5 * std::pow(depth, 2.5) / 2.5;
    EXPECT_NEAR(s.dissipated_energy(), lost, 1e-11 * lost);
  }
}

// Seated under a tip that comes down by d = sin²: C = (λ d^p + c ḋ)₊ takes c ∫ ḋ² on the way down, and all that is
// stored on the way up where it is slack. Here by steps along the parabola d = w t (T − t), down and up again.
class SeatedTop : public testing::TestWithParam<double> {};

// With the stronger damper the force vanishes 5 % of the way up.
INSTANTIATE_TEST_SUITE_P(KelvinVoigt, SeatedTop, testing::Values(40.0, 4000.0));

TEST_P(SeatedTop, LosesWhatADamperTakesAndWhatIsStoredWhereItIsSlack) {
  const double lambda = 1e5, c = GetParam(), w = 3.0, T = 0.1;
  Parameters p = compliant(lambda, 1.5);
  p.contact_law = spring::ContactLaw::kelvin_voigt;
  p.contact_damping = c;
  p.stop_enabled = true;
  p.stop_position = 0.0;
  const auto depth = [&](double t) { return w * t * (T - t); };
  const auto rate = [&](double t) { return w * (T - 2 * t); };
  double low = T / 2, high = T;  // where the damper would pull as much as the law pushes
  for (int i = 0; i < 200; ++i) {
    const double t = (low + high) / 2;
    (lambda * std::pow(depth(t), 1.5) + c * rate(t) > 0.0 ? low : high) = t;
  }
  const double left = lambda * std::pow(depth(low), 2.5) / 2.5;
  const double lost = c * w * w * (std::pow(T, 3) - std::pow(T - 2 * low, 3)) / 6 + left;
  for (const int steps : {1, 20}) {
    Spring s(p);
    Inputs inputs;
    for (int i = 0; i < steps; ++i) {
      const double t = T * i / steps;
      inputs.tip_displacement = {-depth(t), -rate(t), 2 * w};
      s.step(T / steps, inputs);
      EXPECT_GE(s.reaction(), 0.0);
    }
    EXPECT_TRUE(s.seated());
    EXPECT_NEAR(s.dissipated_energy(), lost, 1e-10 * lost) << steps;
  }
}
