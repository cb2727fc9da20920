"""How wrong a step is, told from the step itself, for `springbeam.run.macro_steps.AdaptiveSteps`.

Nothing is computed twice for it: conditions of higher order than those the scheme has imposed are looked at where the
step has them anyway (``docs/coupling.md``, "Adaptive macro steps").
"""

from __future__ import annotations

from ..bodies.protocol import Motion
from ..bodies.stateful import Memory, Stateful
from ..contact.phases import Phase
from ..coupling.protocol import Scales, Step
from ..results.paths import Path
from ..scene import Scene
from ..scene.statics import tip_compliance
from .macro_steps import AdaptiveSteps
from .outcome import RunStopped
from .stepping import Pair, State

#: Displacements are rounded to so many ulp.
_ULPS, _EPS = 16.0, 2.0**-52
#: Order of the cubic.
_CUBIC = 4


class Reach(Memory):
    """How far the motion has come."""

    lowest: list[float]  #: positions of the ends [m]
    highest: list[float]
    fastest: float = 0.0  #: [m/s]
    energy: float = 0.0  #: the largest [J]


class LocalError(Stateful):
    """Estimates relative to the tolerances of a scene, and the scales that these are relative to."""

    state: Reach

    def __init__(self, scene: Scene, pair: Pair, steps: AdaptiveSteps) -> None:
        self._pair, self._steps = pair, steps
        self._relative = scene.coupling.relative_tolerance or 0.0
        self._absolute = scene.coupling.absolute_tolerance or 0.0
        #: By how much a unit of the contact force bends the beam [m/N].
        self._compliance = 0.0 if scene.beam is None else tip_compliance(scene.beam)
        at_start = [end.displacement for end in pair.ends()]
        self.state = Reach(at_start, at_start)

    def note(self, energy: float) -> None:
        """Note that all energies together have been as large as this [J]."""
        if energy > self.state.energy:
            self.state.energy = energy

    def holds(self, state: State, step: Step, refused: str, *, to_kink: bool = False) -> bool:
        """Is the step as accurate as the scene asks? If not, the next one to try has the size that is then set.

        ``refused`` says why longer ones were, or nothing; ``to_kink``, whether it was to end on a kink of a load.
        Raises RunStopped if there is no shorter one.
        """
        error, order = self._estimate(state, step)
        if self._steps.judge(step.size, error, order, to_kink=to_kink):
            return True
        if self._steps.too_short:
            short = f"the error stays above the tolerance, down to a macro step of {step.size:.3g} s, where it is"
            raise RunStopped(refused or f"{short} {error:.3g} of it", step.time)
        return False

    def _estimate(self, state: State, step: Step) -> tuple[float, int]:
        """The step's error, 1 is the tolerance, and the order in which it falls with the size of the step."""
        pair, size = self._pair, step.size
        lowest, highest, speed = self._extremes(step)
        ranges = [high - low for low, high in zip(lowest, highest, strict=True)]
        cubic = [_beside_cubic(a, b, size) for a, b in zip(step.start, step.end, strict=True)]
        rounding = self._rounding(state.contact[0])
        span = min((r for r, least in zip(ranges, rounding, strict=True) if r > least), default=0.0)
        if span == 0.0:
            return 0.0, _CUBIC
        tolerance = self._relative + self._absolute / span
        coupling = pair.coupling(state.phase)
        scales = Scales(span, speed, self.state.energy, pair.reduced_mass(Phase()))
        curve = self._curve(cubic, ranges, rounding)
        told = coupling.local_errors(step, scales)
        return max(curve, *((error / tolerance, order) for error, order in told)) if told else curve

    def accept(self, step: Step) -> None:
        """The motion has come so far."""
        self.state = Reach(*self._extremes(step), self.state.energy)

    def _extremes(self, step: Step) -> tuple[list[float], list[float], float]:
        """Return the lowest and the highest positions of the ends [m] and their largest speed [m/s], with ``step``."""
        passed = [[a.displacement, b.displacement] for a, b in zip(step.start, step.end, strict=True)]
        lowest = [min(low, *places) for low, places in zip(self.state.lowest, passed, strict=True)]
        highest = [max(high, *places) for high, places in zip(self.state.highest, passed, strict=True)]
        return lowest, highest, max(self.state.fastest, *(abs(end.velocity) for end in (*step.start, *step.end)))

    def _curve(self, errors: list[float], ranges: list[float], rounding: list[float]) -> tuple[float, int]:
        allowed = (self._absolute + self._relative * r for r in ranges)
        told = zip(errors, ranges, allowed, rounding, strict=True)
        ratios = [e / (a + least) for e, r, a, least in told if r > 0.0]
        return max(ratios, default=0.0), _CUBIC

    def _rounding(self, contact: float) -> list[float]:
        """Up to where displacements of the ends are rounding [m]: no step is too long for that, though from rest the
        motion so far is shorter still.

        The tip is the sum of what the loads make of it and the force ``contact`` [N], which may be larger than it.
        """
        places = zip(self.state.lowest, self.state.highest, strict=True)
        return [_ULPS * _EPS * max(abs(low), abs(high), self._compliance * abs(contact)) for low, high in places]


def _beside_cubic(start: Motion, end: Motion, size: float) -> float:
    """How far, as means over the step, the motion is from the cubic through its ends [m]."""
    means = end.integral / size, end.integral_2 / size**2
    return Path.through(start[:2], end[:2], size, means).moments_beside_cubic
