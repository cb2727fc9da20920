#include "rest.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace spring {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();
constexpr int parts = 8;  ///< of a stretch in which N is smooth: instants at which it is looked at

/// ∫ f over a … b to 1e-14, where f may behave as a power at both ends: double-exponential quadrature (Takahasi & Mori,
/// "Double exponential formulas for numerical integration", Publ. RIMS 9, 1974, 721–741).
template <class Function>
double integral(const Function& f, double a, double b) {
  constexpr int half = 30;
  static const auto rule = [] {
    constexpr double width = 3.1 / half, pi = 3.14159265358979323846;
    std::array<std::pair<double, double>, half + 1> nodes;  // distance from an end, weight
    for (int i = 0; i <= half; ++i) {
      const double e = std::exp(pi * std::sinh(i * width));
      nodes[static_cast<std::size_t>(i)] = {1.0 / (1.0 + e),
                                            width * pi * std::cosh(i * width) * e / (1.0 + e) / (1.0 + e)};
    }
    nodes[0].second /= 2.0;  // counted from both ends
    return nodes;
  }();
  double sum = 0.0;
  for (const auto& [place, weight] : rule) sum += weight * (f(a + (b - a) * place) + f(b - (b - a) * place));
  return (b - a) * sum;
}

/// Where f, which falls and then rises, is least between a and b: golden-section search.
template <class Function>
double minimum(const Function& f, double a, double b) {
  constexpr double golden = 0.61803398874989485;
  double left = b - golden * (b - a), right = a + golden * (b - a), at_left = f(left), at_right = f(right);
  for (int i = 0; i < 40; ++i) {  // then within 1e-8: the value is exact to rounding
    if (at_left < at_right) {
      b = std::exchange(right, left);
      at_right = at_left;
      at_left = f(left = b - golden * (b - a));
    } else {
      a = std::exchange(left, right);
      at_left = at_right;
      at_right = f(right = a + golden * (b - a));
    }
  }
  return at_left < at_right ? left : right;
}

}  // namespace

Rest rest(const Motion& motion, double y, double depth, bool compliant, const Loads& loads, double size) {
  const Compliance& law = motion.compliance();
  const double slope = loads.tip[1], curvature = loads.tip[2];
  const auto deep = [&](double t) { return depth - t * (slope + t * curvature / 2); };
  const auto rate = [&](double t) { return -(slope + t * curvature); };
  const auto contact = [&](double t) { return compliant ? law.force(deep(t), rate(t)) : 0.0; };
  const auto N = [&](double t) { return motion.holding_force(y, value(loads.force, t), contact(t)); };

  // Where N is not smooth: the tip arrives or leaves, turns, or damping holds the contact force at 0.
  std::vector<double> cuts{0.0, size};
  if (compliant) {
    const double root = std::sqrt(slope * slope + 2.0 * curvature * depth), sum = -(slope + std::copysign(root, slope));
    for (const double t :
         {sum / curvature, -2.0 * depth / sum, -slope / curvature, (law.release_speed() - slope) / curvature})
      if (0.0 < t && t < size) cuts.push_back(t);
    std::sort(cuts.begin(), cuts.end());
  }

  std::vector<double> times{0.0};
  for (std::size_t i = 1; i < cuts.size(); ++i)
    for (int k = 1; k <= parts; ++k)
      times.push_back(k < parts ? cuts[i - 1] + (cuts[i] - cuts[i - 1]) * k / parts : cuts[i]);
  std::vector<double> forces;
  double scale = 0.0;  // of which N is the difference
  for (const double t : times) {
    forces.push_back(N(t));
    scale = std::max(scale, std::abs(value(loads.force, t)) + std::abs(motion.spring_force(y)) + contact(t));
  }
  const auto below = [&](double force) { return force < -8.0 * epsilon * scale; };

  Rest result{size, false, 0.0, 0.0};
  for (std::size_t i = 0; i < times.size() && !result.released; ++i) {
    double under = times[i];
    const std::size_t before = i > 0 ? i - 1 : 0, after = std::min(i + 1, times.size() - 1);
    if (!below(forces[i])) {
      const bool least = (i == before || forces[i] <= forces[before]) && (i == after || forces[i] < forces[after]);
      if (!least) continue;
      under = minimum(N, times[before], times[after]);
      if (!below(N(under))) continue;
    }
    double above = times[before];
    while (under - above > 2.0 * epsilon * size) {
      const double middle = above + (under - above) / 2;
      (N(middle) < 0.0 ? under : above) = middle;
    }
    result.size = above;
    result.released = true;
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
