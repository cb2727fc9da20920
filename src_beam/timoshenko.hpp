// Timoshenko elements of degree p on a uniform mesh, clamped at x = 0; p = 1 are the P1/P1 elements of Ahn & Tate,
// eqs. (57)–(59).
//
// In an element, ξ ∈ [−1, 1], both fields have a hierarchical basis (Szabó & Babuška, Finite Element Analysis, 1991):
// the two hat functions, and for k = 2 … p the bubbles, integrated Legendre polynomials that vanish at its ends,
//   N_k(ξ) = ∫_{−1}^ξ P_{k−1} = (P_k − P_{k−2})/(2k−1).
// Unknowns by element, bubbles before its right node, so that every matrix is banded (half-bandwidth 2p + 1):
//   q = (… | θ̃_{e,2},u_{e,2}, …, θ̃_{e,p},u_{e,p}, θ̃_e,u_e | …) [m],   θ̃ = r θ,   r = √(I/A) the radius of gyration [m].
// With θ̃ both fields carry the same mass, and all is divided by ρA:
//   M q̈ + α_b K q̇ + K q = F/ρA,
//   qᵀMq = ∫ θ̃² + u² dx,   qᵀKq = ∫ E/ρ θ̃_x² + s (u_x − θ̃/r)² dx,   s = KG/ρ [m²/s²].
//
// Both are sums of squares of Legendre coefficients, which integrates them exactly:
//   qᵀKq = Σ_e Σ_{j<p} h/(2j+1) (b_j κ_j² + s γ_j²),
//   κ_0 = (θ̃_e − θ̃_{e−1})/h,   κ_j = 2θ̃_{e,j+1}/h,
//   γ_0 = (u_e − u_{e−1})/h − (θ̃_{e−1} + θ̃_e)/2r + θ̃_{e,2}/3r,
//   γ_1 = 2u_{e,2}/h − (θ̃_e − θ̃_{e−1})/2r + θ̃_{e,3}/5r,
//   γ_j = 2u_{e,j+1}/h − θ̃_{e,j}/(2j−1)r + θ̃_{e,j+2}/(2j+3)r,   bubbles beyond p being 0.
// The shear strain has one more coefficient, γ_p = −h κ_{p−1}/((2p−1) 2r): a stiffer bending term,
//   b_{p−1} = E/ρ + s (h/2r)²/(4p²−1) with full integration,   E/ρ without it,   b_j = E/ρ for j < p − 1.
// Leaving it out is reduced integration: p Gauss points, the zeros of P_p, for the shear. With p = 1 the stiffer term
// is all of the bending, which is how the element locks.
//
// qᵀMq = Σ_e Σ_{j≤p} h/(2j+1) (t_j² + u_j²), t_j and u_j the fields' coefficients, is the consistent mass: it makes
// short waves too fast. Gauss–Lobatto quadrature on the p + 1 nodes, which lumps the mass, has 2/p where ∫P_p² =
// 2/(2p+1) and agrees otherwise; it makes them too slow, by 1/p of that. The averaged mass cancels the two, 1/(p+1) of
// the consistent and p/(p+1) of the lumped one (Ainsworth & Wajid, "Optimally blended spectral-finite element scheme
// for wave propagation and nonstandard reduced integration", SIAM J. Numer. Anal. 48, 2010, 346–371), so that
// frequencies of a bar err with order 2p + 2 instead of 2p. It is ½ of each for p = 1; for every p the top coefficient
// counts
//     1/(p+1) · 1/(2p+1) + p/(p+1) · 1/p = 2/(2p+1),   twice.
//
// So an element has as many strains as unknowns: the discrete cantilever is statically determinate, like the real one,
// and K⁻¹ is two sweeps: forces from the tip, displacements from the clamp. It is accurate to rounding where
// factorising K would lose cond(K) ~ KAG/EI·n⁴.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include <type_traits>

#include "beam.hpp"

namespace beam {

class Timoshenko {
 public:
  /// M = CᵀC, C = matrixU(); banded as it is ordered.
  using MassFactor = Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::NaturalOrdering<int>>;

  /// @pre the parameters passed the check of make_beam()
  /// @throws std::invalid_argument if what follows from the parameters overflows or vanishes
  explicit Timoshenko(const Parameters& parameters);

  Eigen::Index size() const { return 2 * p_ * n_; }               ///< number of unknowns
  Eigen::Index elements() const { return n_; }                    ///< n
  Eigen::Index band_width() const { return 2 * p_ + 1; }          ///< of M and K, on one side of the diagonal
  double mass_per_length() const { return mu_; }                  ///< ρA [kg/m]
  double radius_of_gyration() const { return r_; }                ///< r = √(I/A) [m]
  Eigen::Index tip_index() const { return size() - 1; }           ///< of u(L) in q
  Eigen::Index tip_rotation_index() const { return size() - 2; }  ///< of θ̃(L) in q

  // Element by element; x and y of size() doubles, not overlapping.
  void add_mass_times(double a, const double* x, double* y) const;       ///< y += a M x
  void add_stiffness_times(double c, const double* x, double* y) const;  ///< y += c K x
  /// y = K⁻¹ x in O(n p), see above; x and y not overlapping.
  void flexibility_times(const double* x, double* y) const;
  /// √(h/(2j+1)) (√b_j κ_j, √s γ_j) of all elements, interleaved: its squared norm is xᵀKx.
  void weighted_strains(const double* x, double* strains) const;

