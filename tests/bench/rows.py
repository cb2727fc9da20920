"""What is measured, and the goals: one function per group of rows of docs/performance.md."""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from ctypes import c_size_t
from dataclasses import dataclass
from functools import partial
from math import log10
from pathlib import Path
from time import thread_time
from typing import Any

import numpy as np
import printed
import scipy.sparse.linalg as spla
import sweeps
from fmpy import extract, read_model_description
from fmpy.simulation import instantiate_fmu
from measure import Times, compare, median_and_spread, timed

from springbeam import load_scene, simulate, with_changes
from springbeam.bodies.archive import fmu_directory
from springbeam.bodies.factory import load_bodies
from springbeam.bodies.fmu_bodies import FmuBeam, FmuSpring
from springbeam.bodies.functions import Functions
from springbeam.monolithic import algorithm1, event_driven
from springbeam.monolithic.semi_discrete import assemble
from springbeam.results.recording import MemoryRecorder
from springbeam.results.trajectory import Trajectory
from springbeam.run.simulation import Simulation
from springbeam.scene import Scene

HERE = Path(__file__).parent
PROGRAMS = HERE.parents[1] / "build" / "tests" / "bench"


@dataclass(frozen=True)
class Row:
    """A row of the table."""

    group: str
    what: str
    goal: str
    measured: str
    met: bool | None = None  #: ``None``: measured without a goal
    against: str = ""


@dataclass(frozen=True)
class Effort:
    """How much is measured."""

    rounds: int = 11
    #: Macro steps of the long run.
    long_run: int = 1_000_000
    #: Only see that everything runs.
    quick: bool = False


def ratio_row(group: str, what: str, times: Times, limit: float, against: str, *, faster: bool = False) -> Row:
    """``limit`` bounds ours/rival from above, or with ``faster`` rival/ours from below."""
    ratios = [1.0 / r for r in times.ratios] if faster else times.ratios
    median = statistics.median(ratios)
    seconds = f"{_time(statistics.median(times.ours))} against {_time(statistics.median(times.rival))}"
    return Row(
        group,
        what,
        f"≥ {limit:g} × faster" if faster else f"≤ {limit:g} ×",
        f"{median_and_spread(ratios)} × {'faster' if faster else ''}".rstrip() + f"; {seconds}",
        median >= limit if faster else median <= limit,
        against,
    )


def below(group: str, what: str, values: list[float], goal: float, unit: str, against: str = "") -> Row:
    """``goal`` bounds the median of the values from above, all in ``unit``."""
    met = statistics.median(values) <= goal
    return Row(group, what, f"≤ {goal:g} {unit}", f"{median_and_spread(values)} {unit}", met, against)


def _time(seconds: float) -> str:
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 1e-9:.3g} ns"


def program(name: str, effort: Effort) -> dict[str, Any]:
    """What ``build/tests/bench/NAME`` prints, by the names of its lines."""
    arguments = ["--quick"] if effort.quick else []
    output = subprocess.run([str(PROGRAMS / name), *arguments], stdout=subprocess.PIPE, text=True, check=True).stdout
    lines = [json.loads(line) for line in output.splitlines()]
    return {line["name"] + (f" {line['modes']}" if "modes" in line else ""): line for line in lines}


def _of(line: dict[str, Any]) -> Times:
    return Times(line["ours"], line["rival"])


# -- 1, 2: the beam ---------------------------------------------------------------------------------------------------


def beam(effort: Effort) -> Iterator[Row]:
    found = program("beam_bench", effort)
    bare = "one solve with the factors, one product, by Eigen (SimplicialLDLT, natural order)"
    yield ratio_row("1", "beam step, generalized-α, 1000 elements", _of(found["generalized_alpha"]), 1.5, bare)
    yield ratio_row(
        "1", "the same from the same state under another force", _of(found["generalized_alpha repeated"]), 1.5, bare
    )
    for key, what, goal in (("", "", 1.0), (" repeated", " and the state set back before", 0.35)):
        modal = _of(found["modal fmu" + key])
        rival = f"64 products of 2 × 2 matrices: {_time(statistics.median(modal.rival))}"
        name = f"beam step of the FMU, 64 modes{what}, called from C"
        yield below("1", name, [1e6 * s for s in modal.ours], goal, "µs", rival)
    yield from _initialisation(effort, found)
    for modes, name in ((0, "generalized-α"), (64, "64 modes")):
        line = found[f"scaling {modes}"]
        for key, what, first, shown in (
            ("step", "time of a step", 0, _time),
            ("memory", "memory at its most", 1, _size),
        ):
            # A hundred elements are less than the system gives out at once.
            n, values = line["elements"][first:], line[key][first:]
            exponents = _exponents(n, values)
            yield Row(
                "2",
                f"{what}, {name}, {n[0]:.0e} to {n[-1]:.0e} elements",
                "exponent ≤ 1.1",
                ", ".join(f"{e:.2f}" for e in exponents) + " a decade",
                max(exponents, default=0.0) <= 1.1,
                "; ".join(shown(value) for value in values),
            )


