// Taylor polynomial of the displacement at a segment's start, R(τ) = Σ y⁽ᵏ⁾ τᵏ/k!, k ≤ 4, with its exact integrals.
//
// IDA is given the deviation from R instead of y itself. The equation is the same, but the deviation starts with zero
// value and zero rate, so the low orders with which a freshly started BDF begins meet a solution that has hardly
// moved, the tolerances are relative to what changes, and y is interpolated accurately at events.
#pragma once

#include <array>

namespace spring {

class Taylor {
 public:
  static constexpr int max_order = 4;

  Taylor() = default;
  /// `derivatives` y, ẏ, ÿ, … ; those above `order` are dropped.
  Taylor(const std::array<double, max_order + 1>& derivatives, int order);

  int order() const { return order_; }
  double operator()(double t) const { return start() + rise(t); }
  double start() const { return d_[0]; }
  /// R(τ) − R(0), not spoilt by R(0).
  double rise(double t) const { return t * (d_[1] + t * (d_[2] / 2 + t * (d_[3] / 6 + t * d_[4] / 24))); }
  double rate(double t) const { return d_[1] + t * (d_[2] + t * (d_[3] / 2 + t * d_[4] / 6)); }
  /// y⁽ᵏ⁾/k!
  std::array<double, max_order + 1> coefficients() const { return {d_[0], d_[1], d_[2] / 2, d_[3] / 6, d_[4] / 24}; }

  double integral(double t) const;               ///< ∫₀ᵗ R
  double integral_2(double t) const;             ///< ∫₀ᵗ∫ R
  double squared_rate_integral(double t) const;  ///< ∫₀ᵗ Ṙ²

 private:
  std::array<double, max_order + 1> d_{};
  int order_ = 0;
};

}  // namespace spring
