"""Spectra in one picture: shock, power, and the points of a driven motion; and a run beside what was measured."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from .drawing import BLACK, BLUE, GREEN, ORANGE, PURPLE, VERMILLION
from .timeline import DPI, STYLE, TITLE_WIDTH, WIDTH

_COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, BLACK)
#: Power below this share of the highest line is not drawn.
_FLOOR = 1e-12


def draw(
    shock: Mapping[str, tuple[np.ndarray, np.ndarray]],
    power: Mapping[str, tuple[np.ndarray, np.ndarray]],
    responses: Mapping[str, tuple[np.ndarray, np.ndarray]],
    points: np.ndarray | None,
    title: str,
    path: Path,
) -> None:
    """Draw to ``path``.

    Parameters
    ----------
    shock, power, responses
        Frequencies [Hz] and values by name, shapes (n,): accelerations [m/s²], power densities, half ranges.
    points
        Position [m] and velocity [m/s] once a period, shape (n, 2).
    """
    dots = {"linestyle": "none", "marker": ".", "markersize": 3.0}
    position, velocity = "position once a period of the drive [m]", "velocity [m/s]"
    groups: list[tuple[Mapping[str, Any], str, str, bool, dict[str, Any]]] = [
        (shock, "frequency [Hz]", "largest acceleration [m/s²]", True, {}),
        (power, "frequency [Hz]", "power density [unit²/Hz]", True, {}),
        (responses, "frequency of the chirp [Hz]", "half the range [unit]", False, {}),
        ({} if points is None else {"points": points.T}, position, velocity, False, dots),
    ]
    groups = [group for group in groups if group[0]]
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH, 0.6 + 2.4 * len(groups)), layout="constrained")
        axes = figure.subplots(len(groups), 1, squeeze=False)[:, 0]
        for ax, (curves, across, up, logarithmic, look) in zip(axes, groups, strict=True):
            for k, (name, (x, y)) in enumerate(curves.items()):
                seen = y > _FLOOR * y.max(initial=0.0) if logarithmic else slice(None)
                dashes = {"dashes": (4, k)} if logarithmic and k else {}
                ax.plot(x[seen], y[seen], color=_COLOURS[k % len(_COLOURS)], label=name, **look, **dashes)
            scale = "log" if logarithmic else "linear"
            ax.set(xlabel=across, ylabel=up, xscale=scale, yscale=scale)
            ax.legend()
            ax.grid(alpha=0.3)
        figure.suptitle(textwrap.fill(title, TITLE_WIDTH), fontsize=10.0, x=0.01, ha="left")
        figure.savefig(path, dpi=DPI)


def draw_measured(time: np.ndarray, curves: Mapping[str, tuple[np.ndarray, np.ndarray]], path: Path) -> None:
    """Draw what a run gives beside what was measured, by name, at ``time`` [s]; shapes (n,)."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH, 0.6 + 2.0 * len(curves)), layout="constrained")
        axes = figure.subplots(len(curves), 1, sharex=True, squeeze=False)[:, 0]
        for ax, (name, (ours, theirs)) in zip(axes, curves.items(), strict=True):
            ax.plot(time, theirs, ".", color=BLACK, markersize=2.5, label="measured")
            ax.plot(time, ours, color=BLUE, label="run")
            ax.set_ylabel(name)
            ax.legend()
        axes[-1].set_xlabel("time t [s]")
        figure.savefig(path, dpi=DPI)
