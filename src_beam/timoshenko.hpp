// P1/P1 Timoshenko elements on a uniform mesh, clamped at x = 0 (Ahn & Tate, eqs. (57)–(59)).
//
// Unknowns, interleaved so that every matrix is banded (half-bandwidth 3):
//   q = (θ̃₁,u₁, …, θ̃ₙ,uₙ) [m],   θ̃ = r θ,   r = √(I/A) the radius of gyration [m].
// With θ̃ both fields carry the same mass, and all is divided by ρA:
//   M q̈ + α_b K q̇ + K q = F/ρA,
//   qᵀMq = ∫ θ̃² + u² dx,   qᵀKq = Σ_e h (b κ_e² + s γ_e²),
//   κ_e = (θ̃_i − θ̃_{i−1})/h,   γ_e = (u_i − u_{i−1})/h − (θ̃_{i−1} + θ̃_i)/2r   in element e = [x_{i−1}, x_i],
//   s = KG/ρ,   b = (EI + KAG h²/12)/ρI with full integration,   b = E/ρ with one point for the shear [m²/s²].
// Full integration of a linear shear strain is its mean square plus KAG h²/12 κ²: the same element with a stiffer
// bending term, which is how it locks.
//
// The cantilever is statically determinate, so K⁻¹ is two sweeps: forces from the tip, displacements from the clamp.
// Nothing is subtracted there, and K⁻¹F is accurate to rounding where factorising K would lose cond(K) ~ KAG/EI·n⁴.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "beam.hpp"

namespace beam {

class Timoshenko {
 public:
  /// @pre validate(parameters) passed
  explicit Timoshenko(const Parameters& parameters);

  Eigen::Index size() const { return 2 * n_; }                    ///< number of unknowns
  Eigen::Index elements() const { return n_; }                    ///< n
  double mass_per_length() const { return mu_; }                  ///< ρA [kg/m]
  double radius_of_gyration() const { return r_; }                ///< r = √(I/A) [m]
  Eigen::Index tip_index() const { return 2 * n_ - 1; }           ///< of u(L) in q
  Eigen::Index tip_rotation_index() const { return 2 * n_ - 2; }  ///< of θ̃(L) in q

  /// y = M x; x and y of size() doubles, not overlapping.
  void mass_times(const double* x, double* y) const;
  /// y = K x, element by element; x and y not overlapping.
  void stiffness_times(const double* x, double* y) const;
  /// y = K⁻¹ x in O(n), see above; x and y not overlapping.
  void flexibility_times(const double* x, double* y) const;
  /// √h (√b κ_e, √s γ_e) of all elements, interleaved: its squared norm is xᵀKx.
  void weighted_strains(const double* x, double* strains) const;
  /// The upper bidiagonal C of M = CᵀC, the same for θ̃ and u: its diagonal and superdiagonal by node.
  void mass_cholesky(Eigen::VectorXd& diagonal, Eigen::VectorXd& super) const;

  Eigen::VectorXd mass_times(const Eigen::VectorXd& x) const;
  Eigen::VectorXd stiffness_times(const Eigen::VectorXd& x) const;
  Eigen::VectorXd flexibility_times(const Eigen::VectorXd& x) const;
  Eigen::VectorXd mass_solve(const Eigen::VectorXd& x) const;  ///< M⁻¹ x

  double mass_norm2(const Eigen::VectorXd& x) const;       ///< xᵀMx
  double stiffness_norm2(const Eigen::VectorXd& x) const;  ///< xᵀKx, as a sum of squares

  Eigen::SparseMatrix<double> mass() const;       ///< M, lower triangle
  Eigen::SparseMatrix<double> stiffness() const;  ///< K, lower triangle

  Eigen::VectorXd unit_tip_force() const;  ///< e: 1 in the row of u(L)
  Eigen::VectorXd uniform_load() const;    ///< ∫ψ_i dx in the rows of u: F of f_b = 1 N/m
  Eigen::VectorXd hat_load() const;        ///< ∫ψ_i ψ_n dx in the rows of u: F of f_b = ψ_n
  Eigen::VectorXd linear_shape() const;    ///< u = x, θ = 0

  /// Fields at x = 0, L/20, …, L: `values[j]` = u or θ̃, by linear interpolation.
  void sample_deflection(const double* q, double* values) const { sample(q, 1, values); }
  void sample_scaled_rotation(const double* q, double* values) const { sample(q, 0, values); }

 private:
  void sample(const double* q, int field, double* values) const;

  Eigen::Index n_;
  double h_;   // element length [m]
  double mu_;  // ρA [kg/m]
  double r_;   // √(I/A) [m]
  double b_;   // bending stiffness per ρI [m²/s²]
  double s_;   // shear stiffness per ρA [m²/s²]
};

}  // namespace beam
