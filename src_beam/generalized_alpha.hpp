// Integrator `generalized_alpha` (Chung & Hulbert, "A time integration algorithm for structural dynamics with
// improved numerical dissipation: the generalized-α method", J. Appl. Mech. 60, 1993, 371–375), direct in the mesh's
// unknowns. ρ∞ = 1 is the midpoint rule of Ahn & Tate, eq. (62).
//
//   M a_m + α_b K v_f + K q_f = F(t + (1−α_f)h),   x_m = (1−α_m) x₁ + α_m x₀,  x_f = (1−α_f) x₁ + α_f x₀,
//   q₁ = q₀ + h v₀ + h² [(½−β) a₀ + β a₁],   v₁ = v₀ + h [(1−γ) a₀ + γ a₁],
//   α_m = (2ρ∞−1)/(ρ∞+1),  α_f = ρ∞/(ρ∞+1),  γ = ½ − α_m + α_f,  β = (1 − α_m + α_f)²/4.
//
// For ρ∞ = 1 the acceleration drops out, and the step is, with the mean velocity w = (q₁ − q₀)/h,
//   [M + (h²/4 + α_b h/2) K] w = M v₀ + (h/2)(F̄ − K q₀),   q₁ = q₀ + h w,   v₁ = 2w − v₀,
// F̄ the mean of F over the step (for ρ∞ < 1 F is taken at t + (1−α_f)h). Then E₁ − E₀ = F̄ᵀ(q₁ − q₀) − h α_b wᵀK w holds
// to rounding, whatever happened to F or v between the steps. One step of iterative refinement, with K applied element
// by element, makes that rounding relative to the strain energy instead of to ‖K‖‖w‖² (1e-13 instead of 1e-7 at EI =
// KAG = 3.6e10, n = 1000). Where S is well conditioned it keeps out a drift: the rounding of the factors is the same at
// every step (2e-14 instead of 4e-12 of the energy in 20,000 steps at EI = KAG = 100, n = 200, h = 1e-4).
//
// For ρ∞ < 1 the stored a₀ lacks what happened since the last step: a jump of C or f_b, an impulse that changed the
// damping force, or at the start everything. Left out, it would cost the order: an error h (½−α_f) Δa in v.
// Deviation: the missing force R enters as a₀ += (1−α_m) S⁻¹ R with the matrix S of the step instead of M⁻¹ R. That is
// the same to O(h²) for motions that the step resolves; for those it does not, M⁻¹ would overshoot by (ωh)².
//
// Dissipated energy: (q₁ − q₀)ᵀ α_b K v_f, the work of the damping force in the scheme; for ρ∞ = 1 it is the exact
// h α_b wᵀKw. What ρ∞ < 1 takes out of high frequencies is not part of it. The work of a load with the vector F is that
// of the same scheme, F̄ᵀ(q₁ − q₀), with F at t + (1−α_f)h instead for ρ∞ < 1. ∫u and ∫∫u are those of u linear in time
// between the steps, as the paper reads (62): the work of a polynomial C on that motion is F̄ Δu, what the midpoint rule
// sees.
#pragma once

#include <memory>

#include "timoshenko.hpp"

namespace beam {

std::unique_ptr<Beam> make_generalized_alpha_beam(const std::shared_ptr<const Timoshenko>& mesh,
                                                  const Parameters& parameters);

}  // namespace beam
