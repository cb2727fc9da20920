"""SIGKILL at random moments: what is there loads, and the resumed run is, byte for byte, the one never killed.

SPRINGBEAM_SEED chooses the moments, SPRINGBEAM_KILLS how many. A moment is a share of the rows that the whole run
writes, so that it does not depend on how fast the machine is.
"""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from commands import HANGS, written

from springbeam.results.reading import load_trajectory

pytestmark = [
    pytest.mark.skipif(os.name == "nt", reason="POSIX processes"),
    pytest.mark.usefixtures("fmu_folder"),
]

SEED = int(os.environ.get("SPRINGBEAM_SEED", "20240607"))
KILLS = int(os.environ.get("SPRINGBEAM_KILLS", "20"))
#: Beside wall times, all that may differ.
TIMES = ("setup_time", "wall_time")

#: Each some tenths of a second long; every law, and a scheme of each kind.
COMMANDS = {
    "energy": ["soft", "--set", "time.t_end=1", "--set", "coupling.macro_step=5e-4"],
    "hermite": ["soft", "--set", "coupling.scheme=hermite", "--set", "coupling.degree=2", "--set", "beam.n_modes=20"],
    "compliance": ["soft", "--set", "contact.law=compliance", "--set", "contact.exponent=1"],
    "paper": ["paper-fig4", "--set", "contact.law=paper", "--set", "beam.n_elements=100", "--set", "beam.n_modes=0"],
    "stop": ["beam-on-stop", "--set", "coupling.macro_step=5e-4"],
}  # fmt: skip

#: Runs commands in children of a process that has imported everything, so that a kill seldom meets an import.
NURSERY = """
import json, os, sys
from springbeam import cli
from springbeam.run import runner

for line in sys.stdin:
    arguments, log = json.loads(line)
    child = os.fork()
    if child == 0:
        os.setsid()
        output = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        for stream in (1, 2):
            os.dup2(output, stream)
        sys.argv = ["springbeam", *arguments]
        cli.main()
        os._exit(99)
    print(child, flush=True)
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""


class Nursery:
    def __init__(self, log: Path) -> None:
        self._log = log
        self._process = subprocess.Popen(
            [sys.executable, "-c", NURSERY], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def run(self, *arguments: object, kill_at: tuple[float, Path, int] | None = None) -> int:
        """Return the exit code, −9 if it was killed: after some seconds, and once a file has so many bytes."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        json.dump([[str(argument) for argument in arguments], str(self._log)], self._process.stdin)
        self._process.stdin.write("\n")
        self._process.stdin.flush()
        child = int(self._process.stdout.readline())
        if kill_at is not None:
            seconds, file, enough = kill_at
            time.sleep(seconds)
            while size_of(file) < enough and Path(f"/proc/{child}").exists():
                time.sleep(1e-3)
            with suppress(ProcessLookupError):  # done already, or not yet a group of its own
                os.killpg(child, signal.SIGKILL)
        return int(self._process.stdout.readline())

    def said(self) -> str:
        text = self._log.read_text()
        self._log.write_text("")
        return text

    def close(self) -> None:
        self._process.communicate(timeout=HANGS)


@pytest.fixture(scope="module")
def nursery(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Nursery]:
    started = Nursery(tmp_path_factory.mktemp("nursery") / "log")
    yield started
    started.close()


def size_of(file: Path) -> int:
    return file.stat().st_size if file.exists() else 0


def summary(directory: Path) -> dict[str, Any]:
    loaded = json.loads((directory / "summary.json").read_text())
    return {key: value for key, value in loaded.items() if key not in TIMES}


def check_killed(directory: Path, whole: dict[str, bytes]) -> None:
    """Whole lines that load, the first of those that the whole run writes."""
    if not (directory / "summary.json").exists():
        return  # killed before its first row
    trajectory = load_trajectory(directory)
    assert trajectory.summary["status"] in ("running", "done")  # the latter while the process ends
    for name, content in written(directory).items():
        assert whole[name].startswith(content)
    assert len(trajectory) == len((directory / "trajectory.csv").read_bytes().splitlines()) - 1


def test_a_run_killed_at_random_moments_goes_on_to_the_same_bytes(nursery: Nursery, tmp_path: Path) -> None:
    rng = random.Random(SEED)
    kills = resumed = attempts = 0
    while kills < KILLS:
        attempts += 1
        assert attempts < 5 * KILLS, "the runs end before they can be killed"
        law = rng.choice(list(COMMANDS))
        reference = tmp_path / law
        if not reference.exists():
            assert nursery.run("run", *COMMANDS[law], "--out", reference, "-q", "--no-plots") == 0, nursery.said()
        whole = written(reference)
        directory = tmp_path / f"killed-{attempts}"
        rows, checkpoint = directory / "trajectory.csv", directory / "run.checkpoint"
        interval = rng.choice([0.01, 0.05])
        start = ["run", *COMMANDS[law], "--out", directory, "-q", "--no-plots", "--force", "--checkpoint", interval]
        go_on = ["resume", directory, "-q", "--no-plots"]
        command = start
        for _ in range(rng.choice([1, 2, 3])):
            # One kill in five waits for no row, and so meets the start of the run.
            share, there = max(0.0, rng.uniform(-0.25, 1.0)), size_of(rows)
            seconds = 0.0 if share else rng.uniform(0.0, 0.1)
            enough = there + int(share * (len(whole[rows.name]) - there))
            code = nursery.run(*command, kill_at=(seconds, rows, enough))
            if code != -signal.SIGKILL:
                break
            kills += 1
            check_killed(directory, whole)
            if (directory / "summary.json").exists() and summary(directory)["status"] == "done":
                code = 0
                # Removed after the last word of the summary: the other order could lose both.
                checkpoint.unlink(missing_ok=True)
                break
            resumed += checkpoint.exists()
            command = go_on if checkpoint.exists() else start
        if code != 0:
            nursery.said()
            code = nursery.run(*command)
        assert code == 0, nursery.said()
        assert written(directory) == whole
        assert summary(directory) == summary(reference)
        assert sorted(path.name for path in directory.iterdir()) == sorted([*whole, "summary.json"])
    assert resumed >= KILLS // 4, f"only {resumed} of {kills} runs had taken a checkpoint"
