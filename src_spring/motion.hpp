// The spring's equation of motion while its top is free,
//     m ÿ = F(τ) − α_s ẏ − k1 y − k2 y³ − [touching] C(y − u_tip(τ), ẏ − u̇_tip(τ)),      F = −C + N + f_s − m a,
// with its Jacobian and, for the start of a segment, its time derivatives.
#pragma once

#include <algorithm>
#include <array>

#include "compliance.hpp"
#include "polynomial.hpp"
#include "spring.hpp"
#include "taylor.hpp"

namespace spring {

/// What acts from outside over a segment, τ from its start.
struct Loads {
  Quadratic force;    ///< F [N]
  Quadratic tip;      ///< u_tip [m]
  bool held = false;  ///< something is in contact with the top, and may hold it

  static Loads from(const Parameters& parameters, const Inputs& inputs);
  Loads from_time(double t) const { return {shifted(force, t), shifted(tip, t), held}; }
};

/// f_s − m a [N]
Quadratic load_of(const Parameters& parameters, const Inputs& inputs);

class Motion {
 public:
  explicit Motion(const Parameters& parameters);

  /// ÿ under F and the contact force C of the law inside. [m/s²]
  double acceleration(double y, double z, double force, double contact) const;
  double acceleration_by_displacement(double y, double contact_slope) const;  ///< ∂ÿ/∂y
  double acceleration_by_velocity(double contact_slope) const {
    return -(damping_ + contact_slope) / mass_;
  }  ///< ∂ÿ/∂ẏ

  /// y and its first five derivatives at a segment's start; `depth` = y − u_tip ≥ 0 matters when touching.
  /// Where the power law has no derivative they may be infinite or NaN.
  std::array<double, 6> derivatives(double y, double z, const Loads& loads, bool touching, double depth) const;

  /// Remainder of the equation of motion along a Taylor polynomial R of the motion, without the contact force:
  ///     r(τ) = F − α_s Ṙ − k1 R − k2 R³ − m R̈ = Σ rₖ τᵏ.
  /// The terms below τ^{order−1} vanish by construction (with the contact's own Taylor terms, if it touches).
  std::array<double, 13> remainder(const Taylor& R, const Loads& loads) const;
  /// ÿ − R̈ for y = R + q, ẏ = Ṙ + w, given r(τ) and what the contact force has in excess of its Taylor terms:
  /// the difference itself, free of cancellation.
  double excess_acceleration(double R, double q, double w, double remainder, double contact) const {
    return (remainder - damping_ * w - (k1_ + k2_ * (3.0 * R * (R + q) + q * q)) * q - contact) / mass_;
  }

  /// Σ|forces|/m: what rounding in acceleration() is relative to.
  double acceleration_scale(double y, double z, double force, double contact) const;
  /// Bound of the rates with which the solution can change, √(stiffness/m) + damping/m [1/s], for |y| ≤ `reach`.
  double rate(double reach, const Compliance::Slopes& contact) const;

  /// Force that would hold the top at y, at rest, with its first two derivatives: −F + k1 y + k2 y³ + C. [N, N/s, N/s²]
  Quadratic holding_force(double y, const Loads& loads, bool touching, double depth) const;

  /// What F and the spring, where it pushes that way, add to a motion of the top at y in direction `sense`. [N]
  double push_outwards(double y, double sense, double force) const {
    return sense * force + std::max(0.0, -sense * (k1_ + k2_ * y * y) * y);
  }
  double potential_energy(double y) const;
  const Compliance& compliance() const { return compliance_; }
  double mass() const { return mass_; }
  double damping() const { return damping_; }

 private:
  double mass_, damping_, k1_, k2_;
  Compliance compliance_;
};

}  // namespace spring
