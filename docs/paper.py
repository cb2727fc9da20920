"""The tables and pictures of `master/springbeam/paper/README.md`:  .venv/bin/python docs/paper.py   (minutes)

The tables show what Algorithm 1 gives beside what Ahn & Tate print; each of their functions returns heads and rows.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from pages import IMAGES, table, write_section  # beside this script

from springbeam import Scene, Trajectory, load_scene, simulate, with_changes
from springbeam.paper import co_simulation, monolithic
from springbeam.paper.algorithm import AlgorithmFailure
from springbeam.paper.problem import TABLE_2
from springbeam.pictures.drawing import BLACK, BLUE, GREEN, VERMILLION, decimated

PAGE = "../master/springbeam/paper/README.md"
FIGURES = (2, 3, 4, 5)

Rows = tuple[list[str], list[list[str]]]


@cache
def monolithic_run(number: int) -> Trajectory:
    """Return Figure ``number`` by Algorithm 1 as one system."""
    return monolithic.algorithm_1(load_scene(f"paper-fig{number}"))


@cache
def fmu_run(number: int) -> Trajectory:
    """Return Figure ``number`` by Algorithm 1 through the FMUs."""
    return co_simulation.algorithm_1(load_scene(f"paper-fig{number}"))


def extremes(runs: Mapping[int, Mapping[str, Trajectory]]) -> Rows:
    """Compare positions, velocities and energies of several runs of each figure; ``runs`` are by figure and name."""
    rows = []
    for number, named in runs.items():
        found = named.values()
        rows += [
            [str(number), r"largest \|u_tip\| [µm]", *(f"{1e6 * np.abs(run.u_tip).max():.3f}" for run in found)],
            ["", "y [µm]", *(f"{1e6 * run.y.min():.3f} … {1e6 * run.y.max():.3f}" for run in found)],
            ["", r"largest \|z\| [m/s]", *(f"{np.abs(run.z).max():.3g}" for run in found)],
            ["", "energy (63) [J]", *(f"{energy(run).min():.3f} … {energy(run).max():.3f}" for run in found)],
            ["", "energy residual [J]", *(f"{np.abs(run.energy_residual).max():.1g}" for run in found)],
        ]
    return ["Figure", "", *next(iter(runs.values()))], rows


def table_2() -> Rows:
    """Compare the average number of Newton iterations per solve of (53) with Table 2."""
    heads = ["", *(f"Figure {number}" for number in FIGURES)]
    return heads, [
        ["printed", *(f"{TABLE_2[number][0]:.3f}" for number in FIGURES)],
        ["monolithic", *(f"{monolithic_run(number).summary['iterations_per_solve']:.3f}" for number in FIGURES)],
        ["through the FMUs", *(f"{fmu_run(number).summary['iterations_per_solve']:.3f}" for number in FIGURES)],
    ]


def statements() -> Rows:
    """Measure the statements of section 6 on Figures 2 and 4, as one system."""
    runs = [monolithic_run(number) for number in (2, 4)]
    measures = {
        "steps in which v_tip changes sign": _share_of_sign_changes,
        "successive speeds of the tip differ by at most [m/s]": lambda run: f"{_speed_change(run):.2g}",
        "rows in which the spring top is above Ψ, and above Ψ but below the tip": _rows_above,
        "steps by lines 14–27; by neither line 11 nor 14 (y ≤ Ψ < u)": _steps_by_lines,
        "largest change of z in a step [m/s]": lambda run: f"{np.abs(np.diff(run.z)).max():.2g}",
        "joined steps in which the energy (63) rises": _rising_steps,
        "work of λ_nc(Ψ − u)₊^p, at most [J]": lambda run: f"{_work_of_compliance(run):.1g}",
        "energy that overwriting the tip adds to the beam [J]": lambda run: f"{run.e_injected_beam[-1]:+.4f}",
        "largest N [N]": lambda run: f"{run.foundation_force.max():.3g}",
    }
    return ["", "Figure 2", "Figure 4"], [[name, *map(measure, runs)] for name, measure in measures.items()]


def _share_of_sign_changes(run: Trajectory) -> str:
    return f"{np.mean(run.v_tip[1:] * run.v_tip[:-1] < 0.0):.1%}"


def _speed_change(run: Trajectory) -> float:
    return float(np.abs(run.v_tip[1:] + run.v_tip[:-1]).max())


def _rows_above(run: Trajectory) -> str:
    above = run.y > 0.0
    below_tip = above & (run.y < run.u_tip)
    return f"{above.sum()} of {len(run)}, {below_tip.sum()}"


def _steps_by_lines(run: Trajectory) -> str:
    case = run["case"][1:]
    return f"{np.sum(case == 14)}; {np.sum(case == 0)} of {len(case)}"


def _rising_steps(run: Trajectory) -> str:
    joined = run["case"][1:] == 14
    rising = np.diff(energy(run)) > 1e-12
    return f"{np.sum(joined & rising)} of {joined.sum()}"


def _work_of_compliance(run: Trajectory) -> float:
    return float(np.abs(run.compliance_force[1:] * np.diff(run.u_tip)).sum())


def loads() -> Rows:
    """Show what the load of Figures 3 and 5 changes, and larger multiples of it."""
    scene = load_scene("paper-fig2")
    bare = monolithic_run(2)
    rows = []
    for coefficient in (-6.0, -1.2e4, -6e6, -6e8):
        run = monolithic.algorithm_1(with_changes(scene, beam={"tip_load_coefficient": coefficient}))
        moved = np.abs(run.u_tip - bare.u_tip).max()
        rows.append([f"{coefficient:g}", f"{run.summary['iterations_per_solve']:.3f}", f"{moved:.1e}"])
    return ["load coefficient at the tip", "iterations", "u_tip differs from Figure 2 by at most [m]"], rows


def readings() -> Rows:
    """Compare the readings of what the algorithm leaves open, on Figures 2 and 4."""
    measured = ["iterations", r"largest \|u_tip\| [m]", "largest energy [J]"]
    heads = ["at_contact, y_temp", *(f"Figure {number}: {name}" for number in (2, 4) for name in measured)]
    rows = []
    for at_contact in ("rest", "tip"):
        for y_temp in ("equation", "guess", "both"):
            cells = [_measured(load_scene(f"paper-fig{k}"), at_contact=at_contact, y_temp=y_temp) for k in (2, 4)]
            rows.append([f"{at_contact}, {y_temp}", *cells[0], *cells[1]])
    return heads, rows


def time_steps(sizes: Sequence[float] = (0.02, 0.008, 0.004, 0.002, 0.001)) -> Rows:
    """Show the largest energy [J] of Algorithm 1 by its time step h_t [s]."""
    rows = []
    for number in (2, 4):
        scene = load_scene(f"paper-fig{number}")
        found = [_measured(with_changes(scene, coupling={"macro_step": size})) for size in sizes]
        rows.append([f"Figure {number}", *(cells[-1] for cells in found)])
    return ["h_t", *map(str, sizes)], rows


def _measured(scene: Scene, **choices: Any) -> list[str]:
    """Return iterations, largest displacement of the tip and largest energy, also of a run that breaks down."""
    stop = ""
    try:
        run = monolithic.algorithm_1(scene, **choices)
    except AlgorithmFailure as failure:
        if failure.trajectory is None:
            raise
        run = failure.trajectory
        stop = f", stops at {run.time[-1]:.2f} s"
    iterations = f"{run.summary['iterations_per_solve']:.3f}"
    return [iterations, f"{np.abs(run.u_tip).max():.2g}", f"{energy(run).max():.2g}{stop}"]


# -- pictures

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


# -- the page

TABLES: dict[str, Callable[[], Rows]] = {
    "table-2": table_2,
    "statements": statements,
    "loads": loads,
    "readings": readings,
    "time-steps": time_steps,
}


def treatments(number: int) -> dict[str, Trajectory]:
    """Return the four runs of a figure by name. The resolved one has a macro step below 1/ω of its fastest mode."""
    scene = load_scene(f"paper-fig{number}")
    resolved = with_changes(scene, time={"t_end": 0.5 + 4e-5}, coupling={"macro_step": 1.5e-8})
    return {
        "Algorithm 1, monolithic": monolithic_run(number),
        "Algorithm 1, FMUs": fmu_run(number),
        "transmission, aliased": simulate(scene),
        "transmission, resolved": simulate(resolved),
    }


def main() -> None:
    runs = {number: treatments(number) for number in FIGURES}
    for number, named in runs.items():
        draw(number, named).savefig(IMAGES / f"paper-fig{number}.png", dpi=100)
    for name, (heads, rows) in {"treatments": extremes(runs), **{k: f() for k, f in TABLES.items()}}.items():
        write_section(PAGE, name, table(heads, rows))


if __name__ == "__main__":
    main()