  Eigen::VectorXd mass_times(const Eigen::VectorXd& x) const {
    Eigen::VectorXd y = Eigen::VectorXd::Zero(size());
    add_mass_times(1.0, x.data(), y.data());
    return y;
  }
  Eigen::VectorXd stiffness_times(const Eigen::VectorXd& x) const {
    Eigen::VectorXd y = Eigen::VectorXd::Zero(size());
    add_stiffness_times(1.0, x.data(), y.data());
    return y;
  }
  Eigen::VectorXd flexibility_times(const Eigen::VectorXd& x) const {
    Eigen::VectorXd y(size());
    flexibility_times(x.data(), y.data());
    return y;
  }
  Eigen::VectorXd mass_solve(const Eigen::VectorXd& x) const;  ///< M⁻¹ x

  double mass_norm2(const Eigen::VectorXd& x) const;       ///< xᵀMx, as a sum of squares
  double stiffness_norm2(const Eigen::VectorXd& x) const;  ///< xᵀKx, as a sum of squares

  Eigen::SparseMatrix<double> mass() const;       ///< M, lower triangle
  Eigen::SparseMatrix<double> stiffness() const;  ///< K, lower triangle, with the pattern of M

  Eigen::VectorXd unit_tip_force() const;  ///< e: 1 in the row of u(L)
  /// F of a load of 1 N/m, 1 N or 1 m/s² (Loads::Shape), exact at any degree: ∫ψ_i f_b dx or ψ_i(x) in the rows of u.
  Eigen::VectorXd load(std::size_t shape) const;
  Eigen::VectorXd linear_shape() const;  ///< u = x, θ = 0

  /// Shear force [N] and bending moment [N·m] at x = 0, L/20, …, L that hold what lies between x and the tip, the exact
  /// integrals Q = ∫ f ds, M = ∫ (s − x) f + g ds over x … L: of the inertia of an acceleration, f = ρA ü and g = ρI θ̈,
  InternalForces inertia(const double* acceleration) const;
  /// and of a load of 1 N/m, 1 N or 1 m/s² (Loads::Shape). A point force at x itself counts.
  InternalForces load_resultants(std::size_t shape) const;

  /// Fields at x = 0, L/20, …, L: `values[j]` = u or θ̃.
  void sample_deflection(const double* q, double* values) const { sample(q, 1, values); }
  void sample_scaled_rotation(const double* q, double* values) const { sample(q, 0, values); }

 private:
  struct Strains;
  using Legendre = std::array<double, max_element_degree + 1>;  ///< by degree
  /// Calls use(p). Known to the compiler, the degree of linear elements makes products three times as fast.
  using Linear = std::integral_constant<Eigen::Index, 1>;
  template <typename Use>
  auto with_degree(const Use& use) const {
    return p_ == 1 ? use(Linear()) : use(p_);
  }
  template <typename Degree>
  Strains strains(Degree p, const double* x, Eigen::Index first) const;
  template <typename Degree>
  void stress(Degree p, double c, Strains& s) const;  ///< strains become c times their stresses
  template <typename Degree>
  void add_stresses(Degree p, const Strains& s, double* y, Eigen::Index first) const;
  template <typename Degree>
  static Legendre coefficients(Degree p, const double* x, Eigen::Index first);  ///< of one field in an element
  template <typename Degree>
  static void add_moments(Degree p, const Legendre& moment, double* y, Eigen::Index first);
  template <typename Degree>
  double mass_weight(Degree p, Eigen::Index j) const {
    return (j < p ? h_ : h_ * top_) / static_cast<double>(2 * j + 1);
  }
  Legendre legendre(double xi) const;  ///< P_0, …, P_p at ξ
  double sum(const Legendre& c, const Legendre& P) const;
  double bending_stiffness(Eigen::Index p, Eigen::Index j) const { return j + 1 < p ? b_ : b_top_; }
  Eigen::SparseMatrix<double> assemble(const Eigen::MatrixXd& element) const;
  void sample(const double* q, int field, double* values) const;
  double position(std::size_t shape) const {  ///< x/L of a point force or the tip load
    return shape == Loads::tip ? 1.0 : point_force_position_[shape - Loads::point];
  }

  Eigen::Index n_, p_;
  double h_;      // element length [m]
  double top_;    // how often the top coefficient counts in the mass: 1, or 2 if it is averaged
  double mu_;     // ρA [kg/m]
  double r_;      // √(I/A) [m]
  double b_;      // bending stiffness per ρI, b_j [m²/s²]
  double b_top_;  // b_{p−1}
  double s_;      // shear stiffness per ρA [m²/s²]
  double length_;
  std::array<double, 4> point_force_position_;
};

/// Timoshenko::load_resultants() of all loads.
class LoadResultants {
 public:
  LoadResultants() = default;
  explicit LoadResultants(const Timoshenko& mesh) {
    for (std::size_t i = 0; i < Loads::count; ++i) unit_[i] = mesh.load_resultants(i);
  }
  /// Of loads and a tip force.
  InternalForces of(Loads::Values loads, double tip_force) const;

 private:
  std::array<InternalForces, Loads::count> unit_;
};

/// @throws std::runtime_error if the factor is not to be used
void require_factor(const Timoshenko::MassFactor& factor);

}  // namespace beam
