// The top seated on the foundation, y = φ, under loads that are quadratic in time. The force that holds it there,
//     N(τ) = −F(τ) + k1 (y − y₀) + k2 (y − y₀)³ + C(δ(τ), δ̇(τ)),   δ(τ) = φ − u_tip(τ),
// is known, so there is nothing to integrate numerically but the contact force, by quadrature. Its first fall below 0
// is isolated by the zeros of its derivatives, as those of a flight are (events.hpp).
#pragma once

#include "equation_of_motion.hpp"

namespace spring {

/// How long the top has stayed seated [s], whether N fell below 0 then, ∫N [N·s] and what the contact dissipated [J].
struct SeatedEnd {
  double size;
  bool released;
  double impulse, dissipated;
};

/// Seated at y [m] for `size` [s] or until N falls below 0. `depth`: y − u_tip at the start [m]; `compliant`: whether
/// the contact force acts inside.
SeatedEnd stay_seated(const EquationOfMotion& equation, double y, double depth, bool compliant, const Loads& loads,
                      double size);

}  // namespace spring
