"""The FMUs and their numerics, beside the least work that a step needs."""

import json
import statistics
import subprocess
from math import log10
from pathlib import Path

import scipy.sparse.linalg as spla
from measure import Row, Times, below, compare, ratio_row, shown, timed
from scipy.sparse import csc_matrix

from springbeam import load_scene
from springbeam.bodies.fmu import release
from springbeam.bodies.own import FmuBeam
from springbeam.monolithic.semi_discrete import assemble

PROGRAMS = Path(__file__).parents[2] / "build" / "tests" / "bench"


def program(name, effort):
    """What ``build/tests/bench/NAME`` prints, by the names of its lines."""
    arguments = ["--quick"] if effort.quick else []
    output = subprocess.run([str(PROGRAMS / name), *arguments], stdout=subprocess.PIPE, text=True, check=True).stdout
    lines = [json.loads(line) for line in output.splitlines()]
    return {line["name"] + (f" {line['modes']}" if "modes" in line else ""): line for line in lines}


def _of(line):
    return Times(line["ours"], line["rival"])


def beam(effort):
    found = program("beam_bench", effort)
    bare = "one solve and one product by Eigen"
    yield ratio_row("beam step, midpoint rule, 1000 elements", _of(found["midpoint"]), 1.5, bare)
    yield ratio_row("the same from the same state under another force", _of(found["midpoint repeated"]), 1.5, bare)
    for key, what, goal in (("", "", 1.0), (" repeated", " and the state set back before", 0.35)):
        modal = _of(found["modal fmu" + key])
        rival = f"64 products of 2 × 2 matrices: {shown(statistics.median(modal.rival))}"
        name = f"beam step of the FMU, 64 modes{what}, called from C"
        yield below(name, [1e6 * s for s in modal.ours], goal, "µs", rival)
    yield from _initialisation(effort)
    for modes, name in ((0, "midpoint rule"), (64, "64 modes")):
        line = found[f"scaling {modes}"]
        for key, what, first, unit in (
            ("step", "time of a step", 0, shown),
            ("memory", "memory at its most", 1, _size),
        ):
            # A hundred elements are less than the system gives out at once.
            n = line["elements"][first:]
            values = line[key][first:]
            exponents = _exponents(n, values)
            yield Row(
                f"{what}, {name}, {n[0]:.0e} to {n[-1]:.0e} elements",
                "exponent ≤ 1.1",
                ", ".join(f"{e:.2f}" for e in exponents) + " a decade",
                max(exponents, default=0.0) <= 1.1,
                "; ".join(unit(value) for value in values),
            )


def _exponents(n, values):
    return [log10(b / a) / log10(m / k) for a, b, k, m in zip(values, values[1:], n, n[1:], strict=False)]


def _size(size):
    return f"{size / 1e6:.2g} MB"


def _initialisation(effort):
    """Beside ARPACK's shift-invert Lanczos of scipy for as many modes of the same matrices."""
    paper = load_scene("paper-fig2").beam
    assert paper is not None
    for n, goal, unit, rounds in ((1000, 100.0, "ms", min(effort.rounds, 5)), (100_000, 10.0, "s", 1)):
        if effort.quick and n > 1000:
            continue
        one = paper.model_copy(update={"n_elements": n, "n_modes": 64})

        def ours(one=one):
            made = []
            release()  # an instance that is kept would be given back
            seconds = timed(lambda: made.append(FmuBeam(one, 0.0, 0.0)))
            made[0].close()
            return seconds

        def arpack(one=one):
            d = assemble(one)
            return timed(lambda: spla.eigsh(csc_matrix(d.K), 64, csc_matrix(d.M), sigma=0.0))

        times = compare(ours, arpack, rounds) if n == 1000 else Times([ours()], [arpack()])
        scaled = [seconds * {"ms": 1e3, "s": 1.0}[unit] for seconds in times.ours]
        rival = f"scipy's eigsh (ARPACK) for the same modes: {shown(statistics.median(times.rival))}"
        yield below(f"initialisation of beam.fmu, {n} elements, 64 modes", scaled, goal, unit, rival)


def spring(effort):
    found = program("spring_bench", effort)
    bare = "IDA itself, restarted"
    for name, what in (
        ("soft 1e-12", "`soft`, H = 4e-3, tolerance 1e-12"),
        ("soft 1e-10", "`soft`, H = 4e-3, tolerance 1e-10"),
        ("soft 1e-12 H=2.5e-4", "`soft`, H = 2.5e-4, tolerance 1e-12"),
        ("fig4 1e-12", "`paper-fig4`, H = 4e-3, tolerance 1e-12"),
    ):
        counts = found[f"{name} counts"]
        errors = found[f"{name} errors"]
        against = f"{bare}: {counts['rival'][0]} internal steps, ours {counts['ours'][0]}; error "
        against += f"{errors['rival'][0]:.0e} m, ours {errors['ours'][0]:.0e} m"
        yield ratio_row(f"spring step, {what}", _of(found[name]), 1.2, against)
    yield ratio_row("the same of the FMU, state restored before", _of(found["fmu"]), 1.2, bare)
    flight = _of(found["flight"])
    yield below(
        "spring step of the FMU in flight, H = 4e-3, called from C",
        [1e6 * s for s in flight.ours],
        1.0,
        "µs",
        f"{bare}: {shown(statistics.median(flight.rival))}",
    )
    for key, where, goal in (("held apart", "out of reach", 1.3), ("held", "in touch (a trial and the step)", 2.6)):
        what = f"spring step of the FMU with a contact force that it finds and holds, the tip {where}"
        yield ratio_row(what, _of(found[key]), goal, "one step under a force from outside")
