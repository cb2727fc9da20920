"""Convergence of a run with the beam's mesh and with the modes kept: what of a result is the model's, not the beam's.

A macro step, a scheme, an accuracy say how well the equations of one mesh are solved. This study changes the mesh, and
shows how fast each quantity settles (Richardson 1911, Roache 1994).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any, ClassVar

from matplotlib.figure import Figure
from rich.text import Text

from ..pictures.drawing import BLACK
from ..run.outcome import RunStopped
from ..scene import Scene, SceneError, with_changes
from ..scene.tables import STEP_KEY, TOLERANCE_KEYS
from .accuracy import simulate
from .study import Findings, Record, Study
from .sweep.metrics import METRICS, heading
from .tables import number, table, write_csv

#: Quantities that are compared unless others are asked for, those that a scene has.
QUANTITIES = (
    *("u_tip_end", "u_tip_min", "y_end", "y_min", "contact_force_max", "contact_impulse", "contact_duration"),
    *("rebound_velocity", "first_impact", "first_stop_impact", "first_release", "first_separation"),
)
#: Factor from one level to the next.
RATIO = 2
#: Values that converge more slowly have no limit that one would trust.
_LEAST_ORDER = 0.5
#: Changes below this part of the value are rounding.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class Mesh:
    """What a run differs in."""

    n_elements: int
    n_modes: int  #: kept; 0: all
    finer_steps: bool = False  #: what the time steps change

    @property
    def name(self) -> str:
        return f"{self.n_elements} elements, {self.n_modes or 'all'} modes{', finer steps' * self.finer_steps}"


@dataclass(frozen=True)
class Refinement:
    """Runs whose mesh is finer by `RATIO` from one to the next."""

    refined: str  #: ``elements`` or ``modes``
    levels: list[Record]

    def settled(self, quantity: str) -> Settled:
        """Judge ``quantity`` by its last three values."""
        values = [level["values"].get(quantity) for level in self.levels]
        return settled([value for value in values if value is not None]) if None not in values[-3:] else Settled()


@dataclass(frozen=True)
class Settled:
    """How a quantity converges; ``None`` where its values do not say."""

    change: float | None = None  #: from the last level but one to the last
    order: float | None = None  #: observed, in the size of the mesh
    limit: float | None = None  #: extrapolated to an infinitely fine mesh
    error: float | None = None  #: of the last level, from the limit


def settled(values: Sequence[float]) -> Settled:
    """Return the observed order and the limit of the last three of ``values``, at meshes finer by `RATIO` each.

    With the changes e₁ and e₂ the order is log(e₁/e₂)/log(RATIO), and the limit is e₂/(RATIO^order − 1) further on.
    Values that do not approach anything monotonically have neither.
    """
    if len(values) < 2:
        return Settled()
    change = values[-1] - values[-2]
    if abs(change) <= _ROUNDING * abs(values[-1]):
        return Settled(change, None, values[-1], 0.0)
    before = values[-2] - values[-3] if len(values) > 2 else 0.0
    if before * change <= 0.0 or abs(change) * RATIO**_LEAST_ORDER > abs(before):
        return Settled(change)
    order = math.log(before / change) / math.log(RATIO)
    rest = change / (RATIO**order - 1.0)
    return Settled(change, order, values[-1] + rest, abs(rest))


class Converge(Study):
    """A scene on finer and finer meshes, and with more and more modes of its own mesh."""

    kind: ClassVar[str] = "converge"
    files: ClassVar[tuple[str, ...]] = ("converge.csv", "converge.png")

    scene: Scene
    levels: int = 4  #: of each sequence: n, 2n, 4n, … elements; modes by halves down from those that the scene keeps
    metric: tuple[str, ...] = ()  #: those of `QUANTITIES` that the scene has if there are none

    def sequences(self) -> dict[str, list[Mesh]]:
        """Return the meshes by what is refined.

        Raises
        ------
        SceneError
            If the scene has no beam with a mesh, or a quantity is unknown.
        """
        beam = self.scene.beam
        if beam is None:
            raise SceneError("[beam]: the scene has no mesh to refine")
        if beam.fidelity == "quasi_static":
            raise SceneError('beam.fidelity = "quasi_static": a beam without inertia has no mesh to refine')
        if unknown := [name for name in self.metric if name not in METRICS]:
            raise SceneError(f"{unknown[0]}: no such metric; there are {', '.join(METRICS)}")
        levels = 3 if self.quick else self.levels
        more = [RATIO**k for k in range(levels)]
        found = {"elements": [Mesh(beam.n_elements * k, beam.n_modes) for k in more]}
        if beam.integrator == "modal" and beam.modes_kept >= more[-1]:
            fewer = [Mesh(beam.n_elements, beam.modes_kept // k) for k in more[:0:-1]]
            found["modes"] = [*fewer, found["elements"][0]]
        return found

    def cases(self) -> dict[str, Mesh]:
        """Return all meshes, the finest one with finer steps too."""
        sequences = self.sequences()
        finest = next(iter(sequences.values()))[-1]
        meshes = [mesh for sequence in sequences.values() for mesh in sequence]
        return {mesh.name: mesh for mesh in [*meshes, replace(finest, finer_steps=True)]}

    def record(self, case: Mesh) -> Record:
        """Run one mesh. ``unknowns`` are the modes that take part; a value is ``None`` where it did not happen."""
        mesh = {"n_elements": case.n_elements, "n_modes": case.n_modes}
        scene = with_changes(self.scene, beam=mesh)
        if case.finer_steps:
            scene = _with_finer_steps(scene)
        assert scene.beam is not None
        quantities, cause, began = self.metric or QUANTITIES, "", perf_counter()
        try:
            made = simulate(scene)
            values = {name: METRICS[name](made) for name in quantities}
        except (RunStopped, SceneError) as stopped:  # a SceneError if the accuracy cannot be reached
            values, cause = dict.fromkeys(quantities), str(stopped)
        mesh["unknowns"] = scene.beam.modes_kept
        return {**mesh, "values": values, "seconds": perf_counter() - began, "cause": cause}

    def refinements(self, records: Mapping[str, Record]) -> list[Refinement]:
        """Return the sequences as they were run."""
        return [
            Refinement(refined, [records[mesh.name] for mesh in meshes]) for refined, meshes in self.sequences().items()
        ]

    def quantities(self, records: Mapping[str, Record]) -> list[str]:
        """Return what is compared: what was asked for, or what the scene has."""
        given = next(iter(records.values()))["values"]
        return [name for name, value in given.items() if self.metric or value is not None]

    def findings(self, records: Mapping[str, Record]) -> Findings:
        """Judge how the quantities settle."""
        quantities, by_steps = self.quantities(records), list(records.values())[-1]
        document: dict[str, Any] = {"finer_steps": by_steps}
        shown: list[Any] = [Text(self.scene.title or "(untitled scene)", style="bold")]
        refinements = self.refinements(records)
        for refinement in refinements:
            settled = {name: asdict(refinement.settled(name)) for name in quantities}
            document[refinement.refined] = {"levels": refinement.levels, "settled": settled}
            rows = [_row(name, refinement, refinements[0].levels, by_steps) for name in quantities]
            names = ("", "as given", "extrapolated", "error", "order", "by steps")
            shown.append(table(names, rows, f"more {refinement.refined}"))
            meshes = ("{n_elements} el. {unknowns} modes {seconds:.2g} s".format(**x) for x in refinement.levels)
            shown.append(Text(f"runs      {', '.join(meshes)}"))
        shown += [Text(f"stopped   {name}: {r['cause']}") for name, r in records.items() if r["cause"]]
        shown.append("error: of the run as given; in brackets the last change, where the values show no limit")
        shown.append(
            "by steps: what half the macro step, or a tenth of accuracy or tolerances, changes on the finest mesh"
        )
        return Findings(document, shown)

    def write(self, records: Mapping[str, Record], directory: Path, *, pictures: bool) -> list[Path]:
        """Write a row per run, and draw how far each quantity is from its limit."""
        quantities, refinements = self.quantities(records), self.refinements(records)
        levels = [(sequence.refined, level) for sequence in refinements for level in sequence.levels]
        levels.append(("steps", list(records.values())[-1]))
        rows = [
            {"refined": refined, **{name: level[name] for name in ("n_elements", "n_modes", "unknowns")}}
            | {"wall_time": level["seconds"], **{name: level["values"][name] for name in quantities}}
            | {"stopped": level["cause"]}
            for refined, level in levels
        ]
        files = [write_csv(directory / "converge.csv", rows)]
        if pictures:
            files.append(draw(self.scene.title, refinements, quantities, directory / "converge.png"))
        return files


def _with_finer_steps(scene: Scene) -> Scene:
    """Return ``scene`` with half the macro step, or with a tenth of what its steps follow from."""
    if scene.accuracy is not None:
        return with_changes(scene, accuracy=0.1 * scene.accuracy)
    if not scene.coupling.adaptive:
        return with_changes(scene, coupling={STEP_KEY: 0.5 * scene.coupling.H})
    given = {name: getattr(scene.coupling, name) for name in TOLERANCE_KEYS}
    return with_changes(scene, coupling={name: 0.1 * value for name, value in given.items() if value is not None})


def _row(name: str, refinement: Refinement, elements: Sequence[Record], by_steps: Record) -> tuple[str, ...]:
    """Return a quantity for a terminal: of the mesh as given, and where finer ones or more modes lead."""
    given, last, finer = (level["values"][name] for level in (elements[0], elements[-1], by_steps))
    settled = refinement.settled(name)
    error = "" if settled.change is None else f"({settled.change:.1e})"
    if given is not None and settled.limit is not None:
        error = f"{given - settled.limit:.1e}"
    return (
        heading(name),
        number(given, ".6g"),
        number(settled.limit, ".6g"),
        error,
        number(settled.order, ".1f"),
        "" if last is None or finer is None else f"{finer - last:.1e}",
    )


def draw(title: str, sequences: Sequence[Refinement], quantities: Sequence[str], path: Path) -> Path:
    """Draw to ``path`` how far each quantity is from its limit over the size of the mesh, a panel a sequence."""
    figure = Figure(figsize=(6.0 * len(sequences), 5.0), layout="constrained")
    for ax, sequence in zip(figure.subplots(1, len(sequences), squeeze=False).flat, sequences, strict=True):
        for name, sizes, errors in _errors(sequence, quantities):
            ax.loglog(sizes, errors, ".-", label=name)
        ax.set(xlabel=f"{sequence.refined} of the beam", title=f"more {sequence.refined}")
        sizes = [_size(sequence, level) for level in sequence.levels]
        ax.set_xticks(sizes, list(map(str, sizes)))
        ax.minorticks_off()
        ax.set_ylabel("distance from the extrapolated value, relative")
        ax.grid(alpha=0.3)
        if ax.lines:
            ax.legend(fontsize="small")
        else:
            ax.text(0.5, 0.5, "no quantity converges monotonically", transform=ax.transAxes, ha="center", color=BLACK)
    figure.suptitle(f"{title}: convergence with the mesh")
    figure.savefig(path, dpi=110)
    return path


def _errors(sequence: Refinement, quantities: Sequence[str]) -> Iterator[tuple[str, list[int], list[float]]]:
    for name in quantities:
        limit = sequence.settled(name).limit
        if not limit:
            continue
        points = [
            (_size(sequence, level), abs(value / limit - 1.0))
            for level in sequence.levels
            if (value := level["values"][name]) is not None and abs(value / limit - 1.0) > _ROUNDING
        ]
        if points:
            sizes, errors = zip(*points, strict=True)
            yield heading(name), list(sizes), list(errors)


def _size(sequence: Refinement, level: Record) -> int:
    return int(level["n_elements" if sequence.refined == "elements" else "unknowns"])
