"""The pictures and numbers of docs/paper.md:  .venv/bin/python docs/paper_figures.py   (about a minute)

Writes docs/images/paper-fig2.png … paper-fig5.png and prints every number that docs/paper.md quotes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from pages import IMAGES  # beside this script
from scipy.sparse.linalg import splu

from springbeam import Scene, Trajectory, load_scene, simulate, with_changes
from springbeam.monolithic import event_driven, semi_discrete
from springbeam.paper import co_simulation, monolithic
from springbeam.paper.figures import TABLE_2, draw, energy
from springbeam.paper.problem import AlgorithmFailure

FIGURES = (2, 3, 4, 5)
#: The resolved run: a window after the contact at 0.5 s, and a macro step below 1/ω of the model's fastest mode.
WINDOW = 4e-5
RESOLVED_STEP = 1.5e-8
TREATMENTS = (
    "Algorithm 1, monolithic\n$h_t$ = 4 ms",
    "Algorithm 1, FMUs\n$h_t$ = 4 ms",
    "law transmission\nH = 4 ms (aliased)",
    "law transmission\nresolved, 40 µs",
)


def treatments(number: int) -> tuple[Trajectory, ...]:
    scene = load_scene(f"paper-fig{number}")
    resolved = with_changes(scene, time={"t_end": 0.5 + WINDOW}, coupling={"macro_step": RESOLVED_STEP})
    runs = (
        monolithic.simulate(scene),
        co_simulation.simulate(scene),
        simulate(scene),
        simulate(resolved),
    )
    print(f"\nFigure {number}                      algorithm 1    its FMUs     aliased    resolved")
    for name, what in {
        "largest |u_tip| [m]": lambda r: np.abs(r.u_tip).max(),
        "largest |v_tip| [m/s]": lambda r: np.abs(r.v_tip).max(),
        "lowest y [m]": lambda r: r.y.min(),
        "highest y [m]": lambda r: r.y.max(),
        "largest |z| [m/s]": lambda r: np.abs(r.z).max(),
        "largest |C| [N]": lambda r: np.abs(r.contact_force).max(),
        "E_D lowest [J]": lambda r: energy(r).min(),
        "E_D highest [J]": lambda r: energy(r).max(),
        "|energy residual| [J]": lambda r: np.abs(r.energy_residual).max(),
        "rows": len,
        "events": lambda r: len(r.events),
        "stop impacts": lambda r: sum(event.kind == "stop_impact" for event in r.events),
    }.items():
        print(f"  {name:26s}" + "".join(f"{what(run):12.4g}" for run in runs))
    difference = {name: float(np.abs(runs[0][name] - runs[1][name]).max()) for name in ("u_tip", "v_tip", "y", "z")}
    print(f"  algorithm 1 - through FMUs  {difference}")
    return runs


def table_2(all_runs: dict[int, tuple[Trajectory, ...]]) -> None:
    print(
        "\nTable 2: iterations printed | algorithm 1 (line 10, line 17) | through FMUs;  ms per step likewise; aliased"
    )
    for number, (first, paper, aliased, _) in all_runs.items():
        newton, printed = first.summary["newton"], TABLE_2[number]
        per_step = [1e3 * run.summary["wall_time"] / run.summary["macro_steps"] for run in (first, paper, aliased)]
        print(
            f"  {number}: {printed[0]:.3f} | {first.summary['iterations_per_solve']:.4f} ({newton['predicted']:.4f}, "
            f"{newton['joined']:.4f}) | {paper.summary['iterations_per_solve']:.4f}; "
            f"{1e3 * printed[1]:.2f} | {' | '.join(f'{time:.2f}' for time in per_step)}"
        )


def statements(all_runs: dict[int, tuple[Trajectory, ...]]) -> None:
    for number, (run, paper, *_) in all_runs.items():
        spring, e = run.scene.spring, energy(run)
        assert spring is not None
        case, ratio = run["case"][1:], -run.v_tip[1:] / run.v_tip[:-1]
        between = (run.y > 0.0) & (run.y < run.u_tip)
        together = (run.u_tip <= 0.0) & (run.u_tip >= -0.015)
        de = np.diff(e)
        print(f"\nStatements, Figure {number}, Algorithm 1")
        print(f"  v_tip: |v| in [{np.abs(run.v_tip).min():.4f}, {np.abs(run.v_tip).max():.4f}], changes sign in "
              f"{np.mean(ratio > 0.0):.4f} of the steps, largest |v(l+1) + v(l)| = "
              f"{np.abs(run.v_tip[1:] + run.v_tip[:-1]).max():.3g}")  # fmt: skip
        print(f"  lines 14-27 in {np.sum(case == 14)} of {len(case)} steps, 11-13 in {np.sum(case == 11)}, "
              f"neither in {np.sum(case == 0)}; (7) holds to {np.abs(run.gap[together]).max():.2g} m")  # fmt: skip
        steps = [tuple(float(run[name][k]) for name in ("time", "y", "u_tip")) for k in np.flatnonzero(between)]
        print(f"  rows with y > 0: {np.sum(run.y > 0.0)} (highest {run.y.max():.3g} m); with 0 < y < u: {steps}")
        apart = (paper.y > 0.0) & (paper.y < paper.u_tip)
        print(f"  the same through the FMUs: highest y {paper.y.max():.3g} m; 0 < y < u at {paper.time[apart]}")
        print(f"  largest λ(Ψ-u)^p = {run.compliance_force.max():.3g} N, largest mean force on the overwritten tip = "
              f"{np.abs(run.contact_force).max():.4g} N, largest |Δz| = {np.abs(np.diff(run.z)).max():.3g} m/s, "
              f"N = {run.foundation_force.max():.3g} N")  # fmt: skip
        joined, work = case == 14, np.abs(run.compliance_force[1:] * np.diff(run.u_tip)).sum()
        print(f"  E_D: {e[0]:.6f} -> {e[-1]:.6f} J, in [{e.min():.4f}, {e.max():.4f}]; rises in {np.sum(de > 1e-12)} of"
              f" the steps (by up to {de.max():.3g} J), {np.sum(joined & (de > 1e-12))} of them joined "
              f"({de[joined].max():.3g} J); all work of λ(Ψ-u)^p ≤ {work:.2g} J")  # fmt: skip
        print(f"  injected into the beam {run.e_injected_beam[-1]:+.6f} J (through FMUs "
              f"{paper.summary['injected_into_beam']:+.6f}), spring {run.e_injected_spring[-1]:+.3g} J")  # fmt: skip
    for loaded, bare in ((3, 2), (5, 4)):
        a, b = all_runs[loaded][0], all_runs[bare][0]
        difference = {name: float(np.abs(a[name] - b[name]).max()) for name in ("u_tip", "v_tip", "y", "z")}
        print(f"\nFigure {loaded} - {bare}, Algorithm 1: {difference}")


def load_readings() -> None:
    bare = load_scene("paper-fig2")
    loaded = [with_changes(bare, beam={key: -6.0}).beam for key in ("tip_load_coefficient", "distributed_load")]
    assert bare.beam is not None
    d = semi_discrete.assemble(bare.beam)
    forces = [d.nodal(*semi_discrete.constant_forces(beam)) for beam in loaded if beam is not None]
    solve = splu(d.K.tocsc()).solve
    print("\nStatic tip deflection [m]: hat coefficient -6 as printed, uniform -6 N/m, point force -6 N:")
    print("  ", [float(solve(f)[-1]) for f in (*forces, -6.0 * d.tip_vector)])
    for number in (2, 3):
        beam = load_scene(f"paper-fig{number}").beam
        assert beam is not None
        modes = semi_discrete.modal_beam(beam)
        print(f"Figure {number}: ω₁ = {modes.omega[0]:.6g}, fastest of {len(modes.omega)} modes kept "
              f"{modes.omega[-1]:.4g} rad/s, tip mass {1.0 / modes.inverse_tip_mass:.3g} kg")  # fmt: skip
    print("Algorithm 1 with other loads: coefficient, iterations, largest |u_tip| [m]")
    scene = load_scene("paper-fig2")
    for coefficient in (-6.0, -12000.0, -6e6, -6e8):
        report(f"load {coefficient:g}", with_changes(scene, beam={"tip_load_coefficient": coefficient}))
    report("uniform -6", with_changes(scene, beam={"distributed_load": -6.0}))


def modes_kept() -> None:
    """Print what separates Figure 3 from Figure 2 under `transmission`: a vanishing load brings the same shape."""
    scene = load_scene("paper-fig2")
    for load in (0.0, -6e-12, -6.0):
        run = simulate(with_changes(scene, beam={"tip_load_coefficient": load}))
        print(f"Figure 2, aliased, load {load:g}: y ≥ {run.y.min():.4g} m, {len(run.events)} events")


def report(label: str, scene: Scene, **choices: Any) -> None:
    """Print a run of Algorithm 1, also where it breaks down."""
    broke = ""
    try:
        run = monolithic.simulate(scene, **choices)
    except AlgorithmFailure as failure:
        if failure.trajectory is None:
            raise
        run, broke = failure.trajectory, f"  STOPPED: {failure}"
    e = energy(run)
    solves, apart = run.summary["iterations_per_solve"], run.summary["steps_apart"]
    print(f"  {label:30s} iterations {solves:.4f}  apart {apart}  |z| ≤ {np.abs(run.z).max():.3g}  |u| ≤ "
          f"{np.abs(run.u_tip).max():.3g}  y ≥ {run.y.min():.3g}  E {e[0]:.3g} -> ≤ {e.max():.3g} J  "
          f"N ≤ {run.foundation_force.max():.3g}{broke}")  # fmt: skip


def readings() -> None:
    for number in (2, 4):
        scene = load_scene(f"paper-fig{number}")
        print(f"\nReadings, Figure {number} (at_contact, y_temp)")
        for at_contact in ("rest", "tip"):
            for y_temp in ("equation", "guess", "both"):
                report(f"{at_contact}, {y_temp}", scene, at_contact=at_contact, y_temp=y_temp)
        print(f"Time step of Algorithm 1, Figure {number}")
        for h in (0.02, 0.008, 0.004, 0.002, 0.001):
            report(f"h_t = {h}", with_changes(scene, coupling={"macro_step": h}))
        report("elastic approach", with_changes(scene, beam={"approach": "elastic"}))


def resolution(all_runs: dict[int, tuple[Trajectory, ...]]) -> None:
    """Compare the resolved run of Figure 2 with the monolithic reference of the same law."""
    run = all_runs[2][3]
    reference = event_driven.simulate(run.scene, sample_times=run.time)
    sampled = {name: np.interp(run.time, reference.time, reference[name]) for name in ("y", "u_tip")}
    error = {name: float(np.abs(run[name] - values).max()) for name, values in sampled.items()}
    print(f"\nResolved Figure 2 against the event-driven reference [m]: {error}, events "
          f"{[(e.kind, round(1e6 * (e.time - 0.5), 2), round(e.z or 0.0, 4)) for e in run.events[:4]]}")  # fmt: skip
    for number in FIGURES:
        run = all_runs[number][3]
        release = next(event for event in run.events if event.kind == "release")
        tied = run.time < release.time
        print(f"  Figure {number}: release {1e6 * (release.time - 0.5):.3f} µs, z {release.z:.4f} m/s, deepest y "
              f"{run.y.min():.5g} m, |v_tip| while tied ≤ {np.abs(run.v_tip[tied]).max():.3f}")  # fmt: skip
    for a, b in ((3, 2), (5, 4), (4, 2)):
        p, q = all_runs[a][3], all_runs[b][3]
        until = 2e-5
        times = q.time[q.time <= 0.5 + until]
        print(f"  Figure {a} - {b}, first 20 µs: y differs by "
              f"{np.abs(np.interp(times, p.time, p.y) - q.y[: len(times)]).max():.2g} m")  # fmt: skip


def main() -> None:
    runs = {number: treatments(number) for number in FIGURES}
    for number, found in runs.items():
        draw(number, dict(zip(TREATMENTS, found, strict=True))).savefig(IMAGES / f"paper-fig{number}.png", dpi=100)
    table_2(runs)
    statements(runs)
    load_readings()
    modes_kept()
    readings()
    resolution(runs)


if __name__ == "__main__":
    main()
