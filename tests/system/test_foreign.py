"""FMUs that others made, and elements, in the places of beam and spring: exact solutions, and what is refused."""

import importlib
import os
import re
import signal
import subprocess
import sys
import threading
from multiprocessing.connection import Connection
from pathlib import Path
from time import sleep

import numpy as np
import oscillator
import pytest
import scenes
import tomli_w
from commands import HANGS, command, printed
from scenes import kinds

from springbeam import RunStopped, SceneError, simulate, with_changes
from springbeam.bodies import isolated
from springbeam.bodies.foreign import ForeignBody
from springbeam.bodies.protocol import FmuError
from springbeam.results.files import load_summary
from springbeam.scene import scene_from_dict

M1 = 2.0
M2 = 3.0
K = 40.0
C = 0.2
V = -0.3
STIFFNESS = 50.0
DAMPING = 0.1
#: Names that a scene may leave out, each with what stands on it.
WITHOUT = {"nothing": (), "velocity, impulse": ("velocity", "impulse")}
DOCS = Path(__file__).parents[2] / "docs"
BAD = scenes.table("bad_inputs.toml")["fmus"]
TABLE = scenes.table("system/foreign.toml")
#: What an FMU does after 1.5 s, and the cause that is named.
LATE = BAD["late"]
ENERGIES = ("kinetic_energy", "potential_energy", "dissipated_energy", "load_potential")


@pytest.fixture(scope="module")
def fmu(tmp_path_factory):
    """Write an FMU; another one takes its place at the same path, so that one process serves them all."""
    folder = tmp_path_factory.mktemp("foreign")
    written = {}

    def make(name="oscillator", **made):
        path = folder / f"{name}.fmu"
        if written.get(name) != made:
            oscillator.made(path, **made)
            written[name] = made
        return str(path)

    return make


def pair(path, **changes):
    """A mass with the velocity V on a foreign oscillator, linked."""
    names = {**oscillator.ALL, "fmu": path, "force_sign": -1, "parameters": {"m": M2, "k": K, "c": C}}
    scene = scene_from_dict(
        {
            "time": {"t_end": 1.0},
            "beam": {"element": "point_mass", "mass": M1, "velocity": V},
            "spring": names,
            "contact": {"law": "link", "stiffness": STIFFNESS, "damping": DAMPING},
            "coupling": {"degree": 2, "macro_step": 0.02},
        }
    )
    return with_changes(scene, **changes)


def swung(A, start, times):
    """The solution of ẋ = A x, whose modes are complete."""
    values, modes = np.linalg.eig(A)
    return ((modes * np.linalg.solve(modes, start)) @ np.exp(np.outer(values, times))).real


def linked(times):
    """The exact displacements of both ends from V and rest, shape (2, n)."""
    k = STIFFNESS
    c = DAMPING
    A = np.zeros((4, 4))
    A[:2, 2:] = np.eye(2)
    A[2:, :2] = np.array([[-k, k], [k, -k - K]]) / [[M1], [M2]]
    A[2:, 2:] = np.array([[-c, c], [c, -c - C]]) / [[M1], [M2]]
    return swung(A, [0.0, 0.0, V, 0.0], times)[:2]


def tied(times, velocity=M1 * V / (M1 + M2)):
    """The exact displacements of both ends as one, from this velocity."""
    A = np.array([[0.0, 1.0], [-K / (M1 + M2), -C / (M1 + M2)]])
    return np.array([swung(A, [0.0, velocity], times)[0]] * 2)


def error(run, exact, *arguments):
    """The largest difference of both ends from `linked` or `tied`, of a run whose energy balance closes."""
    assert run.summary["max_energy_residual"] < 1e-11
    assert run.summary.get("max_interface_residual", 0.0) < 1e-11
    return np.abs(np.array([run.u_tip, run.y]) - exact(run.time, *arguments)).max()


TIE = {"law": "tie"}
#: Of the longest steps inside an FMU [s].
INNER = 0.01


def with_steps_inside(kind, inner, **parameters):
    """The parameters of an oscillator with a solver of others, whose steps are at most ``inner`` [s]."""
    return {"parameters": {"m": M2, "k": K, "c": C, "lie": oscillator.LIES[kind], "inner": inner, **parameters}}


@pytest.mark.parametrize("without", WITHOUT)
def test_link_and_tie_are_exact_and_keep_the_interface_energy(fmu, without):
    """An end that takes no impulse starts as fast as the other."""
    spring = dict.fromkeys((*WITHOUT[without], *ENERGIES))
    assert error(simulate(pair(fmu(), spring=spring)), linked) < 1e-9
    start = 0.2 if "impulse" in spring else 0.0
    spring["parameters"] = {"m": M2, "k": K, "c": C, "v0": start}
    run = simulate(pair(fmu(), spring=spring, beam={"velocity": start or V}, contact=TIE))
    assert error(run, tied, *([start] if start else [])) < 1e-12
    assert run.summary["resolved"]


