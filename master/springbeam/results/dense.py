"""Interpolate a run between its rows, by the dense output of each step.

Steps end on events and on changes of phase, so that no polynomial reaches across one. Between two rows

* ``y``, ``z`` and, of ends that move apart, ``u_tip``, ``v_tip`` follow the path of order 6 through both ends of the
  step with its two moments (`springbeam.results.paths`), velocities its slope (order 5);
* ends that a rigid law joins move together: ``u_tip`` takes the path of y, whose own is smoother, ``v_tip`` its slope,
  each with what the rows say of the gap and of the mismatch, linear between them; a tip that the foundation holds stays
  where its rows are;
* ``contact_force``, ``foundation_force`` are the polynomials applied; ``gap``, ``velocity_mismatch``, ``tie_reaction``,
  ``e_total`` and ``energy_residual`` follow from the other columns as in a row;
* ``load_0`` and its like are the signals;
* ``compliance_force``, ``contact_force_smoothed`` and the energies are linear between the rows (order 2; the smoothed
  force, which belongs to the start of its row's step, 1); what an event takes is taken at its row.

At the time of a row the values are the row's, at an event those after it. Orders are those of the polynomials: values
between rows are no more accurate than the rows.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.polynomial.polynomial import polyval

from .extremes import Extremes
from .paths import Path
from .steps import contact_force, load_on_spring
from .trajectory import Trajectory

#: Columns that are linear between rows, and do not change with an event.
_LINEAR = ("compliance_force", "e_contact", "e_dissipated", "e_load")


def at(run: Trajectory, times: Any) -> Trajectory:
    """Return ``run`` at ``times`` [s], in any order, shape (n,): the same columns, events, shapes and summary.

    Raises ValueError for times outside of those that are known, and for a run that has no steps.
    """
    wanted = np.atleast_1d(np.asarray(times, dtype=float))
    if wanted.ndim != 1:
        raise ValueError(f"times of shape {wanted.shape}: one number, or a sequence of them")
    steps = run.steps
    if steps is None:
        raise ValueError(
            "this run has no data between its rows: it is by a reference, by contact.law = 'paper', or "
            "its rows were written at an output interval"
        )
    known = run.columns["time"][: len(steps)]
    outside = ~((wanted >= known[0]) & (wanted <= known[-1]))
    if outside.any():
        raise ValueError(f"time {wanted[outside][0]:g} s: the run is known from {known[0]!s} s to {known[-1]!s} s")
    row = np.searchsorted(known, wanted, side="right") - 1
    columns = {name: values[row] for name, values in run.columns.items()}
    columns["time"] = wanted
    between = np.flatnonzero(wanted > known[row])
    if between.size:
        for name, values in _Between(run, steps, row[between], wanted[between]).columns().items():
            columns[name][between] = values
    return Trajectory(run.scene, columns, list(run.events), run.shapes, dict(run.summary))


def extremes(run: Trajectory, name: str) -> Extremes:
    """Return the lowest and the highest value of a column of the motion on the curve that `at` follows.

    ``name`` is ``u_tip``, ``v_tip``, ``y``, ``z`` or ``gap``. A run that left no steps has its rows only.
    """
    values, times = run.columns[name], run.columns["time"]
    found = Extremes.of_rows(times, values)
    if run.steps is None:
        return found
    after = np.flatnonzero(run.steps["size"] > 0.0)
    steps, before = run.steps[after], after - 1
    start = {key: column[before] for key, column in run.columns.items()}
    powers = motion(steps, start, _held_together(run, before))
    if name in powers:
        curve = powers[name]
    else:  # a gap above the stop
        assert run.scene.stop is not None
        curve = powers["u_tip"].copy()
        curve[0] -= run.scene.stop.position
    return found.beside(curve, start["time"], steps["size"])


def motion(steps: np.ndarray, start: Mapping[str, np.ndarray], joined: np.ndarray) -> dict[str, np.ndarray]:
    """Return displacements, velocities and gap over each of ``steps`` as polynomials of s = τ/H.

    Parameters
    ----------
    steps
        Of sizes above 0 and of dtype `springbeam.results.steps.STEP`, shape (n,).
    start
        Columns ``u_tip``, ``v_tip``, ``y``, ``z`` at the start of each step, after what happens there, as far as the
        scene has them: [m] and [m/s], shape (n,).
    joined
        Whether a rigid law holds the ends, or a tip and the foundation, together over the step, shape (n,).

    Returns
    -------
    dict
        The coefficients of 1, s … s⁵ of ``u_tip``, ``v_tip``, ``y``, ``z`` and, of a pair, ``gap``, shape (6, n).
    """
    found: dict[str, np.ndarray] = {}
    size: Any = steps["size"]
    for position, velocity in (("u_tip", "v_tip"), ("y", "z")):
        if position in start:
            begin: Any = (start[position], start[velocity])
            end: Any = (steps[position], steps[velocity])
            means: Any = (steps[f"{position}_integral"] / size, steps[f"{position}_integral_2"] / size**2)
            path: Any = Path.through(begin, end, size, means)
            powers = np.array(path.powers)
            found[position] = powers
            found[velocity] = np.vstack([np.arange(1.0, 6.0)[:, None] * powers[1:] / size, np.zeros_like(size)])
    if "u_tip" in found and "y" in found:
        for of_tip, of_low in (("u_tip", "y"), ("v_tip", "z")):
            together = found[of_low].copy()
            apart = start[of_tip] - start[of_low]
            together[:2] += apart, steps[of_tip] - steps[of_low] - apart
            found[of_tip] = np.where(joined, together, found[of_tip])
        found["gap"] = found["u_tip"] - found["y"]
    elif "u_tip" in found:
        for name in ("u_tip", "v_tip"):  # the foundation holds it where its rows say
            straight = np.zeros_like(found[name])
            straight[:2] = start[name], steps[name] - start[name]
            found[name] = np.where(joined, straight, found[name])
    return found


def _held_together(run: Trajectory, row: np.ndarray) -> np.ndarray:
    """Return whether a rigid law holds the ends together from each ``row`` on."""
    phase = run.columns["phase"][row]
    held = ("tied", "touch") if "y" in run.columns else ("tied", "touch", "seated")
    return run.scene.contact.rigid & np.isin(phase, held)


class _Between:
    """Columns at times strictly between a row and the one after it; ``row`` is the row before each time."""

    def __init__(self, run: Trajectory, steps: np.ndarray, row: np.ndarray, times: np.ndarray) -> None:
        self._run, self._row, self._steps = run, row, steps[row + 1]
        start, end = run.columns["time"][row], run.columns["time"][row + 1]
        self._share = (times - start) / (end - start)
        self._tau = self._share * self._steps["size"]

    def columns(self) -> dict[str, np.ndarray]:
        run, steps = self._run, self._steps
        contact = run.scene.contact
        found: dict[str, np.ndarray] = {}
        start = {name: values[self._row] for name, values in run.columns.items()}
        curves = motion(steps, start, _held_together(run, self._row))
        curves.pop("gap", None)
        found |= {name: polyval(self._share, powers, tensor=False) for name, powers in curves.items()}
        at = run.columns["time"][self._row] + self._tau
        found |= {f"load_{i}": load.value(at) for i, load in enumerate(run.scene.loads)}
        pair, phase = "u_tip" in found and "y" in found, start["phase"]
        found |= {name: self._linear(name, run.columns[name][self._row + 1]) for name in _LINEAR if name in run.columns}
        found |= self._mechanical()
        if "contact_force_smoothed" in run.columns:
            smoothed = run.columns["contact_force_smoothed"]
            same = run.columns["phase"][self._row + 1] == phase
            after = np.where(same, smoothed[self._row + 1], smoothed[self._row])
            found["contact_force_smoothed"] = self._linear("contact_force_smoothed", after)
        force = contact_force(steps, self._tau)
        if "contact_force" in run.columns:
            found["contact_force"] = force
        if "tie_reaction" in run.columns:
            found["tie_reaction"] = force - found["compliance_force"] if contact.rigid else np.zeros_like(force)
        if "foundation_force" in run.columns:
            held = steps["foundation_force"]
            borne = load_on_spring(run.scene, at - self._tau) - load_on_spring(run.scene, at)
            found["foundation_force"] = np.where(held != 0.0, held + force - steps["contact_force"] + borne, 0.0)
        if pair:
            found["gap"] = found["u_tip"] - found["y"]
            if not (contact.rigid or contact.lasting):
                phase = np.where(phase == "seated", phase, np.where(found["gap"] < 0.0, "touch", "free"))
                found["phase"] = phase
            found["velocity_mismatch"] = np.where(phase == "free", 0.0, found["v_tip"] - found["z"])
        elif "gap" in run.columns:
            assert run.scene.stop is not None
            found["gap"] = found["u_tip"] - run.scene.stop.position
        energies = [name for name in run.columns if name.startswith("e_") and name != "e_total"]
        found["e_impact_loss"] = run.columns["e_impact_loss"][self._row]
        found["e_total"] = sum((found[name] for name in energies), np.zeros_like(force))
        found["energy_residual"] = found["e_total"] - (run.columns["e_total"][0] - run.columns["energy_residual"][0])
        return found

    def _linear(self, name: str, end: np.ndarray) -> np.ndarray:
        """Return what goes from the row's value to ``end``, which is reached before the event of the next row."""
        return np.asarray((1.0 - self._share) * self._run.columns[name][self._row] + self._share * end)

    def _mechanical(self) -> dict[str, np.ndarray]:
        """Return the energies of the bodies [J], without what the event of the next row moves and takes."""
        columns, after = self._run.columns, self._row + 1
        lost = columns["e_impact_loss"][after] - columns["e_impact_loss"][self._row]
        of_spring = np.zeros_like(lost)
        if "z" in columns:
            struck = columns["z"][after] != self._steps["z"]
            of_beam = np.zeros_like(lost)
            if "v_tip" in columns:
                of_beam = self._impulses() * 0.5 * (self._steps["v_tip"] + columns["v_tip"][after])
            of_spring = np.where(struck, -lost - of_beam, 0.0)
        jumps = {"e_beam": -lost - of_spring, "e_spring": of_spring}
        return {
            name: self._linear(name, columns[name][after] - jump) for name, jump in jumps.items() if name in columns
        }

    def _impulses(self) -> np.ndarray:
        """Return the impulse on the tip at the end of each step [N·s]: of the first event there."""
        times = np.array([event.time for event in self._run.events])
        on_tip = np.array([event.impulse_contact for event in self._run.events])
        end = self._steps["time"]
        if not times.size:
            return np.zeros_like(end)
        first = np.minimum(np.searchsorted(times, end), len(times) - 1)
        return np.where(times[first] == end, on_tip[first], 0.0)
