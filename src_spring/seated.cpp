#include "seated.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "events.hpp"

namespace spring {
namespace {

constexpr double epsilon = std::numeric_limits<double>::epsilon();

/// Part of the time on the foundation, in s = τ/size, in which the tip presses on the top all the time, or never.
struct Stretch {
  double from, to;
  bool pressed;
};

/// N over s. Its derivative of order k is, where the tip presses,
///     P⁽ᵏ⁾ + λ Q_k δ^{p−k},   Q_0 = 1 + χ δ̇,   Q_{k+1} = Q_k′ δ + (p − k) Q_k δ′,
/// and a damper adds c δ̇; with P = −F + k1 (y − y₀) + k2 (y − y₀)³ of degree 2. So the third one is 0 where the
/// polynomial Q_3 is, whatever p is: between these places the second derivative is monotone and has one zero at most,
/// and so on down to N itself.
class HoldingForce {
 public:
  HoldingForce(const EquationOfMotion& equation, double y, double depth, const Loads& loads, double size)
      : law_(equation.compliance()),
        size_(size),
        spring_force_(equation.spring_force(y)),
        load_(scaled(loads.force, size)),
        depth_{depth, -size * loads.tip[1], -size * size * loads.tip[2] / 2} {
    const double p = law_.exponent(), chi = law_.damping();
    factors_[0] = {1.0 + chi * depth_[1] / size, 2.0 * chi * depth_[2] / size};
    for (std::size_t k = 0; k + 1 < factors_.size(); ++k)
      for (std::size_t i = 0; i <= k + 1; ++i)
        for (std::size_t j = i > 0 ? 0 : 1; j <= 2; ++j) {
          const double factor = static_cast<double>(i) + (p - static_cast<double>(k)) * static_cast<double>(j);
          factors_[k + 1][i + j - 1] += factor * factors_[k][i] * depth_[j];
        }
  }

  double depth(double s) const { return sum_of_powers(depth_, s, 0, 2); }                           ///< [m]
  double rate(double s) const { return (depth_[1] + 2.0 * s * depth_[2]) / size_; }                 ///< δ̇ [m/s]
  double contact(double s) const { return law_.force(depth(s), rate(s)); }                          ///< [N]
  double damping_power(double s) const { return (contact(s) - law_.elastic(depth(s))) * rate(s); }  ///< [W]

  /// The tip arrives or leaves, turns, or leaves so fast that damping takes all of the force.
  std::vector<Stretch> stretches(bool compliant) const {
    if (!compliant) return {{0.0, 1.0, false}};
    std::vector<double> cuts{0.0, 1.0};
    const auto cut = [&cuts](const Series& distance, int degree) {
      for (const double s : sign_changes(distance, degree)) cuts.push_back(s);
    };
    cut(depth_, 2);
    cut({depth_[1], 2.0 * depth_[2]}, 1);
    cut(factors_[0], 1);
    std::sort(cuts.begin(), cuts.end());
    if (law_.viscosity() > 0.0) cut_by_damper(cuts);
    std::vector<Stretch> parts;
    for (std::size_t i = 1; i < cuts.size(); ++i)
      if (cuts[i] > cuts[i - 1]) parts.push_back({cuts[i - 1], cuts[i], contact((cuts[i - 1] + cuts[i]) / 2) > 0.0});
    return parts;
  }

  /// The last place in the stretch before N is below 0; nothing if it never is.
  std::optional<double> first_fall(const Stretch& stretch) const {
    std::vector<double> ends;  // of the parts in which the derivative of order k is monotone
    if (stretch.pressed)
      for (const double s : sign_changes(factors_[3], 4))
        if (stretch.from < s && s < stretch.to) ends.push_back(s);
    ends.push_back(stretch.to);
    for (int k = 2; k >= 0; --k) {
      // The second derivative is scaled by a power of δ, of which rounding is left where δ is 0. What it does so near
      // the ends changes N by less than its rounding.
      const double inset = k == 2 ? 1e-7 * (stretch.to - stretch.from) : 0.0;
      const auto negative = [&](double s) { return derivative_sign(k, s, stretch.pressed) < 0.0; };
      if (k == 0 && negative(stretch.from)) return stretch.from;
      std::vector<double> changes;
      for (double& end : ends) end = std::min(end, stretch.to - inset);
      changes_between(stretch.from + inset, ends, negative, [&](double s, bool now) {
        changes.push_back(s);
        return k == 0 && now;
      });
      if (k == 0 && !changes.empty()) return changes.back();
      ends = changes;
      ends.push_back(stretch.to);
    }
    return {};
  }

