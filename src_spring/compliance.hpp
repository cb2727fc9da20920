// Normal compliance with a moving obstacle, δ = y − u_tip (Ahn & Tate, section 2; docs/model.md), damped as Hunt and
// Crossley have it:
//     C = λ δ₊^p (1 + χ δ̇)₊,   stored Φ = λ δ₊^{p+1}/(p+1),   dissipated (C − λ δ₊^p) δ̇ ≥ 0,
// or by a damper c beside it: C = (λ δ^p + c δ̇)₊ for δ > 0, which begins with a jump.
#pragma once

#include <algorithm>
#include <array>

#include "taylor.hpp"

namespace spring {

class Compliance {
 public:
  static constexpr std::size_t highest_power = 4;  ///< p up to which extend() multiplies powers

  /// λ [N/m^p], p, χ [s/m], c [N·s/m]; one of the last two is 0
  Compliance(double stiffness, double exponent, double damping = 0.0, double viscosity = 0.0)
      : lambda_(stiffness), p_(exponent), chi_(damping), c_(viscosity) {}

  double stiffness() const { return lambda_; }
  double exponent() const { return p_; }
  double damping() const { return chi_; }
  double viscosity() const { return c_; }

  double elastic(double depth) const;  ///< λ δ₊^p [N]
  double energy(double depth) const;   ///< Φ [J]
  bool damped() const { return chi_ > 0.0 || c_ > 0.0; }
  /// Whether damping neither begins nor ceases to leave no force while depth and rate change by less than this.
  bool keeps_side(double depth, double rate, double change, double change_of_rate) const;
  /// (1 + χ δ̇)₊
  double damping_factor(double rate) const { return std::max(0.0, 1.0 + chi_ * rate); }
  double force(double depth, double rate) const { return depth > 0.0 ? continued(depth, rate).force : 0.0; }  ///< C [N]

  /// The law while touching, continued smoothly to δ < 0: for internal steps that go past
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

  /// Along a depth δ(s), s = τ/H: Taylor coefficients of λ δ^p, and of what damping adds to it.
  struct Along {
    Series elastic{}, damping{};                    ///< [N]
    std::array<Series, highest_power - 1> power{};  ///< δ², δ³, …
  };
  /// Sets coefficient `n` of each from δ's up to n + 1 and from the lower ones; `size` H [s].
  /// @pre δ is well above 0 over the segment, or polynomial(), or n < 2, n < 3 if p is a whole number
  void extend(Along& along, std::size_t n, const Series& depth, double size) const;
  /// p is a whole number, at which the force is analytic in δ ≥ 0, also at δ = 0, and so small that extend() multiplies
  /// powers instead of dividing by δ.
  bool polynomial() const;

 private:
  bool even() const;  ///< p is an even number
  double continued_elastic(double depth) const;
  double continued_slope(double depth) const;
  double elastic_coefficient(Along& along, std::size_t n, const Series& depth) const;

  double lambda_, p_, chi_, c_;
};

}  // namespace spring