ELEMENT = {"element": "spring_damper", "mass": M2, "stiffness": K, "damping": C}


@pytest.mark.parametrize(
    ("heavy", "position", "restitution"),
    [*((heavy, -0.01, 0.5) for heavy in TABLE["heavy"]), ("by the FMU", 0.0, 0.0), ("by a load", 0.0, 0.0)],
)
def test_the_seated_force_is_the_body_s(fmu, heavy, position, restitution):
    """It falls or starts on the foundation and comes to rest on it; the foundation bears 8 N + k φ."""
    k = TABLE["heavy"][heavy]["k"]
    scene = pair(
        fmu(),
        beam={"element": "point_mass", "mass": 1e-3, "displacement": 5.0, "velocity": 0.0},
        stop={"position": position, "restitution": restitution},
        contact={"law": "compliance", "stiffness": 1e4, "damping": 0.0, "exponent": 1.0},
        coupling={"degree": 0},
        **TABLE["heavy"][heavy]["change"],
    )
    run = simulate(scene)
    assert kinds(run)[-1] == "seated"
    assert run["foundation_force"][-1] == pytest.approx(8.0 + k * position, rel=1e-9)
    assert run.y[-1] == pytest.approx(position, abs=1e-14)
    assert run.summary["max_energy_residual"] < 1e-9


@pytest.mark.parametrize(("scheme", "version"), [("jacobi", "2.0"), ("gauss_seidel", "2.0"), ("jacobi", "3.0")])
def test_without_state_saving_values_are_exchanged(fmu, scheme, version):
    path = fmu(version=version, state=False, slopes=False)
    spring = dict.fromkeys(ENERGIES)
    errors = []
    for size in (2e-3, 1e-3):
        coupling = {"scheme": scheme, "degree": 0, "macro_step": size}
        run = simulate(pair(path, spring=spring, coupling=coupling, time={"t_end": 0.1}))
        assert run.summary["spring_rollbacks"] == 0
        errors.append(np.abs(run.y - linked(run.time)[1]).max())
    assert 0.9 < np.log2(errors[0] / errors[1]) < 1.1


def test_steps_of_one_size_stay_of_one_size(fmu):
    """Also after an impact, and where a load begins."""
    pulse = {"on": "tip", "signal": "half_sine", "start": 0.1, "duration": 0.3}
    for changes in ({"contact": TIE}, {"loads": [pulse]}):
        run = simulate(pair(fmu(variable=False), coupling={"degree": 0}, **changes))
        assert np.diff(run.time[run.time > 0.0]) == pytest.approx(0.02, rel=1e-9)


@pytest.mark.parametrize("what", BAD["refused"])
def test_an_fmu_that_cannot_be_used_is_refused_before_the_run(fmu, what):
    made = dict(BAD["refused"][what].get("fmu", {}))
    if "units" in made:
        made["edits"] = oscillator.in_units("s", made.pop("units"), made.pop("bases", {}))
    case = scenes.without_false(BAD["refused"][what])
    case.pop("fmu", None)
    if "lie" in case:
        parameters = {"m": M2, "k": K, "lie": oscillator.LIES[case.pop("lie")], "inner": INNER}
        case["spring"] = {**case.get("spring", {}), "parameters": parameters}
    said = case.pop("said")
    with pytest.raises((FmuError, SceneError)) as caught:
        simulate(pair(fmu(**made), **case))
    assert any(all(text in line for text in said) for line in str(caught.value).splitlines())


