"""Spectra in one picture: shock, power, and the points of a driven motion; and a run beside what was measured."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from .drawing import BLACK, BLUE, GREEN, ORANGE, PURPLE, VERMILLION
from .timeline import DPI, STYLE, WIDTH

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
    parts = [bool(shock), bool(power), bool(responses), points is not None]
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH, 0.6 + 2.4 * sum(parts)), layout="constrained")
        axes = iter(figure.subplots(sum(parts), 1, squeeze=False)[:, 0])
        for curves, quantity in ((shock, "largest acceleration [m/s²]"), (power, "power density [unit²/Hz]")):
            if not curves:
                continue
            ax = next(axes)
            for k, (name, (frequency, values)) in enumerate(curves.items()):
                seen = values > _FLOOR * values.max(initial=0.0)
                ax.loglog(
                    frequency[seen],
                    values[seen],
                    color=_COLOURS[k % len(_COLOURS)],
                    dashes=(4, k) if k else (),
                    label=name,
                )
            ax.set(xlabel="frequency [Hz]", ylabel=quantity)
            ax.legend()
            ax.grid(alpha=0.3)
        if responses:
            ax = next(axes)
            for k, (name, (frequency, values)) in enumerate(responses.items()):
                ax.plot(frequency, values, color=_COLOURS[k % len(_COLOURS)], label=name)
            ax.set(xlabel="frequency of the chirp [Hz]", ylabel="half the range [unit]")
            ax.legend()
            ax.grid(alpha=0.3)
        if points is not None:
            ax = next(axes)
            ax.plot(*points.T, ".", color=BLUE, markersize=3.0)
            ax.set(xlabel="position once a period of the drive [m]", ylabel="velocity [m/s]")
            ax.grid(alpha=0.3)
        figure.suptitle(title)
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
