// Checks of what comes from outside; messages name the quantity, its value and what is allowed.
#pragma once

#include <string>

#include "spring.hpp"

namespace spring {

std::string number(double value);

/// @throws std::invalid_argument
void check(const Parameters& parameters);
/// @throws std::invalid_argument
void check(const Inputs& inputs);

/// |y| where a softening spring's potential has its hilltop, √(k1/|k2|); infinity for any other.
double hilltop(const Parameters& parameters);

}  // namespace spring