@pytest.mark.parametrize("macro_step", [1e-2, 1e-3])
@pytest.mark.parametrize("kind", ["explicit", "semi-implicit"])
@pytest.mark.parametrize("law", TABLE["euler"])
def test_contact_with_a_solver_of_order_1_is_right_to_that_order(fmu, law, kind, macro_step):
    """Errors are in proportion to the steps inside, also where a macro step is one of them.

    The displacement that a force causes over a step of K Euler steps is short or long by 1/K: a tie doubled the
    difference of both velocities every few steps, to 0.47 m of 7 mm, and the contact force had the wrong sign.
    """
    tables = {"coupling": {"degree": 0, "macro_step": macro_step}, **TABLE["euler"][law]["change"]}
    exact = simulate(pair(fmu(), spring=ELEMENT, **tables))
    times = np.linspace(macro_step, 1.0, 300)
    errors = []
    for inner in (1e-3, 5e-4):
        run = simulate(pair(fmu(), spring=with_steps_inside(kind, inner), **tables))
        assert kinds(run) == kinds(exact)
        assert run.summary["max_interface_residual"] < 1e-11
        assert any("its solver is of order 1" in warning for warning in run.summary["warnings"])
        a, b = run.at(times), exact.at(times)
        errors.append(np.array([np.abs(a[name] - b[name]).max() for name in ("y", "contact_force")]))
    assert (errors[0] < TABLE["euler"][law]["most"]).all()
    assert 1.6 < errors[0][0] / errors[1][0] < 2.4


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_an_fmu_with_internal_steps_is_run_in_steps_of_one_size(fmu, version):
    """Trial steps of 1 µs move it by 10 ms: the sign of its force was that of a rounding, its mass 1e-16 kg."""
    scene = pair(fmu(version=version), spring=with_steps_inside("grid", INNER), coupling={"degree": 0})
    run = simulate(scene)
    exact = simulate(pair(fmu(), coupling={"degree": 0}))
    assert error(run, linked) == pytest.approx(error(exact, linked), rel=1e-6)
    assert any("it moves in internal steps" in warning for warning in run.summary["warnings"])


def test_a_slope_that_an_fmu_does_not_follow_is_not_used(fmu):
    """OpenModelica's FMUs say canInterpolateInputs and ignore derivatives: a warning, and the run of degree 0."""
    spring = {"parameters": {"m": M2, "k": K, "c": C, "lie": oscillator.LIES["slopes"]}}
    run = simulate(pair(fmu(), spring=spring, coupling={"degree": None}))
    said = simulate(pair(fmu(slopes=False), coupling={"degree": None}))
    assert np.array_equal(run.y, said.y)
    assert run.summary["degree"] == 0
    assert any("a force that grows over a step is not followed" in warning for warning in run.summary["warnings"])


def test_units_that_an_fmu_declares_are_converted(fmu, tmp_path):
    """F [kN] = m [kg] a [mm/ms²], k [kN/mm] and c [kN ms/mm]: 1e-6 and 1e-3 of their values in SI units."""
    path = fmu(edits=oscillator.in_units("ms", TABLE["units"], TABLE["bases"]))
    scene = pair(path, spring={"parameters": {"m": M2, "k": 1e-6 * K, "c": 1e-3 * C}})
    run = simulate(scene)
    assert error(run, linked) < 1e-9
    tie = {"spring": {"parameters": {"m": M2, "k": 1e-6 * K, "c": 1e-3 * C}}, "contact": TIE}
    assert error(simulate(pair(path, **tie)), tied) < 1e-12  # by an impulse
    file = tmp_path / "scene.toml"
    file.write_text(tomli_w.dumps(scene.model_dump(exclude_none=True)), encoding="utf-8")
    shown = printed("doctor", file)
    assert "the time is in ms, that is 0.001 s" in shown
    assert "x is in mm, that is 0.001 m" in shown
    assert "SI units are assumed" not in shown
    assert run["e_spring"] == pytest.approx(simulate(pair(fmu())).e_spring, rel=1e-9, abs=1e-12)


def test_the_body_that_the_page_builds_by_python_fmu_is_the_element(tmp_path, monkeypatch):
    """docs/own_fmu.md says how close it is, 1e-12 m: Runge-Kutta steps of order 4 at H = 1e-3 s."""
    monkeypatch.syspath_prepend(DOCS)
    page = importlib.import_module("own_fmu")
    python = page.built(tmp_path)
    below = page.body(python, m=1.0, k=30.0, c=0.5)
    above = page.body(python, m=2.0, k=30.0, c=0.5, v0=-0.5)
    run, _, apart = page.compared(above, below, page.LINK)
    assert apart < 1e-11
    assert run.summary["max_interface_residual"] < 1e-11


#: Where a body of Python raises an exception: the line before it, and what is reported.
RAISES = {
    "step": ("def do_step(self, time, size):", "cannot step at t"),
    "initialisation": ("def exit_initialization_mode(self):", "cannot be initialised"),
    "instantiation": ("self.m = 1.0", "cannot be instantiated"),
}


