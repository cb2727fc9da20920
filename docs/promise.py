"""What `--accuracy` costs and keeps on random scenes:  .venv/bin/python docs/promise.py [NUMBER]…   (seven minutes)

Writes the table of docs/accuracy.md, "What the promise costs". With NUMBERs only these scenes are run, and printed.
"""

from __future__ import annotations

import sys
from concurrent.futures import ProcessPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from math import pi, sqrt
from multiprocessing import get_context
from typing import Any, NamedTuple

import numpy as np
from pages import table, write_section  # beside this script

from springbeam import simulate, with_changes
from springbeam.monolithic import event_driven
from springbeam.results.trajectory import Trajectory
from springbeam.run.outcome import RunStopped
from springbeam.scene import Beam, Scene, SceneError, scene_from_dict
from springbeam.scene.resolution import fastest_frequency, slowest_frequency
from springbeam.scene.statics import tip_compliance, tip_inertia
from springbeam.studies.accuracy import pick
from springbeam.studies.reference import comparable_until
from springbeam.studies.tradeoff.configurations import configurations
from springbeam.studies.tradeoff.errors import errors

ACCURACIES = (1e-3, 1e-4, 1e-5)
KINDS = ("pair", "damped pair", "pair of few modes", "pair with stop", "beam on stop", "law compliance", "spring")
#: Families of the sweep that make the runs of others, for as many calls or more.
REPEATED = {"auto"}
#: What a promise may cost, and how many that cost more are named.
MOST, DEAREST = 3.0, 8
PROCESSES = 2
#: Rows of a run that are compared, about.
ROWS = 200
SEED, SCENES = 2029, 8 * len(KINDS)


# -- scenes -----------------------------------------------------------------------------------------------------------


def drawn(number: int) -> Scene:
    """Draw scene ``number`` of the seed. Motions are as large as the tip's speed and the lowest frequency make them."""
    random, kind = np.random.default_rng([SEED, number]), KINDS[number % len(KINDS)]

    def between(low: float, high: float) -> float:
        """Draw a number, evenly over the decades."""
        return float(f"{np.exp(random.uniform(np.log(low), np.log(high))):.4g}")

    def some(probability: float, value: float) -> float:
        return value if random.random() < probability else 0.0

    def signed(value: float) -> float:
        return value if random.random() < 0.5 else -value

    restitution = 1.0 if random.random() < 0.5 else between(0.2, 0.95)
    if kind == "spring":
        mass, stiffness, reach = between(0.01, 10.0), between(1.0, 1e4), between(1e-3, 0.5)
        omega = sqrt(stiffness / mass)
        tables = {
            "time": {"t_end": between(1.0, 5.0) * 2.0 * pi / omega},
            "spring": {
                "mass": mass, "linear_stiffness": stiffness, "equilibrium": reach,
                "cubic_stiffness": stiffness * between(0.05, 2.0) / reach**2,
                "damping": some(0.5, between(0.01, 0.3) * mass * omega),
                "external_force": some(0.5, signed(between(0.1, 0.5) * stiffness * reach)),
            },
            "coupling": {"macro_step": 0.1 / omega},
        }  # fmt: skip
        if random.random() < 0.5:
            tables["stop"] = {"position": -between(0.1, 0.8) * reach, "restitution": restitution}
        return scene_from_dict(tables)

    length, speed = between(0.2, 2.0), between(0.1, 3.0)
    thickness = length / between(3.0, 20.0)
    young, elements = between(1e5, 2e11), int(random.integers(5, 31))
    form: dict[str, Any] = {
        "density": between(900.0, 8000.0), "area": thickness**2, "second_moment_of_area": thickness**4 / 12.0,
        "young_modulus": young, "shear_modulus": young / 2.6, "shear_coefficient": 5.0 / 6.0, "length": length,
        "n_elements": elements, "initial_velocity_slope": -speed / length, "reduced_integration": True,
    }  # fmt: skip
    beam = Beam(**form)
    omega, stiffness = slowest_frequency(beam), 1.0 / tip_compliance(beam)
    reach = speed / omega  # of the tip, m
    if kind == "damped pair" or random.random() < 0.3:
        form["alpha_b"] = 2.0 * between(1e-4, 3e-2) / omega
    if kind == "pair of few modes":
        form["n_modes"] = int(random.integers(2, 9))
    form["distributed_load"] = some(0.3, signed(between(0.1, 0.5) * stiffness * reach / length))
    form["tip_load_coefficient"] = some(0.2, signed(between(0.1, 0.5) * stiffness * reach * elements / length))
    if random.random() < 0.3:
        form["initial_deflection_slope"], form["approach"] = between(0.05, 0.5) * reach / length, "elastic"
    tables = {"time": {"t_end": between(0.3, 2.0) * 2.0 * pi / omega}, "beam": form}
    fastest = fastest_frequency(Beam(**form))
    if kind == "beam on stop":
        tables["stop"] = {"position": 0.0, "restitution": restitution}
        tables["coupling"] = {"macro_step": 1.0 / fastest}
        return scene_from_dict(tables)
    mass, k1 = between(0.05, 5.0) * tip_inertia(beam), between(0.2, 20.0) * stiffness
    reach = speed * sqrt((mass + tip_inertia(beam)) / (k1 + stiffness))
    tables["spring"] = {
        "mass": mass, "linear_stiffness": k1, "cubic_stiffness": k1 * between(0.05, 2.0) / reach**2,
        "damping": some(0.5, between(0.01, 0.3) * sqrt(mass * k1)),
        "external_force": some(0.3, signed(between(0.1, 0.5) * k1 * reach)),
    }  # fmt: skip
    if kind == "pair with stop" or (kind == "law compliance" and random.random() < 0.3):
        tables["stop"] = {"position": -between(0.1, 0.8) * reach, "restitution": restitution}
    if kind == "law compliance":
        exponent, depth = float(random.choice([1.0, 1.5, 2.0, 3.0])), between(0.02, 0.2) * reach
        tables["contact"] = {
            "law": "compliance", "exponent": exponent, "stiffness": (k1 + stiffness) * reach / depth**exponent,
        }  # fmt: skip
    tables["coupling"] = {"macro_step": 1.0 / max(fastest, sqrt(k1 / mass))}
    return scene_from_dict(tables)


