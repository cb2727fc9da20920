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

/// c x^p, 0 where c = 0 whatever x^p is.
double term(double c, double x, double p) { return c == 0.0 ? 0.0 : c * power(x, p); }

}  // namespace

double Compliance::force(double depth) const { return depth > 0.0 ? lambda_ * power(depth, p_) : 0.0; }

double Compliance::slope(double depth) const { return depth > 0.0 ? lambda_ * p_ * power(depth, p_ - 1.0) : 0.0; }

double Compliance::energy(double depth) const {
  return depth > 0.0 ? lambda_ * power(depth, p_ + 1.0) / (p_ + 1.0) : 0.0;
}

double Compliance::continued_force(double depth) const {
  if (depth >= 0.0) return force(depth);
  const bool even = analytic() && p_ / 2.0 == std::floor(p_ / 2.0);
  return (even ? lambda_ : -lambda_) * power(-depth, p_);
}

double Compliance::continued_slope(double depth) const {
  if (depth >= 0.0) return lambda_ * p_ * power(depth, p_ - 1.0);
  const bool even = analytic() && p_ / 2.0 == std::floor(p_ / 2.0);
  return (even ? -lambda_ : lambda_) * p_ * power(-depth, p_ - 1.0);
}

std::array<double, 4> Compliance::rates(const std::array<double, 4>& depth) const {
  const auto& [d, v, a, j] = depth;
  const double first = term(lambda_ * p_, d, p_ - 1.0);
  const double second = term(lambda_ * p_ * (p_ - 1.0), d, p_ - 2.0);
  const double third = term(lambda_ * p_ * (p_ - 1.0) * (p_ - 2.0), d, p_ - 3.0);
  return {force(d), first * v, second * v * v + first * a, third * v * v * v + 3.0 * second * v * a + first * j};
}

bool Compliance::analytic() const { return p_ == std::floor(p_); }

}  // namespace spring
