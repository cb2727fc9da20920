"""Tables of this room's ``README.md``: what Algorithm 1 gives beside what Ahn & Tate print.

Each function returns the heads and the rows of a table. ``docs/paper.py`` writes them into the page, and draws the
pictures by `springbeam.paper.figures.draw`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np

from ..results.trajectory import Trajectory
from ..scene import Scene, load_scene, with_changes
from . import co_simulation, monolithic
from .figures import TABLE_2, energy
from .problem import AlgorithmFailure

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
