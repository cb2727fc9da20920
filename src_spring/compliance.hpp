// Normal compliance with a moving obstacle: C = λ δ₊^p, δ = y − u_tip (Ahn & Tate, section 2; design.md section 3).
#pragma once

#include <array>

namespace spring {

class Compliance {
 public:
  Compliance(double stiffness, double exponent) : lambda_(stiffness), p_(exponent) {}

  double exponent() const { return p_; }
  double force(double depth) const;   ///< λ δ₊^p [N]
  double slope(double depth) const;   ///< ∂C/∂δ [N/m]
  double energy(double depth) const;  ///< λ δ₊^{p+1}/(p+1) [J]

  /// The force while touching and its slope, continued smoothly to δ < 0: what an integrator sees of an internal step
  /// that goes past the opening (the event is then located and what lies beyond is dropped).
  double continued_force(double depth) const;
  double continued_slope(double depth) const;

  /// C and its first three time derivatives for δ, δ̇, δ̈, δ⃛ with δ ≥ 0. Where the power law has no derivative (δ = 0,
  /// non-integer p) they may be infinite or NaN.
  std::array<double, 4> rates(const std::array<double, 4>& depth) const;
  /// p is an integer: the force is analytic in δ ≥ 0, also at δ = 0.
  bool analytic() const;

 private:
  double lambda_, p_;
};

}  // namespace spring
