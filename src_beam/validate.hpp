// Parameter checks: a message always names the parameter, its value and what is allowed.
#pragma once

#include <cmath>

#include "beam.hpp"

namespace beam {

/// Highest polynomial degree of an element.
inline constexpr int max_element_degree = 12;

/// Most elements times their degree that a beam may have; bounds memory, not the mathematics.
inline constexpr int max_elements = 1000000;

/// Most unknowns of a dense eigenproblem: of the mesh (two per element and degree) where all modes are wanted, of the
/// reduced basis where some are.
inline constexpr int max_dense_unknowns = 1000;

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
