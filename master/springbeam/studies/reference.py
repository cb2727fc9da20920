"""The monolithic reference of a scene, how long two solutions can be compared, and at which points."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..monolithic import event_driven
from ..results.contact_times import contact_changes
from ..results.trajectory import TOLD, Trajectory, columns_of
from ..scene import Scene, SceneError

#: Relative change of the initial velocity that shows how fast two solutions separate, and how far that may grow.
PERTURBATION, _GROWTH = 1e-7, 1e4
#: Intervals of contact shorter than this many macro steps are no evidence either way.
SHORT = 2.0


def refuse_without_reference(scene: Scene) -> None:
    """Raise SceneError if `event_driven` cannot solve ``scene``; the message names what it can solve."""
    if scene.contact.algorithm:
        raise SceneError(
            f'[contact] law = "{scene.contact.law}": Algorithm 1 has no exact solution to compare with, and does not '
            'converge; law = "transmission" or "compliance" has, and does'
        )
    for table, body in scene.partners.items():
        raise SceneError(
            f"[{table}] {'fmu' if table in scene.foreign else 'element'}: no reference knows this body, a "
            f"{type(body).__name__}; springbeam run --accuracy compares runs of smaller and smaller steps instead"
        )
    if scene.contact.facts.strikes and scene.contact.impact == "rest" and scene.beam and scene.spring:
        raise SceneError("contact.impact = 'rest': no reference has it; use 'inelastic' or 'tip'")
    if scene.contact.soft and scene.massless:
        raise SceneError(
            f"beam.fidelity = 'quasi_static': no reference has it with law '{scene.contact.law}'; use 'dynamic'"
        )


def reference_and_perturbed(scene: Scene, times: np.ndarray) -> tuple[Trajectory, Trajectory]:
    """Return the reference at ``times`` [s], and once more from initial velocities changed by `PERTURBATION`."""
    perturbed = event_driven.simulate(
        scene, sample_times=times, velocity_perturbation=PERTURBATION * initial_speed(scene)
    )
    return event_driven.simulate(scene, sample_times=times), perturbed


def initial_speed(scene: Scene) -> float:
    """Return a speed of the start [m/s], of the slope of a beam [1/s], that a perturbation is relative to."""
    if scene.beam is not None:
        return abs(scene.beam.initial_velocity_slope) or abs(scene.beam.initial_deflection_slope) or 1.0
    assert scene.spring is not None
    return abs(scene.spring.initial_velocity) or abs(scene.spring.equilibrium) or 1.0


def comparable_until(scene: Scene) -> float:
    """Return the end of the window in which a perturbation of the reference grows less than 1e4 times and moves no
    change of contact [s]."""
    times = np.linspace(scene.contact_time or 0.0, scene.time.t_end, 401)
    exact, moved = reference_and_perturbed(scene, times)
    name = "u_tip" if scene.beam is not None else "y"
    off = np.abs(moved[name] - exact[name]) > _GROWTH * PERTURBATION * np.abs(exact[name] - exact[name][0]).max()
    end = float(times[np.argmax(off)]) if off.any() else float(times[-1])
    changes, others = contact_changes(exact, 0.0), contact_changes(moved, 0.0)
    for i, (kind, time) in enumerate(changes):
        if time >= end:
            break
        if i >= len(others) or others[i].kind != kind or abs(others[i].time - time) > 1e-3 * end:
            return 0.5 * (time + (changes[i - 1].time if i else float(exact.time[0])))
    return end


def macro_points(scene: Scene) -> np.ndarray:
    """Return the times of the macro grid of ``scene`` [s]."""
    start, H, end = scene.contact_time or 0.0, scene.coupling.H, scene.time.t_end
    return np.minimum(start + H * np.arange(np.floor((end - start) / H * (1.0 + 1e-9)) + 1.0), end)


def away_from(times: np.ndarray, events: Iterable[float], size: float) -> np.ndarray:
    """Return which of ``times`` are more than `SHORT` and a half macro steps of ``size`` [s] away from all events."""
    apart = np.abs(times[:, None] - np.array([*events, np.inf]))
    return np.asarray(np.all(apart > (SHORT + 0.5) * size, axis=1))


def quantities(scene: Scene) -> list[str]:
    """Return the columns that are compared."""
    wanted = ("u_tip", "v_tip", "e_beam", "y", "z", "e_spring", "contact_force", *TOLD)
    there = columns_of(scene).keys() - {"bending_stress"}  # which follows from strains: the references have none
    return [name for name in wanted if name in there]


def sample(run: Trajectory, times: np.ndarray, name: str) -> np.ndarray:
    """Return a quantity at macro points [s]; of the contact force the mean of both limits, the next row's smoothed."""
    H, rows = run.scene.coupling.H, run.time
    wanted = times + H * (name == "contact_force")
    nearest = rows[np.searchsorted(rows, wanted - 1e-9 * H).clip(max=len(rows) - 1)]  # what is known at rows alone
    wanted = np.where(np.abs(nearest - wanted) <= 1e-9 * H, nearest, wanted)
    found = run.at(np.minimum(wanted, rows[-1]))[name if name != "contact_force" else "contact_force_smoothed"]
    return np.where(wanted <= rows[-1], found, np.nan)
