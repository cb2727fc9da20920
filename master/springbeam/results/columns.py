"""Columns and energies of a run: functions of its scene and its records."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Any

import numpy as np

from ..motion.events import Event
from ..scene import Scene, Spring
from .records import BEAM_REPORTS, PHASE_NAMES, SPRING_REPORTS, STEP_COLUMNS, common, joined, seated
from .trajectory import BODY_COLUMNS, Trajectory, columns_of

#: Limit of a column that does not affect the motion [N]; pictures multiply two of them.
MOST_SHOWN = 1e150
#: Warning of a run in which a force was too large for its column.
_NOT_SHOWN = (
    f"compliance_force is larger than {MOST_SHOWN:g} N at times and is written as that, tie_reaction with it; "
    "the motion does not depend on either. A smaller contact.stiffness or contact.exponent keeps them in range"
)
#: Records from which columns are made at once, to bound the memory for a long run.
_TOGETHER = 4096
#: Columns from the beam, and their fields in a record.
_OF_BEAM = {
    "a_tip": "tip_acceleration",
    **{name: name for name in ("clamp_force", "clamp_moment", "bending_stress")},
}


def columns(scene: Scene, steps: np.ndarray, first: np.ndarray) -> dict[str, np.ndarray]:
    """Return the columns of records of a run of ``scene``, those of `columns_of`.

    Parameters
    ----------
    scene
        As run.
    steps
        Any records of the run, of dtype `springbeam.results.records.STEP`, shape (n,).
    first
        The first record of the run, shape (1,).
    """
    u, v, y, z = (steps[f"{name}_after"] for name in ("u_tip", "v_tip", "y", "z"))
    apart = ~joined(steps)
    rigid = scene.contact.rigid
    zeros = np.zeros(len(steps))
    contact = steps["contact_force_after"]
    if rigid:
        v, z = (np.where(apart, own, common(steps, seated(steps), "v_tip_after", "z_after")) for own in (v, z))
    phase = PHASE_NAMES[steps["phase"].astype(int)]
    if rigid:  # ends that touch and part at once: a pulling force is no contact force
        contact = np.where(phase == "touch", np.maximum(contact, 0.0), contact)
    compliance = zeros if rigid else contact
    if scene.coupled and scene.contact.impacts:
        compliance = np.minimum(normal_compliance(scene, u, first), MOST_SHOWN)
    energies = ledger(steps)
    table = {
        "time": steps["time"],
        "u_tip": u,
        "v_tip": v,
        "y": y,
        "z": z,
        "contact_force": contact,
        "compliance_force": compliance,
        "tie_reaction": contact - compliance if rigid else zeros,
        "foundation_force": steps["foundation_force_after"],
        "gap": u - y,
        "phase": phase,
        **energies,
        "energy_residual": energies["e_total"] - steps["energy_at_start"],
        **{f"load_{i}": load.value(steps["time"]) for i, load in enumerate(scene.loads)},
    }
    reports = int(first["reports"][0]) if len(first) else BEAM_REPORTS + SPRING_REPORTS
    if reports & BEAM_REPORTS:
        table |= {name: steps[field] for name, field in _OF_BEAM.items()}
    if reports & SPRING_REPORTS and scene.spring is not None:
        table["a_y"] = _acceleration(scene, scene.spring, table, steps)
    if rigid and "a_tip" in table and (scene.lower is None or "a_y" in table):
        # Joined ends move as one; the tip's own acceleration alternates from step to step.
        table["a_tip"] = np.where(apart, table["a_tip"], table.get("a_y", 0.0))
    return {name: np.array(table[name]) for name in columns_of(scene) if name in table or name not in BODY_COLUMNS}


def _acceleration(scene: Scene, spring: Spring, table: Mapping[str, np.ndarray], steps: np.ndarray) -> np.ndarray:
    """Return ÿ [m/s²] of the spring's top under the forces of its row, 0 while it is seated."""
    force = -spring.force(table["y"]) - spring.damping * table["z"]
    for i, load in enumerate(scene.loads):
        if load.on in ("spring", "base"):
            force = force + table[f"load_{i}"] * (1.0 if load.on == "spring" else -spring.mass)
    if scene.coupled:
        force = force - table["contact_force"]
    return np.where(seated(steps), 0.0, force / spring.mass)


def first_not_finite(scene: Scene, steps: np.ndarray, first: np.ndarray) -> tuple[int, str] | None:
    """Return the first row that has a number that is not finite, and which; ``None`` if there is none.

    Parameters as of `columns`.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        table = [(name, values) for name, values in columns(scene, steps, first).items() if name != "phase"]
    table += [(name, steps[name]) for name in STEP_COLUMNS]
    finite = np.isfinite([values for _, values in table])
    if finite.all():
        return None
    row = int(np.argmin(finite.all(axis=0)))
    name, values = table[int(np.argmin(finite[:, row]))]
    return row, f"{name} = {values[row]}"


def blocks(scene: Scene, steps: np.ndarray) -> Iterator[dict[str, np.ndarray]]:
    """Yield the columns of all records of a run, some thousand rows at a time."""
    for begin in range(0, max(len(steps), 1), _TOGETHER):  # of no records as well, columns without rows
        yield columns(scene, steps[begin : begin + _TOGETHER], steps[:1])


def trajectory_of(
    scene: Scene, steps: np.ndarray, events: list[Event], shapes: np.ndarray | None, summary: dict[str, Any]
) -> Trajectory:
    """Return the run of records, events and shapes; parameters as of `springbeam.results.recording`."""
    between = steps if steps["size"].any() else None
    return Trajectory(scene, columns(scene, steps, steps[:1]), events, shapes, summary, between)


def normal_compliance(scene: Scene, u: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Return λ (Ψ − u)₊^p [N], the part of a rigid contact's force that the paper calls normal compliance."""
    psi = first["y_after"] if scene.equilibrium is None else scene.equilibrium
    return scene.contact.compliance(psi - u)


def not_shown(scene: Scene, steps: np.ndarray) -> str | None:
    """Return a warning if a compliance force beside a rigid law was too large for its column."""
    if not (scene.coupled and scene.contact.impacts):
        return None
    too_large = (normal_compliance(scene, steps["u_tip_after"], steps[:1]) > MOST_SHOWN).any()
    return _NOT_SHOWN if too_large else None


def ledger(steps: np.ndarray, received: Collection[str] = ()) -> dict[str, np.ndarray]:
    """Return the columns from ``e_beam`` to ``e_total`` [J]: energies, what was lost, minus the work of the loads.

    The energy of a body in ``received``, "beam" or "spring", is the work that it has received, because its own account
    may be wrong.
    """

    def account(body: str) -> tuple[Any, Any, Any]:
        """Return the energies [J] that a body stores, dissipates and gets from its loads."""
        if body in received:
            return steps[f"{body}_received"], nothing, nothing
        stored = steps[f"{body}_kinetic"] + steps[f"{body}_potential"]
        return stored, steps[f"{body}_dissipated"], steps[f"{body}_load"]

    nothing = np.zeros(len(steps))
    e_beam, lost_beam, load_beam = account("beam")
    e_spring, lost_spring, load_spring = account("spring")
    energies = {
        "e_beam": e_beam,
        "e_spring": e_spring,
        "e_contact": steps["law_stored"],
        "e_dissipated": lost_beam + lost_spring + steps["law_dissipated"],
        "e_impact_loss": steps["impact_loss"],
        "e_load": load_beam + load_spring,
    }
    return {**energies, "e_total": np.sum(list(energies.values()), axis=0)}
