// The top at rest on the foundation, y = φ, under loads that are quadratic in time. The force that holds it there,
//     N(τ) = −F(τ) + k1 (y − y₀) + k2 (y − y₀)³ + C(δ(τ), δ̇(τ)),   δ(τ) = φ − u_tip(τ),
// is known, so there is nothing to integrate numerically but the contact force, by quadrature. Its first fall below 0
// is isolated by the zeros of its derivatives, as those of a flight are (events.hpp).
#pragma once

#include "motion.hpp"

namespace spring {

/// What a rest came to: how long it lasted [s], whether N fell below 0 at its end, ∫N [N·s] and what the contact
/// dissipated [J].
struct Rest {
  double size;
  bool released;
  double impulse, dissipated;
};

/// Rest at y [m] for `size` [s] or until N falls below 0. `depth`: y − u_tip at the start [m]; `compliant`: whether the
/// contact force acts inside.
Rest rest(const Motion& motion, double y, double depth, bool compliant, const Loads& loads, double size);

}  // namespace spring
