"""Observed orders in the macro step, stretch by stretch between changes of contact."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from ...monolithic import event_driven
from ...results.contact_times import contact_changes
from ...run.runner import simulate
from ...scene import Scene, SceneError, with_changes
from .sampling import SHORT, away_from, macro_points, quantities


@dataclass(frozen=True)
class OrderRow:
    """Errors of a quantity in one stretch between changes of contact, at H, H/2, …"""

    phase: str
    begin: float  #: [s]
    end: float
    quantity: str
    errors: tuple[float, ...]
    orders: tuple[float, ...]  #: between neighbours


def orders(scene: Scene, halvings: int = 3) -> list[OrderRow]:
    """Return the observed orders in H of displacement, velocity and contact force.

    Errors are in the max norm against the event-driven reference, at the macro points that all runs share and two
    macro steps away from the events.
    """
    size = scene.coupling.H
    if scene.contact.law == "paper":
        raise SceneError("contact.law = 'paper': Algorithm 1 does not converge; --orders needs another law")
    runs = [simulate(with_changes(scene, coupling={"macro_step": size / 2**k})) for k in range(halvings + 1)]
    times = macro_points(runs[0], scene)
    reference = event_driven.simulate(scene, sample_times=times)
    changes = [change.time for change in contact_changes(reference, SHORT * size)]
    edges = [scene.contact_time or 0.0, *changes, float(runs[0].time[-1])]
    found: list[OrderRow] = []
    for begin, end in itertools.pairwise(edges):
        inside = times[(times > begin) & (times < end) & away_from(times, (begin, end), size)]
        if len(inside) < 4:
            continue
        phase = str(reference.phase[np.searchsorted(reference.time, inside[len(inside) // 2])])
        for name, sample in quantities(scene):
            if name in ("e_beam", "e_spring") or (name == "contact_force" and phase == "free"):
                continue
            exact = sample(reference, inside)
            errors = []
            for run in runs:
                difference = np.abs(sample(run, inside) - exact)
                errors.append(float(np.nanmax(difference)) if np.isfinite(difference).any() else float("nan"))
            with np.errstate(divide="ignore", invalid="ignore"):
                observed = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
            found.append(OrderRow(phase, begin, end, name, tuple(errors), tuple(observed.tolist())))
    return found
