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
from springbeam.run.master import Master
from springbeam.scene import Scene, SceneError, load_scene
from springbeam.studies.stability.cells import PARAMETERS, scene_dict

pytestmark = pytest.mark.usefixtures("fmu_folder")

Tables = dict[str, dict[str, Any]]
EXAMPLES = int(os.environ.get("SPRINGBEAM_EXAMPLES", "25"))
MOST_ROWS = 500


def randomized(test: Callable[[], None]) -> Callable[[], None]:
    chosen = os.environ.get("SPRINGBEAM_SEED")
    if chosen is not None:
        test = seed(int(chosen))(test)
    every = list(HealthCheck)
    return settings(max_examples=EXAMPLES, derandomize=chosen is None, suppress_health_check=every)(test)


def decades(low: float, high: float) -> st.SearchStrategy[float]:
    """10^low … 10^high, evenly over the decades."""
    return st.floats(low, high).map(lambda exponent: float(f"{10.0**exponent:.4g}"))


@st.composite
def scenes(draw: st.DrawFn) -> Tables:
    """Some sixty macro steps of an extreme scene: a cell of `springbeam stability`, with what its cells leave out."""
    cell = {axis.name: axis.value(draw(st.floats(0.0, 1.0, exclude_max=True))) for axis in PARAMETERS}
    tables: Tables = scene_dict({**cell, "steps": draw(st.integers(10, 60))})
    contact, coupling = tables["contact"], tables["coupling"]
    if beam := tables.get("beam"):
        beam["length"] = length = draw(decades(-1, 1))
        beam["initial_deflection_slope"] /= length
        beam |= {key: draw(decades(-3, 3)) for key in ("density", "area", "second_moment_of_area")}
        beam["mass_matrix"] = draw(st.sampled_from(["consistent", "averaged"]))
        beam["fidelity"] = beam["fidelity"] if contact["law"] == "transmission" else "dynamic"
    ordinary = coupling["scheme"] in ("jacobi", "gauss_seidel")
    if contact["law"] != "paper" and not ordinary and not draw(st.integers(0, 4)):
        del coupling["macro_step"]
        coupling["relative_tolerance"] = draw(decades(-6, -1))
    return tables


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

    def written(self: Master, step: Any, ends: Any) -> None:
        nonlocal rows
        rows += 1
        if rows > MOST_ROWS:
            raise KeyboardInterrupt
        write(self, step, ends)

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
            patch.setattr(Master, "_record", interrupting(Master._record))
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