@pytest.mark.parametrize("place", RAISES)
def test_what_an_exception_of_a_body_of_python_says_is_reported(tmp_path, place):
    line, said = RAISES[place]
    text = re.search(r"```py\n(from pythonfmu .*?)```", (DOCS / "own_fmu.md").read_text("utf-8"), re.S)[1]
    raising = 'if "resources" in __file__: raise KeyError("no row of the table")'
    before, after = text.split(line)
    (tmp_path / "msd.py").write_text(f"{before}{line}\n        {raising}{after}", encoding="utf-8")
    build = [sys.executable, "-m", "pythonfmu", "build", "-f", "msd.py", "--handle-state"]
    subprocess.run(build, cwd=tmp_path, check=True)
    python = {"fmu": str(tmp_path / "MassSpringDamper.fmu"), "force": "F", "displacement": "x", "velocity": "v"}
    beam = {"element": "point_mass", "mass": M1}
    contact = {"law": "link", "stiffness": STIFFNESS}
    scene = scene_from_dict({"time": {"t_end": 1.0}, "beam": beam, "spring": python, "contact": contact})
    with pytest.raises(FmuError, match=rf"{said}.*KeyError\('no row of the table'\)"):
        simulate(scene)


@pytest.fixture
def hanging(monkeypatch):
    """Tell whether an FMU hangs, which it says itself; patience is then at its end, and an hour has passed."""
    asked = []
    ask = isolated.FmuProcess.ask
    clock = isolated.monotonic
    poll = Connection.poll

    def noted(self, *arguments):
        asked.append(self._errors)
        return ask(self, *arguments)

    def hangs():
        return any("hanging" in path.read_text() for path in asked[-1:] if path.exists())

    def polled(self, patience):
        while not poll(self, 0.05):
            if hangs() and patience < 3600.0:
                return False
        return True

    monkeypatch.setattr(isolated.FmuProcess, "ask", noted)
    monkeypatch.setattr(isolated, "monotonic", lambda: clock() + 3600.0 * hangs())
    monkeypatch.setattr(Connection, "poll", polled)
    return hangs


def test_ctrl_c_names_an_fmu_that_does_not_return(fmu, monkeypatch, hanging):
    monkeypatch.setattr(ForeignBody, "PATIENCE", HANGS + 3600.0)  # it is not given up before

    def interrupting():
        while not hanging():
            sleep(0.01)
        os.kill(os.getpid(), signal.SIGINT)

    parameters = {"m": M2, "k": K, "lie": oscillator.LIES["late hang"]}
    interrupt = threading.Thread(target=interrupting)
    interrupt.start()
    with pytest.raises(RunStopped, match=r"interrupted, for it .* from its step at t = 1\.5 s"):
        simulate(pair(fmu(), spring={"parameters": parameters}, time={"t_end": 2.0}))
    interrupt.join()


@pytest.mark.usefixtures("hanging")
def test_a_crash_in_mid_run_loses_nothing(fmu, tmp_path):
    rows = {}
    for lie in ("none", *LATE):
        scene = pair(fmu(), spring={"parameters": {"m": M2, "k": K, "lie": oscillator.LIES[lie]}}, time={"t_end": 2.0})
        (tmp_path / "scene.toml").write_text(tomli_w.dumps(scene.model_dump(exclude_none=True)))
        done = command("run", tmp_path / "scene.toml", "--out", tmp_path / lie, "--no-plots", "-q")
        rows[lie] = (tmp_path / lie / "trajectory.csv").read_bytes()
        if lie == "none":
            continue
        summary = load_summary(tmp_path / lie)
        assert (done.exit_code, summary["status"]) == (3, "stopped")
        assert LATE[lie] in done.stderr
        assert LATE[lie] in summary["cause"]
        assert summary["time"] == pytest.approx(1.5, abs=0.02)
        assert rows["none"].startswith(rows[lie])
        assert rows[lie].count(b"\n") == pytest.approx(1.5 / 0.02, abs=3)


def test_events_are_those_of_the_element(fmu):
    """A mass falls on a foreign oscillator above a lossy foundation; trial steps of H/256 show when they part."""
    tables = {
        "beam": {"displacement": 0.01, "velocity": -1.0, "external_force": -5.0},
        "stop": {"position": -0.05, "restitution": 0.6},
        "contact": {"law": "transmission"},
        "coupling": {"macro_step": 0.01},
    }
    below = {"parameters": {"m": M2, "k": 400.0, "c": C}}
    scene = pair(fmu(), spring=below, **tables)
    run = simulate(scene)
    exact = simulate(pair(fmu(), spring={**ELEMENT, "stiffness": 400.0}, **tables))
    assert kinds(run) == kinds(exact)
    assert {"impact", "stop_impact", "release", "separation"} <= set(kinds(run))
    assert [e.time for e in run.events] == pytest.approx([e.time for e in exact.events], abs=5e-9)
    assert exact.summary["max_energy_residual"] < 1e-11
    assert run.summary["max_interface_residual"] < 1e-12
