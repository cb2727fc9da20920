"""What Algorithm 1 asks of a scene, and the result of a run by it, whoever makes its steps."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ..monolithic.rows import finished
from ..motion.events import Event
from ..results.trajectory import Trajectory
from ..scene import Scene, SceneError
from ..scene.frequencies import slowest_frequency
from ..scene.laws import TransmissionContact

#: Table 2 by figure: iterations per solve of (53), and time per step [s]. Its header says "Figure 5" twice; the third
#: column is taken as Figure 4.
TABLE_2 = {2: (1.990, 5.63e-3), 3: (3.010, 5.84e-3), 4: (2.000, 5.90e-3), 5: (2.978, 5.83e-3)}

#: Columns that runs of a scene do not have: the lines that decided (11, 14, or 0 where neither holds), and the work
#: that no force of the model does: of the overwritten tip on the beam, of the exchange of yˡ on the spring [J].
EXTRA = ("case", "e_injected_beam", "e_injected_spring")


def refuse(scene: Scene) -> None:
    """Raise SceneError if ``scene`` is not one that Algorithm 1 is written for."""
    if scene.beam is None or scene.spring is None or scene.massless or scene.loads or scene.static:
        raise SceneError(
            'Algorithm 1 needs a [spring] and a [beam] with fidelity = "dynamic", and knows neither [[loads]] nor a '
            "start at rest"
        )
    if not isinstance(scene.contact, TransmissionContact):
        raise SceneError(f'[contact] law = "{scene.contact.law}": Algorithm 1 has its own law; leave law out')
    if scene.accuracy is not None or scene.coupling.adaptive:
        raise SceneError("Algorithm 1 has one step size; give [coupling] macro_step, no accuracy and no tolerance")


def steps(scene: Scene) -> Iterator[tuple[float, float]]:
    """Yield the end [s] and the size [s] of each step of h_t = ``coupling.macro_step``; the last one may be shorter."""
    start = scene.contact_time or 0.0
    h = scene.coupling.H
    whole, rest = scene.equal_steps
    for number in range(1, whole + 1):
        yield start + number * h, h
    if rest > 0.0:
        yield scene.time.t_end, rest


def _not_resolved(scene: Scene) -> str | None:
    """Return in words by how much the slowest oscillation turns in a step; ``None`` if it is at most 1 rad."""
    assert scene.beam is not None
    assert scene.spring is not None
    H = scene.coupling.H
    p = scene.spring
    heights = [p.equilibrium] if scene.stop is None else [p.equilibrium, scene.stop.position]
    stiffest = max(0.0, *map(p.stiffness, heights))
    turn = H * max(slowest_frequency(scene.beam), (stiffest / p.mass) ** 0.5)
    if turn <= 1.0:
        return None
    return (
        f"not resolved: the slowest oscillation of a body turns {turn:.3g} rad in a macro step. Velocities, forces and "
        f"times of events are samples of a faster motion; coupling.macro_step <= {0.95 * H / turn:.1e} s resolves it"
    )


def result(
    scene: Scene,
    columns: dict[str, np.ndarray],
    shapes: np.ndarray,
    events: list[Event],
    summary: Mapping[str, Any],
) -> Trajectory:
    """Return the result of a run: ``columns``, what follows from them, and the balance of its energy.

    Parameters
    ----------
    columns
        All columns of a step but those of `springbeam.monolithic.rows.finished`; forces are means over the step [N].
    shapes
        Deflections [m], bending moments [N·m] and shear forces [N] of each row, shape (n, 63).
    events
        First contact, and impacts on the foundation.
    summary
        What only one of the two programs can say.
    """
    columns |= {name: np.zeros(len(columns["time"])) for name in ("e_contact", "e_impact_loss")}
    unresolved = _not_resolved(scene)
    warnings = ["Algorithm 1 overwrites the tip's position, which changes the energy by energy_residual"]
    run = finished(scene, columns, shapes, events, {}, EXTRA)
    run.summary = {
        "status": "done",
        "macro_steps": len(run) - 1,
        **summary,
        "max_energy_residual": run.summary["largest_relative_energy_residual"],
        "injected_into_beam": float(columns["e_injected_beam"][-1]),
        "injected_into_spring": float(columns["e_injected_spring"][-1]),
        "resolved": unresolved is None,
        "warnings": [*warnings, *([] if unresolved is None else [unresolved])],
        "scene": scene.model_dump(exclude_none=True),
    }
    return run
