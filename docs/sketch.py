"""Draws the sketch of README.md and model.md, beam, spring and stop with their symbols: python docs/sketch.py"""

from __future__ import annotations

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from pages import IMAGES  # beside this script

from springbeam.pictures.drawing import BLACK, BLUE, GREY, VERMILLION

#: Lengths of the sketch: tip, its deflection, top at the start and now, foundation, ground; half widths of the mass.
LENGTH, SUNK, START, TOP, FLOOR, GROUND = 7.0, -1.3, -1.0, -1.5, -2.6, -4.3
HALF, THICK, MASS = 0.55, 0.13, 0.45


def ground(ax: Axes, x0: float, x1: float, y: float) -> None:
    ax.plot([x0, x1], [y, y], color=BLACK, lw=2.0)
    for x in np.arange(x0 + 0.2, x1 + 0.05, 0.2):
        ax.plot([x, x - 0.2], [y, y - 0.2], color=GREY, lw=0.8)


def arrow(ax: Axes, x: float, y0: float, y1: float, colour: str, width: float = 1.3) -> None:
    ax.annotate("", (x, y1), (x, y0), arrowprops={"arrowstyle": "-|>", "color": colour, "lw": width})


def beam(ax: Axes) -> None:
    ax.plot([0.0, 0.0], [-0.8, 0.8], color=BLACK, lw=2.0)
    for y in np.arange(-0.7, 0.85, 0.2):
        ax.plot([0.0, -0.2], [y, y - 0.2], color=GREY, lw=0.8)
    s = np.linspace(0.0, 1.0, 60)
    sag = 0.5 * SUNK * s**2 * (3.0 - s)
    ax.fill_between(LENGTH * s, sag - THICK, sag + THICK, facecolor=BLUE, alpha=0.3, edgecolor=BLUE)
    ax.plot([0.0, LENGTH + 1.0], [0.0, 0.0], color=GREY, lw=0.8, ls="--")
    arrow(ax, 4.2, 0.0, 0.5 * SUNK * 0.6**2 * 2.4 + THICK, BLUE)
    ax.text(4.35, -0.3, "u(t, x)", color=BLUE)
    ax.text(0.1, 0.25, "x = 0")
    ax.text(LENGTH, 0.2, "x = L", ha="center")
    ax.text(1.2, -1.2, "beam: ρ, A, I, E, G, K, α_b", color=BLUE)
    arrow(ax, LENGTH - 0.9, SUNK - 1.1, SUNK - 0.0, VERMILLION, 2.0)
    ax.text(LENGTH - 1.05, SUNK - 0.95, "C", color=VERMILLION, ha="right")


def spring(ax: Axes) -> None:
    x = LENGTH
    ax.add_patch(matplotlib.patches.Rectangle((x - HALF, TOP - MASS), 2 * HALF, MASS, facecolor=VERMILLION, alpha=0.3))
    ax.text(x, TOP - 0.5 * MASS, "m", color=VERMILLION, ha="center", va="center")
    turns = np.linspace(TOP - MASS - 0.3, GROUND + 0.3, 12)
    side = x - 0.25 + np.r_[0.0, 0.18 * (-1.0) ** np.arange(10), 0.0]
    ax.plot([side[0], *side, side[-1]], [TOP - MASS, *turns, GROUND], color=VERMILLION, lw=1.3)
    damper = x + 0.3
    ax.plot([damper, damper], [TOP - MASS, -3.1], color=VERMILLION, lw=1.3)
    ax.plot([damper - 0.13, damper + 0.13], [-3.1, -3.1], color=VERMILLION, lw=1.3)
    ax.plot(damper + np.array([-0.2, -0.2, 0.2, 0.2]), [-2.8, -3.4, -3.4, -2.8], color=VERMILLION, lw=1.3)
    ax.plot([damper, damper], [-3.4, GROUND], color=VERMILLION, lw=1.3)
    ax.text(x - 0.65, -3.2, "k1, k2", color=VERMILLION, ha="right")
    ax.text(damper + 0.3, -3.5, "α_s", color=VERMILLION)
    ground(ax, x - 0.9, x + 0.9, GROUND)
    ax.plot([x - 0.9, x + 1.0], [START, START], color=GREY, lw=0.8, ls="--")
    ax.text(x + 1.1, START, "Ψ: the top at the start", color=GREY, va="center")
    arrow(ax, x + 0.75, 0.0, TOP, VERMILLION)
    ax.text(x + 0.87, 0.35 * TOP, "y", color=VERMILLION, va="center")
    ground(ax, x + 0.45, x + 1.3, FLOOR)
    ax.text(x + 1.4, FLOOR, "φ: foundation, y ≥ φ", va="center")
    arrow(ax, x + 1.1, FLOOR, FLOOR + 0.7, BLACK, 2.0)
    ax.text(x + 1.22, FLOOR + 0.45, "N")


def drawn() -> Figure:
    figure = Figure(figsize=(7.0, 3.6))
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    beam(ax)
    spring(ax)
    arrow(ax, 0.1, -3.9, -3.1, BLACK)
    ax.text(0.3, -3.4, "up is positive")
    ax.text(0.3, -3.85, "C > 0 lifts the tip and presses the spring", color=VERMILLION)
    ax.set(xlim=(-0.4, 10.9), ylim=(-4.6, 1.0))
    ax.set_axis_off()
    return figure


if __name__ == "__main__":
    with matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": "sketch", "font.size": 10.0}):
        drawn().savefig(IMAGES / "sketch.svg", metadata={"Date": None})
