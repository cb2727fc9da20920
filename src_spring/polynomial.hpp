// A quantity that is quadratic in time over a segment, p(τ) = c₀ + c₁τ + c₂τ²/2: its value and derivatives at τ = 0.
#pragma once

#include <array>

namespace spring {

using Quadratic = std::array<double, 3>;

inline double value(const Quadratic& c, double t) { return c[0] + t * (c[1] + t * c[2] / 2); }
inline double rate(const Quadratic& c, double t) { return c[1] + t * c[2]; }
/// ∫₀ᵗ p
inline double integral(const Quadratic& c, double t) { return t * (c[0] + t * (c[1] / 2 + t * c[2] / 6)); }
/// ∫₀ʰ p ẋ dτ of a path that rises by Δ = x(h) − x(0), with I = ∫(x − x(0)) dτ and J = ∫∫(x − x(0)) dτ dτ; x may have
/// kinks. By parts.
inline double work(const Quadratic& p, double h, double rise, double I, double J) {
  return p[0] * rise + p[1] * (h * rise - I) + p[2] * (h * h / 2 * rise - h * I + J);
}
/// p over scaled time s = τ/h.
inline Quadratic scaled(const Quadratic& c, double h) { return {c[0], h * c[1], h * h * c[2]}; }
/// p with time counted from `t`.
inline Quadratic shifted(const Quadratic& c, double t) { return {value(c, t), rate(c, t), c[2]}; }

}  // namespace spring
