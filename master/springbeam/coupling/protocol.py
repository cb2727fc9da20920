"""What a run asks of a coupling, and the step that it is given."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

from ..bodies.protocol import NO_FORCE, Body, Ends, Force, Motion, StepRefused

#: Conditions on the gap over a step of size H as a linear map of an end's motion, each in metres.
Conditions = Callable[[Motion, float], tuple[float, ...]]


class Step(NamedTuple):
    """An attempted step and what the bodies' ends did on it."""

    time: float  #: where it begins [s]
    size: float  #: [s]
    contact: Force  #: C on the step
    foundation: Force  #: N on the step
    start: Ends  #: at the mark
    end: Ends


class LawEnergies(NamedTuple):
    """Energies of the contact law, beside those of the bodies [J]."""

    stored: float = 0.0
    dissipated: float = 0.0  #: since the start


NO_ENERGIES = LawEnergies()


@dataclass
class Counts:
    """What a coupling remembers: at least what it has counted."""

    iterations: int = 0  #: corrections of the force since the start
    dissipated: float = 0.0  #: by a soft law since the start [J]


class Coupling:
    """Finds the contact force of a step and advances both bodies under it."""

    #: Degree of the contact force over a step.
    degree: int = 0
    #: Whether the force does no net work but that of the law's energies, at any step.
    energy_exact: bool = True
    state: Counts

    def solve(self, upper: Body, lower: Body, time: float, size: float, start: Ends, guess: Force) -> Step:
        """Advance both bodies from their marks, where their ends are at ``start``, and return the step.

        Parameters
        ----------
        upper, lower
            The bodies.
        time, size
            Of the step [s].
        start
            The ends at the marks.
        guess
            The contact force as far as known.

        Raises
        ------
        StepRefused
            If a body does; as NotConverged if the force was not found.
        """
        raise NotImplementedError

    def accept(self, step: Step) -> None:
        """Count from now on what ``step``, which is made, has dissipated."""

    def energies(self, ends: Ends) -> LawEnergies:
        """Return the energies of the contact law at the ``ends``."""
        return NO_ENERGIES


class Uncoupled(Coupling):
    """Nothing between the bodies: each advances alone."""

    def solve(self, upper: Body, lower: Body, time: float, size: float, start: Ends, guess: Force) -> Step:
        upper.rewind()
        tip = upper.advance_alone(time, size)
        lower.rewind()
        return Step(time, size, NO_FORCE, NO_FORCE, start, (tip, lower.advance_alone(time, size)))


class NotConverged(StepRefused):
    """The contact force of a step was not found; ``residual`` [m] is that of the conditions on the gap."""

    def __init__(self, residual: float, iterations: int) -> None:
        super().__init__(f"contact force not found after {iterations} iterations, gap condition {residual:.3g} m")
        self.residual = residual
