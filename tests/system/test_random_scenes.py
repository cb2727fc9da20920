"""Random scenes, valid and spoilt: done, stopped or refused, by name, and never anything that is not a number.

SPRINGBEAM_SEED chooses other scenes, SPRINGBEAM_EXAMPLES how many.
"""

from __future__ import annotations

import json
import os
import tempfile
import warnings
from collections.abc import Callable
from math import isfinite, sqrt
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from commands import command
from hypothesis import HealthCheck, event, given, seed, settings
from hypothesis import strategies as st

from springbeam.results.reading import load_trajectory
from springbeam.run.rows import Rows
from springbeam.scene import Scene, SceneError, load_scene

pytestmark = pytest.mark.usefixtures("fmu_folder")

Tables = dict[str, dict[str, Any]]
EXAMPLES = int(os.environ.get("SPRINGBEAM_EXAMPLES", "25"))
MOST_ROWS = 500


def randomized(test: Callable[[], None]) -> Callable[[], None]:
    chosen = os.environ.get("SPRINGBEAM_SEED")
    if chosen is not None:
        test = seed(int(chosen))(test)
    return settings(
        max_examples=EXAMPLES,
        derandomize=chosen is None,
        database=None,
        deadline=None,
        suppress_health_check=list(HealthCheck),
    )(test)


def decades(low: float, high: float) -> st.SearchStrategy[float]:
    """10^low … 10^high, evenly over the decades."""
    return st.floats(low, high).map(lambda exponent: float(f"{10.0**exponent:.4g}"))


def signed(numbers: st.SearchStrategy[float]) -> st.SearchStrategy[float]:
    return st.one_of(st.just(0.0), numbers, numbers.map(lambda x: -x))


@st.composite
def scenes(draw: st.DrawFn) -> Tables:
    """Some sixty macro steps of a scene that is valid but for what does not go together."""
    some = draw(st.sampled_from(["pair", "pair with stop", "pair with stop", "beam", "beam on stop", "spring"]))
    step = draw(decades(-4, -1))
    tables: Tables = {"time": {"t_end": step * draw(st.integers(1, 60))}}
    height = draw(signed(decades(-4, 0)))
    if "beam" in some or "pair" in some:
        elements, degree = draw(st.integers(1, 12)), draw(st.sampled_from([1, 1, 1, 2, 3]))
        tables["beam"] = {
            "density": draw(decades(-2, 4)),
            "area": draw(decades(-4, 1)),
            "second_moment_of_area": draw(decades(-6, 1)),
            "young_modulus": draw(decades(0, 11)),
            "shear_modulus": draw(decades(0, 11)),
            "shear_coefficient": draw(st.sampled_from([1.0, 5 / 6])),
            "length": draw(decades(-1, 1)),
            "alpha_b": draw(st.one_of(st.just(0.0), decades(-6, 0))),
            "n_elements": elements,
            "element_degree": degree,
            "n_modes": draw(st.sampled_from([0, 0, 1, elements])),
            "reduced_integration": draw(st.booleans()),
            "mass_matrix": draw(st.sampled_from(["consistent", "averaged"])),
            "integrator": draw(st.sampled_from(["modal", "modal", "generalized_alpha"])),
            "rho_inf": draw(st.sampled_from([1.0, 0.8, 0.0])),
            "distributed_load": draw(signed(decades(-2, 3))),
            "initial_velocity_slope": -draw(decades(-2, 2)),
            "approach": draw(st.sampled_from(["undeformed", "elastic"])),
            "fidelity": draw(st.sampled_from(["dynamic"] * 5 + ["quasi_static"])),
        }
        above = draw(st.one_of(st.just(0.0), decades(-3, -1)))
        tables["beam"]["initial_deflection_slope"] = (height + above) / tables["beam"]["length"]
    if "spring" in some or "pair" in some:
        mass = draw(decades(-4, 2))
        stiffness = min(draw(decades(-1, 8)), mass * (10.0 / step) ** 2)  # some ten radians a step
        tables["spring"] = {
            "mass": mass,
            "damping": draw(st.one_of(st.just(0.0), decades(-3, 1).map(lambda x: x * sqrt(mass * stiffness)))),
            "linear_stiffness": stiffness,
            "cubic_stiffness": draw(signed(decades(-2, 2))) * stiffness,
            "equilibrium": height,
            "external_force": draw(signed(decades(-3, 3))),
            "initial_velocity": draw(signed(decades(-3, 1))),
        }
    if "stop" in some:
        below = draw(decades(-6, -1)) if "pair" in some else 0.0
        tables["stop"] = {
            "position": height - below,
            "restitution": draw(st.sampled_from([1.0, 1.0, 0.0, 0.5, 0.999])),
        }
    tables["contact"] = {
        "law": draw(st.sampled_from(["transmission", "compliance", "paper"])),
        "impact": draw(st.sampled_from(["inelastic", "rest", "tip"])),
        "stiffness": draw(decades(0, 9)),
        "exponent": draw(st.sampled_from([1.0, 1.5, 3.0, 30.0])),
    }
    scheme = draw(st.sampled_from(["energy", "energy", "hermite", "jacobi", "gauss_seidel"]))
    tables["coupling"] = {"scheme": scheme, "degree": draw(st.sampled_from([0, 1, 2]))}
    if draw(st.integers(0, 9)):
        make_possible(draw, tables, some)
    if tables["contact"]["law"] != "paper" and scheme not in ("jacobi", "gauss_seidel") and not draw(st.integers(0, 4)):
        tables["coupling"]["relative_tolerance"] = draw(decades(-6, -1))
    else:
        tables["coupling"]["macro_step"] = step
    return tables


