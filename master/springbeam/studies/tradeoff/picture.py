"""Work–precision diagrams of a tradeoff."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...pictures.drawing import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILLION
from ...scene import Scene
from .points import Point, Points

#: Colour and marker by family; like the scheme, but hollow: dotted with steps from tolerances, dash-dotted with another
#: tolerance of IDA.
_LOOKS = {
    "energy 0": (BLUE, "o"), "energy 1": (SKY, "s"), "energy 2": (GREEN, "^"),
    "hermite 1": (ORANGE, "D"), "hermite 2": (VERMILLION, "v"),
    "auto": (BLACK, "+"),
    "jacobi 0": (ORANGE, "D"), "jacobi 1": (VERMILLION, "v"),
    "gauss_seidel 0": (GREEN, "^"), "gauss_seidel 1": (PURPLE, "P"),
    "DOP853": (GREY, "o"), "LSODA": (GREY, "s"), "Radau": (GREY, "^"), "Algorithm 1": (GREY, "X"),
    "modes": (BLUE, "o"), "elements of degree 1": (SKY, "s"),
    "elements of degree 4": (GREEN, "^"), "elements of degree 8": (VERMILLION, "v"),
}  # fmt: skip
_ADAPTIVE, _IDA = " adaptive", ", IDA "
#: Errors outside are drawn at the edge: nothing is right, or rounding.
_WORST, _BEST = 1.0, 1e-13
_NOTE_WIDTH = 85  #: characters a column of the picture


def draw(scene: Scene, found: Points, notes: Sequence[str], path: Path) -> Path:
    """Draw error over wall time, over doStep calls, and the model's error over its size, to ``path``."""
    same = [p for p in found.points if not p.refined and p.errors is not None]
    models = [p for p in found.points if p.refined and p.errors is not None]
    columns = 3 if models else 2
    figure = Figure(figsize=(6.0 * columns, 6.5), layout="constrained")
    axes = figure.subplots(1, columns)
    _curves(axes[0], same, lambda p: p.solve * 1e3)
    front = found.front()
    axes[0].plot(
        [p.solve * 1e3 for p in front], [_clipped(p) for p in front],
        color=BLACK, linewidth=6.0, alpha=0.15, zorder=0, label="Pareto front",
    )  # fmt: skip
    axes[0].set(xlabel="solve, wall time [ms]", title="coupling and integration, same model")
    _curves(axes[1], [p for p in same if not p.monolithic], lambda p: p.do_steps)
    axes[1].set(xlabel="doStep calls of both FMUs", title="co-simulation, same model")
    if models:
        _curves(axes[2], models, lambda p: p.unknowns)
        axes[2].set(xlabel="unknowns of the beam (modes kept)", title="the model, beside a finer mesh")
        axes[2].legend(fontsize="small")
    for ax in axes:
        ax.set(xscale="log", yscale="log", ylabel="largest relative error of u_tip and y")
        ax.grid(alpha=0.3)
    figure.suptitle(f"{scene.title}: errors up to t = {scene.time.t_end:.6g} s")
    lines = [line for note in notes for line in textwrap.wrap(note, _NOTE_WIDTH * columns)]
    figure.legend(
        *axes[0].get_legend_handles_labels(), loc="outside lower center", fontsize="small", ncols=3 * columns,
        title="\n".join(lines) or None, title_fontsize="small", alignment="left",
    )  # fmt: skip
    figure.savefig(path, dpi=110)
    return path


def _clipped(point: Point) -> float:
    return min(max(point.displacement, _BEST), _WORST)


def _curves(ax: Axes, points: list[Point], cost: Callable[[Point], float]) -> None:
    for family in dict.fromkeys(p.family for p in points):
        mine = [p for p in points if p.family == family]
        colour, marker = _LOOKS[family.removesuffix(_ADAPTIVE).partition(_IDA)[0]]
        line = "-"
        if mine[0].monolithic:
            line = "--"
        elif family.endswith(_ADAPTIVE):
            line = ":"
        elif _IDA in family:
            line = "-."
        hollow = line != "-"
        ax.plot(
            [cost(p) for p in mine], [_clipped(p) for p in mine], marker=marker, markersize=5, color=colour,
            linestyle="none" if family == "auto" else line, linewidth=1.2, label=family,
            markerfacecolor="none" if hollow else colour, zorder=3 if family == "auto" else 2,
        )  # fmt: skip
