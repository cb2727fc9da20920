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

double Compliance::elastic(double depth) const { return depth > 0.0 ? lambda_ * power(depth, p_) : 0.0; }

double Compliance::energy(double depth) const {
  return depth > 0.0 ? lambda_ * power(depth, p_ + 1.0) / (p_ + 1.0) : 0.0;
}

double Compliance::continued_elastic(double depth) const {
  if (depth >= 0.0) return elastic(depth);
  const bool even = analytic() && p_ / 2.0 == std::floor(p_ / 2.0);
  return (even ? lambda_ : -lambda_) * power(-depth, p_);
}

double Compliance::continued_slope(double depth) const {
  if (depth >= 0.0) return lambda_ * p_ * power(depth, p_ - 1.0);
  const bool even = analytic() && p_ / 2.0 == std::floor(p_ / 2.0);
  return (even ? -lambda_ : lambda_) * p_ * power(-depth, p_ - 1.0);
}

Compliance::Effect Compliance::continued(double depth, double rate) const {
  const double elastic = continued_elastic(depth), factor = damping_factor(rate);
  return {elastic * factor, elastic * (factor - 1.0) * rate};
}

Compliance::Slopes Compliance::slopes(double depth, double rate) const {
  const double elastic = continued_elastic(depth), slope = continued_slope(depth), factor = damping_factor(rate);
  const double by_rate = factor > 0.0 ? elastic * chi_ : 0.0;
  return {slope * factor, by_rate, slope * (factor - 1.0) * rate, elastic * (factor - 1.0) + by_rate * rate};
}

std::array<double, 4> Compliance::elastic_rates(const Depth& depth) const {
  const auto& [d, v, a, j, s] = depth;
  const double first = term(lambda_ * p_, d, p_ - 1.0);
  const double second = term(lambda_ * p_ * (p_ - 1.0), d, p_ - 2.0);
  const double third = term(lambda_ * p_ * (p_ - 1.0) * (p_ - 2.0), d, p_ - 3.0);
  return {elastic(d), first * v, second * v * v + first * a, third * v * v * v + 3.0 * second * v * a + first * j};
}

std::array<double, 4> Compliance::rates(const Depth& depth) const {
  const auto E = elastic_rates(depth);
  if (!damped()) return E;
  const auto& [d, v, a, j, s] = depth;
  const double G = damping_factor(v);
  if (G == 0.0) return {};
  return {E[0] * G, E[1] * G + E[0] * chi_ * a, E[2] * G + chi_ * (2.0 * E[1] * a + E[0] * j),
          E[3] * G + chi_ * (3.0 * E[2] * a + 3.0 * E[1] * j + E[0] * s)};
}

Quadratic Compliance::dissipation(const Depth& depth) const {
  if (!damped()) return {};
  auto P = rates(depth);  // C − λ δ^p
  const auto E = elastic_rates(depth);
  for (std::size_t k = 0; k < 4; ++k) P[k] -= E[k];
  const auto& [d, v, a, j, s] = depth;
  return {P[0] * v, P[1] * v + P[0] * a, P[2] * v + 2.0 * P[1] * a + P[0] * j};
}

bool Compliance::analytic() const { return p_ == std::floor(p_); }

}  // namespace spring