def _exponents(n: list[float], values: list[float]) -> list[float]:
    return [log10(b / a) / log10(m / k) for a, b, k, m in zip(values, values[1:], n, n[1:], strict=False)]


def _size(size: float) -> str:
    return f"{size / 1e6:.2g} MB"


def _initialisation(effort: Effort, found: dict[str, Any]) -> Iterator[Row]:
    """Beside ARPACK's shift-invert Lanczos of scipy for as many modes of the same matrices."""
    paper = load_scene("paper-fig2").beam
    assert paper is not None
    for n, goal, unit, rounds in ((1000, 100.0, "ms", min(effort.rounds, 5)), (100_000, 10.0, "s", 1)):
        if effort.quick and n > 1000:
            continue
        one = paper.model_copy(update={"n_elements": n, "n_modes": 64})

        def ours(one: Any = one) -> float:
            made: list[FmuBeam] = []
            seconds = timed(lambda: made.append(FmuBeam(one, 0.0, 0.0)))
            made[0].close()
            return seconds

        def arpack(one: Any = one) -> float:
            d = assemble(one)
            return timed(lambda: spla.eigsh(d.K.tocsc(), 64, d.M.tocsc(), sigma=0.0))

        times = compare(ours, arpack, rounds) if n == 1000 else Times([ours()], [arpack()])
        scaled = [seconds * {"ms": 1e3, "s": 1.0}[unit] for seconds in times.ours]
        rival = f"scipy's eigsh (ARPACK) for the same modes: {_time(statistics.median(times.rival))}"
        yield below("2", f"initialisation of beam.fmu, {n} elements, 64 modes", scaled, goal, unit, rival)
    if not effort.quick:
        line = found["scaling 64"]
        yield Row(
            "2",
            "initialisation, 64 modes, by elements",
            "",
            "; ".join(f"{n:.0e}: {_time(s)}" for n, s in zip(line["elements"], line["initialisation"], strict=True)),
        )


# -- 3: the spring ----------------------------------------------------------------------------------------------------


def spring(effort: Effort) -> Iterator[Row]:
    found = program("spring_bench", effort)
    bare = "IDA restarted on (y, z, ∫y, ∫∫y), same tolerances"
    for name, what in (
        ("soft 1e-12", "`soft`, H = 4e-3, tolerance 1e-12"),
        ("soft 1e-10", "`soft`, H = 4e-3, tolerance 1e-10"),
        ("soft 1e-12 H=2.5e-4", "`soft`, H = 2.5e-4, tolerance 1e-12"),
        ("fig4 1e-12", "`paper-fig4`, H = 4e-3, tolerance 1e-12"),
    ):
        counts, errors = found[f"{name} counts"], found[f"{name} errors"]
        against = f"{bare}: {counts['rival'][0]} internal steps, ours {counts['ours'][0]}; error "
        against += f"{errors['rival'][0]:.0e} m, ours {errors['ours'][0]:.0e} m"
        yield ratio_row("3", f"spring step, {what}", _of(found[name]), 1.2, against)
    yield ratio_row("3", "the same of the FMU, state restored before", _of(found["fmu"]), 1.2, bare)


# -- 4: the master ----------------------------------------------------------------------------------------------------


#: The calls of a macro step; those before the first one are set-up.
STEPPING = (*("DoStep", "GetReal", "SetReal", "SetRealInputDerivatives", "GetFMUState", "SetFMUState"),)


