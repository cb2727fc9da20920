"""Convergence of a run with the beam's mesh and with the modes kept: what of a result is the model's, not the beam's.

A macro step, a scheme, an accuracy say how well the equations of one mesh are solved. This study changes the mesh, and
shows how fast each quantity settles (Richardson 1911, Roache 1994).
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import matplotlib.pyplot as plt

from ..pictures.drawing import BLACK
from ..run.outcome import RunStopped
from ..scene import Scene, SceneError, with_changes
from .accuracy import simulate
from .sweep.metrics import METRICS, heading

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
class Level:
    """A run of one mesh."""

    n_elements: int
    n_modes: int  #: kept; 0: all
    unknowns: int  #: modes that take part
    values: dict[str, float | None]  #: by quantity; ``None`` where it did not happen
    seconds: float  #: wall time
    cause: str = ""  #: why it stopped early


@dataclass(frozen=True)
class Refinement:
    """Runs whose mesh is finer by `RATIO` from one to the next."""

    refined: str  #: ``elements`` or ``modes``
    levels: list[Level]

    def settled(self, quantity: str) -> Settled:
        """Judge ``quantity`` by its last three values."""
        values = [level.values.get(quantity) for level in self.levels]
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


@dataclass(frozen=True)
class Study:
    """What `study` found."""

    scene: Scene
    quantities: tuple[str, ...]
    sequences: list[Refinement]
    halved: Level  #: the finest mesh with half the macro step: what the time steps change

    @property
    def as_given(self) -> Level:
        """Return the run of the scene's own mesh."""
        return self.sequences[0].levels[0]


#: ``progress(what)`` before each run.
Progress = Callable[[str], None]


def study(
    scene: Scene, levels: int = 4, quantities: Sequence[str] = (), progress: Progress = lambda what: None
) -> Study:
    """Run ``scene`` on finer and finer meshes, and with more and more modes of its own mesh.

    Parameters
    ----------
    levels
        Runs of each sequence, at least 3: n, 2n, 4n, … elements; modes by halves down from those that the scene keeps.
    quantities
        Names of `METRICS`; those of `QUANTITIES` that the scene has if there are none.

    Raises
    ------
    SceneError
        If the scene has no beam with a mesh, or a quantity is unknown.
    """
    if scene.beam is None or scene.beam.fidelity == "quasi_static":
        raise SceneError("[beam]: the scene has no mesh to refine" if scene.beam is None else
                         'beam.fidelity = "quasi_static": a beam without inertia has no mesh to refine')  # fmt: skip
    if unknown := [name for name in quantities if name not in METRICS]:
        raise SceneError(f"{unknown[0]}: no such metric; there are {', '.join(METRICS)}")
    wanted = tuple(quantities) or QUANTITIES

    beam = scene.beam
    exact = beam.mesh == "none"

    def run(elements: int, modes: int, what: Scene = scene) -> Level:
        progress(f"{elements} elements, {modes or 'all'} modes")
        mesh = {} if exact else {"n_elements": elements}
        return _level(with_changes(what, beam={**mesh, "n_modes": modes}), wanted)

    more = [RATIO**k for k in range(levels)]
    by_elements = [run(0, beam.n_modes * k) if exact else run(beam.n_elements * k, beam.n_modes) for k in more]
    sequences = [Refinement("modes" if exact else "elements", by_elements)]
    most = 0 if exact else beam.modes_kept
    if beam.integrator == "modal" and most >= RATIO ** (levels - 1):
        kept = [run(beam.n_elements, most // RATIO**k) for k in range(levels - 1, 0, -1)]
        sequences.append(Refinement("modes", [*kept, by_elements[0]]))
    finest = by_elements[-1]
    finer = with_changes(scene, coupling={"macro_step": 0.5 * scene.coupling.H}) if scene.accuracy is None else scene
    halved = run(finest.n_elements, finest.n_modes, finer)
    found = tuple(name for name in wanted if name in quantities or by_elements[0].values[name] is not None)
    return Study(scene, found, sequences, halved)


def _level(scene: Scene, quantities: Sequence[str]) -> Level:
    assert scene.beam is not None
    mesh = (0 if scene.beam.mesh == "none" else scene.beam.n_elements, scene.beam.n_modes, scene.beam.modes_kept)
    began = perf_counter()
    try:
        made = simulate(scene)
    except RunStopped as stopped:
        return Level(*mesh, dict.fromkeys(quantities), perf_counter() - began, stopped.cause)
    return Level(*mesh, {name: METRICS[name](made) for name in quantities}, perf_counter() - began)


def write_csv(found: Study, path: Path) -> None:
    """Write a row per run."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(("refined", "n_elements", "n_modes", "unknowns", "wall_time", *found.quantities, "stopped"))
        levels = [(s.refined, level) for s in found.sequences for level in s.levels]
        for refined, level in [*levels, ("macro step halved", found.halved)]:
            mesh = (refined, level.n_elements, level.n_modes, level.unknowns, level.seconds)
            writer.writerow((*mesh, *(level.values[name] for name in found.quantities), level.cause))


def draw(found: Study, path: Path) -> None:
    """Draw to ``path`` how far each quantity is from its limit over the size of the mesh, a panel a sequence."""
    figure, panels = plt.subplots(
        1, len(found.sequences), figsize=(6.0 * len(found.sequences), 5.0), squeeze=False, layout="constrained"
    )
    for ax, sequence in zip(panels.flat, found.sequences, strict=True):
        for name, sizes, errors in _errors(found, sequence):
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
    figure.suptitle(f"{found.scene.title}: convergence with the mesh")
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _errors(found: Study, sequence: Refinement) -> Iterator[tuple[str, list[int], list[float]]]:
    for name in found.quantities:
        limit = sequence.settled(name).limit
        if not limit:
            continue
        points = [
            (_size(sequence, level), abs(value / limit - 1.0))
            for level in sequence.levels
            if (value := level.values[name]) is not None and abs(value / limit - 1.0) > _ROUNDING
        ]
        if points:
            sizes, errors = zip(*points, strict=True)
            yield heading(name), list(sizes), list(errors)


def _size(sequence: Refinement, level: Level) -> int:
    return level.n_elements if sequence.refined == "elements" else level.unknowns
