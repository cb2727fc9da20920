// Power series in scaled time s = τ/H ∈ [0, 1], of which a motion is the first terms.
#pragma once

#include <array>
#include <cstddef>

namespace spring {

/// Highest power of a motion.
inline constexpr int max_order = 12;

/// Coefficients of s⁰, s¹, …: as many as a motion has, and the first that it leaves out.
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

}  // namespace spring
