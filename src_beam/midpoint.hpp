// Integrator `midpoint`: the midpoint rule of Ahn & Tate, eq. (62), direct in the mesh's unknowns. With the mean
// velocity w = (q₁ − q₀)/h and F̄ the mean of F over the step,
//   [M + (h²/4 + α_b h/2) K] w = M v₀ + (h/2)(F̄ − K q₀),   q₁ = q₀ + h w,   v₁ = 2w − v₀.
// Then E₁ − E₀ = F̄ᵀ(q₁ − q₀) − h α_b wᵀK w holds to rounding, whatever happened to F or v between the steps: the work
// of the loads and the dissipated energy are these. Iterative refinement, with K applied element by element, makes that
// rounding relative to the strain energy instead of to ‖K‖‖w‖² (1e-13 instead of 1e-7 at EI = KAG = 3.6e10, n = 1000).
// Where the matrix is well conditioned it keeps out a drift: the rounding of the factors is the same at every step
// (2e-14 instead of 4e-12 of the energy in 20,000 steps at EI = KAG = 100, n = 200, h = 1e-4). Where a beam is so stiff
// in shear that it does not converge, the step is refused.
//
// ∫u and ∫∫u are those of u linear in time between the steps, as the paper reads (62): the work of a polynomial C on
// that motion is C̄ Δu, as in the midpoint rule.
#pragma once

#include <memory>

#include "timoshenko.hpp"

namespace beam {

std::unique_ptr<Beam> make_midpoint_beam(std::unique_ptr<const Timoshenko> mesh, const Parameters& parameters);

}  // namespace beam