#: Laws, schemes and degrees that go together.
COMBINATIONS = (
    *[("transmission", "energy", (0, 1, 2))] * 3,
    *[("transmission", "hermite", (1, 2))] * 2,
    *[("compliance", "energy", (0, 1, 2))] * 2,
    ("compliance", "jacobi", (0, 1)),
    ("compliance", "gauss_seidel", (0, 1)),
    ("paper", "energy", (0,)),
)


def make_possible(draw: st.DrawFn, tables: Tables, some: str) -> None:
    """Change what does not go together."""
    beam, contact, coupling = tables.get("beam"), tables["contact"], tables["coupling"]
    known = [each for each in COMBINATIONS if each[0] != "paper" or some == "pair with stop"]
    contact["law"], coupling["scheme"], degrees = draw(st.sampled_from(known))
    coupling["degree"] = draw(st.sampled_from(degrees))
    if beam is None:
        return
    if contact["law"] != "transmission" or "spring" not in tables or contact["impact"] == "tip":
        beam["fidelity"] = "dynamic"
    if beam["fidelity"] == "quasi_static":
        beam["approach"] = "undeformed"
        coupling.update(scheme="energy")
    if beam["integrator"] == "generalized_alpha":
        coupling.update(scheme="energy", degree=0)
    if contact["law"] == "paper":
        beam["rho_inf"] = 1.0
    if contact["law"] == "compliance" and some == "beam on stop":
        tables["stop"]["restitution"] = 1.0
    if some != "beam":
        lowest = tables["spring"]["equilibrium"] if "spring" in tables else tables["stop"]["position"]
        reach = 0.5 * tables["time"]["t_end"] * -beam["initial_velocity_slope"] * beam["length"]
        above = beam["initial_deflection_slope"] * beam["length"] - lowest
        beam["initial_deflection_slope"] = (lowest + min(max(above, 0.0), reach)) / beam["length"]


ODD = st.one_of(
    st.sampled_from(
        [0, -1, 0.0, -0.0, 1e300, -1e300, 1e-300, 5e-324, 1e999, -1e999, float("nan"), 10**30, True, False]
    ),
    st.sampled_from(["", "1.0", "paper", "elastic", "é\n", [], [1.0], {}, {"x": 1.0}]),
    st.floats(),
    st.integers(-3, 3),
)


@st.composite
def spoilt(draw: st.DrawFn) -> Tables:
    """A scene with one to three keys or tables changed."""
    tables: Any = draw(scenes())
    for _ in range(draw(st.integers(1, 3))):
        table = draw(st.sampled_from(sorted(tables)))
        content = tables[table]
        keys = sorted(content) if isinstance(content, dict) else []
        what = draw(st.sampled_from(["odd", "odd", "odd", "odd", "key", "table", "rename", "move"]))
        if what == "table" or not keys:
            tables[table] = draw(ODD)
            if draw(st.booleans()):
                del tables[table]
            if not tables:
                return {}
            continue
        key = draw(st.sampled_from(keys))
        if what == "odd":
            content[key] = draw(ODD)
        elif what == "key":
            del content[key]
        elif what == "rename":
            content[draw(st.text(min_size=1, max_size=8))] = content.pop(key)
        else:
            other = tables[draw(st.sampled_from(sorted(tables)))]
            if isinstance(other, dict):
                other[key] = content[key]
    return tables


