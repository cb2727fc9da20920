"""Judge a run by its energy ledger: when it warns, when it stops, and with which message."""

from __future__ import annotations

from collections.abc import Callable, Collection
from math import inf
from typing import Any

import numpy as np

from ..motion.curves import EPS
from ..results.columns import ledger
from ..results.spans import energy_of_force
from .stepping import Pair

#: Relative energy residual up to which a coupling that creates no energy is exact: rounding and solvers' tolerances.
EXACT = 1e-8
#: Share of the energy that a contact force alone would give: energies below are the rounding of works that cancel.
_HELD = 10.0 * EPS / EXACT
#: What a warning says where more of the energy has changed.
CHANGED = "has changed the energy"
#: Largest such residual where a scheme changes the energy itself.
APPROXIMATE = 1e-3
#: Energy-error allowance per unit of solver tolerance: 1e-12 gives `EXACT`.
_TOLERANCES = EXACT / 1e-12


def bounds(tolerance: float, *, exchanges: bool = False) -> tuple[float, float]:
    """Return the relative energy residuals above which a run warns, and above which it stops.

    Parameters
    ----------
    tolerance
        The largest relative tolerance of the coupling and of the bodies.
    exchanges
        Whether the scheme exchanges once per macro step.
    """
    if exchanges:
        return APPROXIMATE, 0.1
    return min(max(EXACT, _TOLERANCES * tolerance), APPROXIMATE), APPROXIMATE


def errors(
    steps: np.ndarray, first: np.ndarray, scale: float, received: Collection[str] = ()
) -> tuple[np.ndarray, np.ndarray]:
    """Return by how much the energy has changed at each of ``steps``, over the largest until then, and that [J].

    The largest energy grows with each step by what the rounding of works that cancel may add to the residual.
    ``first`` is the first record of the run, shape (1,): it has the energy that should be kept. ``scale`` is the
    largest energy before ``steps`` [J], ``received`` as of `ledger`.
    """
    with np.errstate(over="ignore", invalid="ignore"):  # what is not finite is refused by the record
        energies = ledger(steps, received)
        initial = float(first["energy_at_start"][0])
        if received:
            initial = float(ledger(first, received)["e_total"][0])
        # Beyond its hilltop a softening spring has a negative potential, which may cancel its kinetic energy.
        of_spring = np.maximum(np.abs(energies["e_spring"]), steps["spring_kinetic"])
        size = np.abs(energies["e_beam"]) + of_spring + energies["e_contact"]
        rounding = np.cumsum(_HELD * energy_of_force(steps))
        largest = rounding + np.maximum.accumulate(np.maximum(size - rounding, max(scale, abs(initial))))
        residual = energies["e_total"] - initial
        return np.divide(residual, largest, out=np.zeros_like(residual), where=largest > 0.0), largest


class Balance:
    """How much of a run's energy may change, and has."""

    def __init__(self, pair: Pair) -> None:
        self._pair = pair
        tolerance = max(pair.setup.tolerance, *(body.tolerance for body in pair.bodies))
        self._warns, self._stops = bounds(tolerance, exchanges=pair.setup.exchanges)
        #: The bodies whose energy is the work that they have received, by table.
        self._received = [
            table for table, body in zip(("beam", "spring"), pair.bodies, strict=True) if body.received is not None
        ]
        #: Bodies of the caller may report no energies; there is then no balance to judge by.
        self._unknown = any(
            not body.can().energies and body.received is None and body.mass < inf for body in pair.bodies
        )
        if self._unknown:
            self._warns = self._stops = inf
        self._scale = 0.0  #: the largest energy so far [J]

    def check(self, steps: np.ndarray, first: np.ndarray) -> tuple[np.ndarray, Callable[[int], str]]:
        """Return at which of the next records too much of the energy has changed, and why; see `Log`."""
        share, largest = errors(steps, first, self._scale, self._received)
        self._scale = float(largest[-1])
        return np.abs(share) > self._stops, lambda row: self._cause(float(abs(share[row])), steps)

    def report(self, steps: np.ndarray) -> tuple[dict[str, Any], list[str], bool]:
        """Return what all records of the run, shape (n,), say of its energy.

        That is residuals and what bodies and contact law have dissipated [J], warnings, and whether so much has changed
        that the motion is in doubt.
        """
        if not len(steps):
            return {"max_energy_residual": 0.0}, [], False
        of_own, of_judged = (
            float(np.abs(errors(steps, steps[:1], 0.0, received)[0]).max()) for received in ((), self._received)
        )
        setup = self._pair.setup
        last = steps[-1]
        summary = {
            "max_energy_residual": of_own,
            **({"max_interface_residual": of_judged} if self._received else {}),
            **({"loss_beam": float(last["beam_dissipated"])} if setup.upper else {}),
            **({"loss_spring": float(last["spring_dissipated"])} if setup.lower else {}),
            **({"loss_contact": float(last["law_dissipated"])} if self._pair.law is not None else {}),
        }
        warnings = []
        if self._unknown:
            warnings.append("a body reports no energies, so the energy balance is not checked")
        elif of_judged > self._warns:
            warnings.append(self._cause(of_judged, steps))
        elif of_own > self._warns:
            warnings.append(
                f"the energies that the FMUs report have an error of {100.0 * of_own:.2g} %, by their own "
                f"solvers: the coupling has kept those of the interface to {of_judged:.1e}"
            )
        return summary, warnings, of_judged > self._warns

    def _cause(self, share: float, steps: np.ndarray) -> str:
        """Return in words why a ``share`` of the energy has changed, and what would help."""
        setup = self._pair.setup
        cause = "rounding, or a solver's tolerance,"
        remedy = "the results are not to be trusted; try another coupling.macro_step"
        if not self._pair.joined.energy_exact:
            cause = f"{setup.scheme} of degree {setup.degree}"
            or_else = ", or coupling.scheme = 'energy'" if self._pair.repeatable else ""
            H = setup.macro_step or steps["size"].max()
            remedy = f"the macro step {H:g} s is too large for it; take a smaller one{or_else}"
        return f"{cause} {CHANGED} by {100.0 * share:.2g} %: {remedy}"
