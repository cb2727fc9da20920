"""A scene for many macro steps into files: long_run.py SCENE_AS_JSON DIRECTORY STEPS prints, for every tenth of the
steps, memory in use [bytes] and the mean time of a tied step [s]; then the summary."""

from __future__ import annotations

import json
import os
import sys
from time import perf_counter

from springbeam.results.directory import RunDirectory
from springbeam.results.file_recorder import FileRecorder
from springbeam.run.runner import run
from springbeam.scene import scene_from_dict


def main(scene_as_json: str, directory: str, steps: int) -> None:
    scene = scene_from_dict(json.loads(scene_as_json))
    marks: list[tuple[int, float]] = []
    due = steps // 10
    last, before, tied, spent = perf_counter(), "", 0, 0.0

    def progress(time: float, phase: str, macro_steps: int) -> None:
        nonlocal due, last, before, tied, spent
        now = perf_counter()
        if phase == before == "tied":  # without events, which other phases have more of
            tied, spent = tied + 1, spent + now - last
        if macro_steps >= due:
            due += steps // 10
            with open("/proc/self/statm") as memory:
                resident = int(memory.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")
            marks.append((resident, spent / max(tied, 1)))
            tied, spent = 0, 0.0
        last, before = now, phase

    with FileRecorder(scene, RunDirectory.create(directory)) as recorder:
        summary = run(scene, recorder, progress)
    print(json.dumps([marks, summary]))


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]))
