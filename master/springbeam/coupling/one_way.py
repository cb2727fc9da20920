"""One-way coupling by a soft law: the contact force acts on one end only, the other one drives.

For a driving end that the force would hardly move. It makes one step per macro step, with nothing at its end; the
driven body then finds the force of the projected law (`soft`) from how the driving end has moved.

What is neglected is bounded. A linear body at rest, stiffness k, answers a step of the force by at most twice its
static deflection (undamped, each mode by φ²/ω² (1 − cos ωt); damped, by less), and any force is a sum of steps, so

    |Δu| ≤ 2 V/k,     V = ∫ |dC| the total variation of the contact force so far,

for the whole mesh at once, since Σ φ_k²/ω_k² = 1/k. The bound is compared with the largest penetration so far. The
work of C on the driving end, which it does not feel, is booked, so that the ledger still closes.
"""

from __future__ import annotations

from math import inf

from ..bodies import force
from ..bodies.elements import Prescribed
from ..bodies.protocol import NO_FORCE, Body, Ends, Force
from ..contact.laws import SoftLaw
from .projection import penetration
from .protocol import Booking, Step
from .soft import SoftSolver


class OneWay(SoftSolver):
    """Coupling that one end does not feel; `springbeam.run.ledger` bounds what is left out.

    Parameters
    ----------
    law, degree, tolerance
        As of `SoftSolver`.
    upper_drives
        Whether the upper body drives the lower one, or the lower the upper.
    """

    def __init__(self, law: SoftLaw, degree: int, tolerance: float, *, upper_drives: bool) -> None:
        super().__init__(law, degree, tolerance)
        self._upper_drives = upper_drives

    def solve(self, upper: Body, lower: Body, time: float, size: float, start: Ends, guess: Force) -> Step:
        driver, driven = (upper, lower) if self._upper_drives else (lower, upper)
        driver.rewind()
        end = Prescribed(driver.advance_alone(time, size))
        if driven.mass == inf:
            held = driven.advance(time, size, guess)
            ends = (end.motion(), held) if self._upper_drives else (held, end.motion())
            known = Step(time, size, guess, NO_FORCE, start, ends)
            before, x = penetration(known, self.degree)
            return known._replace(contact=force.derivatives(self._projection.force(before, size, x), size))
        upper, lower = (end, driven) if self._upper_drives else (driven, end)
        return super().solve(upper, lower, time, size, start, guess)

    def accept(self, step: Step) -> None:
        super().accept(step)
        driver = 0 if self._upper_drives else 1
        work = force.work_on(step.contact, step.start[driver], step.end[driver], step.size)
        self.state.unfelt += work if self._upper_drives else -work

    def booking(self, ends: Ends) -> Booking:
        return super().booking(ends)._replace(unfelt=self.state.unfelt)
