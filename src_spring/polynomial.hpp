// A quantity that is quadratic in time over a segment: p(τ) = c₀ + c₁τ + c₂τ²/2.
#pragma once

#include <array>

namespace spring {

struct Quadratic {
  std::array<double, 3> c{};  ///< value and derivatives at τ = 0

  double operator()(double t) const { return c[0] + t * (c[1] + t * c[2] / 2); }
  double rate(double t) const { return c[1] + t * c[2]; }
  /// The same quantity with time counted from `t`.
  Quadratic shifted(double t) const { return {{(*this)(t), rate(t), c[2]}}; }
};

}  // namespace spring
