// Taylor polynomial of the displacement at a segment's start, in scaled time s = τ/H ∈ [0, 1], with its exact
// integrals:
//     R(s) = Σ c_k sᵏ, k ≤ order.
//
// IDA is given the deviation from R instead of y itself. The equation is the same, but the deviation starts with zero
// value and zero rate, so the low orders with which a freshly started BDF begins meet a solution that has hardly
// moved, the tolerances are relative to what changes, and y is interpolated accurately at events. Where R alone is
// exact to the tolerance, one internal step of IDA confirms that.
#pragma once

#include <array>
#include <cstddef>

namespace spring {

/// Highest order of R.
inline constexpr int max_order = 12;

/// Coefficients of s⁰, s¹, …: as many as R has, and the first that it leaves out.
using Series = std::array<double, max_order + 2>;

/// Σ c_k sᵏ over first ≤ k ≤ last.
template <std::size_t n>
double sum_of_powers(const std::array<double, n>& c, double s, int first, int last) {
  double sum = 0.0;
  for (int k = last; k >= first; --k) sum = sum * s + c[static_cast<std::size_t>(k)];
  for (int k = 0; k < first; ++k) sum *= s;
  return sum;
}

/// Sign of the first coefficient that is not 0: where what starts so goes from s = 0 on.
template <std::size_t n>
double direction(const std::array<double, n>& series) {
  for (const double c : series)
    if (c != 0.0) return c > 0.0 ? 1.0 : -1.0;
  return 0.0;
}

class Taylor {
 public:
  Taylor() = default;
  /// Coefficients above `order` are dropped.
  Taylor(const Series& coefficients, int order);

  int order() const { return order_; }
  const Series& coefficients() const { return c_; }
  double operator()(double s) const { return start() + rise(s); }
  double start() const { return c_[0]; }
  /// R(s) − R(0), not spoilt by R(0).
  double rise(double s) const { return sum_of_powers(c_, s, 1, order_); }
  double rate(double s) const { return sum_of_powers(rate_, s, 0, order_ - 1); }       ///< dR/ds
  double rate_rise(double s) const { return sum_of_powers(rate_, s, 1, order_ - 1); }  ///< dR/ds less its start

  double integral(double s) const;               ///< ∫₀ˢ R
  double integral_2(double s) const;             ///< ∫₀ˢ∫ R
  double squared_rate_integral(double s) const;  ///< ∫₀ˢ (dR/ds)²

 private:
  Series c_{}, rate_{};
  int order_ = 0;
};

}  // namespace spring
