#include "parameters.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

namespace spring {

double Parameters::hilltop() const {
  return linear_stiffness > 0.0 && cubic_stiffness < 0.0 ? std::sqrt(linear_stiffness / -cubic_stiffness)
                                                         : std::numeric_limits<double>::infinity();
}

void check(const Parameters& p) {
  if (p.cubic_stiffness < 0.0 && p.linear_stiffness <= 0.0)
    throw std::invalid_argument("spring: linear_stiffness = " + number(p.linear_stiffness) +
                                ", cubic_stiffness = " + number(p.cubic_stiffness) +
                                ": a softening spring (cubic_stiffness < 0) needs linear_stiffness > 0, "
                                "else there is no potential well");
  if (std::abs(p.displacement - p.unloaded) > p.hilltop())
    throw std::invalid_argument("spring: displacement = " + number(p.displacement) +
                                ": the start of a softening spring must be within the hilltop of its potential, "
                                "|y - unloaded| <= sqrt(linear_stiffness/|cubic_stiffness|) = " +
                                number(p.hilltop()));
  if (p.stop_enabled && p.displacement < p.stop_position)
    throw std::invalid_argument("spring: displacement = " + number(p.displacement) +
                                ": must not start below stop_position = " + number(p.stop_position));
}

}  // namespace spring
