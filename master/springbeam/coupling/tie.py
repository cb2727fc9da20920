"""The tie: both ends move together, and the contact force is what keeps them together."""

from __future__ import annotations

from math import sqrt

from ..bodies import force
from ..bodies.protocol import Force, Motion
from . import energy, hermite
from .protocol import Conditions, ErrorEstimate, Scales, Step
from .solver import StepSolver

#: The conditions of each scheme, by degree.
SCHEMES: dict[str, dict[int, Conditions]] = {"energy": energy.CONDITIONS, "hermite": hermite.CONDITIONS}


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
        self._scheme = scheme
        self.energy_exact = scheme == "energy"
        self.sharpest = (energy if self.energy_exact else hermite).SHARPEST[degree]

    def force_without_mismatch(self, step: Step, reduced_mass: float) -> Force:
        """Return C without the image of the mismatch of the ends' velocities."""
        if not self.energy_exact or step.size == 0.0:
            return step.contact
        before, after = _gaps(step)
        image = energy.image(before, after, step.size, self.degree, reduced_mass)
        c0, c1, c2 = step.contact
        return (c0 - image[0], c1 - image[1], c2 - image[2])

    def local_errors(self, step: Step, scales: Scales) -> list[ErrorEstimate]:
        """Estimate from conditions of higher order than those imposed, where the step has them anyway."""
        size, degree = step.size, self.degree
        gaps = _gaps(step)
        if self._scheme == "hermite":
            of_length, order = hermite.gap_inside(gaps[1], size, degree) / scales.span, hermite.ORDER_INSIDE[degree]
            work = abs(force.work(step.contact, gaps[1], size))
            of_energy = work / scales.energy if scales.energy > 0.0 else 0.0
            return [(of_length, order), (of_energy, order + 1)]
        # Relative to the motion's energy, and to its length (all that a massless tip has).
        created, order = energy.created_mismatch(gaps[0], gaps[1], degree), energy.ORDER_CREATED[degree]
        of_energy = created * sqrt(0.5 * scales.reduced_mass / scales.energy) if scales.energy > 0.0 else 0.0
        return [(of_energy, order), (size * created / (6.0 * scales.span), order + 1)]


def _gaps(step: Step) -> list[Motion]:
    """Return the gap's motion at the start and at the end of ``step``."""
    return [Motion(*(x - y for x, y in zip(*ends, strict=True))) for ends in (step.start, step.end)]
