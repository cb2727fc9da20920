#include "parameters.hpp"

#include <charconv>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace spring {
namespace {

void require(bool condition, const char* name, double value, const char* allowed) {
  if (!condition)
    throw std::invalid_argument(std::string("spring: ") + name + " = " + number(value) + ": must be " + allowed);
}

void require_finite(const char* name, double value) { require(std::isfinite(value), name, value, "finite"); }

void require_finite(const char* name, const Quadratic& values) {
  for (double value : values) require_finite(name, value);
}

}  // namespace

std::string number(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value, std::chars_format::general, 12).ptr};
}

double hilltop(const Parameters& p) {
  return p.linear_stiffness > 0.0 && p.cubic_stiffness < 0.0 ? std::sqrt(p.linear_stiffness / -p.cubic_stiffness)
                                                             : std::numeric_limits<double>::infinity();
}

void check(const Parameters& p) {
  require(p.mass > 0.0 && std::isfinite(p.mass), "mass", p.mass, "> 0 and finite");
  require(p.damping >= 0.0 && std::isfinite(p.damping), "damping", p.damping, ">= 0 and finite");
  require_finite("linear_stiffness", p.linear_stiffness);
  require_finite("cubic_stiffness", p.cubic_stiffness);
  require_finite("displacement", p.displacement);
  require_finite("velocity", p.velocity);
  if (p.cubic_stiffness < 0.0 && p.linear_stiffness <= 0.0)
    throw std::invalid_argument("spring: linear_stiffness = " + number(p.linear_stiffness) +
                                ", cubic_stiffness = " + number(p.cubic_stiffness) +
                                ": a softening spring (cubic_stiffness < 0) needs linear_stiffness > 0, "
                                "else there is no potential well");
  if (std::abs(p.displacement) > hilltop(p))
    throw std::invalid_argument("spring: displacement = " + number(p.displacement) +
                                ": the start of a softening spring must be within the hilltop of its potential, "
                                "|y| <= sqrt(linear_stiffness/|cubic_stiffness|) = " +
                                number(hilltop(p)));
  if (p.contact_law != ContactLaw::external && p.contact_law != ContactLaw::normal_compliance)
    throw std::invalid_argument("spring: contact_law = " + std::to_string(static_cast<int>(p.contact_law)) +
                                ": must be 1 (external) or 2 (normal_compliance)");
  require(p.compliance_stiffness >= 0.0 && std::isfinite(p.compliance_stiffness), "compliance_stiffness",
          p.compliance_stiffness, ">= 0 and finite");
  require(p.compliance_exponent >= 1.0 && p.compliance_exponent <= 100.0, "compliance_exponent", p.compliance_exponent,
          "in [1, 100]");
  require(p.compliance_damping >= 0.0 && std::isfinite(p.compliance_damping), "compliance_damping",
          p.compliance_damping, ">= 0 and finite");
  require_finite("stop_position", p.stop_position);
  require(p.restitution >= 0.0 && p.restitution <= 1.0, "restitution", p.restitution, "in [0, 1]");
  require(p.relative_tolerance > 0.0 && p.relative_tolerance <= 1e-2, "relative_tolerance", p.relative_tolerance,
          "in (0, 1e-2]");
  require(p.absolute_tolerance > 0.0 && p.absolute_tolerance <= 1e-2, "absolute_tolerance", p.absolute_tolerance,
          "in (0, 1e-2]");
  if (p.stop_enabled && p.displacement < p.stop_position)
    throw std::invalid_argument("spring: displacement = " + number(p.displacement) +
                                ": must not start below stop_position = " + number(p.stop_position));
}

void check(const Inputs& inputs) {
  require_finite("contact_force", inputs.contact_force);
  require_finite("foundation_force", inputs.foundation_force);
  require_finite("external_force", inputs.external_force);
  require_finite("base_acceleration", inputs.base_acceleration);
  require_finite("tip_displacement", inputs.tip_displacement);
}

}  // namespace spring
