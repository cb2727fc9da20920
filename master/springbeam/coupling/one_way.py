"""One-way coupling of the normal-compliance law: the contact force acts on one end only, the other one drives.

For a driving end that the force would hardly move. It makes one step per macro step, with nothing at its end; the
driven body then finds the force of the discrete gradient (`compliance`) from where the driving end has gone.

What is neglected is bounded. A linear body at rest, stiffness k, answers a step of the force by at most twice its
static deflection (undamped, each mode by φ²/ω² (1 − cos ωt); damped, by less), and any force is a sum of steps, so

    |Δu| ≤ 2 V/k,     V = ∫ |dC| the total variation of the contact force so far,

for the whole mesh at once, since Σ φ_k²/ω_k² = 1/k. The bound is compared with the largest penetration so far. The
work of C on the driving end, which it does not feel, is booked, so that the ledger still closes.
"""

from __future__ import annotations

from ..bodies.memory import Memory
from ..bodies.protocol import NO_FORCE, Body, Force, Held
from .compliance import Compliance, discrete_gradient


class OneWay(Memory):
    """The step's force, and what has been neglected.

    Parameters
    ----------
    compliance
        Solver of the law.
    stiffness, exponent
        λ_nc [N/m^q] and q of the law.
    beam_drives
        Whether the beam drives the spring, or the spring the beam.
    driver_stiffness
        k: static force per displacement of the driving end [N/m].
    """

    REMEMBERED = ("_variation", "_force", "_deepest", "work")

    def __init__(
        self, compliance: Compliance, stiffness: float, exponent: float, beam_drives: bool, driver_stiffness: float
    ) -> None:
        self._compliance, self._law = compliance, (stiffness, exponent)
        self.beam_drives, self._stiffness = beam_drives, driver_stiffness
        self._variation = self._force = self._deepest = 0.0
        self.work = 0.0  #: of the contact force on the driving end, which does not feel it [J]

    def solve(self, beam: Body, partner: Body, time: float, size: float, guess: Force, start: float) -> Force:
        """Advance both bodies from their marks by ``size`` [s]; parameters and errors as of `Compliance.solve`."""
        driver, driven = (beam, partner) if self.beam_drives else (partner, beam)
        driver.rewind()
        end = Held(driver.advance(time, size, NO_FORCE).displacement)
        if driven.mass == float("inf"):
            depth = driven.motion().displacement - end.motion().displacement
            return (discrete_gradient(start, depth, *self._law), 0.0, 0.0)
        if self.beam_drives:
            return self._compliance.solve(end, driven, time, size, guess, start)
        return self._compliance.solve(driven, end, time, size, guess, start)

    def accept(self, force: float, moved: float, depth: float) -> None:
        """A step is made, with its ``force`` [N]; the driving end ``moved`` [m], ``depth`` [m] is the penetration."""
        self._variation += abs(force - self._force)
        self._force = force
        self._deepest = max(self._deepest, depth)
        self.work += (force if self.beam_drives else -force) * moved

    @property
    def neglected(self) -> float:
        """Bound of the driving end's motion that is left out, 2 V/k [m]."""
        return 2.0 * self._variation / self._stiffness

    @property
    def share(self) -> float:
        """`neglected` over the largest penetration so far, 0 before contact."""
        return self.neglected / self._deepest if self._deepest > 0.0 else 0.0
