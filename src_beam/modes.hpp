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

#include <Eigen/Core>

#include "timoshenko.hpp"

namespace beam {

/// Mass-normalised: φᵀ M φ = 1 kg, φᵀ K φ = ω². m of them, ω ascending (to rounding).
struct Modes {
  Eigen::VectorXd omega;                            ///< [rad/s], m
  Eigen::VectorXd tip;                              ///< φ_u(L) ≥ 0 [1/√kg], m
  Eigen::VectorXd tip_rotation;                     ///< φ_θ(L) [1/(m √kg)], m
  std::array<Eigen::VectorXd, Loads::count> loads;  ///< modal force per unit of each, as ∫ φ_u dx [m/√kg], m
  Eigen::VectorXd linear_shape;                     ///< coordinates of u = x, θ = 0: φᵀ M q [m √kg], m
  Eigen::MatrixXd deflection;                       ///< φ_u at the output points, 21 × m
  Eigen::MatrixXd rotation;                         ///< φ_θ at the output points, 21 × m
  Eigen::MatrixXd shear, moment;                    ///< of the inertia of φ there, 21 × m, see Timoshenko::inertia()
  LoadResultants resultants;                        ///< of the loads there
  double residual = 0.0;  ///< largest ‖φ − ω² K⁻¹M φ‖_K / ω of the computed modes, φ with unit M-norm
};

/// Lowest modes by implicitly restarted Lanczos on K⁻¹M, M-orthonormal columns.
/// @throws std::runtime_error if it does not converge
Eigen::MatrixXd lanczos_modes(const Timoshenko& mesh, Eigen::Index count);
inline constexpr const char* remedy = "; keep fewer n_modes, or use the integrator generalized_alpha";

/// @throws std::runtime_error if the eigensolver does not converge
Modes compute_modes(const Timoshenko& mesh, const Parameters& parameters);

}  // namespace beam
