// Timoshenko elements of degree p on a uniform mesh, clamped at x = 0; p = 1 are the P1/P1 elements of Ahn & Tate,
// eqs. (57)–(59).
//
// In an element, ξ ∈ [−1, 1], both fields have a hierarchical basis (Szabó & Babuška, Finite Element Analysis, 1991):
// the two hat functions, and for k = 2 … p the bubbles, integrated Legendre polynomials that vanish at its ends,
//   N_k(ξ) = ∫_{−1}^ξ P_{k−1} = (P_k − P_{k−2})/(2k−1).
// Unknowns by element, bubbles before its right node, so that every matrix is banded (half-bandwidth 2p + 1):
//   q = (… | θ̃_{e,2},u_{e,2}, …, θ̃_{e,p},u_{e,p}, θ̃_e,u_e | …) [m],   θ̃ = r θ,   r = √(I/A) the radius of gyration [m].
// With θ̃ both fields carry the same mass:
//   qᵀMq = ∫ ρA (θ̃² + u²) dx,   qᵀKq = ∫ EA θ̃_x² + s (u_x − θ̃/r)² dx,   s = KAG [N].
//
// Both are sums of squares of Legendre coefficients, which integrates them exactly:
//   qᵀKq = Σ_e Σ_{j<p} h/(2j+1) (b_j κ_j² + s γ_j²),
//   κ_0 = (θ̃_e − θ̃_{e−1})/h,   κ_j = 2θ̃_{e,j+1}/h,
//   γ_0 = (u_e − u_{e−1})/h − (θ̃_{e−1} + θ̃_e)/2r + θ̃_{e,2}/3r,
//   γ_1 = 2u_{e,2}/h − (θ̃_e − θ̃_{e−1})/2r + θ̃_{e,3}/5r,
//   γ_j = 2u_{e,j+1}/h − θ̃_{e,j}/(2j−1)r + θ̃_{e,j+2}/(2j+3)r,   bubbles beyond p being 0.
// The shear strain has one more coefficient, γ_p = −h κ_{p−1}/((2p−1) 2r): a stiffer bending term,
//   b_{p−1} = EA + s (h/2r)²/(4p²−1) with full integration,   EA without it,   b_j = EA for j < p − 1.
// Leaving it out is reduced integration: p Gauss points, the zeros of P_p, for the shear. With p = 1 the stiffer term
// is all of the bending, which is how the element locks.
//
// qᵀMq = Σ_e Σ_{j≤p} ρA h/(2j+1) (t_j² + u_j²), t_j and u_j the fields' coefficients, is the consistent mass: it makes
// short waves too fast. Gauss–Lobatto quadrature on the p + 1 nodes, which lumps the mass, has 2/p where ∫P_p² =
// 2/(2p+1) and agrees otherwise; it makes them too slow, by 1/p of that. The averaged mass cancels the two, 1/(p+1) of
// the consistent and p/(p+1) of the lumped one (Ainsworth & Wajid, "Optimally blended spectral-finite element scheme
// for wave propagation and nonstandard reduced integration", SIAM J. Numer. Anal. 48, 2010, 346–371), so that
// frequencies of a bar err with order 2p + 2 instead of 2p. It is ½ of each for p = 1; for every p the top coefficient
// counts
//     1/(p+1) · 1/(2p+1) + p/(p+1) · 1/p = 2/(2p+1),   twice.
//
// So an element has as many strains as unknowns: the discrete cantilever is statically determinate, like the real one,
// and K⁻¹ is two sweeps: forces from the tip, which bend each element as a cantilever of its own, and the displacements
// of their left nodes from the clamp. It is accurate to rounding where
// factorising K would lose cond(K) ~ KAG/EI·n⁴.
#pragma once

#include "band.hpp"
#include "beam.hpp"

namespace beam {

class Timoshenko final : public Discretisation {
 public:
  /// @pre the parameters passed the check of make_beam()
  /// @throws std::invalid_argument if what follows from the parameters overflows or vanishes
  explicit Timoshenko(const Parameters& parameters);

  Eigen::Index size() const { return 2 * p_ * n_; }  ///< number of unknowns
  Eigen::Index elements() const { return n_; }       ///< n

  Eigen::VectorXd linear_shape() const override;
  const Eigen::VectorXd& load(std::size_t shape) const override;
  Eigen::VectorXd mass_solve(const Vector& f) const override;
  Eigen::VectorXd stiffness_times(const Vector& q) const override;
  Eigen::VectorXd flexibility_times(const Vector& f) const override;  ///< in O(n p²), see above
  double mass_norm2(const Vector& q) const override;
  double stiffness_norm2(const Vector& q) const override { return weighted_strains(q).squaredNorm(); }
  double tip(const Vector& q) const override { return q[size() - 1]; }
  double tip_rotation(const Vector& q) const override { return q[size() - 2] / r_; }
  Shape deflection(const Vector& q) const override { return sample(q, 1); }
  Shape rotation(const Vector& q) const override { return sample(q, 0) / r_; }
  InternalForces inertia(const Vector& acceleration) const override;

  Eigen::VectorXd mass_times(const Vector& q) const;
  /// y += m M v + k K q, element by element.
  void add_products(double m, const Vector& v, double k, const Vector& q, Eigen::VectorXd& y) const;
  /// m M + k K, factorised.
  BandFactors factors(double m, double k) const;
  /// m M + k K of an element behind a node.
  Eigen::MatrixXd element(double m, double k) const;
  /// √(h/(2j+1)) (√b_j κ_j, √s γ_j) of all elements: its squared norm is qᵀKq.
  Eigen::VectorXd weighted_strains(const Vector& q) const;

 private:
  template <int P>
  struct Element;
  template <typename Use>
  auto with_element(const Use& use) const;
  Eigen::VectorXd basis(double part) const;  ///< the functions of an element there, 0 … 1
  Shape sample(const Vector& q, int field) const;

  Parameters parameters_;
  Eigen::Index n_, p_;
  double h_;                      // element length [m]
  double r_;                      // √(I/A) [m]
  Eigen::MatrixXd T_;             // Legendre coefficients of a field by its unknowns (left node, bubbles, right node)
  Eigen::MatrixXd S_;             // h times those of its derivative
  Eigen::MatrixXd mass_;          // of a field in an element
  Eigen::MatrixXd weights_;       // (b_j, s)/h(2j+1) of the strains h κ_j, h γ_j
  Eigen::MatrixXd from_strains_;  // unknowns of an element that is clamped at its left node, by its strains
  BandFactors mass_factors_;
  mutable std::array<Eigen::VectorXd, Loads::count> loads_;  // computed at first use
};

}  // namespace beam
