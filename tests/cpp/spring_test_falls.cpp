// No impact and no contact is missed, and none is found late: random motions over one step, beside references.
//
// Other ones: --gtest_filter=*Falls* --gtest_shuffle --gtest_random_seed=N --gtest_repeat=K
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "spring.hpp"
#include "spring_support.hpp"

using namespace spring_test;
using spring::Polynomial;

namespace {

using Real = long double;

/// One of 0 … 1, …, also the same for the same seed.
class Chance {
 public:
  explicit Chance(unsigned kind)
      : engine_(kind + 1000U * static_cast<unsigned>(testing::UnitTest::GetInstance()->random_seed())) {}
  double between(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_()) / 4294967295.0);
  }
  double power(double low, double high) { return std::pow(10.0, between(low, high)); }
  bool one_in(unsigned n) { return engine_() % n == 0; }
  template <class Value>
  Value of(const std::vector<Value>& values) {
    return values[engine_() % values.size()];
  }

 private:
  std::mt19937 engine_;
};

double at(const Polynomial& p, double t) { return p[0] + t * (p[1] + t * p[2] / 2); }
double rate(const Polynomial& p, double t) { return p[1] + t * p[2]; }

/// A motion over a step, by classical Runge–Kutta steps; the contact force acts, or does not.
struct Reference {
  const Parameters& p;
  const Inputs& inputs;
  bool touching;
  double y, z, t = 0.0;

  double depth() const { return y - at(inputs.tip_displacement, t); }
  double acceleration(double time, double place, double speed) const {
    double force = at(inputs.external_force, time) - p.damping * speed -
                   (p.linear_stiffness + p.cubic_stiffness * place * place) * place;
    const double deep = place - at(inputs.tip_displacement, time);
    if (touching && deep > 0.0) {
      const double approach = speed - rate(inputs.tip_displacement, time);
      force -= p.compliance_stiffness * std::pow(deep, p.compliance_exponent) *
               std::max(0.0, 1.0 + p.compliance_damping * approach);
    }
    return force / p.mass;
  }
  void advance(double h) {
    const double a1 = acceleration(t, y, z);
    const double z2 = z + h / 2 * a1, a2 = acceleration(t + h / 2, y + h / 2 * z, z2);
    const double z3 = z + h / 2 * a2, a3 = acceleration(t + h / 2, y + h / 2 * z2, z3);
    const double z4 = z + h * a3, a4 = acceleration(t + h, y + h * z3, z4);
    y += h / 6 * (z + 2 * z2 + 2 * z3 + z4);
    z += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    t += h;
  }
};

