"""The energy ledger of a run, what judges the run by it, and what is said where something has changed the energy."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite
from typing import Any

from ..bodies.checkpointed import Checkpointed
from ..bodies.protocol import Body, Ends, Energies
from ..coupling.protocol import Booking
from ..scene import Scene
from ..scene.tables import ORDINARY_SCHEMES
from .outcome import RunStopped
from .stepping import Pair

#: Relative energy residual up to which a coupling that creates no energy is exact: rounding and solvers' tolerances.
EXACT = 1e-8
#: Largest such residual where a scheme, an integrator or Algorithm 1 changes the energy itself.
APPROXIMATE = 1e-3
#: Energy-error allowance per unit of solver tolerance: 1e-12 gives `EXACT`.
_TOLERANCES = EXACT / 1e-12


def bounds(scene: Scene) -> tuple[float, float]:
    """Relative energy residuals above which a run warns, and above which it stops."""
    coupling, beam = scene.coupling, scene.beam
    changes = coupling.scheme == "hermite" or coupling.scheme in ORDINARY_SCHEMES or scene.contact.algorithm
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


class Balance(Checkpointed):
    """The ledger of a run, and how much of the energy may change."""

    CHECKPOINTED = ("ledger", "_judged")

    def __init__(self, scene: Scene, pair: Pair) -> None:
        self._scene, self._pair = scene, pair
        self.ledger = Ledger()
        #: The ledger, or with foreign bodies, whose own accounts may be off, that of the work that they have received.
        self._judged = Ledger() if scene.foreign else self.ledger
        self._numerically_damped = scene.beam is not None and scene.beam.damped_numerically
        self._warns, self._stops = bounds(scene)
        #: Bodies of the caller's may tell no energies; there is then no balance to judge by.
        self._untold = any(type(body).energies is Body.energies and body.mass < inf for body in pair.bodies)
        if self._untold:
            self._warns = self._stops = inf

    def book(self, ends: Ends) -> tuple[float, ...]:
        """Return the energies of the next row, as `Ledger.book` does, where the ends are."""
        if self._judged is not self.ledger:
            self._judged.book(*self._pair.exchanged(ends))
        return self.ledger.book(*self._pair.energies(ends))

    def lose(self, energy: float) -> None:
        """Book what an impact has taken [J]."""
        self.ledger.impact_loss += energy
        if self._judged is not self.ledger:
            self._judged.impact_loss += energy

    @property
    def _error(self) -> float:
        """Return the share of the energy that has changed; what numerical damping takes is not an error."""
        return self._judged.gain if self._numerically_damped else self._judged.relative

    @property
    def changed(self) -> bool:
        """Whether so much of the energy has changed that the motion is in doubt."""
        return self._error > self._warns

    def refuse_change(self, time: float, macro_step: float) -> None:
        """Raise RunStopped if more of the energy has changed by ``time`` [s] than can be right."""
        if self._error > self._stops:
            raise RunStopped(self._cause(macro_step), time)

    def warnings(self, macro_step: float) -> list[str]:
        """Return what a user should know of the energies."""
        if self._untold:
            return ["a body reports no energies, so the energy balance is not checked"]
        if self._judged.relative > self._warns:
            return [self._cause(macro_step)]
        if self.ledger.relative > self._warns:
            return [
                f"the energies that the FMUs tell are off by {100.0 * self.ledger.relative:.2g} %, by their own "
                f"solvers: the coupling has kept those of the interface to {self._judged.relative:.1e}"
            ]
        return []

    def summary(self) -> dict[str, Any]:
        """Return the residuals, and what the bodies and the contact law have dissipated [J], for ``summary.json``."""
        beam, spring, contact = self.ledger.dissipated
        return {
            "max_energy_residual": self.ledger.relative,
            "max_energy_residual_joule": self.ledger.largest_residual,
            **({"max_interface_residual": self._judged.relative} if self._scene.foreign else {}),
            **({"loss_beam": beam} if self._pair.beam is not None else {}),
            **({"loss_spring": spring} if self._pair.spring is not None else {}),
            **({"loss_contact": contact} if self._pair.law.soft else {}),
        }

    def _cause(self, macro_step: float) -> str:
        coupling, beam = self._scene.coupling, self._scene.beam
        causes, remedies = [], []
        if not self._pair.joined.energy_exact:
            causes.append(f"{coupling.scheme} of degree {coupling.degree}")
            or_else = ", or coupling.scheme = 'energy'" if self._pair.repeatable else ""
            remedies.append(f"the macro step {macro_step:g} s is too large for it; take a smaller one{or_else}")
        if self._numerically_damped:
            assert beam is not None
            causes.append(f"beam.rho_inf = {beam.rho_inf:g}")
            remedies.append("no column books what numerical damping takes; beam.rho_inf = 1 takes nothing")
        if not causes:
            causes.append("rounding, or a solver's tolerance,")
            remedies.append("the results are not to be trusted; try another coupling.macro_step")
        percent = 100.0 * self._judged.relative
        return f"{' with '.join(causes)} has changed the energy by {percent:.2g} %: {'; '.join(remedies)}"