 private:
  /// Adds where the force of a damper is as large as the elastic one.
  void cut_by_damper(std::vector<double>& cuts) const {
    constexpr int samples = 16;  // between two of the other cuts, where depth and rate are monotone
    const auto pulls = [this](double s) { return law_.elastic(depth(s)) + law_.viscosity() * rate(s) < 0.0; };
    const std::size_t known = cuts.size();
    for (std::size_t i = 1; i < known; ++i) {
      std::array<double, samples> ends;
      for (int k = 0; k < samples; ++k) ends[k] = cuts[i - 1] + (k + 1) * (cuts[i] - cuts[i - 1]) / samples;
      changes_between(cuts[i - 1], ends, pulls, [&cuts](double s, bool) {
        cuts.push_back(s);
        return false;
      });
    }
    std::sort(cuts.begin(), cuts.end());
  }

  /// What has the sign of the derivative of order k: nothing in it grows without bound at δ = 0. N counts as negative
  /// only where it is so by more than its rounding.
  double derivative_sign(int k, double s, bool pressed) const {
    const double force = value(load_, s);
    double plain = k == 0 ? spring_force_ - force : k == 1 ? -spring::rate(load_, s) : -load_[2];
    double sum = plain;
    double contact = 0.0;
    if (pressed) {
      if (k < 2) plain += law_.viscosity() * (k == 0 ? rate(s) : 2.0 * depth_[2] / size_);
      const double over = law_.exponent() - k, deep = std::max(depth(s), 0.0);
      const auto& Q = factors_[static_cast<std::size_t>(k)];
      contact = law_.stiffness() * sum_of_powers(Q, s, 0, k + 1) * std::pow(deep, std::max(over, 0.0));
      sum = plain * std::pow(deep, std::max(-over, 0.0)) + contact;
    }
    return k > 0 ? sum : sum + 8.0 * epsilon * (std::abs(force) + std::abs(spring_force_) + std::abs(contact));
  }

  const Compliance& law_;
  double size_, spring_force_;
  Polynomial load_;                  ///< F over s
  Series depth_;                     ///< δ over s
  std::array<Series, 4> factors_{};  ///< Q_k over s
};

/// ∫ f over a … b to 1e-14, where f may behave as a power at both ends: double-exponential quadrature (Takahasi & Mori,
/// "Double exponential formulas for numerical integration", Publ. RIMS 9, 1974, 721–741).
template <class Function>
double integral(const Function& f, double a, double b) {
  // At 3.1 the weights are below rounding; 30 nodes a side integrate powers up to 20 to 3e-15, that of 100 to 2e-11.
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

SeatedEnd stay_seated(const EquationOfMotion& equation, double y, double depth, bool compliant, const Loads& loads,
                      double size) {
  const HoldingForce N(equation, y, depth, loads, size);
  SeatedEnd result{size, false, 0.0, 0.0};
  for (auto [from, to, pressed] : N.stretches(compliant)) {
    const auto fall = N.first_fall({from, to, pressed});
    if (fall) to = *fall;
    if (from < to && N.depth((from + to) / 2) > 0.0) {
      result.impulse += size * integral([&N](double s) { return N.contact(s); }, from, to);
      result.dissipated += size * integral([&N](double s) { return N.damping_power(s); }, from, to);
    }
    if (!fall) continue;
    result.size = to * size;
    result.released = true;
    break;
  }
  result.impulse += result.size * (equation.spring_force(y) - mean(loads.force, result.size));
  return result;
}

}  // namespace spring