class Inside:
    """Time spent in `STEPPING` calls while it is in force; what ctypes needs for a call is not part of it."""

    def __init__(self) -> None:
        self.seconds, self.calls = 0.0, 0
        self._prepared = Functions.prepared

    def __enter__(self) -> Inside:
        inside, prepared = self, self._prepared

        def timed_call(self: Functions, name: str, *arguments: Any) -> Callable[[], int]:
            function = prepared(self, name, *arguments)
            if name not in STEPPING:
                return function

            def call() -> int:
                began = thread_time()
                status = function()
                inside.seconds += thread_time() - began
                inside.calls += 1
                return status

            return call

        Functions.prepared = timed_call  # type: ignore[method-assign]
        return self

    def __exit__(self, *_: object) -> None:
        Functions.prepared = self._prepared  # type: ignore[method-assign]


def nothing(times: int = 20_000) -> float:
    """Seconds that `Inside` sees of a call that does nothing."""
    with Inside() as inside:
        body = FmuSpring(load_scene("soft").spring, 0.0)  # type: ignore[arg-type]
        call = body.fmu.prepared("GetReal", None, c_size_t(0), None)
        inside.seconds, inside.calls = 0.0, 0
        for _ in range(times):
            call()
        body.close()
    return inside.seconds / times


def tied_phase(scene: Scene) -> tuple[float, int]:
    """Seconds and macro steps of the first tied phase of `soft`, up to the foundation, in a run of the whole scene."""
    clock: list[float] = []

    def progress(time: float, phase: str, macro_steps: int) -> None:
        if time < UNTIL:
            clock.append(thread_time())

    simulate(scene, progress)
    return clock[-1] - clock[0], len(clock) - 1


def through_fmpy(effort: Effort, calls: int = 20_000) -> Row:
    """What a call costs through FMPy's own methods: says how fast Python is on this machine."""
    path = str(fmu_directory() / "spring.fmu")
    description = read_model_description(path)
    slave = instantiate_fmu(extract(path), description, fmi_type="CoSimulation")
    references = [next(v.valueReference for v in description.modelVariables if v.name == "displacement")]
    read = slave.getReal
    costs = [1e6 * timed(lambda: [read(references) for _ in range(calls)]) / calls for _ in range(effort.rounds)]
    slave.freeInstance()
    return Row("4", "for scale: one variable read by FMPy's getReal", "", f"{median_and_spread(costs)} µs")


def master(effort: Effort) -> Iterator[Row]:
    yield through_fmpy(effort)
    empty = nothing()
    for H, scheme, degree in ((2.5e-4, "energy", 0), (1e-3, "energy", 0), (1e-3, "energy", 2), (1e-3, "hermite", 2)):
        coupling = {"macro_step": H, "scheme": scheme, "degree": degree}
        scene = with_changes(load_scene("soft"), coupling=coupling)
        only_tied = with_changes(scene, time={"t_end": 0.071})
        outside, within = [], []
        for _ in range(effort.rounds):
            seconds, steps = tied_phase(scene)
            with Inside() as inside:
                summary = simulate(only_tied).summary
            of_fmus = (inside.seconds - inside.calls * empty) / summary["macro_steps"]
            within.append(1e6 * of_fmus)
            outside.append(1e6 * (seconds / steps - of_fmus))
        name = f"`soft` tied, {scheme} {degree}, H = {H:g}"
        for body, goal in (("beam", 2), ("spring", 3)):
            # The first steps of each size, H/8 after the impact, what is left of H, and H, measure what is remembered.
            per_step = (summary[f"{body}_steps"] - 3 * (degree + 1)) / summary["macro_steps"]
            yield Row("4", f"{name}: {body} doSteps per macro step", f"≤ {goal}", f"{per_step:.3f}", per_step <= goal)
        inner = f"inside {median_and_spread(within)} µs"
        yield below("4", f"{name}: time outside the FMUs per macro step", outside, 40.0, "µs", inner)
        if effort.quick:
            return


# -- where the time goes ----------------------------------------------------------------------------------------------

#: Before the first optimisation that was measured with these benchmarks, on the machine of the page [µs].
BEFORE = {
    "both bodies marked": 0.914,
    "a step attempted: 2 doSteps of each body, and the contact force": 27.2,
    "of it, the beam set back and stepped": 3.52,
    "of it, the spring set back and stepped": 5.23,
    "is an event due at the start": 0.845,
    "does one come inside": 2.31,
    "a row: energies, ledger, recorder": 5.67,
    "of it, energies of both bodies": 1.72,
    "of it, the ledger": 0.938,
    "a shape (400 a run)": 8.69,
}


