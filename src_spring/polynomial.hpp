// A quantity that is quadratic in time over a step, p(τ) = p₀ + p₁τ + p₂τ²/2: its value and its first two time
// derivatives at τ = 0.
#pragma once

#include <array>

namespace spring {

using Polynomial = std::array<double, 3>;

inline double value(const Polynomial& p, double t) { return p[0] + t * (p[1] + t * p[2] / 2); }
inline double rate(const Polynomial& p, double t) { return p[1] + t * p[2]; }
/// Over 0 … t.
inline double mean(const Polynomial& p, double t) { return p[0] + t * (p[1] / 2 + t * p[2] / 6); }
/// ∫₀ʰ p ẋ dτ of a path that rises by Δ = x(h) − x(0), with I = ∫(x − x(0)) dτ and J = ∫∫(x − x(0)) dτ dτ; x may have
/// kinks. By parts.
inline double work(const Polynomial& p, double h, double rise, double I, double J) {
  return p[0] * rise + p[1] * (h * rise - I) + p[2] * (h * h / 2 * rise - h * I + J);
}
/// p over scaled time s = τ/h.
inline Polynomial scaled(const Polynomial& p, double h) { return {p[0], h * p[1], h * h * p[2]}; }
/// p with time counted from `t`.
inline Polynomial shifted(const Polynomial& p, double t) { return {value(p, t), rate(p, t), p[2]}; }

}  // namespace spring
