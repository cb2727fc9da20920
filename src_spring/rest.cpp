#include "rest.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "events.hpp"

namespace spring {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr int parts = 8;  ///< of a stretch in which N is smooth: instants at which it is looked at

struct Distance {
  double value, rate;
};

/// Where the distance `at(s)` falls through 0 between `low` and `high`: it is below 0 at `high`, where it is `end`, or
/// at its minimum, if the rate turns from `rate` ≤ 0 at `low` to one above 0.
template <class At>
std::optional<double> fall(double low, double high, double rate, const Distance& end, double resolution, const At& at) {
  double under = high;
  if (!(end.value < 0.0)) {
    if (!(rate <= 0.0 && end.rate > 0.0)) return {};
    under = last_before(low, high, resolution, [&](double s) { return at(s).rate > 0.0; });
    if (!(at(under).value < 0.0)) return {};
  }
  return last_before(low, under, resolution, [&](double s) { return at(s).value < 0.0; });
}

/// ∫ f over a … b to 1e-14, where f may behave as a power at both ends: double-exponential quadrature (Takahasi & Mori,
/// "Double exponential formulas for numerical integration", Publ. RIMS 9, 1974, 721–741).
template <class Function>
double integral(const Function& f, double a, double b) {
  constexpr int half = 30;
  constexpr double width = 3.1 / half, pi = 3.14159265358979323846;
  double sum = 0.0;
  for (int i = 0; i <= half; ++i) {
    const double e = std::exp(pi * std::sinh(i * width)), place = 1.0 / (1.0 + e);  // from an end
    const double weight = width * pi * std::cosh(i * width) * e / (1.0 + e) / (1.0 + e) / (i > 0 ? 1.0 : 2.0);
    sum += weight * (f(a + (b - a) * place) + f(b - (b - a) * place));
  }
  return (b - a) * sum;
}

}  // namespace

Rest rest(const Motion& motion, double y, double depth, bool compliant, const Loads& loads, double size) {
  const Compliance& law = motion.compliance();
  const double slope = loads.tip[1], curvature = loads.tip[2];
  const auto deep = [&](double t) { return depth - t * (slope + t * curvature / 2); };
  const auto rate = [&](double t) { return -(slope + t * curvature); };
  const auto contact = [&](double t) { return compliant ? law.force(deep(t), rate(t)) : 0.0; };
  // N, above 0 by its rounding, and its rate.
  const auto N = [&](double t) {
    const double D = deep(t), C = contact(t), F = value(loads.force, t);
    const double rounding = 8.0 * epsilon * (std::abs(F) + std::abs(motion.spring_force(y)) + C);
    const double rate = motion.holding_force(y, loads.from_time(t), compliant && D > 0.0, D)[1];
    return Distance{motion.holding_force(y, F, C) + rounding, rate};
  };

  // Where N is not smooth: the tip arrives or leaves, turns, or damping holds the contact force at 0.
  std::vector<double> cuts{0.0, size};
  if (compliant) {
    const Series deep_over_s{depth, -slope * size, -curvature / 2 * size * size};
    const auto cut = [&](const Series& distance, int degree) {
      for (const double s : sign_changes(distance, degree)) cuts.push_back(s * size);
    };
    cut(deep_over_s, 2);
    cut({-slope, -curvature * size}, 1);
    if (law.damped()) cut({law.release_speed() - slope, -curvature * size}, 1);
    std::sort(cuts.begin(), cuts.end());
  }

  Rest result{size, false, 0.0, 0.0};
  Distance before = N(0.0);
  for (std::size_t i = 1; i < cuts.size(); ++i)
    for (int k = 0; k < parts && !result.released; ++k) {
      const double part = (cuts[i] - cuts[i - 1]) / parts, from = cuts[i - 1] + k * part;
      const double to = k + 1 < parts ? from + part : cuts[i];
      const Distance after = N(to);
      if (const auto release = fall(from, to, before.rate, after, 2.0 * epsilon * size, N))
        result = {*release, true, 0.0, 0.0};
      before = after;
    }

  result.impulse = result.size * (motion.spring_force(y) - mean(loads.force, result.size));
  for (std::size_t i = 1; i < cuts.size(); ++i) {
    const double from = cuts[i - 1], to = std::min(cuts[i], result.size);
    if (!compliant || from >= to || deep(from + (to - from) / 2) <= 0.0) continue;
    result.impulse += integral(contact, from, to);
    if (law.damped())
      result.dissipated += integral([&](double t) { return (contact(t) - law.elastic(deep(t))) * rate(t); }, from, to);
  }
  return result;
}

}  // namespace spring