class _Enough(Exception):
    pass


def profile(effort: Effort) -> Iterator[Row]:
    """Parts of a macro step, each repeated by itself in the middle of the first tied phase of `soft`."""
    scene = load_scene("soft")
    beam, spring = load_bodies(scene, 0.0)
    assert isinstance(beam, FmuBeam)
    assert spring is not None

    def progress(time: float, phase: str, macro_steps: int) -> None:
        if macro_steps == 20:
            raise _Enough

    recorder = MemoryRecorder(scene)
    simulation = Simulation(scene, 0.0, beam, spring, recorder, progress)
    with suppress(_Enough):
        simulation._run()
    state, pair, detector = simulation._state, simulation._pair, simulation._detector
    start, H = pair.ends(), scene.coupling.H
    pair.mark()
    step = pair.attempt(state, H, start)
    end = pair.ends()
    energies = pair.energies(end)
    simulation._rows._next_shape, simulation._rows._shapes_left = float("inf"), 0

    def stepped(body: FmuBeam | FmuSpring) -> None:
        body.rewind()
        body.advance(state.time, H, step.contact)

    parts: list[Callable[[], object]] = [
        pair.mark,
        lambda: pair.attempt(state, H, start),
        lambda: stepped(beam),
        lambda: stepped(spring),
        lambda: detector.at_start(state, start),
        lambda: detector.first(state, step),
        lambda: simulation._rows.write(state, step),
        lambda: pair.energies(end),
        lambda: simulation._balance.ledger.book(*energies),
        lambda: recorder.shape(1.0, beam.shape()),
    ]
    calls = 10 if effort.quick else 2000
    for (what, before), part in zip(BEFORE.items(), parts, strict=True):
        if part == pair.mark:
            pair.rewind()
        seconds = [timed(lambda part=part: [part() for _ in range(calls)]) / calls for _ in range(effort.rounds)]  # type: ignore[misc]
        if part in parts[:4]:  # the bodies at the end of the step that is looked at
            step = pair.attempt(state, H, start)
        yield Row("4", what, "", f"{median_and_spread([1e6 * s for s in seconds])} µs", None, f"before: {before:g} µs")
    for body in (beam, spring):
        body.close()


# -- 5, 6: the paper's scene ------------------------------------------------------------------------------------------


def paper(effort: Effort) -> Iterator[Row]:
    scene = with_changes(load_scene("paper-fig2"), contact={"law": "paper", "impact": "rest"})
    if effort.quick:
        scene = with_changes(scene, time={"t_end": 0.54})
    steps = 0

    def ours() -> float:
        nonlocal steps
        summary = simulate(scene).summary
        steps = int(summary["macro_steps"])
        return float(summary["wall_time"])

    def theirs(run: Trajectory) -> float:
        return float(run.summary["newton"]["time_per_step"]) * (len(run) - 1)

    as_printed = compare(ours, lambda: theirs(printed.simulate(scene)), min(effort.rounds, 3))
    yield ratio_row(
        "5",
        f"`paper-fig2`, law `paper`, {steps} steps, 1000 elements",
        as_printed,
        10.0,
        "Algorithm 1 as printed in scipy.sparse, `spsolve` for each of its linear systems, three a step",
        faster=True,
    )
    times = compare(ours, lambda: theirs(algorithm1.simulate(scene)), min(effort.rounds, 5))
    ratios = median_and_spread([1.0 / ratio for ratio in times.ratios])
    seconds = f"{_time(statistics.median(times.ours))} against {_time(statistics.median(times.rival))}"
    condensed = "the same numbers from one solution a step, factorised once before the clock runs (SuperLU)"
    yield Row("5", "the same", "", f"{ratios} × faster; {seconds}", None, condensed)
    bare = statistics.median(program("beam_bench", effort)["generalized_alpha"]["rival"])
    of_solves = Times(times.ours, [bare * steps] * len(times.ours))
    yield ratio_row("5", "the same", of_solves, 5.0, f"{steps} bare solves and products, one a step, by Eigen")
    resolved = with_changes(
        load_scene("paper-fig2"),
        beam={"n_modes": 64},
        coupling={"macro_step": 4e-6},
        time={"t_end": 0.5 + 4e-6 * (100 if effort.quick else 5000)},
    )
    per_step = []
    for _ in range(min(effort.rounds, 5)):
        summary = simulate(resolved).summary
        per_step.append(float(summary["wall_time"]) / summary["macro_steps"])
    median, needed = statistics.median(per_step), 3.5 / 4e-6
    per_step_of_scipy = statistics.median(times.rival) / steps
    yield Row(
        "6",
        "`paper-fig2` resolved: H = 4e-6 ≤ 1/ω₁, 64 modes",
        "",
        f"{median_and_spread([1.0 / s for s in per_step])} macro steps a second; up to T = 4: {needed:.3g} steps, "
        f"{_time(median * needed)}",
        None,
        f"Algorithm 1 in scipy.sparse, {_time(per_step_of_scipy)} a step: {_time(per_step_of_scipy * needed)}",
    )


