"""Figures 2–5 and Table 2 of Ahn & Tate: what is printed, and pictures of several runs of one case below each other."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ..pictures.drawing import BLACK, BLUE, GREEN, VERMILLION, decimated
from ..results.trajectory import Trajectory

#: Table 2 by figure: iterations per solve of (53), and time per step [s]. Its header says "Figure 5" twice; the third
#: column is taken as Figure 4.
TABLE_2 = {2: (1.990, 5.63e-3), 3: (3.010, 5.84e-3), 4: (2.000, 5.90e-3), 5: (2.978, 5.83e-3)}

_STYLE: Any = {
    "font.size": 8.0,
    "axes.titlesize": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-3, 5),
}
_TITLES = ("beam's tip u(t,1) [µm]", "spring's top y [µm]", "velocities [m/s]", "energy [J]")
_KEYS = ((BLUE, "beam, its tip"), (VERMILLION, "spring, its top"), (BLACK, "energy (63)"))
#: A run shorter than this [s] resolves the vibration: lines instead of dots, in µs since first contact.
_RESOLVED = 1e-3


def energy(run: Trajectory) -> np.ndarray:
    """Return the energy (63), with the potential of the loads."""
    return np.asarray(run.e_beam + run.e_spring + run.e_load)


@matplotlib.rc_context(_STYLE)
def draw(number: int, runs: Mapping[str, Trajectory]) -> Figure:
    """Return the picture of the case of Figure ``number``.

    It has a row for each run, named on its left, and columns of the tip, the spring's top, velocities and energy.
    """
    figure = Figure(figsize=(10.5, 2.1 * len(runs)), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(len(runs), len(_TITLES), squeeze=False)
    spring = next(iter(runs.values())).scene.spring
    assert spring is not None
    load = "" if number in (2, 4) else ", load −6 at the tip"
    data = f"k1 = {spring.linear_stiffness:g}, k2 = {spring.cubic_stiffness:g}{load}"
    figure.suptitle(f"Case of Figure {number}: {data}", x=0.01, ha="left", fontsize=11)
    for ax, title in zip(axes[0], _TITLES, strict=True):
        ax.set_title(title)
    for row, (label, run) in zip(axes, runs.items(), strict=True):
        _draw_row(row, run)
        row[0].set_ylabel(label)
    keys = [Line2D([], [], color=colour, lw=2.0, label=label) for colour, label in _KEYS]
    figure.legend(handles=keys, loc="outside upper right", ncols=len(keys), frameon=False)
    return figure


def _draw_row(row: Any, run: Trajectory) -> None:
    resolved = run.time[-1] - run.time[0] < _RESOLVED
    time = 1e6 * (run.time - run.time[0]) if resolved else run.time
    columns: tuple[tuple[tuple[np.ndarray, str], ...], ...] = (
        ((1e6 * run.u_tip, BLUE),),
        ((1e6 * run.y, VERMILLION),),
        ((run.v_tip, BLUE), (run.z, VERMILLION)),
        ((energy(run), BLACK), (run.e_beam, BLUE), (run.e_spring, VERMILLION)),
    )
    for ax, lines in zip(row, columns, strict=True):
        ax.axhline(0.0, color=GREEN, lw=0.6, ls="--", zorder=0)
        for values, colour in lines:
            keep = decimated(time, values, 500)
            total = colour == BLACK
            look: dict[str, Any] = {"lw": 2.4 if total else 0.9}
            if not resolved:  # step to step it alternates: dots
                look = {"ls": "none", "marker": ".", "ms": 5.0 if total else 2.0, "mew": 0.0}
            ax.plot(time[keep], values[keep], color=colour, **look)
        ax.set_xlabel(f"t − {run.time[0]:g} s [µs]" if resolved else "t [s]", labelpad=1.0)
