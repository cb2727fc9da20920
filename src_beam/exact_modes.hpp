// The modes of the continuous beam, without a mesh and without an eigenproblem.
//
// With x in units of L and a = ρω²L²/E, b = ρω²L²/KG, c = ρAω²L⁴/EI, every motion at the frequency ω is made of the
// four waves e^{±√σ x},
//     σ₁,₂ = −(a + b)/2 ± √((a − b)²/4 + c),     p_j = σ_j + b,   p₁ > 0 > p₂ = −c/p₁.
// C_j = cosh √σ_j and S_j = sinh √σ_j/√σ_j are real for either sign of σ_j. With r = c/p₁² the clamped–free beam has
// the frequency equation
//     F(ω) = 2 + (r + 1/r) C₁C₂ − (a + b) S₁S₂ = 0,
// both spectra in one. The number of frequencies below ω (Wittrick & Williams, "A general algorithm for computing
// natural frequencies of elastic structures", Quart. J. Mech. Appl. Math. 24, 1971, 263–284) is that of the beam which
// is pinned at x = 0 and guided (θ = 0) at x = L, whose modes are sines (m − ½)πx, corrected by the signs of two
// stiffnesses: of the clamp's, which holds θ(0), and of θ(L), which is let go. With X = S₁C₂ + r S₂C₁ this is
//     N(ω) = #{m ≥ 1: (m − ½)π < √−σ₂} + #{m ≥ 1: (m − ½)π < √−σ₁}  −  [X C₁C₂ < 0]  +  [F X < 0].
// So the k-th frequency lies between the (k−1)-th and the (k+1)-th of the sines, which are known, and none is missed.
#pragma once

#include "modes.hpp"

namespace beam {

/// Number of natural frequencies of the beam below `omega` [rad/s].
long exact_mode_count(const Parameters& parameters, double omega);

/// The n_modes lowest modes, and what the others would add to the tip's static deflection: their compliance
/// L³/3EI + L/KAG − Σ φ_k(L)²/ω_k² is spread over those kept, with the weights κ_k = (ω_k/ω_n)⁴,
///     tip_k = φ_k(L) √(1 + A κ_k),   Σ tip_k²/ω_k² = L³/3EI + L/KAG,
/// and each load and the start u = x get a multiple of κ_k tip_k with which the static u(L), or the start's, is exact
/// too. The weights fall fast enough for the tip to follow slow forces as if all modes were there, to the third order
/// in 1/n, and no mode is added whose frequency is out of line with the others: that would ring after an impact.
/// @pre the parameters passed the check of make_beam()
/// @throws std::invalid_argument if the beam starts with u = s x and so few modes do not hold the energy of that
/// @throws std::runtime_error if the parameters leave the range of floating-point numbers
Modes exact_modes(const Parameters& parameters);

}  // namespace beam
