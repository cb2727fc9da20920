// A quantity that is quadratic in time over a segment, p(τ) = c₀ + c₁τ + c₂τ²/2: its value and derivatives at τ = 0.
#pragma once

#include <array>

namespace spring {

using Quadratic = std::array<double, 3>;

inline double value(const Quadratic& c, double t) { return c[0] + t * (c[1] + t * c[2] / 2); }
inline double rate(const Quadratic& c, double t) { return c[1] + t * c[2]; }
/// ∫₀ᵗ p
inline double integral(const Quadratic& c, double t) { return t * (c[0] + t * (c[1] / 2 + t * c[2] / 6)); }
/// p with time counted from `t`.
inline Quadratic shifted(const Quadratic& c, double t) { return {value(c, t), rate(c, t), c[2]}; }

}  // namespace spring
