// The spring's equation of motion while its top is free,
//     m ÿ = F(τ) − α_s ẏ − k1 x − k2 x³ − [touching] C(y − u_tip(τ), ẏ − u̇_tip(τ)),
//     x = y − y₀ the spring's elongation,   F = −C + N + f_s − m a,
// with its Jacobian and, for the start of a segment, its time derivatives.
#pragma once

#include <algorithm>
#include <array>

#include "compliance.hpp"
#include "parameters.hpp"
#include "taylor.hpp"

namespace spring {

/// External loads over a segment, quadratic in the time τ since its start.
struct Loads {
  Polynomial force;  ///< F [N]
  Polynomial tip;    ///< u_tip [m]

  static Loads from(const Parameters& parameters, const Inputs& inputs);
  Loads from_time(double t) const { return {shifted(force, t), shifted(tip, t)}; }
  Loads scaled(double size) const { return {spring::scaled(force, size), spring::scaled(tip, size)}; }
};

/// A motion from a segment's start on: Taylor coefficients in s = τ/H of the elongation x = y − y₀, of x², of the depth
/// y − u_tip and of the contact. Those of x are known up to `highest`; from s¹ on they are those of y.
struct Expansion {
  double size;    ///< H [s]
  Loads loads;    ///< over s
  bool touching;  ///< whether the contact force acts
  Series x{}, square{}, depth{};
  Compliance::Along contact;
  std::size_t highest = 1;

  /// From x [m], z [m/s] and y − u_tip, under loads over τ, over a segment of `size` [s].
  Expansion(double x, double z, double depth, const Loads& loads, double size, bool touching);
  /// To a segment of H × `factor` under the same loads over τ; nothing can be added then.
  void shorten(double factor, const Loads& unscaled);
};

/// f_s − m a [N]
Polynomial load_of(const Parameters& parameters, const Inputs& inputs);

/// The law inside.
Compliance contact_of(const Parameters& parameters);

class EquationOfMotion {
 public:
  explicit EquationOfMotion(const Parameters& parameters);

  /// ÿ under F and the contact force C of the law inside. [m/s²]
  double acceleration(double y, double z, double force, double contact) const;
  double acceleration_by_displacement(double y, double contact_slope) const;  ///< ∂ÿ/∂y
  /// ∂ÿ/∂ẏ
  double acceleration_by_velocity(double contact_slope) const { return -(damping_ + contact_slope) / mass_; }

  /// Adds one coefficient to the motion.
  void extend(Expansion& motion) const;
  /// What the motion below its highest coefficient leaves of the equation at s = 1, as H² |ÿ| [m]; 0 if that is
  /// rounding, NaN if it leaves the range of numbers.
  double residual(const Expansion& motion) const;

  /// Bounds of the rates with which the solution can change, for |x| ≤ `reach`: √(stiffness/m), damping/m [1/s].
  struct Rates {
    double oscillation, decay;
    double sum() const { return oscillation + decay; }
  };
  Rates rates(double reach, const Compliance::Slopes& contact) const;

  double elongation(double y) const { return y - unloaded_; }  ///< x [m]
  /// k1 x + k2 x³ [N]
  double spring_force(double y) const { return (k1_ + k2_ * elongation(y) * elongation(y)) * elongation(y); }
  /// Force that would hold the top at y, at rest, −F + k1 x + k2 x³ + C, and its first two derivatives [N, N/s, N/s²].
  Polynomial holding_force(double y, const Loads& loads, bool touching, double depth) const;

  double potential_energy(double y) const;
  const Compliance& compliance() const { return compliance_; }
  double mass() const { return mass_; }
  double damping() const { return damping_; }

 private:
  double mass_, damping_, k1_, k2_, unloaded_;
  Compliance compliance_;
};

}  // namespace spring