/// Steps from event to event over `size`. In each part the reference, from the same state, stays above the stop and on
/// one side of the tip to within `tolerance`, and ends where both say: so none is missed and none is late. Returns how
/// many there were.
int expect_events(Spring& s, const Parameters& p, Inputs inputs, double size, double length, double tolerance,
                  const char* kind, int seed) {
  const int n = p.compliant() ? 4000 : 1500;
  int events = 0;
  for (double left = size; left > 1e-9 * size && events < 40; ++events) {
    const double stop = p.stop_position;
    const double gap_now = s.displacement() - stop;
    // Impacts that die out, and rest, are other tests'.
    const bool on_stop = p.stop_enabled && gap_now <= 0.0;
    if (on_stop && !(p.restitution * std::abs(s.velocity()) > 1e-4 * length / size)) break;
    const double start_y = s.displacement();
    const double z = on_stop && s.velocity() < 0.0 ? -p.restitution * s.velocity() : s.velocity();
    const auto reached = s.step_to_event(left, inputs, 0.0, true);
    // Which side of the tip it is on is seen in the middle of the part.
    const auto run = [&](bool touching, const auto& see) {
      Reference reference{p, inputs, touching, start_y, z};
      see(reference);
      for (int i = 0; i < n; ++i) {
        reference.advance(reached.size / n);
        see(reference);
      }
      return reference;
    };
    bool touching = false;
    if (p.compliant()) {
      double most = 0.0;
      run(true, [&](const Reference& r) {
        if (std::abs(r.depth()) > std::abs(most)) most = r.depth();
      });
      touching = most > 0.0;
    }
    double lowest = 0.0, wrong = 0.0;
    const Reference end = run(touching, [&](const Reference& r) {
      if (p.stop_enabled) lowest = std::min(lowest, r.y - stop);
      if (p.compliant()) wrong = std::min(wrong, touching ? r.depth() : -r.depth());
    });
    EXPECT_GE(lowest, -tolerance) << kind << " " << seed << ": an impact was missed in part " << events;
    EXPECT_GE(wrong, -tolerance) << kind << " " << seed << ": a contact was missed in part " << events;
    EXPECT_NEAR(s.displacement(), end.y, tolerance * (1.0 + std::abs(end.y) / length)) << kind << " " << seed;
    if (reached.event) {
      const double gap = p.stop_enabled ? std::abs(s.displacement() - stop) : 1.0;
      const double depth = p.compliant() ? std::abs(end.depth()) : 1.0;
      EXPECT_LE(std::min(gap, depth), tolerance) << kind << " " << seed << ": nothing happens there";
    }
    if (testing::Test::HasFailure()) return events;
    left -= reached.size;
    for (auto* input : {&inputs.external_force, &inputs.tip_displacement})
      *input = {at(*input, reached.size), rate(*input, reached.size), (*input)[2]};
  }
  return events;
}

}  // namespace

// ẏ = v (τ − a)(τ − b)(τ − d) with all of its turns known, some of them beyond the step or next to each other; y comes
// from a height with which the stop is near one of the turns. The first place below the stop follows by bisection.
TEST(Falls, OfCubicSpeedsWithKnownRoots) {
  Chance chance(1);
  int impacts = 0;
  for (int i = 0; i < 4000; ++i) {
    const double length = chance.power(-9, 3), duration = chance.power(-6, 3), mass = chance.power(-3, 3);
    std::vector<double> turns{chance.between(0, 1), chance.between(0, 1.2), chance.between(-0.2, 1.2)};
    if (chance.one_in(4)) turns[1] = turns[0] + chance.power(-8, -2);
    std::sort(turns.begin(), turns.end());
    const double a = turns[0], b = turns[1], d = turns[2], sign = chance.one_in(2) ? 1.0 : -1.0;
    const Real c0 = -a * b * d, c1 = a * b + a * d + b * d, c2 = -(a + b + d);
    const auto rise = [&](Real s) { return sign * s * (c0 + s * (c1 / 2 + s * (c2 / 3 + s / 4))); };
    const double near = turns[static_cast<std::size_t>(chance.between(0, 2.99))];
    const double stop =
        static_cast<double>(rise(std::clamp(near, 0.0, 1.0))) + (chance.one_in(2) ? 1.0 : -1.0) * chance.power(-9, -1);
    if (stop > 0.0) continue;  // the start is above it
    Parameters p;
    p.mass = mass;
    p.linear_stiffness = 0.0;
    p.velocity = static_cast<double>(sign * c0) * length / duration;
    p.stop_enabled = true;
    p.stop_position = stop * length;
    p.restitution = chance.between(0, 1);
    Inputs inputs;
    const double scale = sign * mass * length / duration / duration;
    inputs.external_force = {scale * static_cast<double>(c1), 2 * scale * static_cast<double>(c2) / duration,
                             6 * scale / duration / duration};
    std::vector<double> places{0.0};
    for (const double turn : turns)
      if (0.0 < turn && turn < 1.0) places.push_back(turn);
    places.push_back(1.0);
    double fall = 2.0, least = 1.0;  // where it falls first; how near it comes before or goes beyond
    for (std::size_t k = 1; k < places.size() && fall > 1.0; ++k) {
      const double depth = static_cast<double>(rise(places[k]) - stop);
      least = std::min(least, std::abs(depth));
      if (depth >= 0.0) continue;
      double low = places[k - 1], high = places[k];
      for (int halving = 0; halving < 60; ++halving) {
        const double middle = (low + high) / 2;
        (rise(middle) - stop < 0.0L ? high : low) = middle;
      }
      fall = low;
    }
    if (least < 1e-12) continue;  // rounding decides
    Spring s(p);
    const auto reached = s.step_to_event(duration, inputs, 0.0, true);
    ASSERT_EQ(reached.event, fall < 1.0) << i;
    if (!reached.event) continue;
    ++impacts;
    // Where it comes down at speed w, rounding of y moves it by 1e-16/w.
    const double speed = static_cast<double>(std::abs((fall - a) * (fall - b) * (fall - d)));
    ASSERT_NEAR(reached.size / duration, fall, 1e-13 + 1e-15 / speed) << i;
    ASSERT_EQ(s.displacement(), p.stop_position);
  }
  EXPECT_GT(impacts, 1000);
}

