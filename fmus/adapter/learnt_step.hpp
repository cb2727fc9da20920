// The size H of the communication steps, which nobody tells an FMU: each learns it from the steps.
#pragma once

#include <cmath>
#include <limits>

namespace fmi {

/// What a step is expected to have before the first one: the step size of DefaultExperiment [s].
inline constexpr double default_step = 1e-3;

/// Whether a step is a rest that the rounding of an importer's times has left, as a last step may be.
inline bool is_rest(double H, double time, double size) { return size <= 1e-6 * H && size <= 1e-9 * std::abs(time); }

/// H [s] after a step of `size` from `time`, before which it was `H`: that size, unless it is a rest or differs by the
/// rounding of times. Both FMUs of a pair go by this: each knows what the other expects.
inline double learnt_step(double H, double time, double size) {
  const double rounding = 1e-6 * H + 64.0 * std::numeric_limits<double>::epsilon() * std::abs(time);
  return is_rest(H, time, size) || std::abs(size - H) <= rounding ? H : size;
}

}  // namespace fmi
