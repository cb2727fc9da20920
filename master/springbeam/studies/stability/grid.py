"""The grid of extreme scenes: each cell is run and put into a class; what the classes amount to.

===========  ==========================================================================================================
conserved    done, energy constant to `ledger.EXACT`, nothing lost
dissipative  done, energy plus booked losses constant to `ledger.EXACT`
approximate  done, energy changed by more: within the bound of its scheme (`ledger.bounds`), or the run says so
refused      a scene that cannot be run, with the reason
stopped      ended early, with the cause
garbage      anything else: a run that calls itself resolved and is far from the event-driven reference; a coupling that
             changes no energy and has changed it; energy changed without a warning, numbers that are not finite, bodies
             that overlap, damping that returns energy, a crash
===========  ==========================================================================================================

The same settings give the same cells and outcomes, in whatever order and in however many processes they run.
"""

from __future__ import annotations

import statistics
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any, ClassVar

import numpy as np
import tomli_w
from rich.table import Table

from ...bodies.protocol import FmuError
from ...monolithic import event_driven
from ...pictures.diagrams import figure_with
from ...pictures.drawing import BLACK, BLUE, GREEN, ORANGE, SKY, STONE
from ...results.dense import at
from ...results.distance import motion
from ...results.trajectory import Trajectory
from ...run.ledger import EXACT, bounds
from ...run.outcome import RunStopped
from ...run.runner import Simulation
from ...scene import SceneError, scene_from_dict
from ..comparison import PERTURBATION, perturbed
from ..picture import Scale, cells, column
from ..study import Study
from ..tables import Findings, Row, table
from .cells import COUPLINGS, SLICES, UNITS, sampled_cells, scene_dict, slice_cells

#: In the order in which pictures and tables show them; the last must stay empty.
CLASSES = ("conserved", "dissipative", "approximate", "refused", "stopped", "garbage")
#: What a coupling is, and columns of the table.
_NAMES = ("law", "scheme", "degree")
#: Of `CLASSES`; residuals outside are drawn in the colours of the ends.
_COLOURS, _RESIDUALS = (BLUE, SKY, GREEN, STONE, ORANGE, BLACK), (1e-16, 1.0)
#: Quick: the hypercube has so many times fewer cells, each axis of a slice half as many.
_QUICK = 5
#: A run is cut after this many accepted steps: a contact that opens and closes in every macro step.
_MOST_STEPS = 600
#: Bodies may overlap or, joined, part by so much of their motion.
_OVERLAP = 1e-9
#: A coupling that changes no energy, at whatever step, may change it by so much of the largest before it is wrong: what
#: rounding leaves of a gap costs energy where the force of a step is very large.
_GUARANTEED = 1e-6
#: What is resolved may be off by so much of its motion, unless a change of the initial velocity changes the motion by
#: more than so many times as much.
_RESOLVED, _WELL_CONDITIONED = 0.05, 100.0
#: Times at which a resolved cell is compared with the reference, and how long that may take [s].
_COMPARED, _PATIENCE = 60, 60.0
#: Rounding of a sum of energies, of the largest so far.
_SLACK = 1e-10


