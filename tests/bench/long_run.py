"""`soft` with losses for many macro steps into files: long_run.py STEPS prints, for every tenth of them, memory in use
[bytes] and the clock [s]."""

from __future__ import annotations

import json
import os
import sys
import tempfile
from time import perf_counter

from springbeam import load_scene, with_changes
from springbeam.recording import FileRecorder, RunDirectory
from springbeam.runner import run

H = 2e-3


def main(steps: int) -> None:
    scene = with_changes(
        load_scene("soft"),
        beam={"n_elements": 10, "alpha_b": 1e-6},
        spring={"damping": 1e-3},
        stop={"restitution": 0.999},
        coupling={"macro_step": H},
        time={"t_end": steps * H},
    )
    marks: list[tuple[int, float]] = []
    due = steps // 10

    def progress(time: float, phase: str, macro_steps: int) -> None:
        nonlocal due
        if macro_steps >= due:
            due += steps // 10
            with open("/proc/self/statm") as memory:
                resident = int(memory.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
            marks.append((resident, perf_counter()))

    with tempfile.TemporaryDirectory() as folder, FileRecorder(scene, RunDirectory.create(folder)) as recorder:
        run(scene, recorder, progress)
    print(json.dumps(marks))


if __name__ == "__main__":
    main(int(sys.argv[1]))
