// The Duffing spring with its foundation, integrated by SUNDIALS IDA as an implicit system F(t, Y, Ẏ) = 0.
//     m ÿ + α_s ẏ + k1 y + k2 y³ = −C + N + f_s − m a   (Ahn & Tate, eq. (6)),      up is positive.
// a is the acceleration of the foundation, relative to which y is counted.
// C comes from outside (contact_law external) or from the normal compliance inside, C = λ_nc δ₊^p (1 + χ δ̇)₊,
// δ = y − u_tip;
// N comes from outside or, with the stop enabled, from Signorini's condition (8) with restitution:
//     0 ≤ N ⊥ y − φ ≥ 0,   z⁺ = −e z⁻ at an impact. Impacts that die out end seated, y = φ, until N would be < 0.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "polynomial.hpp"

namespace spring {

enum class ContactLaw { external = 1, normal_compliance = 2 };

/// SI units.
struct Parameters {
  double mass = 1.0;              ///< m [kg]
  double damping = 0.0;           ///< α_s [N·s/m]
  double linear_stiffness = 1.0;  ///< k1 [N/m]
  double cubic_stiffness = 0.0;   ///< k2 [N/m³]
  double displacement = 0.0;      ///< y at the start [m]
  double velocity = 0.0;          ///< ẏ at the start [m/s]
  ContactLaw contact_law = ContactLaw::external;
  double compliance_stiffness = 1.0e4;  ///< λ_nc [N/m^p]
  double compliance_exponent = 3.0;     ///< p [–] ≥ 1
  double compliance_damping = 0.0;      ///< χ [s/m]
  bool stop_enabled = false;
  double stop_position = -1.0;  ///< φ [m]
  double restitution = 1.0;     ///< e in [0, 1]
  double relative_tolerance = 1e-12;
  double absolute_tolerance = 1e-14;
};

/// Held or polynomial over one step; τ from its start.
struct Inputs {
  Quadratic contact_force{};      ///< C [N], positive presses the spring down
  Quadratic foundation_force{};   ///< N ≥ 0 [N], upward; used when the stop inside is not enabled
  Quadratic external_force{};     ///< f_s [N]
  Quadratic base_acceleration{};  ///< a of the foundation [m/s²]: y is relative to it, so that it acts as −m a
  Quadratic tip_displacement{};   ///< u_tip [m]; read by normal_compliance only
};

/// The step could not be completed: the state is as before the step, `reached` tells how far it came.
class StepFailure : public std::runtime_error {
 public:
  StepFailure(const std::string& what, double reached) : std::runtime_error(what), reached(reached) {}
  double reached;  ///< [s] after the step's start
};
/// A softening spring (k1 > 0 > k2) beyond the hilltop |y| = √(k1/|k2|) of its potential.
class Escape : public StepFailure {
 public:
  using StepFailure::StepFailure;
};

/// One spring. Every step starts IDA afresh, so a step repeated from the same saved state is bit-identical.
class Spring {
 public:
  /// @throws std::invalid_argument naming the parameter, its value and what is allowed
  explicit Spring(const Parameters& parameters);
  ~Spring();
  Spring(Spring&&) noexcept;
  Spring& operator=(Spring&&) noexcept;

  /// Advance by `size` [s] > 0. The work is bounded: a step that spans too much of the motion is refused.
  /// @throws StepFailure, Escape (state unchanged)
  void step(double size, const Inputs& inputs);

  /// Take `inputs` as acting at the present instant, for acceleration(), reaction() and contact_energy() before the
  /// first step or after an input has jumped. The motion does not depend on it.
  void observe(const Inputs& inputs);

  /// Instantaneous upward impulse J [N·s]: z += J/m.
  void apply_impulse(double impulse);

  double displacement() const;             ///< y [m]
  double velocity() const;                 ///< z [m/s]
  double acceleration() const;             ///< ż [m/s²] under the inputs at the end of the last step
  double displacement_integral() const;    ///< ∫ y dτ over the last step [m·s]
  double displacement_integral_2() const;  ///< ∫∫ y dτ dτ over the last step [m·s²]
  double reaction() const;                 ///< C of the law inside, at the end of the last step [N]; 0 for external
  Quadratic tip() const;                   ///< u_tip [m] and its rate there, as observed or extrapolated; no curvature
  double stop_force() const;               ///< mean of N over the last step, law inside [N]
  double stop_impulse() const;             ///< sum of stop impulses over the last step [N·s]
  double kinetic_energy() const;           ///< ½ m z² [J]
  double potential_energy() const;         ///< ½ k1 y² + ¼ k2 y⁴ [J]
  double contact_energy() const;           ///< λ_nc (y − u_tip)₊^{p+1}/(p+1) of the law inside [J]
  double dissipated_energy() const;        ///< by α_s and χ since the start, an integrated unknown [J]
  double load_work() const;                ///< of f_s and −m a since the start [J]
  double impact_loss() const;              ///< energy lost in stop impacts since the start [J]
  bool seated() const;                     ///< held on the foundation by the law inside
  long ida_steps() const;                  ///< internal IDA steps since the start

  /// The whole dynamic state as a flat vector of fixed length.
  void save(std::vector<double>& state) const;
  /// @throws std::invalid_argument if the length does not fit or a number cannot be; the state is then unchanged
  void restore(const std::vector<double>& state);

 private:
  bool finite() const;

  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace spring
