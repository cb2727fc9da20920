// Normal compliance with a moving obstacle, δ = y − u_tip (Ahn & Tate, section 2; docs/model.md), damped as Hunt and
// Crossley have it:
//     C = λ δ₊^p (1 + χ δ̇)₊,   stored Φ = λ δ₊^{p+1}/(p+1),   dissipated (C − λ δ₊^p) δ̇ ≥ 0.
#pragma once

#include <algorithm>
#include <array>

#include "polynomial.hpp"

namespace spring {

class Compliance {
 public:
  /// λ [N/m^p], p, χ [s/m]
  Compliance(double stiffness, double exponent, double damping = 0.0)
      : lambda_(stiffness), p_(exponent), chi_(damping) {}

  double elastic(double depth) const;  ///< λ δ₊^p [N]
  double energy(double depth) const;   ///< Φ [J]
  bool damped() const { return chi_ > 0.0; }
  /// (1 + χ δ̇)₊
  double damping_factor(double rate) const { return std::max(0.0, 1.0 + chi_ * rate); }
  double force(double depth, double rate) const { return elastic(depth) * damping_factor(rate); }  ///< C [N]

  /// The law while touching, continued smoothly to δ < 0: what an integrator sees of an internal step that goes past
  /// the opening (the event is then located and what lies beyond is dropped).
  struct Effect {
    double force, dissipation;  ///< [N], [W]
  };
  Effect continued(double depth, double rate) const;
  struct Slopes {
    double force_by_depth, force_by_rate;              ///< [N/m], [N·s/m]
    double dissipation_by_depth, dissipation_by_rate;  ///< [N/s], [N]
  };
  Slopes slopes(double depth, double rate) const;

  /// δ ≥ 0 and its first four time derivatives.
  using Depth = std::array<double, 5>;
  /// C and its first three time derivatives. Where the power law has no derivative (δ = 0, non-integer p) they may be
  /// infinite or NaN.
  std::array<double, 4> rates(const Depth& depth) const;
  /// The dissipated power [W] and its first two time derivatives; as rates().
  Quadratic dissipation(const Depth& depth) const;
  /// p is an integer: the force is analytic in δ ≥ 0, also at δ = 0.
  bool analytic() const;

 private:
  double continued_elastic(double depth) const;
  double continued_slope(double depth) const;
  std::array<double, 4> elastic_rates(const Depth& depth) const;

  double lambda_, p_, chi_;
};

}  // namespace spring
