"""Work–precision diagrams of a `Study`."""

from __future__ import annotations

from collections.abc import Callable
from itertools import cycle
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.axes import Axes

from ..drawing import BLACK, BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILLION
from . import Point, Study

_COLOURS = (BLUE, SKY, GREEN, ORANGE, VERMILLION, PURPLE)
_MARKERS = ("o", "s", "^", "D", "v", "P", "X")
#: Errors outside are drawn at the edge: nothing is right, or rounding.
_WORST, _BEST = 1e1, 1e-13


def draw(study: Study, path: Path) -> None:
    """Error over wall time, error over doStep calls, and error of the model over its size, as a picture at ``path``."""
    same = [p for p in study.points if not p.configuration.refined and p.errors is not None]
    models = [p for p in study.points if p.configuration.refined and p.errors is not None]
    columns = 3 if models else 2
    figure, axes = plt.subplots(1, columns, figsize=(6.0 * columns, 6.0), layout="constrained")
    _curves(axes[0], same, lambda p: p.solve * 1e3)
    front = study.front()
    axes[0].plot(
        [p.solve * 1e3 for p in front], [_clipped(p) for p in front],
        color=BLACK, linewidth=6.0, alpha=0.15, zorder=0, label="Pareto front",
    )  # fmt: skip
    axes[0].set(xlabel="solve, wall time [ms]", title="coupling and integration, same model")
    axes[0].legend(fontsize="small", ncols=2)
    _curves(axes[1], [p for p in same if not p.configuration.monolithic], lambda p: p.beam_steps + p.spring_steps)
    axes[1].set(xlabel="doStep calls of both FMUs", title="co-simulation, same model")
    if models:
        _curves(axes[2], models, lambda p: p.configuration.unknowns)
        axes[2].set(xlabel="unknowns of the beam (modes kept)", title="the model, beside a finer mesh")
        axes[2].legend(fontsize="small")
    for ax in axes:
        ax.set(xscale="log", yscale="log", ylabel="largest relative error of u_tip and y")
        ax.grid(alpha=0.3)
    figure.suptitle(f"{study.scene.title}: errors up to t = {study.scene.time.t_end:.4g} s")
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _clipped(point: Point) -> float:
    return min(max(point.displacement, _BEST), _WORST)


def _curves(ax: Axes, points: list[Point], cost: Callable[[Point], float]) -> None:
    families = dict.fromkeys(p.configuration.family for p in points)
    for family, colour, marker in zip(families, cycle(_COLOURS), cycle(_MARKERS), strict=False):
        mine = [p for p in points if p.configuration.family == family]
        monolithic = mine[0].configuration.monolithic
        ax.plot(
            [cost(p) for p in mine], [_clipped(p) for p in mine], marker=marker, markersize=5, color=colour,
            linestyle="--" if monolithic else "-", linewidth=1.2, label=family,
            markerfacecolor="none" if monolithic else colour,
        )  # fmt: skip