# -- 7: a long run ----------------------------------------------------------------------------------------------------


def long_run(effort: Effort) -> Iterator[Row]:
    steps = 2000 if effort.quick else effort.long_run
    scene = with_changes(
        load_scene("soft"),
        beam={"n_elements": 10, "alpha_b": 1e-6},
        spring={"damping": 1e-3},
        stop={"restitution": 0.999},
        coupling={"macro_step": 2e-3},
        time={"t_end": steps * 2e-3},
    )
    with tempfile.TemporaryDirectory() as folder:
        arguments = [json.dumps(scene.model_dump(exclude_none=True)), folder, str(steps)]
        program = [sys.executable, str(HERE / "long_run.py"), *arguments]
        output = subprocess.run(program, stdout=subprocess.PIPE, text=True, check=True).stdout
    marks, _ = json.loads(output)
    resident, per_step = np.array(marks).T
    growth = float(resident[-1] - resident[0]) / 1e6
    change = float(per_step[-1] / per_step[1])
    yield Row(
        "7",
        f"`soft` with losses, {steps:.0e} macro steps into files: memory",
        "constant",
        f"{growth:+.2f} MB from the first tenth to the end, of {resident[0] / 1e6:.0f} MB",
        growth < 1.0,
    )
    yield Row(
        "7",
        "the same: time of a tied step, last tenth over second tenth",
        "constant",
        f"{change:.2f} ({min(per_step) * 1e6:.0f} – {max(per_step) * 1e6:.0f} µs)",
        0.8 < change < 1.2,
    )


# -- 8: what an accuracy costs ----------------------------------------------------------------------------------------

#: Ours: macro steps, and tolerances of the coupling and of IDA; the force is quadratic.
STEPS = (1, 2, 3, 4, 6, 8, 12, 16, 20, 24, 28, 32, 40)
TOLERANCES = ((1e-4, 1e-3), (1e-5, 1e-3), (1e-6, 1e-4), (1e-8, 1e-8))
RIVALS = {"DOP853": (1e-1, 1e-2, 1e-3, 1e-4), "LSODA": (1e-2, 1e-3), "Radau": (1e-2,)}
#: A method so many times dearer than the cheapest is not tried on the finer mesh.
_HOPELESS = 10.0
#: Just before the first impact on the foundation of `soft` [s]. Until then y moves 15 mm.
UNTIL = 0.0712


@dataclass(frozen=True)
class Candidate:
    """A run of ours; errors of y [m] at its macro points, and between them by `Trajectory.at`."""

    scene: Scene
    seconds: float
    at_points: float
    between: float

    @property
    def setting(self) -> str:
        coupling, spring = self.scene.coupling, self.scene.spring
        assert spring is not None
        return (
            f"{coupling.scheme} {coupling.degree}, {round(UNTIL / coupling.H)} steps, tolerances "
            f"{coupling.tolerance:.0e} and {spring.relative_tolerance:.0e}"
        )


