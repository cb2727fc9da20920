// What a step does with quantities that are quadratic in time (common.hpp).
#pragma once

#include "../fmus/adapter/common.hpp"

namespace spring {

using common::mean, common::number, common::Polynomial, common::rate, common::value;

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
