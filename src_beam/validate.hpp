// Parameter checks: a message always names the parameter, its value and what is allowed.
#pragma once

#include <cmath>
#include <string>

#include "beam.hpp"

namespace beam {

/// The shortest decimal that reads back as the same double, for messages.
std::string number(double value);

/// @throws std::invalid_argument for the first parameter that is not allowed
void validate(const Parameters& parameters);

[[noreturn]] void reject_not_finite(const char* name, double value);

/// @throws std::invalid_argument unless `value` is finite
inline void require_finite(const char* name, double value) {
  if (!std::isfinite(value)) reject_not_finite(name, value);
}

/// @throws std::invalid_argument unless `size` is a finite, positive step size [s]
void require_step_size(double size);

}  // namespace beam