// The step that was missed, from the outside: it is below the stop for t in 0.542 … 0.929.
TEST(Falls, BelowTheStopInTheMiddleOfAStep) {
  const double a = 0.660669, b = 0.990272, d = 1.07613;
  Parameters p;
  p.linear_stiffness = 0.0;
  p.displacement = a * (a * b * d - a * (a * b + a * d + b * d) / 2 + a * a * (a + b + d) / 3 - a * a * a / 4);
  p.velocity = -a * b * d;
  p.stop_enabled = true;
  p.stop_position = 0.00142837;
  Spring s(p);
  Inputs inputs;
  inputs.external_force = {a * b + a * d + b * d, -2 * (a + b + d), 6.0};
  s.step(1.0, inputs);
  EXPECT_GE(s.impacts(), 1);
}

namespace {

/// A spring near a stop or a tip, over up to three times its time scale.
struct Scene {
  Parameters p;
  Inputs inputs;
  double size, length;
};

Scene random_scene(Chance& chance) {
  Scene scene;
  auto& [p, inputs, size, length] = scene;
  length = chance.power(-6, 2);
  const double duration = chance.power(-5, 2), unit = length / duration / duration;  // of acceleration
  p.mass = chance.power(-2, 2);
  p.absolute_tolerance = 1e-14 * length;  // a rebound that rises no higher dies out
  const double stiffness = p.mass / duration / duration;
  p.linear_stiffness = chance.one_in(4) ? 0.0 : stiffness * chance.power(-2, 1);
  if (chance.one_in(2)) p.cubic_stiffness = stiffness / length / length * chance.power(-2, 0.5);
  if (chance.one_in(2)) p.damping = p.mass / duration * chance.power(-2, 1);
  p.displacement = length * chance.between(-0.3, 0.3);
  p.velocity = length / duration * chance.between(-1, 1);
  p.restitution = chance.one_in(3) ? chance.of<double>({0.0, 1.0}) : chance.between(0, 1);
  size = duration * chance.between(0.2, 3.0);
  const double turns = chance.between(1, 8) / size;
  inputs.external_force = {p.mass * unit * chance.between(-8, 8), p.mass * unit * turns * chance.between(-8, 8),
                           p.mass * unit * turns * turns * chance.between(-8, 8)};
  return scene;
}

}  // namespace

// Springs with all that acts on a free top above a stop, impact by impact.
TEST(Falls, OfSpringsToTheStop) {
  Chance chance(2);
  int impacts = 0;
  for (int i = 0; i < 400; ++i) {
    auto [p, inputs, size, length] = random_scene(chance);
    p.stop_enabled = true;
    p.stop_position = p.displacement - length * (chance.one_in(10) ? 0.0 : chance.power(-4, 0));
    Spring s(p);
    impacts += expect_events(s, p, inputs, size, length, 1e-8 * length, "stop", i) - 1;
    ASSERT_FALSE(HasFailure());
  }
  EXPECT_GT(impacts, 300);
}

