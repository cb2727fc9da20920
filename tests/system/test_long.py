"""Long runs: memory stays flat, the energy is kept, the time does not drift.

SPRINGBEAM_STEPS=1000000 .venv/bin/python -m pytest tests/system/test_long.py -s     makes them long (minutes each).
"""

import json
import os
import subprocess
import sys

import numpy as np

from springbeam.results.files import load_events
from springbeam.scene import load_scene, with_changes

STEPS = int(os.environ.get("SPRINGBEAM_STEPS", "10000"))
H = 2e-3

#: Meets, bounces, is released and hits the foundation; everything takes a little energy, until the ends stay joined.
SCENE = with_changes(
    load_scene("soft"),
    time={"t_end": STEPS * H},
    beam={"n_elements": 10, "alpha_b": 1e-6},
    spring={"damping": 1e-3},
    stop={"restitution": 0.999},
    coupling={"macro_step": H},
)

#: Run with a scene, a directory and a number of steps; prints what Python and numpy hold of what they have allocated
#: since the first tenth [bytes], after each other tenth, and the summary.
RUN = """
import gc, json, sys, tracemalloc
from springbeam.results.directory import RunDirectory
from springbeam.results.recording import FileRecorder
from springbeam.run.runner import run
from springbeam.scene import scene_from_dict

scene, tenth, held = scene_from_dict(json.loads(sys.argv[1])), int(sys.argv[3]) // 10, []

def progress(time, phase, macro_steps):
    if macro_steps >= tenth * (len(held) + 1):
        gc.collect()
        held.append(tracemalloc.get_traced_memory()[0])
        tracemalloc.start()

with FileRecorder(scene, RunDirectory.create(sys.argv[2])) as recorder:
    print(json.dumps([run(scene, recorder, progress), held]))
"""


def test_a_long_run(tmp_path):
    directory = tmp_path / "run"
    arguments = [json.dumps(SCENE.model_dump(exclude_none=True)), str(directory), str(STEPS)]
    output = subprocess.run([sys.executable, "-c", RUN, *arguments], stdout=subprocess.PIPE, text=True, check=True)
    summary, held = json.loads(output.stdout)
    time = np.loadtxt(directory / "trajectory.csv", delimiter=",", skiprows=1, usecols=0)
    events = list(load_events(directory))
    (directory / "trajectory.csv").unlink()  # 0.3 GB a million steps, which pytest would keep
    print(f"{len(events)} events, energy residual {summary['max_energy_residual']:.1e}, memory {held}")
    assert (summary["status"], summary["max_energy_residual"] <= 1e-8) == ("done", True)
    assert len(events) > STEPS // 1000
    # Two tenths of the steps in, everything is allocated. Rows kept in memory would be 168 bytes each as doubles; a
    # buffer holds some for a time.
    assert held[-1] - held[1] < 0.5 * 168 * 0.8 * STEPS
    # Macro steps end on t₀ + k H, not on a sum of H; only events and the rest of their step are in between.
    grid = H * np.arange(STEPS + 1)
    assert time[-1] == SCENE.time.t_end == grid[-1]
    assert np.count_nonzero(~np.isin(time, grid)) <= 2 * len(events)
    assert np.count_nonzero(~np.isin(grid, time)) <= len(events)
