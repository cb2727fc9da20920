// Integrator `modal`: each mode of the reduced basis (modes.hpp) stepped exactly (modal_oscillator.hpp) under a
// tip force that is quadratic in time and a constant f_b:
//   η̈_k + α_b ω_k² η̇_k + ω_k² η_k = φ_k(L) C(τ) + f_b ∫φ_k dx + tip_load ∫φ_k ψ_n dx.
// Per step size the coefficients are computed once; a step is then a few multiply-adds per mode.
#pragma once

#include <memory>

#include "integrator.hpp"

namespace beam {

/// @throws std::runtime_error if the modes cannot be computed
std::unique_ptr<BeamIntegrator> make_modal_beam(const Parameters& parameters);

}  // namespace beam