def accuracy(effort: Effort) -> Iterator[Row]:
    methods = list(RIVALS)[:1] if effort.quick else list(RIVALS)
    for n in (50,) if effort.quick else (50, 200):
        soft = with_changes(load_scene("soft"), beam={"n_elements": n}, time={"t_end": UNTIL})
        grid = np.linspace(0.0, UNTIL, 401)
        exact = event_driven.simulate(soft, sample_times=grid)
        scale = float(np.abs(exact.y).max())
        families = [
            [_candidate(soft, scheme, steps, *tolerances) for steps in (STEPS[-2:] if effort.quick else STEPS)]
            for tolerances in (TOLERANCES[2:3] if effort.quick else TOLERANCES)
            for scheme in ("energy", "hermite")
        ]
        theirs: list[tuple[float, float, str, float]] = []
        for method in methods:
            for rtol in RIVALS[method]:
                error = float(np.abs(_scipy(soft, method, rtol, scale, grid).y - exact.y).max())
                theirs.append((_seconds(soft, method, rtol, scale), error, method, rtol))
        for target, error_of, meaning in (
            (1e-6, "at_points", "1e-6 m at macro points"),
            (1e-6, "between", "1e-6 m, also between macro points"),
            (1e-6 * scale, "at_points", "1e-6 of its motion at macro points"),
        ):
            chosen = _cheapest(families, error_of, target)
            best, _, method, rtol = min(t for t in theirs if t[1] <= target)
            times = compare(partial(_ours, chosen.scene), partial(_seconds, soft, method, rtol, scale), effort.rounds)
            yield ratio_row(
                "8",
                f"`soft`, {n} elements, y within {meaning}: {chosen.setting}, error {getattr(chosen, error_of):.1e} m",
                times,
                10.0,
                f"the cheapest of scipy's: {method}, rtol {rtol:.0e}",
                faster=True,
            )
            if effort.quick:
                return
        methods = list(dict.fromkeys(m for seconds, _, m, _ in theirs if seconds <= _HOPELESS * best))


def _candidate(soft: Scene, scheme: str, steps: int, tolerance: float, ida: float) -> Candidate:
    scene = with_changes(
        soft,
        coupling={"scheme": scheme, "degree": 2, "macro_step": UNTIL / steps, "tolerance": tolerance},
        spring={"relative_tolerance": ida, "absolute_tolerance": 1e-2 * ida},
    )
    run = simulate(scene)
    exact = event_driven.simulate(soft, sample_times=np.union1d(np.linspace(0.0, UNTIL, 401), run.time))
    at = np.searchsorted(exact.time, run.time)
    return Candidate(
        scene,
        min(_ours(scene) for _ in range(3)),
        float(np.abs(run.y - exact.y[at]).max()),
        float(np.abs(run.at(exact.time).y - exact.y).max()),
    )


def _cheapest(families: list[list[Candidate]], error_of: str, target: float) -> Candidate:
    """Return the cheapest that is within the target together with all finer ones of its family: not by luck."""
    kept = []
    for family in families:
        fine = [getattr(candidate, error_of) <= target for candidate in family]
        kept += [candidate for i, candidate in enumerate(family) if all(fine[i:])]
    return min(kept, key=lambda candidate: candidate.seconds)


def _ours(scene: Scene) -> float:
    return float(simulate(scene).summary["wall_time"])


def _seconds(scene: Scene, method: str, rtol: float, scale: float) -> float:
    """What scipy takes without rows; the matrices are made before the clock runs."""
    return float(_scipy(scene, method, rtol, scale, np.array([scene.time.t_end])).summary["wall_time"])


def _scipy(scene: Scene, method: str, rtol: float, scale: float, times: np.ndarray) -> Any:
    return event_driven.simulate(scene, method=method, rtol=rtol, atol=1e-3 * rtol * scale, nodes=2, sample_times=times)


def sweep(effort: Effort) -> Iterator[Row]:
    """Throughput of a sweep, its workers warm."""
    for workers in (1,) if effort.quick else (1, 2):
        with sweeps.warm(workers) as pool:
            for t_end, runs in sweeps.SIZES[-1:] if effort.quick else sweeps.SIZES:
                todo = sweeps.plan(t_end, 4 if effort.quick else runs)
                times = compare(
                    partial(sweeps.recorded, todo, pool),
                    partial(sweeps.in_a_pool, todo, pool),
                    min(effort.rounds, 5),
                )
                each = statistics.median(times.rival) * workers / len(todo.cases())
                yield ratio_row(
                    "9",
                    f"a sweep on {workers} worker{'s' * (workers > 1)}, runs of {_time(each)}",
                    times,
                    1.18,  # 85 % of the throughput
                    "a pool of as many processes, handed the same runs one by one",
                )


GROUPS: dict[str, Callable[[Effort], Iterator[Row]]] = {
    "beam": beam,
    "spring": spring,
    "master": master,
    "profile": profile,
    "paper": paper,
    "long": long_run,
    "accuracy": accuracy,
    "sweep": sweep,
}
