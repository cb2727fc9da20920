"""The energy ledger of a run."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from ..bodies.checkpointed import Checkpointed
from ..bodies.protocol import Energies
from ..coupling.protocol import Booking
from ..scene import Scene
from ..scene.tables import ORDINARY_SCHEMES

#: Relative energy residual up to which a coupling that creates no energy is exact: rounding and solvers' tolerances.
EXACT = 1e-8
#: Largest such residual where a scheme, an integrator or Algorithm 1 changes the energy itself.
APPROXIMATE = 1e-3
#: Energy-error allowance per unit of solver tolerance: 1e-12 gives `EXACT`.
_TOLERANCES = EXACT / 1e-12


def bounds(scene: Scene) -> tuple[float, float]:
    """Relative energy residuals above which a run warns, and above which it stops."""
    coupling, beam = scene.coupling, scene.beam
    changes = coupling.scheme == "hermite" or coupling.scheme in ORDINARY_SCHEMES or scene.contact.law == "paper"
    if changes or (beam is not None and beam.damped_numerically):
        return APPROXIMATE, 0.1
    tolerance = max(coupling.tolerance, 0.0 if scene.spring is None else scene.spring.relative_tolerance)
    return min(max(EXACT, _TOLERANCES * tolerance), APPROXIMATE), APPROXIMATE


@dataclass
class Ledger(Checkpointed):
    """E_beam + E_spring + E_contact + dissipated + impact losses − work of external loads = constant."""

    impact_loss: float = 0.0  #: [J], by whoever applies an impact
    initial: float | None = None  #: the total of the first row [J]
    scale: float = 0.0  #: the largest energy so far [J]
    largest_residual: float = 0.0  #: [J]
    relative: float = 0.0  #: the largest residual over the scale at its time
    gain: float = 0.0  #: the same of the residuals that are positive
    dissipated: tuple[float, float, float] = (0.0, 0.0, 0.0)  #: by the beam, the spring, the contact law [J]

    def book(self, beam: Energies, spring: Energies, between: Booking) -> tuple[float, ...]:
        """Return the energies of the next row [J], from ``e_beam`` to ``energy_residual`` as in a run's columns.

        ``between`` is what the coupling adds.

        One that is not finite changes nothing: it is no row of the results.
        """
        (kinetic, potential, dissipated, load), (kinetic_2, potential_2, dissipated_2, load_2) = beam, spring
        e_beam, e_spring = kinetic + potential, kinetic_2 + potential_2
        contact, law_dissipated, unfelt = between
        lost_in = (dissipated, dissipated_2, law_dissipated)
        dissipated, load = dissipated + dissipated_2 + law_dissipated, load + unfelt + load_2
        lost = self.impact_loss
        total = e_beam + e_spring + contact + dissipated + lost + load
        if (initial := self.initial) is None:
            self.initial = initial = total
        residual = total - initial
        if isfinite(residual):
            self.dissipated = lost_in
            self.scale = scale = max(self.scale, abs(initial), abs(e_beam) + abs(e_spring) + contact)
            share = residual / scale if scale > 0.0 else 0.0
            if abs(residual) > self.largest_residual:
                self.largest_residual = abs(residual)
            if abs(share) > self.relative:
                self.relative = abs(share)
            if share > self.gain:
                self.gain = share
        return e_beam, e_spring, contact, dissipated, lost, load, total, residual
