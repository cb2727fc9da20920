"""Random scenes of extremes: done, stopped or refused, by name, and never anything that is not a number.

SPRINGBEAM_SEED chooses other scenes, SPRINGBEAM_EXAMPLES how many.
"""

import json
import os
import tempfile
import warnings
from contextlib import nullcontext
from math import isfinite
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from commands import Interrupt, command
from hypothesis import HealthCheck, event, given, seed, settings
from hypothesis import strategies as st

from springbeam.results.files import load_trajectory
from springbeam.studies.stability.cells import PARAMETERS, scene_dict

Tables = dict[str, dict[str, Any]]
SEED = os.environ.get("SPRINGBEAM_SEED")
EXAMPLES = int(os.environ.get("SPRINGBEAM_EXAMPLES", "25"))
MOST_STEPS = 500


def decades(low, high):
    """10^low … 10^high, evenly over the decades."""
    return st.floats(low, high).map(lambda exponent: float(f"{10.0**exponent:.4g}"))


@st.composite
def scenes(draw):
    """Some sixty macro steps of an extreme scene: a cell of `springbeam stability`, with what its cells leave out."""
    cell = {axis.name: axis.at(draw(st.floats(0.0, 1.0, exclude_max=True))) for axis in PARAMETERS}
    tables = scene_dict({**cell, "steps": draw(st.integers(10, 60))})
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


@settings(max_examples=EXAMPLES, derandomize=SEED is None, suppress_health_check=list(HealthCheck))
@(seed(int(SEED)) if SEED else lambda test: test)
@given(scenes())
def test_a_random_scene_is_done_or_stops_by_name(tables):
    with tempfile.TemporaryDirectory() as folder:
        path, out = Path(folder) / "scene.toml", Path(folder) / "out"
        path.write_text(tomli_w.dumps(tables))
        with warnings.catch_warnings(), pytest.MonkeyPatch.context() as patch:
            # Adaptive steps may be small, and bouncing without end.
            patch.setattr("springbeam.cli.run._progress", lambda *_, **__: nullcontext(Interrupt(MOST_STEPS)))
            warnings.simplefilter("error")  # numpy's, of overflow
            result = command("run", path, "--out", out, "--no-plots")
        event(f"exit code {result.exit_code}")
        assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
        assert result.exit_code in (0, 2, 3)
        assert "Traceback" not in result.output
        if result.exit_code == 2:
            assert result.stderr.startswith("error: ")
            assert not out.exists()
            return
        summary = json.loads((out / "summary.json").read_text(), parse_constant=pytest.fail)
        run = load_trajectory(out)  # refuses what is not finite
        assert isfinite(float(summary["max_energy_residual"]))
        if result.exit_code == 3:
            assert summary["status"] in ("stopped", "interrupted")
            assert summary["cause"] in result.stderr or summary["status"] == "interrupted"
        else:
            assert (summary["status"], run.time[-1]) == ("done", pytest.approx(run.scene.time.t_end, rel=1e-9))