# -- runs -------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Run:
    """What a way to run a scene costs, and where it ends up."""

    name: str
    calls: int  #: doStep calls of both FMUs, of all pilot runs
    trajectory: Trajectory

    @property
    def compared(self) -> np.ndarray:
        """Return the times of the rows that are judged: some, as each costs the reference a step."""
        return np.asarray(self.trajectory.time[:: len(self.trajectory) // ROWS + 1])


class Kept(NamedTuple):
    """What became of one promise: a scene at one accuracy."""

    number: int
    accuracy: float
    calls: int
    error: float  #: the larger one of both
    cheapest: str  #: what keeps the same promise for fewest calls
    ratio: float  #: of the calls

    @property
    def kind(self) -> str:
        return KINDS[self.number % len(KINDS)]

    @property
    def broken(self) -> bool:
        return self.error > self.accuracy

    @property
    def name(self) -> str:
        return f"{self.number} at {self.accuracy:.0e}"


def promised(scene: Scene, accuracy: float) -> Run:
    found = pick(scene.model_copy(update={"accuracy": accuracy}))
    return Run(f"--accuracy {accuracy:.0e}", found.pilot_steps + found.run.do_steps, found.run)


def swept(scene: Scene, most: int) -> list[Run]:
    """Run the configurations of `springbeam tradeoff` for the same model that make at most so many calls."""
    bodies = (scene.beam is not None) + (scene.spring is not None)

    def limited(time: float, phase: str, macro_steps: int) -> None:
        if bodies * macro_steps > most:
            raise RunStopped("too dear", time)

    runs: list[Run] = []
    too_dear: set[str] = set()  # finer ones of these are
    for configuration in configurations(scene):
        if configuration.refined or configuration.monolithic or configuration.family in too_dear | REPEATED:
            continue
        try:
            run = simulate(configuration.scene, limited)
        except RunStopped as stopped:
            if stopped.cause == "too dear":
                too_dear.add(configuration.family)
            continue
        runs.append(Run(configuration.name, run.do_steps, run))
    return runs


def judge_number(number: int) -> list[Kept]:
    """Judge scene ``number``; nothing if the reference finds no end of the events, or all accuracies are refused."""
    try:
        return judged(drawn(number), number)
    except event_driven.ReferenceFailure:
        return []


def judged(scene: Scene, number: int = 0) -> list[Kept]:
    """Judge a scene as far as a perturbation of it stays small; without the accuracies that are refused."""
    scene = with_changes(scene, time={"t_end": comparable_until(scene)})
    ours: dict[float, Run] = {}
    for accuracy in ACCURACIES:
        with suppress(SceneError, RunStopped):
            ours[accuracy] = promised(scene, accuracy)
    if not ours:
        return []
    rivals = swept(scene, max(run.calls for run in ours.values()))
    every = [*ours.values(), *rivals]
    reference = event_driven.simulate(scene, sample_times=np.unique(np.concatenate([run.compared for run in every])))
    kept = []
    for accuracy, run in ours.items():
        span = run.trajectory.time[-1] - run.trajectory.time[0]
        step = span / run.trajectory.summary["macro_steps"]

        def error(run: Run, step: float = step, span: float = span) -> float:
            found = errors(run.trajectory, reference, step)
            return max(found.y_max if scene.beam is None else found.u_tip_max, found.event_time / span)

        good = [rival for rival in rivals if rival.calls < run.calls and error(rival) <= accuracy]
        best = min(good, key=lambda rival: rival.calls, default=run)
        kept.append(Kept(number, accuracy, run.calls, error(run), best.name, run.calls / best.calls))
    return kept


# -- tables -----------------------------------------------------------------------------------------------------------


def costs(kept: list[Kept]) -> list[str]:
    groups = {f"{accuracy:.0e}": [k for k in kept if k.accuracy == accuracy] for accuracy in ACCURACIES}
    groups |= {kind: [k for k in kept if k.kind == kind] for kind in KINDS}
    head = ["", "median", "90 %", "worst", "above 3", "promise broken, by a factor of at most"]
    return table(head, [row(name, group) for name, group in {**groups, "all": kept}.items() if group])


def row(name: str, group: list[Kept]) -> list[str]:
    ratios, broken = [k.ratio for k in group], [k.error / k.accuracy for k in group if k.broken]
    above, factor = sum(ratio > MOST for ratio in ratios), f", {max(broken):.1f}" if broken else ""
    values = [f"{value:.1f}" for value in (*np.quantile(ratios, [0.5, 0.9]), max(ratios))]
    return [name, *values, f"{above} of {len(group)}", f"{len(broken)}{factor}"]


def named(kept: list[Kept]) -> list[str]:
    """Name the dearest scenes, and all broken promises."""
    dear = sorted((k for k in kept if k.ratio > MOST), key=lambda k: -k.ratio)[:DEAREST]
    broken = sorted((k for k in kept if k.broken), key=lambda k: -k.error / k.accuracy)
    return [
        "* Dearest: " + ("; ".join(f"{k.name}: {k.ratio:.1f} times {k.cheapest}" for k in dear) or "none above 3"),
        "* Broken: " + ("; ".join(f"{k.name}: {k.error / k.accuracy:.1f}" for k in broken) or "none"),
    ]


def main(numbers: list[int]) -> None:
    todo = numbers or list(range(SCENES))
    kept: list[Kept] = []
    with ProcessPoolExecutor(PROCESSES, get_context("spawn")) as pool:
        for done, found in enumerate(pool.map(judge_number, todo), 1):
            kept += found
            print(f"{done}/{len(todo)}", *(map(report, found) if found else ["not compared"]), sep="\n  ", flush=True)
    lines = [*costs(kept), "", *named(kept)]
    if not numbers:
        missing = len(ACCURACIES) * SCENES - len(kept)
        unknown = f"* Not compared: {missing}, that are refused or where the reference finds no end of events"
        write_section("accuracy.md", "promise", [*lines, unknown])
    print(*lines, sep="\n")


def report(k: Kept) -> str:
    kept = "BROKEN" if k.broken else "kept"
    return f"{k.name} ({k.kind}): {kept}, error {k.error:.1e}, {k.calls} calls, {k.ratio:.2f} times {k.cheapest}"


if __name__ == "__main__":
    main([int(number) for number in sys.argv[1:]])
