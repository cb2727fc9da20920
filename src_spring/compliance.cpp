#include "compliance.hpp"

#include <cmath>

namespace spring {
namespace {

/// x^p for x ≥ 0. Half-integer powers by products and a square root, which every processor rounds alike.
double power(double x, double p) {
  const double twice = 2.0 * p;
  if (twice < 0.0 || twice > 16.0 || twice != std::floor(twice)) return std::pow(x, p);
  const int n = static_cast<int>(twice) / 2;
  double result = static_cast<int>(twice) % 2 != 0 ? std::sqrt(x) : 1.0;
  for (int i = 0; i < n; ++i) result *= x;
  return result;
}

}  // namespace

double Compliance::elastic(double depth) const { return depth > 0.0 ? lambda_ * power(depth, p_) : 0.0; }

double Compliance::energy(double depth) const { return std::max(0.0, depth) * elastic(depth) / (p_ + 1.0); }

double Compliance::continued_elastic(double depth) const {
  const double sign = depth < 0.0 && !even() ? -1.0 : 1.0;
  return sign * lambda_ * power(std::abs(depth), p_);
}

double Compliance::continued_slope(double depth) const {
  const double sign = depth < 0.0 && even() ? -1.0 : 1.0;
  return sign * lambda_ * p_ * power(std::abs(depth), p_ - 1.0);
}

Compliance::Effect Compliance::continued(double depth, double rate) const {
  const double elastic = continued_elastic(depth);
  const double force = c_ > 0.0 ? std::max(0.0, elastic + c_ * rate) : elastic * damping_factor(rate);
  return {force, (force - elastic) * rate};
}

Compliance::Slopes Compliance::slopes(double depth, double rate) const {
  const double elastic = continued_elastic(depth), slope = continued_slope(depth), factor = damping_factor(rate);
  if (c_ > 0.0) {
    if (elastic + c_ * rate <= 0.0) return {0.0, 0.0, -slope * rate, -elastic};
    return {slope, c_, 0.0, 2.0 * c_ * rate};
  }
  const double by_rate = factor > 0.0 ? elastic * chi_ : 0.0;
  return {slope * factor, by_rate, slope * (factor - 1.0) * rate, elastic * (factor - 1.0) + by_rate * rate};
}

bool Compliance::keeps_side(double depth, double rate, double change, double change_of_rate) const {
  if (chi_ > 0.0) return 2.0 * change_of_rate < std::abs(1.0 / chi_ + rate);
  if (rate > change_of_rate) return true;
  const double force = continued_elastic(depth) + c_ * rate, slope = continued_slope(std::abs(depth) + change);
  return 2.0 * (slope * change + c_ * change_of_rate) < std::abs(force);
}

double Compliance::elastic_coefficient(Along& along, std::size_t n, const Series& depth) const {
  if (polynomial()) {
    const Series* last = &depth;
    for (std::size_t j = 0; j + 2 <= static_cast<std::size_t>(p_); ++j) {
      along.power[j][n] = 0.0;
      for (std::size_t k = 0; k <= n; ++k) along.power[j][n] += depth[k] * (*last)[n - k];
      last = &along.power[j];
    }
    return lambda_ * (*last)[n];
  }
  if (n == 0 || depth[0] <= 0.0) return elastic(depth[0]);
  // δ f' = p δ' f for f = δ^p, coefficient by coefficient.
  double sum = 0.0;
  for (std::size_t k = 1; k <= n; ++k) {
    const double share = static_cast<double>(k) / static_cast<double>(n);
    sum += (share * (p_ + 1.0) - 1.0) * depth[k] * along.elastic[n - k];
  }
  return sum / depth[0];
}

void Compliance::extend(Along& along, std::size_t n, const Series& depth, double size) const {
  auto& [elastic, damping, power] = along;
  elastic[n] = elastic_coefficient(along, n, depth);
  if (!damped()) return;
  const auto rate = [&](std::size_t k) { return static_cast<double>(k + 1) * depth[k + 1] / size; };
  if (c_ > 0.0) {
    damping[n] = elastic[0] + c_ * rate(0) > 0.0 ? c_ * rate(n) : -elastic[n];
  } else if (damping_factor(rate(0)) > 0.0) {
    damping[n] = 0.0;
    for (std::size_t k = 0; k <= n; ++k) damping[n] += chi_ * elastic[k] * rate(n - k);
  } else {
    damping[n] = -elastic[n];
  }
}

bool Compliance::polynomial() const { return p_ == std::floor(p_) && p_ <= static_cast<double>(highest_power); }
bool Compliance::even() const { return p_ / 2.0 == std::floor(p_ / 2.0); }

}  // namespace spring