class Grid(Study):
    """A Latin hypercube over all parameters, and slices through two of them."""

    kind: ClassVar[str] = "stability"
    announced: ClassVar[str] = "{} cells, mostly below a second each; --samples and --resolution set how many"
    parallel: ClassVar[bool] = True

    samples: int = 300
    resolution: int = 6  #: values of each parameter of a slice
    seed: int = 1

    def cases(self) -> dict[str, dict[str, Any]]:
        """Return the cells."""
        samples, resolution = self.samples, self.resolution
        if self.quick:
            samples, resolution = -(-samples // _QUICK), -(-resolution // 2)
        cells = [*sampled_cells(samples, self.seed), *slice_cells(resolution)]
        if not cells:
            raise SceneError("no cells: --samples and --resolution are both 0")
        return {str(number): cell for number, cell in enumerate(cells)}

    def record(self, case: Mapping[str, Any]) -> Row:
        """Run a cell."""
        return run_cell(dict(case))

    def lost(self, cause: str) -> Row:
        """Return the outcome of a cell that crashes."""
        return ended("garbage", f"crashed: {cause}")

    def findings(self, records: Mapping[str, Row]) -> Findings:
        """Count classes; passed if no cell is garbage."""
        bad = {name: record["reason"] for name, record in records.items() if record["kind"] == "garbage"}
        files = {name: f"stability-garbage-{name}.toml" for name in bad}
        garbage = [f"garbage   {files[name]}: {reason}" for name, reason in bad.items()]
        errors = [record["error_motion"] for record in records.values() if record["error_motion"] is not None]
        resolved = sum(record["resolved"] for record in records.values())
        beside = f"{resolved} cells call themselves resolved, {len(errors)} were compared with the reference"
        if errors:
            beside += f": errors {statistics.median(errors):.0e} in the median, at most {max(errors):.0e}"
        classes = Counter(record["kind"] for record in records.values())
        told = {"cells": len(records), "classes": classes, "resolved": resolved, "compared": len(errors)}
        cells, rows = self.cases(), self.rows(records)
        slices = any(row["slice"] for row in rows)
        return Findings(
            {**told, "garbage": bad},
            [_classes(rows), beside, *garbage],
            code=1 if bad else 0,
            tables={self.kind: [row | dict(zip(_NAMES, row.pop("coupling"), strict=True)) for row in map(dict, rows)]},
            texts={file: tomli_w.dumps(scene_dict(cells[name])) for name, file in files.items()},
            pictures={f"stability-{what}": partial(_drawn, rows, what) for what in ("classes", "residuals") if slices},
        )


def _classes(rows: Sequence[Row]) -> Table:
    """Return a row per coupling, with the largest residual of the runs that were done."""
    shown = []
    for coupling in (*COUPLINGS, None):
        mine = [row for row in rows if coupling in (row["coupling"], None)]
        counts = Counter(row["kind"] for row in mine)
        done = [row["residual"] or 0.0 for row in mine if row["kind"] not in ("refused", "stopped")]
        name = "all" if coupling is None else " ".join(map(str, coupling)).removeprefix("transmission ")
        shown.append((name, *(counts[kind] or None for kind in CLASSES), max(done, default=None)))
    names = ("coupling", *(f"{kind[:4]}.:" for kind in CLASSES), "residual:.0e")
    return table(names, shown, f"{len(rows)} cells")


def _drawn(rows: Sequence[Row], what: str) -> Any:
    """Draw maps of the slices: ``classes`` of the cells, or their energy ``residuals``."""
    from matplotlib.colors import ListedColormap, LogNorm

    look: dict[str, Any] = {"cmap": ListedColormap(_COLOURS), "vmin": -0.5, "vmax": len(CLASSES) - 0.5}
    if what == "residuals":
        look = {"cmap": "cividis", "norm": LogNorm(*_RESIDUALS, clip=True)}
    names = [name for name in SLICES if any(row["slice"] == name for row in rows)]
    figure, axes = figure_with(len(names), 4, (4.2, 3.6), f"Slices through the extremes: {what}")
    for ax, name in zip(axes, names, strict=True):
        mine = [row for row in rows if row["slice"] == name]
        x, y = (Scale(key, f"{key} [{UNITS.get(key, '–')}]", words=True) for key in SLICES[name][:2])
        values = np.array([CLASSES.index(row["kind"]) for row in mine], dtype=float)
        if what == "residuals":
            values = np.maximum(column(mine, "residual"), _RESIDUALS[0])
        drawn = cells(ax, mine, x, y, values, **look)
        ax.set(title=name, facecolor=STONE)  # where nothing was run
        ax.tick_params(labelsize="small")
        ax.tick_params(axis="x", labelrotation=30)
    bar = figure.colorbar(drawn, ax=axes, shrink=0.6)
    if what == "classes":
        bar.set_ticks(range(len(CLASSES)), labels=CLASSES)
    else:
        bar.set_label("largest energy residual / largest energy so far (grey: refused)")
    return figure


# -- how a cell ends --------------------------------------------------------------------------------------------------


def ended(kind: str, reason: str = "") -> Row:
    """Return the record of a cell that ended as one of `CLASSES`.

    ``reason``: refused, stopped, garbage: why; approximate: the run's warnings. ``residual``: the largest energy
    residual over the largest energy until then; ``overlap`` of bodies, or the gap of joined ones, over the largest
    motion; ``resolved``: whether the run calls itself so; ``error_motion`` of u_tip and y beside the reference, over
    their largest changes, of what is resolved and well-conditioned.
    """
    told: Row = dict.fromkeys(("residual", "overlap", "error_motion"))
    return {"kind": kind, "reason": " ".join(reason.split()), **told, "resolved": False, "macro_steps": 0, "events": 0}


def run_cell(cell: dict[str, Any]) -> Row:
    """Run a cell and return how it ended."""
    cause = ""
    try:
        simulation = Simulation(scene_from_dict(scene_dict(cell), source="cell"))
    except (SceneError, FmuError) as error:
        return ended("refused", str(error))
    with simulation:
        try:
            for _ in range(_MOST_STEPS):
                if not simulation.step():
                    break
            found = simulation.run  # where the last steps are checked
        except RunStopped as stopped:
            cause, found = stopped.cause, simulation.run
    if "traceback" in found.summary:  # an error that nobody foresaw
        return ended("garbage", f"crashed: {cause}")
    outcome = judged(found, cause)
    if outcome["resolved"] and outcome["kind"] not in ("stopped", "garbage"):
        outcome["error_motion"] = off = _error(found)
        if off is not None and off > _RESOLVED:
            why = f"calls itself resolved, and is {off:.1e} of its motion off the reference"
            outcome |= {"kind": "garbage", "reason": why}
    return outcome


def _error(run: Trajectory) -> float | None:
    """Return the error of ``run``; ``None`` without a reference, or if it is large and the motion ill-conditioned."""
    scene, end = run.scene, float(run.time[-1])
    times = np.linspace(float(run.time[0]), end, _COMPARED)
    options: dict[str, Any] = {"sample_times": times, "t_end": end, "time_limit": _PATIENCE}
    try:
        exact = event_driven.simulate(scene, **options)
        error = motion(at(run, exact.time).columns, exact.columns)
        if error <= _RESOLVED:
            return error
        few = _WELL_CONDITIONED * PERTURBATION
        if any(motion(moved.columns, exact.columns) > few for moved in perturbed(scene, **options)):
            return None
    except (ValueError, event_driven.ReferenceFailure):
        return None
    return error


def judged(run: Trajectory, cause: str = "") -> Row:
    """Return the class of a run that is done, or has stopped for ``cause``, from what it recorded."""
    counts = {name: run.summary[name] for name in ("macro_steps", "events")}
    if len(run.time) == 0:
        return ended("stopped", cause) | counts
    # The scale is the largest energy so far [J], as in `springbeam.run.ledger.errors`.
    stored = {name: np.abs(run[name]) for name in ("e_beam", "e_spring", "e_contact") if name in run.columns}
    if run.scene.spring is not None:
        stored["e_spring"] = np.maximum(stored["e_spring"], 0.5 * run.scene.spring.mass * run.z**2)
    mechanical = sum(stored.values())
    scale, overlap = np.maximum.accumulate(np.maximum(mechanical, abs(run.e_total[0]))), _overlap(run)
    relative = np.divide(run.energy_residual, scale, out=np.zeros_like(scale), where=scale > 0.0)
    measured = {"residual": float(np.abs(relative).max()), "overlap": overlap}
    resolved = {"resolved": bool(run.summary["resolved"])}
    return ended(*_class(run, cause, relative, scale, overlap)) | counts | measured | resolved


def _class(run: Trajectory, cause: str, relative: np.ndarray, scale: np.ndarray, overlap: float) -> tuple[str, str]:
    """Return the class of a run and why, by its relative residuals, the scale of its energy and its overlap."""
    scene = run.scene
    residual = float(np.abs(relative).max())
    keeps = scene.coupling.scheme == "energy"
    if keeps and residual > _GUARANTEED:
        return "garbage", f"energy residual {residual:.1e} of a coupling that changes none; {cause}"
    if cause:
        return "stopped", cause
    if faults := list(_faults(run, overlap, scale)):
        return "garbage", "; ".join(faults)
    if residual <= EXACT:
        lost = run.e_dissipated[-1] + run.e_impact_loss[-1]
        return "dissipative" if lost > EXACT * scale[-1] else "conserved", ""
    said = [text for text in run.summary["warnings"] if "energy" in text]
    tolerance = max(scene.coupling.tolerance, 0.0 if scene.spring is None else scene.spring.relative_tolerance)
    if said or residual <= bounds(tolerance, exchanges=not keeps)[0]:
        return "approximate", "; ".join(said)
    return "garbage", f"energy residual {residual:.1e}, and nothing says so"


def _faults(run: Trajectory, overlap: float, scale: np.ndarray) -> Iterator[str]:
    """Yield what must not be, whatever the scene."""
    for name, values in run.columns.items():
        if name != "phase" and not np.all(np.isfinite(values)):
            yield f"{name} is not finite"
    lost = {"damping": run.e_dissipated, "impacts": run.e_impact_loss}
    for what, energy in lost.items():
        change = np.diff(energy)
        if np.any(change < -_SLACK * scale[1:]):
            yield f"energy lost by {what} comes back: {change.min() / scale[-1]:.1e} of the largest"
    if overlap > _OVERLAP:
        yield f"the bodies overlap or part by {overlap:.1e} of their motion"


def _overlap(run: Trajectory) -> float:
    """Return the largest overlap of bodies that may not, over the largest deflection or motion in a step."""
    scene, overlaps = run.scene, [0.0]
    positions = [run[name] for name in ("u_tip", "y") if name in run.columns]
    if run.shapes is not None and len(run.shapes[0]):
        positions.append(run.shapes[1])  # the tip is as exact as the largest deflection, however little it moves
    speeds = [run[name] for name in ("v_tip", "z") if name in run.columns]
    motion, moved = (max(float(np.abs(values).max()) for values in several) for several in (positions, speeds))
    motion += scene.coupling.H * moved
    if scene.contact.rigid and scene.coupled:
        joined, free = np.isin(run.phase, ("tied", "touch")), run.phase == "free"
        overlaps += [np.abs(run.gap[joined]).max(initial=0.0), np.max(-run.gap[free], initial=0.0)]
    if scene.stop is not None and not scene.elastic_stop:
        overlaps.append(np.max(scene.stop.position - (run.y if "y" in run.columns else run.u_tip)))
    return float(max(overlaps)) / motion if motion > 0.0 else 0.0