// The same beside a tip that moves, with contacts that begin and end, and without or with a stop.
TEST(Falls, OfSpringsToTheTip) {
  Chance chance(3);
  int events = 0;
  for (int i = 0; i < 150; ++i) {
    auto [p, inputs, size, length] = random_scene(chance);
    p.contact_law = ContactLaw::normal_compliance;
    p.compliance_exponent = chance.of<double>({1.0, 1.5, 2.0, 3.0, 4.0, 5.0});
    p.compliance_stiffness =
        p.mass / size / size * chance.power(-1, 2) / std::pow(0.1 * length, p.compliance_exponent - 1.0);
    if (chance.one_in(3)) p.compliance_damping = chance.power(-2, 0) * size / length;
    if (chance.one_in(2)) {
      p.stop_enabled = true;
      p.stop_position = p.displacement - length * chance.power(-3, 0);
    }
    const double fast = length / size;
    inputs.tip_displacement = {p.displacement + length * chance.between(-0.05, 0.3), fast * chance.between(-1, 1),
                               fast / size * chance.between(-4, 4)};
    Spring s(p);
    events += expect_events(s, p, inputs, size, length, 1e-7 * length, "tip", i) - 1;
    ASSERT_FALSE(HasFailure());
  }
  EXPECT_GT(events, 200);
}

// A top at rest under a tip that moves and a load: N is not below 0 before it is left, and is 0 there.
TEST(Falls, OfHoldingForces) {
  Chance chance(4);
  int left = 0;
  for (int i = 0; i < 1000; ++i) {
    Parameters p;
    p.linear_stiffness = 0.0;
    p.stop_enabled = true;
    p.stop_position = 0.0;
    p.contact_law = ContactLaw::normal_compliance;
    p.compliance_stiffness = 1.0;
    p.compliance_exponent = chance.one_in(2) ? chance.of<double>({1.0, 1.5, 2.0, 3.0, 4.0}) : chance.between(1, 6);
    if (chance.one_in(3)) p.compliance_damping = chance.power(-1, 0.5);
    Inputs inputs;
    inputs.tip_displacement = {chance.between(-1, 0.3), chance.between(-2, 2), chance.between(-4, 4)};
    const auto& u = inputs.tip_displacement;
    const auto contact = [&](double t) {
      const double depth = -at(u, t);
      const double factor = std::max(0.0, 1.0 - p.compliance_damping * rate(u, t));
      return depth > 0.0 ? std::pow(depth, p.compliance_exponent) * factor : 0.0;
    };
    // Through the contact force at three instants, less a little: N is about 0 at several places.
    const double a = chance.between(0, 0.3), b = chance.between(0.3, 0.6), c = chance.between(0.6, 1);
    const double first = (contact(b) - contact(a)) / (b - a), second = (contact(c) - contact(b)) / (c - b);
    const double bend = (second - first) / (c - a), start = contact(a) - a * first + a * b * bend;
    inputs.external_force = {std::min(start, contact(0.0)) - chance.power(-6, 0), first - (a + b) * bend, 2 * bend};
    const auto N = [&](double t) { return contact(t) - at(inputs.external_force, t); };
    Spring s(p);
    const auto reached = s.step_to_event(1.0, inputs, 0.0, true);
    const auto& F = inputs.external_force;
    const double terms = std::abs(F[0]) + std::abs(F[1]) + std::abs(F[2]);
    const auto rounding = [&](double t) { return 1e-14 * contact(t) + 1e-15 * terms; };
    constexpr int n = 2000;
    for (int k = 0; k <= n; ++k) {
      const double t = reached.size * k / n;
      ASSERT_GE(N(t), -rounding(t)) << i << ", at " << k;
    }
    if (!reached.event) continue;
    ++left;
    // Rounding of the instant, where N falls steeply, or that of N.
    const double steep = std::abs(N(reached.size + 1e-7) - N(reached.size - 1e-7)) / 2e-7;
    ASSERT_LE(N(reached.size), rounding(reached.size) + 1e-14 * steep) << i;
  }
  EXPECT_GT(left, 200);
}
