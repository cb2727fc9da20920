// Integrator `modal`: each mode of the reduced basis (modes.hpp) stepped exactly (modal_oscillator.hpp) under a
// tip force and loads that are quadratic in time:
//   η̈_k + α_b ω_k² η̇_k + ω_k² η_k = φ_k(L) C(τ) + Σ f_i(τ) b_ki,   b_ki the modal force per unit of load i.
// With G_k and r of modal_oscillator.hpp and f(τ) = f₀ + f₁τ + f₂τ²/2 the loads' modal force, their work over a step is
//   ∫ f η̇ dτ = f₀ Δη + f₁ (h Δη − Z₁) + f₂ (h²/2 Δη − h Z₁ + Z₂),   Z₁ = ∫(η − η₀) dτ,   Z₂ = ∫∫(η − η₀) dτ dτ,
//   Z₁ = v₀ G₁ + r G₂ + F₁ G₃ + F₂ G₄,   F all of the modal force, the tip force's included;   Z₂ has every index one
//   higher.
// Per step size the coefficients are computed once; a step is then a few multiply-adds per mode.
#pragma once

#include <memory>

#include "timoshenko.hpp"

namespace beam {

/// @throws std::runtime_error if the modes cannot be computed
std::unique_ptr<Beam> make_modal_beam(const Timoshenko& mesh, const Parameters& parameters);

}  // namespace beam
