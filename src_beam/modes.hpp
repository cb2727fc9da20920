// The reduced basis of the modal integrator: lowest modes plus static shapes.
//
// Modes are the lowest n of K φ = ω² M φ. Kept alone they would be too stiff at the tip, so the basis is augmented
// by the M-orthogonal residuals of static shapes (modal truncation augmentation: Dickens, Nakagawa & Wittbrodt,
// "A critique of mode acceleration and modal truncation augmentation methods for modal response analysis",
// Computers & Structures 62, 1997, 985–998): K⁻¹e of the tip force, K⁻¹F of the uniform load, and u = x, the shape of
// every start. A Rayleigh–Ritz step diagonalises all of them together; what is added behaves as three more modes of
// high frequency. So the static tip compliance and the initial state are those of the full mesh for any n ≥ 1, and
// everything stays a linear mechanical system with a mass and a continuous state.
//
// These three are always there: the basis follows from the mesh and n alone, not from what the beam is loaded with.
// The hat load has no shape of its own. With K⁻¹e in the basis the static u(L) is exact under any load (it is the
// work of that load on K⁻¹e), and outside the last elements a hat load acts as a tip force. Its shape would add a mode
// as fast as the mesh's fastest, and with it a tip mass of the order ρA h.
//
// The alternative, adding the missing compliance as a massless spring in series (static or residual-flexibility
// correction), would let u(L) jump whenever C does: the tip's velocity, its work and a gap kept closed would have no
// meaning, and the energy could not be conserved.
#pragma once

#include "timoshenko.hpp"

namespace beam {

/// Mass-normalised: φᵀ M φ = 1 kg, φᵀ K φ = ω². m of them, ω ascending (to rounding), φ_u(L) ≥ 0. Unknowns are the
/// modal displacements η [m √kg].
struct Modes final : Discretisation {
  Eigen::VectorXd omega;                            ///< [rad/s], m
  Eigen::VectorXd tip_rotations;                    ///< φ_θ(L) [1/(m √kg)], m
  std::array<Eigen::VectorXd, Loads::count> loads;  ///< modal force per unit of each, as ∫ φ_u dx [m/√kg], m
  Eigen::VectorXd start;                            ///< coordinates of u = x, θ = 0: φᵀ M q [m √kg], m
  Eigen::MatrixXd deflections, rotations;           ///< φ_u and φ_θ at the output points, 21 × m
  Eigen::MatrixXd shears, moments;                  ///< of the inertia of φ there, 21 × m, see inertia()
  double residual = 0.0;  ///< largest ‖φ − ω² K⁻¹M φ‖_K / ω of the computed modes, φ with unit M-norm

  Eigen::VectorXd linear_shape() const override { return start; }
  const Eigen::VectorXd& load(std::size_t shape) const override { return loads[shape]; }
  Eigen::VectorXd mass_solve(const Vector& f) const override { return f; }
  Eigen::VectorXd stiffness_times(const Vector& eta) const override { return omega.cwiseAbs2().cwiseProduct(eta); }
  Eigen::VectorXd flexibility_times(const Vector& f) const override { return f.cwiseQuotient(omega.cwiseAbs2()); }
  double mass_norm2(const Vector& eta) const override { return eta.squaredNorm(); }
  double stiffness_norm2(const Vector& eta) const override { return omega.cwiseProduct(eta).squaredNorm(); }
  double tip(const Vector& eta) const override { return loads[Loads::tip].dot(eta); }
  double tip_rotation(const Vector& eta) const override { return tip_rotations.dot(eta); }
  Shape deflection(const Vector& eta) const override { return deflections * eta; }
  Shape rotation(const Vector& eta) const override { return rotations * eta; }
  InternalForces inertia(const Vector& acceleration) const override {
    return {shears * acceleration, moments * acceleration};
  }
};

/// Lowest modes by implicitly restarted Lanczos on K⁻¹M, M-orthonormal columns.
/// @throws std::runtime_error if it does not converge
Eigen::MatrixXd lanczos_modes(const Timoshenko& mesh, Eigen::Index count);
inline constexpr const char* remedy = "; keep fewer n_modes, or use the integrator midpoint";

/// The lowest `n_modes`, 0 = all, and what completes them.
/// @throws std::runtime_error if the eigensolver does not converge
Modes compute_modes(const Timoshenko& mesh, Eigen::Index n_modes);

}  // namespace beam
