"""Run the scenes of ``docs/published/`` and write the table of published.md: python docs/published.py"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from math import inf, isnan, nan, pi, sqrt
from pathlib import Path
from typing import NamedTuple

import numpy as np
from pages import table, write_section  # beside this script
from scipy.optimize import brentq
from scipy.sparse.linalg import eigsh
from scipy.special import ellipk

from springbeam import Trajectory, load_scene, simulate, with_changes
from springbeam.monolithic.semi_discrete import assemble

SCENES = Path(__file__).parent / "published"


class Line(NamedTuple):
    """A number of others beside ours, and how far they may be apart, relatively, and why so far."""

    case: str
    what: str
    source: str
    theirs: float
    ours: float
    bound: float
    unit: str = ""


def run(name: str, **changes: object) -> Trajectory:
    """Run the scene of ``name`` with some keys changed."""
    return simulate(with_changes(load_scene(SCENES / f"{name}.toml"), **changes))


def times_of(trajectory: Trajectory, kind: str) -> list[float]:
    """Return when the events of a kind were [s]."""
    return [event.time for event in trajectory.events if event.kind.value == kind]


def largest(trajectory: Trajectory, column: str) -> float:
    """Return the largest absolute value of a column on its curve, in the steps beside its largest rows."""
    last = len(trajectory) - 1
    found = 0.0
    for row in np.abs(trajectory[column]).argsort()[-20:]:
        begin = trajectory.time[max(row - 1, 0)]
        end = trajectory.time[min(row + 1, last)]
        found = max(found, float(np.abs(trajectory.at(np.linspace(begin, end, 201))[column]).max()))
    return found


def lines() -> Iterator[Line]:
    """Yield all lines; the bounds are half of the last digit that is published, unless a comment says more."""
    sdnd101 = run("sdnd101")
    first, second, *_ = times_of(sdnd101, "impact")
    manual = partial(Line, "SDND101", source="code_aster")
    yield manual(what="largest force", theirs=9950.37, ours=largest(sdnd101, "contact_force"), bound=5e-7, unit="N")
    yield manual(what="contact lasts", theirs=0.03126, ours=times_of(sdnd101, "separation")[0], bound=1.6e-5, unit="s")
    yield manual(what="period", theirs=0.345419, ours=second - first, bound=2e-6, unit="s")

    # Their closed forms have four and six digits.
    for name, events, force, bound in (("sdnd102", 18, 1521.0, 4e-4), ("sdnd121", 14, 224393.0, 1e-4)):
        shaken = run(name)
        case = name.upper()
        yield Line(case, "number of events", "code_aster", events, len(shaken.events), 0.0)
        yield Line(case, "largest force", "closed form", force, largest(shaken, "contact_force"), bound, "N")

    for theirs in (1.986564, 1.749016, 1.432385):
        speed = brentq(lambda v, period=theirs: one_sided_period(v) - period, 0.0317, 30.0, xtol=1e-13)
        meetings = times_of(run("sdnd122", spring={"initial_velocity": float(speed)}), "impact")
        yield Line("SDND122", "period", "code_aster", theirs, meetings[1] - meetings[0], 4e-7, "s")

    # EI, KAG and ρA of a section; a thousandth of its inertia, of its shear compliance, or of both.
    section = {"diameter": None, "area": 0.01 * pi, "second_moment_of_area": 2.5e-5 * pi, "shear_coefficient": 0.9}
    stiff = {**section, "shear_coefficient": 900.0}
    slender = {**section, "second_moment_of_area": 2.5e-8 * pi, "young_modulus": 1e13}
    for which, keys, source, u, v, bounds in (
        ("neither", slender, "code_aster", -1.85334e-6, -4.63284e-3, (0.01, 0.05)),
        ("rotary inertia", stiff, "Hermite elements, Newmark", -2.694e-6, -4.109e-3, (0.01, 0.01)),
    ):
        beam = run("sdnl104", beam=keys)
        case = f"SDNL104, {which}"
        yield Line(case, "u(0.1315 s)", source, u, float(beam.at(0.1315).u_tip[0]), bounds[0], "m")
        yield Line(case, "v(0.1566 s)", source, v, float(beam.at(0.1566).v_tip[0]), bounds[1], "m/s")
    whole = run("sdnl104")
    for what, found, unit in (
        ("u(0.1315 s)", whole.at(0.1315).u_tip, "m"),
        ("v(0.1566 s)", whole.at(0.1566).v_tip, "m/s"),
    ):
        yield Line("SDNL104, rotary inertia and shear", what, "none", nan, float(found[0]), inf, unit)

    for r, s, theirs in ((0.02, 0.04, 3.49980), (0.04, 0.08, 3.45267), (0.08, 0.16, 3.28370)):
        keys = {"second_moment_of_area": r**2, "young_modulus": r**-2, "shear_coefficient": s**-2}
        beam = with_changes(load_scene(SCENES / "huang.toml"), beam=keys).beam
        assert beam is not None
        mesh = assemble(beam)
        (lowest,) = eigsh(mesh.K, 1, mesh.M, sigma=0.0, return_eigenvectors=False)
        yield Line("Huang", f"√(ρAL⁴/EI) ω₁, r = {r}", "exact equation", theirs, sqrt(lowest), 2e-6)

    pulse = 0.011
    for quality, share, theirs in ((None, 0.81, 1.768), (10.0, 0.81, 1.651)):
        rate = 2.0 * pi * share / pulse
        spring = {"mass": 1.0, "linear_stiffness": rate**2, "damping": rate / quality if quality else 0.0}
        shock = run("srs", spring=spring, time={"t_end": 0.04}).at(np.linspace(0.0, 0.04, 40_001))
        ours = np.abs(rate**2 * shock.y + spring["damping"] * shock.z).max() / 490.33
        what = f"peak at f T = {share}, " + ("undamped" if quality is None else f"Q = {quality:g}")
        yield Line("shock spectrum", what, "Irvine", theirs, float(ours), 3e-4)

    for weight, theirs in ((0.0, 1.0 / 3.0), (-9.81, 10.81 / 3.0)):
        loss = run("two-masses", beam={"external_force": weight}).events[0].energy_loss
        yield Line("two masses", f"loss under {weight:g} N", "momentum", theirs, loss, 1e-9, "J")

    for restitution in (0.5, 0.7, 0.9):
        ball = run("zeno", stop={"restitution": restitution}, time={"t_end": 9.0})
        theirs = sqrt(2.0 / 9.81) * (1.0 + restitution) / (1.0 - restitution)
        # It seats when a bounce is lost in rounding.
        yield Line("Zeno", f"seated, e = {restitution}", "closed form", theirs, times_of(ball, "seated")[0], 1e-6, "s")

    duffing = run("duffing-period")
    theirs = 4.0 / sqrt(2.0) * float(ellipk(0.25))
    turn = brentq(lambda t: float(duffing.at(t).z[0]), theirs - 0.1, theirs + 0.02, xtol=1e-13)
    yield Line("Duffing", "period from y = 1", "elliptic integral K", theirs, turn, 1e-9, "s")

    for size in (0.1, 0.5, 1.0):
        touched = times_of(run("graze", coupling={"macro_step": size}), "stop_impact")[0]
        theirs = pi - float(np.arccos(0.9998))
        yield Line("graze", f"first touch, H = {size:g} s", "closed form", theirs, touched, 1e-9, "s")
        missed = run("graze", coupling={"macro_step": size}, stop={"position": -0.5001})
        yield Line("graze", f"touches 1e-4 m below, H = {size:g} s", "closed form", 0, len(missed.events), 0.0)


def one_sided_period(speed: float) -> float:
    """Return the period [s] of SDND122 that starts at y = 0 with ``speed`` [m/s]: free, and on both springs."""
    free, both, gap = sqrt(10.0), sqrt(60.0), 0.01
    way = free * gap
    if speed <= way:
        return 2.0 * pi / free
    met = sqrt(speed**2 - way**2)
    # On both springs it swings about 50/60 of the gap.
    held = pi - 2.0 * np.arctan(gap * both / (6.0 * met))
    return float((pi + 2.0 * np.arcsin(way / speed)) / free + held / both)


def written(found: Line) -> tuple[str, ...]:
    """Return the cells of a line."""
    values = ("" if isnan(x) else f"{x:.6g} {found.unit}".strip() for x in (found.theirs, found.ours))
    return (found.case, found.what, found.source, *values)


HEAD = ("case", "", "source", "theirs", "ours")

if __name__ == "__main__":
    write_section("published.md", "published", table(HEAD, map(written, lines())))
