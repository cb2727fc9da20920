"""The tie: both ends move together, and the contact force is what keeps them together.

Its scheme says by which conditions on the gap g over a step. With g = 0 at the step's start and g(H) = 0, the work of
C(τ) = Σ c_j τʲ on both bodies together is, by parts,

    ∫ C ġ dτ = [C g]₀ᴴ − Σ j c_j ∫ τ^{j−1} g dτ = 0    if    ∫ τ^{j−1} g dτ = 0,  j = 1 … d,

whatever the coefficients, the step and the bodies: scheme ``energy`` creates no energy. The moments are taken against
Legendre polynomials of s = 2τ/H − 1, which spans the same space and keeps the system well conditioned: ∫ g dτ = I₁ and
∫ s g dτ = I₁ − 2 I₂/H, with I₁ = ∫ g dτ and I₂ = ∫∫ g dτ dτ = ∫ (H − τ) g dτ.

Scheme ``hermite`` lets displacements and velocities agree at every macro point: g(H) = 0, ġ(H) = 0 and, for degree 2,
∫ g dτ = 0. Because the velocities agree wherever a step ends, a step that ends on an event hands the right velocities
to it, and the order holds through events. The price is stability: the work ∫ C ġ dτ does not vanish, and the scheme
amplifies modes beyond a bound on ωH (``docs/coupling.md`` has it measured).
"""

from __future__ import annotations

from math import sqrt

from ..bodies import force
from ..bodies.protocol import Force, Motion
from .protocol import ErrorEstimate, Scales, Step
from .solver import SCHEMES, StepSolver

#: Where C is most accurate, as a share of the step: the last zero of P′_{d+2}, what a force of the next degree leaves;
#: the last Gauss point.
SHARPEST = {
    "energy": {0: 0.5, 1: 0.5 + 0.5 / sqrt(5.0), 2: 0.5 + 0.5 * sqrt(3.0 / 7.0)},
    "hermite": {1: 0.5 + 0.5 / sqrt(3.0), 2: 0.5 + 0.5 * sqrt(0.6)},
}
#: Order in the step's size of the velocity mismatch that one step of ``energy`` creates, and of `gap_inside`.
_ORDER_CREATED, _ORDER_INSIDE = {0: 2, 1: 3, 2: 4}, {1: 4, 2: 5}


class Tie(StepSolver):
    """Coupling by the conditions of a scheme; parameters as of `StepSolver`.

    Parameters
    ----------
    scheme
        ``energy`` or ``hermite``.
    degree
        Of the contact force; one that the scheme has.
    """

    def __init__(self, scheme: str, degree: int, tolerance: float, expected: float = 0.0) -> None:
        super().__init__(SCHEMES[scheme][degree], degree, tolerance, expected)
        self.energy_exact, self.sharpest = scheme == "energy", SHARPEST[scheme][degree]

    def force_without_mismatch(self, step: Step, reduced_mass: float) -> Force:
        """Return C without the part that turns a mismatch w of the ends' velocities round.

        ``energy`` adds −2(−1)^d μ w/H P′_{d+1}(2τ/H − 1) [N], which is what free masses would do.
        """
        if not self.energy_exact or step.size == 0.0:
            return step.contact
        (before, after), size = _gaps(step), step.size
        if self.degree == 1:
            slope = 6.0 * reduced_mass * (before.velocity + after.velocity) / (size * size)
            added = (-0.5 * size * slope, slope, 0.0)
        else:
            k = -reduced_mass * (before.velocity - after.velocity) / size
            added = (k, 0.0, 0.0) if self.degree == 0 else (6.0 * k, -30.0 * k / size, 60.0 * k / (size * size))
        c0, c1, c2 = step.contact
        return (c0 - added[0], c1 - added[1], c2 - added[2])

    def local_errors(self, step: Step, scales: Scales) -> list[ErrorEstimate]:
        """Estimate from conditions of higher order than those imposed, where the step has them anyway."""
        size, degree, (before, after) = step.size, self.degree, _gaps(step)
        if not self.energy_exact:
            of_length, order = gap_inside(after, size, degree) / scales.span, _ORDER_INSIDE[degree]
            work = abs(force.work(step.contact, after, size))
            of_energy = work / scales.energy if scales.energy > 0.0 else 0.0
            return [(of_length, order), (of_energy, order + 1)]
        # The mismatch of velocities that the step creates: where the ends answer a force as free masses do, the one
        # that it starts with turns into w⁺ = −(−1)^d w. It is relative to the motion's energy, and to its length (all
        # that a massless tip has).
        created = abs(after.velocity - before.velocity if degree == 1 else after.velocity + before.velocity)
        order = _ORDER_CREATED[degree]
        of_energy = created * sqrt(0.5 * scales.reduced_mass / scales.energy) if scales.energy > 0.0 else 0.0
        return [(of_energy, order), (size * created / (6.0 * scales.span), order + 1)]


def gap_inside(end: Motion, size: float, degree: int) -> float:
    """Return the first moment of the gap that ``hermite`` leaves: ∫ g dτ/H, or ∫ s g dτ/H with s = 2τ/H − 1 [m]."""
    moment = end.integral if degree == 1 else end.integral - 2.0 * end.integral_2 / size
    return abs(moment) / size


def _gaps(step: Step) -> list[Motion]:
    """Return the gap's motion at the start and at the end of ``step``."""
    return [Motion(*(x - y for x, y in zip(*ends, strict=True))) for ends in (step.start, step.end)]