def cheap(scene: Scene) -> bool:
    """Whether it runs in a moment: what is changed may be a mesh, or the length of the run."""
    beam, spring, coupling = scene.beam, scene.spring, scene.coupling
    step = coupling.macro_step or scene.time.t_end / 60.0
    fast = 0.0
    if spring is not None:
        amplitude = abs(spring.equilibrium) + abs(spring.initial_velocity) * step
        fast = step * sqrt(min(abs(spring.linear_stiffness) / spring.mass, 1e300))
        fast += step * amplitude * sqrt(min(abs(spring.cubic_stiffness) / spring.mass, 1e300))
    few = scene.time.t_end / step < 100 and (beam is None or beam.n_elements * beam.element_degree < 50)
    return few and fast < 1e3


def interrupting(write: Callable[..., None]) -> Callable[..., None]:
    """Ctrl-C for a run of many rows: adaptive steps may be small, and bouncing without end."""
    rows = 0

    def written(self: Rows, state: Any, step: Any) -> None:
        nonlocal rows
        rows += 1
        if rows > MOST_ROWS:
            raise KeyboardInterrupt
        write(self, state, step)

    return written


def check(text: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path, out = Path(folder) / "scene.toml", Path(folder) / "out"
        path.write_bytes(text.encode("utf-8", "surrogatepass"))
        try:
            if not cheap(load_scene(path)):
                event("not run")
                return
        except SceneError:
            pass
        with warnings.catch_warnings(), pytest.MonkeyPatch.context() as patch:
            patch.setattr(Rows, "write", interrupting(Rows.write))
            warnings.simplefilter("error")  # numpy's, of overflow
            result = command("run", path, "--out", out, "--no-plots", "-q")
        event(f"exit code {result.exit_code}")
        assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
        assert result.exit_code in (0, 2, 3)
        assert "Traceback" not in result.output
        if result.exit_code == 2:
            assert result.stderr.startswith("error: ")
            assert not out.exists()
            event("refused: " + " ".join(result.stderr.split(".toml: ")[-1].split()[:3]))
            return
        summary = json.loads((out / "summary.json").read_text(), parse_constant=pytest.fail)
        assert "traceback" not in summary, summary["traceback"]
        trajectory = load_trajectory(out)  # refuses what is not finite
        assert isfinite(float(summary["max_energy_residual"]))
        if result.exit_code == 3:
            assert summary["status"] in ("stopped", "interrupted")
            assert summary["cause"]
            assert summary["cause"] in result.stderr or summary["status"] == "interrupted"
            event(f"stopped: {summary['cause'].split(':')[0][:60]}")
            return
        assert summary["status"] == "done"
        t_end, step = trajectory.scene.time.t_end, trajectory.scene.coupling.macro_step
        if trajectory.scene.contact.law == "paper":  # whole steps only
            assert step is not None
            assert t_end - step < trajectory.time[-1] <= t_end * (1.0 + 1e-9)
        else:
            assert trajectory.time[-1] == t_end


@randomized
@given(scenes())
def test_a_random_scene_is_done_or_stops_by_name(tables: Tables) -> None:
    check(tomli_w.dumps(tables))


@randomized
@given(spoilt())
def test_a_spoilt_scene_is_refused_or_as_any_other(tables: Tables) -> None:
    try:
        text = tomli_w.dumps(tables)
    except (UnicodeEncodeError, TypeError):
        return
    check(text)


@randomized
@given(scenes(), st.data())
def test_a_damaged_file_is_refused_or_as_any_other(tables: Tables, data: st.DataObject) -> None:
    text = tomli_w.dumps(tables)
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(text)))
        cut = data.draw(st.sampled_from([0, 0, 1, 1, 5, 200]))
        text = text[:at] + data.draw(st.text(max_size=3)) + text[at + cut :]
    check(text)
