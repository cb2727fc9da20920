// Parameters and inputs. The caller has checked that each parameter is within its own limits, those of the table in
// fmus/spring/spring_fmu.cpp, and that inputs are finite.
#pragma once

#include "polynomial.hpp"

namespace spring {

enum class ContactLaw { external = 1, normal_compliance = 2, kelvin_voigt = 3 };

/// SI units.
struct Parameters {
  double mass = 1.0;              ///< m [kg]
  double damping = 0.0;           ///< α_s [N·s/m]
  double linear_stiffness = 1.0;  ///< k1 [N/m]
  double cubic_stiffness = 0.0;   ///< k2 [N/m³]
  double unloaded = 0.0;          ///< y₀ [m], where the spring force is 0
  double displacement = 0.0;      ///< y at the start [m]
  double velocity = 0.0;          ///< ẏ at the start [m/s]
  ContactLaw contact_law = ContactLaw::external;
  double compliance_stiffness = 1.0e4;  ///< λ_nc [N/m^p]
  double compliance_exponent = 3.0;     ///< p [–] ≥ 1
  double compliance_damping = 0.0;      ///< χ [s/m], of normal_compliance
  double contact_damping = 0.0;         ///< c [N·s/m], of kelvin_voigt
  bool stop_enabled = false;
  double stop_position = -1.0;  ///< φ [m]
  double restitution = 1.0;     ///< e in [0, 1]
  double relative_tolerance = 1e-12;
  double absolute_tolerance = 1e-14;

  bool compliant() const { return contact_law != ContactLaw::external; }
  /// |y − y₀| at the maximum of a softening spring's potential, √(k1/|k2|) [m]; infinity for any other.
  double hilltop() const;
};

/// Inputs over one step, quadratic in the time τ since its start.
struct Inputs {
  Polynomial contact_force{};      ///< C [N], positive presses the spring down
  Polynomial foundation_force{};   ///< N ≥ 0 [N], upward; used when the stop inside is not enabled
  Polynomial external_force{};     ///< f_s [N]
  Polynomial base_acceleration{};  ///< a of the foundation [m/s²]: y is relative to it, so that it acts as −m a
  Polynomial tip_displacement{};   ///< u_tip [m]; read by a law inside only

  bool operator==(const Inputs& other) const {
    return contact_force == other.contact_force && foundation_force == other.foundation_force &&
           external_force == other.external_force && base_acceleration == other.base_acceleration &&
           tip_displacement == other.tip_displacement;
  }
};

/// @throws std::invalid_argument naming the parameter that contradicts the others, its value and what is allowed
void check(const Parameters& parameters);

}  // namespace spring
