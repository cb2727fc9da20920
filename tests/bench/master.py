"""The master: what a macro step costs outside the FMUs, where that goes, and the paper's scene."""

import statistics
from ctypes import c_size_t
from functools import partial
from time import process_time, thread_time

import printed
from measure import Row, Times, below, compare, median_and_spread, ratio_row, shown

from springbeam import load_scene, simulate, with_changes
from springbeam.bodies.fmu import Fmu, release
from springbeam.bodies.own import FmuSpring
from springbeam.paper import co_simulation, monolithic

#: Just before the first impact on the foundation of `soft` [s].
UNTIL = 0.0712
#: The calls of a macro step beside its advances; those before the first one are set-up.
STEPPING = ("GetReal", "GetFMUstate", "SetFMUstate")


class Inside:
    """Time spent in advances and `STEPPING` calls while it is in force; what ctypes needs is not part of it."""

    def __init__(self):
        self.seconds = 0.0
        self.calls = 0
        self._bound = Fmu.bound
        self._advancing = Fmu.advancing

    def _timed(self, function):
        def call():
            began = thread_time()
            status = function()
            self.seconds += thread_time() - began
            self.calls += 1
            return status

        return call

    def __enter__(self):
        def bound(fmu, name, *arguments):
            function = self._bound(fmu, name, *arguments)
            return self._timed(function) if name in STEPPING else function

        def advancing(fmu, *arguments):
            advance, *arrays = self._advancing(fmu, *arguments)
            return self._timed(advance), *arrays

        Fmu.bound = bound
        Fmu.advancing = advancing
        return self

    def __exit__(self, *_):
        Fmu.bound = self._bound
        Fmu.advancing = self._advancing


def nothing(times=20_000):
    """Seconds that `Inside` sees of a call that does nothing."""
    with Inside() as inside:
        body = FmuSpring(load_scene("soft").spring, 0.0)
        call = body.fmu.bound("GetReal", None, c_size_t.from_param(0), None)
        inside.seconds = 0.0
        inside.calls = 0
        for _ in range(times):
            call()
        body.close()
    return inside.seconds / times


def tied_phase(scene):
    """Seconds and macro steps of the first tied phase of `soft`, up to the foundation, in a run of the whole scene."""
    clock = []

    def progress(time, phase, macro_steps):
        if time < UNTIL:
            clock.append(thread_time())

    simulate(scene, progress)
    return clock[-1] - clock[0], len(clock) - 1


def whole_call(effort):
    """What a call of `simulate` takes beside its solution, in a process that has run the scene before."""
    scene = with_changes(load_scene("soft"), time={"t_end": UNTIL}, coupling={"macro_step": UNTIL / 6})
    simulate(scene)
    calls = []
    solutions = []
    for _ in range(5 * effort.rounds):
        began = process_time()
        run = simulate(scene)
        calls.append(process_time() - began)
        solutions.append(float(run.summary["wall_time"]))
    times = Times(calls, solutions)
    return ratio_row("`soft` to 0.0712 s in 6 macro steps: a whole call", times, 4.0, "its solution, `wall_time`")


def master(effort):
    yield whole_call(effort)
    empty = nothing()
    for H, scheme, degree in ((2.5e-4, "energy", 0), (1e-3, "energy", 0), (1e-3, "energy", 2)):
        coupling = {"macro_step": H, "scheme": scheme, "degree": degree}
        scene = with_changes(load_scene("soft"), coupling=coupling)
        only_tied = with_changes(scene, time={"t_end": 0.071})
        outside = []
        within = []
        for _ in range(effort.rounds):
            seconds, steps = tied_phase(scene)
            release()  # instances that are kept would go on with calls that nobody times
            with Inside() as inside:
                summary = simulate(only_tied).summary
            release()
            of_fmus = (inside.seconds - inside.calls * empty) / summary["macro_steps"]
            within.append(1e6 * of_fmus)
            outside.append(1e6 * (seconds / steps - of_fmus))
        name = f"`soft` tied, {scheme} {degree}, H = {H:g}"
        goal = 26.0 if degree == 0 else 30.0
        inner = f"inside {median_and_spread(within)} µs"
        yield below(f"{name}: time outside the FMUs per macro step", outside, goal, "µs", inner)
        if effort.quick:
            return


def paper(effort):
    scene = load_scene("paper-fig2")
    if effort.quick:
        scene = with_changes(scene, time={"t_end": 0.54})
    steps = scene.equal_steps[0]

    def seconds(program):
        return float(program.algorithm_1(scene).summary["wall_time"])

    for what, program, rounds, beside in (
        (f"`springbeam paper 2`, {steps} steps, 1000 elements", printed, 3,
         "Algorithm 1 as printed in scipy.sparse, `spsolve` for each of its linear systems, three a step"),
        ("the same", monolithic, 5,
         "the same numbers from one solution a step, factorised once (SuperLU)"),
    ):  # fmt: skip
        times = compare(lambda: seconds(co_simulation), partial(seconds, program), min(effort.rounds, rounds))
        ratios = median_and_spread([1.0 / ratio for ratio in times.ratios])
        medians = f"{shown(statistics.median(times.ours))} against {shown(statistics.median(times.rival))}"
        yield Row(what, "", f"{ratios} × faster; {medians}", None, beside)
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
    median = statistics.median(per_step)
    needed = 3.5 / 4e-6
    per_step_of_scipy = statistics.median(times.rival) / steps
    yield Row(
        "`paper-fig2` resolved: H = 4e-6 ≤ 1/ω₁, 64 modes",
        "",
        f"{median_and_spread([1.0 / s for s in per_step])} macro steps a second; up to T = 4: {needed:.3g} steps, "
        f"{shown(median * needed)}",
        None,
        f"Algorithm 1 in scipy.sparse, {shown(per_step_of_scipy)} a step: {shown(per_step_of_scipy * needed)}",
    )
