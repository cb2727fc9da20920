// What parameters must be together; a message names the parameter, its value and what is allowed.
#pragma once

#include <string>

#include "beam.hpp"

namespace beam {

/// The shortest decimal that reads back as the same double, for messages.
std::string number(double value);

/// @pre each parameter is within its own limits, those of the table in fmus/beam/beam_fmu.cpp
/// @throws std::invalid_argument for the first parameter that is not allowed beside the others
void validate(const Parameters& parameters);

}  // namespace beam
