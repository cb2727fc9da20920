"""What ordinary co-simulation masters do with a soft law: exchange values once per macro step.

The force is taken from the ends as they were exchanged; nothing is repeated, so nothing balances its work on both
bodies, and a contact too stiff for the macro step gains energy. Kept to be measured against.

* ``jacobi``: both bodies advance under the force of the step's start;
* ``gauss_seidel``: the upper body advances first, the lower one under the force that the new tip position gives.

Degree 0 holds the force over the step, degree 1 continues its elastic part linearly: by Ċ = F′(p) ṗ at the start, and
for the second body of ``gauss_seidel`` towards the force at the step's end with y continued by z.
"""

from __future__ import annotations

from ..bodies.protocol import NO_FORCE, Body, Ends, Force
from ..scene.laws import SoftLaw
from .projection import SoftCoupling
from .protocol import Step


class Exchange(SoftCoupling):
    """Coupling by one exchange per step; what the law dissipates is that of the path of the ends.

    Parameters
    ----------
    law
        The contact law.
    sequential
        ``gauss_seidel`` if true, else ``jacobi``.
    degree
        0 or 1: the force over a step, constant or linear.
    """

    energy_exact = False

    def __init__(self, law: SoftLaw, sequential: bool, degree: int) -> None:
        super().__init__(law, degree)
        self._sequential = sequential

    def solve(self, upper: Body, lower: Body, time: float, size: float, start: Ends, guess: Force) -> Step:
        """Return the step with the force on the upper body; ``guess`` plays no part. Raises StepRefused."""
        tip, low = start
        p = low.displacement - tip.displacement
        rate = low.velocity - tip.velocity
        force = (self.law.force(p, rate), self.law.slope(p) * rate if self.degree else 0.0, 0.0)
        upper.rewind()
        tip = upper.advance(time, size, force)
        on_lower = force
        if self._sequential:
            moved = low.displacement + (size * low.velocity if self.degree else 0.0)
            end = self.law.force(moved - tip.displacement, low.velocity - tip.velocity)
            on_lower = (force[0], (end - force[0]) / size, 0.0) if self.degree else (end, 0.0, 0.0)
        lower.rewind()
        return Step(time, size, force, NO_FORCE, start, (tip, lower.advance(time, size, on_lower)))
