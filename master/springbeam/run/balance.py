"""What judges a run by its energies, and what is said where something has changed them."""

from __future__ import annotations

from math import inf
from typing import Any

from ..bodies.checkpointed import Checkpointed
from ..bodies.protocol import Body
from ..coupling.protocol import Ends
from ..scene import Scene
from .ledger import Ledger, bounds
from .outcome import RunStopped
from .stepping import Pair


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
