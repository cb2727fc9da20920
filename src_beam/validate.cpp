#include "validate.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <stdexcept>
#include <string>

namespace beam {
namespace {

[[noreturn]] void reject(const char* name, double value, const std::string& allowed) {
  throw std::invalid_argument(std::string("beam: ") + name + " = " + number(value) + " is not allowed; it must be " +
                              allowed);
}

void require_positive(const char* name, double value) {
  if (!(std::isfinite(value) && value > 0.0)) reject(name, value, "finite and > 0");
}

}  // namespace

std::string number(double value) {
  std::array<char, 32> text;
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

void validate(const Parameters& p) {
  // Each factor may be harmless and the product still leave the range of a double.
  require_positive("density * area [kg/m]", p.density * p.area);
  require_positive("second_moment_of_area / area [m2]", p.second_moment_of_area / p.area);
  require_positive("young_modulus / density [m2/s2]", p.young_modulus / p.density);
  require_positive("shear_modulus * shear_coefficient / density [m2/s2]",
                   p.shear_modulus * p.shear_coefficient / p.density);

  if (p.n_elements > max_elements / p.element_degree) {
    reject("n_elements", p.n_elements,
           "0 (no mesh) or between 1 and " + std::to_string(max_elements / p.element_degree) + " (" +
               std::to_string(max_elements) + " over element_degree)");
  }
  if (p.n_elements == 0) {
    const std::string without = "without a mesh (n_elements = 0)";
    if (p.n_modes == 0)
      reject("n_modes", p.n_modes, "between 1 and " + std::to_string(max_exact_modes) + " " + without);
    if (p.integrator != Integrator::modal)
      reject("integrator", static_cast<int>(p.integrator), std::string("1 (") + integrator_names[0] + ") " + without);
    if (p.mass_matrix != MassMatrix::consistent || p.reduced_integration)
      reject(p.reduced_integration ? "reduced_integration" : "mass_matrix",
             p.reduced_integration ? 1 : static_cast<int>(p.mass_matrix), "left at its default " + without);
    return;
  }
  if (p.integrator != Integrator::modal) return;
  const int unknowns = 2 * p.n_elements * p.element_degree;
  const std::string mesh = std::to_string(p.n_elements) + " elements of degree " + std::to_string(p.element_degree);
  if (p.n_modes > unknowns) {
    reject("n_modes", p.n_modes, "between 0 (all) and " + std::to_string(unknowns) + ", the unknowns of " + mesh);
  }
  const int most = std::min(unknowns / 2, max_dense_unknowns);
  if (unknowns > max_dense_unknowns && (p.n_modes == 0 || p.n_modes > most)) {
    reject("n_modes", p.n_modes,
           "between 1 and " + std::to_string(most) + " with " + mesh + " (all modes only up to " +
               std::to_string(max_dense_unknowns) +
               " unknowns); keep fewer n_modes, or use the integrator generalized_alpha");
  }
}

}  // namespace beam
