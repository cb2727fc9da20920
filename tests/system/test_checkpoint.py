"""What a checkpoint refuses to go on from, and runs that ended early for another reason than a kill."""

import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from itertools import count
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
from commands import HANGS, Interrupt, printed, refused, written

import springbeam
from springbeam import RigidWall, Simulation, SpringDamper, load_scene, with_changes
from springbeam.bodies.protocol import FmuError
from springbeam.results.directory import RunDirectory
from springbeam.results.files import load_trajectory
from springbeam.results.recording import FileRecorder
from springbeam.run import runner
from springbeam.run.checkpoint import Checkpoint, CheckpointRefused

SCENE = with_changes(load_scene("soft"), beam={"n_elements": 10}, coupling={"macro_step": 2e-3})
CHANGES = ["--set", "beam.n_elements=10", "--set", "coupling.macro_step=2e-3"]


def interrupted_into(directory, steps=200, scene=SCENE):
    """With a checkpoint every 40 steps or so, by a clock that is told the time by being asked."""
    with (
        patch("springbeam.run.runner.perf_counter", side_effect=count(1.0)),
        pytest.raises(KeyboardInterrupt),
        FileRecorder(scene, RunDirectory.create(directory)) as recorder,
    ):
        runner.run(scene, recorder, Interrupt(steps), seconds=40.0)
    return directory


@pytest.fixture(scope="module")
def left(tmp_path_factory):
    return interrupted_into(tmp_path_factory.mktemp("left") / "run")


@pytest.fixture
def interrupted(tmp_path, left):
    return Path(shutil.copytree(left, tmp_path / "run"))


def files(directory):
    return {path.name: path.read_bytes() for path in directory.iterdir()}


@pytest.fixture(scope="module")
def whole(tmp_path_factory, fmu_folder):
    directory = tmp_path_factory.mktemp("whole")
    with FileRecorder(SCENE, RunDirectory.create(directory)) as recorder:
        runner.run(SCENE, recorder)
    return directory


# -- values ---------------------------------------------------------------------------------------------------------


def test_a_state_of_another_kind_of_part_is_refused():
    with pytest.raises(ValueError, match="Expected"):
        SpringDamper(1.0).restore(RigidWall(0.0).save())


# -- refused --------------------------------------------------------------------------------------------------------


def checksummed(content):
    """A file with a good checksum of content that no run writes: no accident, but no traceback either."""
    return b"springbeam checkpoint sha256 %s\n%s" % (hashlib.sha256(content).hexdigest().encode(), content)


def refused_untouched(directory, contents):
    """Return what `resume` says of each file in the place of the checkpoint; it touches nothing."""
    for content in contents:
        (directory / "run.checkpoint").write_bytes(content)
        before = files(directory)
        yield refused("resume", directory)
        assert files(directory) == before


def test_a_damaged_checkpoint_is_refused_and_nothing_is_touched(interrupted):
    good = (interrupted / "run.checkpoint").read_bytes()
    damaged = [good[:at] + bytes([good[at] ^ 4]) + good[at + 1 :] for at in (0, 10, 22, 40, 100, 3000)]
    damaged += [good[:size] for size in (0, 1, 21, 60, 120, 2000, -1)]
    damaged += [b"PK\x03\x04", b"{}", b"\xff" * 100, b"springbeam checkpoint\n", b"springbeam checkpoint sha256\n"]
    for said in refused_untouched(interrupted, damaged):
        assert "not a checkpoint of springbeam, or damaged" in said
    forged = [b"\x90", b"\x91" * 100_000, b"nonsense", b"\xc1"]
    for old, new in (
        (b"version", b"visions"),
        (b"macro_steps", b"micro_steps"),
        (b"touch", b"couch"),
        (b"transitions", b"transistors"),
    ):
        forged.append(good.partition(b"\n")[2].replace(old, new, 1))
    for said in refused_untouched(interrupted, map(checksummed, forged)):
        assert said.startswith("error: ")


def test_a_run_without_checkpoints_says_how_to_take_them(interrupted):
    (interrupted / "run.checkpoint").unlink()
    assert "no checkpoint; springbeam run --checkpoint SECONDS takes them" in refused("resume", interrupted)
    (interrupted / "run.checkpoint").mkdir()
    assert f"{interrupted / 'run.checkpoint'}: Is a directory" in refused("resume", interrupted)


def test_another_version_is_refused(interrupted, monkeypatch):
    monkeypatch.setattr(runner, "__version__", "9.9")
    with pytest.raises(CheckpointRefused, match=r"written by springbeam 0\.1\.0, this is 9\.9"):
        springbeam.resume(interrupted)


def test_another_scene_is_refused(interrupted):
    summary = json.loads((interrupted / "summary.json").read_text())
    summary["scene"]["stop"]["restitution"] = 0.5
    (interrupted / "summary.json").write_text(json.dumps(summary))
    with pytest.raises(CheckpointRefused, match=r"summary\.json: its scene is not the one that was run"):
        springbeam.resume(interrupted)


@pytest.mark.parametrize("name", ["beam", "spring"])
def test_another_fmu_is_refused(interrupted, tmp_path, fmu_folder, monkeypatch, name):
    for fmu in ("beam.fmu", "spring.fmu"):
        shutil.copy(fmu_folder / fmu, tmp_path / fmu)
    monkeypatch.setenv("SPRINGBEAM_FMUS", str(tmp_path))
    with (tmp_path / f"{name}.fmu").open("ab") as file:
        file.write(b" ")
    with pytest.raises(CheckpointRefused, match=rf"the run began with another {name}\.fmu"):
        springbeam.resume(interrupted)
    (tmp_path / f"{name}.fmu").unlink()
    with pytest.raises(FmuError, match=rf"{name}\.fmu"):
        springbeam.resume(interrupted)


def test_the_time_that_a_run_has_taken_is_that_of_all_its_parts(interrupted):
    before = Checkpoint.read(interrupted / "run.checkpoint").wall_time  # by the clock of `interrupted_into`
    assert before > 100.0
    assert springbeam.resume(interrupted).summary["wall_time"] > before


# -- atomic ---------------------------------------------------------------------------------------------------------


def test_the_last_checkpoint_stays_when_the_next_cannot_be_written(interrupted, monkeypatch):
    path = interrupted / "run.checkpoint"
    before, names = path.read_bytes(), sorted(os.listdir(interrupted))
    checkpoint = Checkpoint.read(path)

    def no_room(*_):
        raise OSError(28, "No space left on device")

    for function in ("fsync", "replace"):
        with monkeypatch.context() as patched:
            patched.setattr(os, function, no_room)
            with pytest.raises(OSError, match="No space left"):
                checkpoint.write(path)
        assert path.read_bytes() == before
        assert sorted(os.listdir(interrupted)) == names
    checkpoint.write(path)
    assert path.read_bytes() == before


def test_rows_reach_the_disk_before_the_checkpoint_that_counts_them(tmp_path, monkeypatch):
    calls = []
    for name in ("fsync", "replace"):
        original = getattr(os, name)

        def noted(*arguments, name=name, original=original):
            what = arguments[0] if name == "replace" else os.readlink(f"/proc/self/fd/{arguments[0]}")
            calls.append((name, Path(what).name))
            return original(*arguments)

        monkeypatch.setattr(os, name, noted)
    if not Path("/proc/self/fd").exists():
        pytest.skip("no /proc")
    recorder = FileRecorder(SCENE, RunDirectory.create(tmp_path / "run"))
    with recorder, pytest.raises(KeyboardInterrupt):
        runner.run(SCENE, recorder, Interrupt(2), seconds=0.0)
    at = calls.index(("fsync", "shapes.csv"))
    assert calls[at : at + 5] == [
        ("fsync", "shapes.csv"),
        ("fsync", "events.csv"),
        ("fsync", "steps.bin"),
        ("fsync", "run.checkpoint.part"),
        ("replace", "run.checkpoint.part"),
    ]


# -- the command, as a process --------------------------------------------------------------------------------------


LONG = ["run", "soft", *CHANGES, "--set", "time.t_end=4", "--no-plots", "-q"]


@pytest.fixture(scope="module")
def long(tmp_path_factory):
    directory = tmp_path_factory.mktemp("long") / "run"
    printed(*LONG, "--out", directory)
    return directory


def started(directory):
    """The command, once it has taken a checkpoint."""
    program = [sys.executable, "-m", "springbeam", *LONG, "--out", str(directory), "--checkpoint", "0.05"]
    run = subprocess.Popen(program, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + HANGS
    while not (directory / "run.checkpoint").exists():
        assert time.monotonic() < deadline
        time.sleep(0.01)
    return run


@pytest.mark.skipif(os.name == "nt", reason="POSIX signals")
@pytest.mark.parametrize(
    ("number", "share", "code", "status"),
    [(signal.SIGTERM, 0.0, 3, "interrupted"), (signal.SIGKILL, 0.6, -signal.SIGKILL, "running")],
)
def test_a_run_that_is_ended_from_outside_goes_on_to_the_same_bytes(tmp_path, long, number, share, code, status):
    """Once so much is written; test_recording.py has what a kill leaves of each write."""
    directory, whole = tmp_path / "run", written(long)
    run = started(directory)
    while run.poll() is None and (directory / "steps.bin").stat().st_size < share * len(whole["steps.bin"]):
        time.sleep(1e-3)
    run.send_signal(number)
    _, errors = run.communicate(timeout=HANGS)
    assert run.returncode == code
    assert ("interrupted (reached t = " in errors) == (status == "interrupted")
    assert "Traceback" not in errors
    assert load_trajectory(directory).summary["status"] == status
    assert all(whole[name].startswith(content) for name, content in written(directory).items())
    printed("resume", directory, "--no-plots", "-q")
    assert written(directory) == whole
    clocks = ("setup_time", "wall_time")
    left, never = (json.loads((of / "summary.json").read_text()) for of in (directory, long))
    assert {key: left[key] for key in left if key not in clocks} == {
        key: never[key] for key in never if key not in clocks
    }


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="limits of another process")
def test_a_run_without_room_ends_with_3_and_goes_on_where_there_is(tmp_path, long):
    """The limit of a file's size stands for the disk's: no root needed."""
    import resource

    run = started(tmp_path / "run")
    limit = (tmp_path / "run" / "steps.bin").stat().st_size + 50_000
    resource.prlimit(run.pid, resource.RLIMIT_FSIZE, (limit, limit))
    _, errors = run.communicate(timeout=HANGS)
    assert run.returncode == 3
    assert "the run stopped early: " in errors
    assert "File too large" in errors
    # Afterwards a measurement of coverage that has no room either may complain.
    assert "Traceback" not in errors.partition("what was computed is in")[0]
    trajectory = load_trajectory(tmp_path / "run")
    assert trajectory.summary["status"] == "stopped"
    assert "File too large" in trajectory.summary["cause"]
    cut = {name: (tmp_path / "run" / name).read_bytes() for name in ("steps.bin", "shapes.csv")}
    assert max(map(len, cut.values())) == limit  # of whichever grows faster
    assert all((long / name).read_bytes().startswith(content) for name, content in cut.items())
    printed("resume", tmp_path / "run", "--no-plots", "-q")
    assert written(tmp_path / "run") == written(long)


# -- a run goes on from a checkpoint to the same bits, whenever it was stopped and whatever it was doing -------------

SOFT = with_changes(load_scene("soft"), beam={"n_elements": 10}, coupling={"macro_step": 2e-3})
COMPLIANCE = {"law": "compliance", "exponent": 1.0}
SCENES = {
    "energy": SOFT,
    "energy 2, damped": with_changes(SOFT, beam={"alpha_b": 1e-3}, spring={"damping": 0.5}, coupling={"degree": 2}),
    "hermite 2": with_changes(SOFT, coupling={"scheme": "hermite", "degree": 2, "macro_step": 1e-3}),
    "adaptive": with_changes(SOFT, coupling={"relative_tolerance": 1e-4}),
    "midpoint": with_changes(SOFT, beam={"integrator": "midpoint"}),
    "quasi-static": with_changes(
        SOFT, beam={"fidelity": "quasi_static", "alpha_b": 0.1, "distributed_load": -20.0}, coupling={"degree": 1}
    ),
    "compliance": with_changes(SOFT, contact={**COMPLIANCE, "exponent": 1.5}, coupling={"degree": 2}),
    # Some of its steps find their force at degree 0 only.
    "too stiff for its degree": with_changes(
        SOFT, contact={**COMPLIANCE, "stiffness": 1e18}, coupling={"degree": 2, "macro_step": 4e-3}, stop=None
    ),
    "gauss_seidel": with_changes(
        SOFT,
        contact={**COMPLIANCE, "stiffness": 100.0},
        coupling={"scheme": "gauss_seidel", "macro_step": 4e-4},
        time={"t_end": 0.4},
    ),
    # The load presses tip and spring onto the foundation until they stay there.
    "seated": with_changes(
        SOFT,
        beam={"distributed_load": -6.0, "alpha_b": 2e-2},
        spring={"damping": 2.0},
        stop={"restitution": 0.3},
        time={"t_end": 1.0},
    ),
    "loads": with_changes(
        SOFT,
        coupling={"degree": 1},
        spring={"external_force": -5.0, "damping": 2.0},
        stop={"restitution": 0.3},
        loads=[
            {"on": "base", "signal": "harmonic", "frequency": 12.0, "amplitude": 5.0},
            {"on": "beam", "at": 0.4, "signal": "half_sine", "start": 0.01, "duration": 0.3, "amplitude": -9.0},
        ],
    ),
    "beam on a stop": with_changes(SOFT, spring=None, stop={"restitution": 0.4}, beam={"alpha_b": 1e-3}),
    "spring on a stop": with_changes(
        SOFT, beam=None, stop={"restitution": 0.7}, spring={"initial_velocity": -1.0}, time={"t_end": 4.0}
    ),
    "elastic approach": with_changes(SOFT, beam={"approach": "elastic", "initial_deflection_slope": 0.05}),
    "retie": with_changes(load_scene("paper-fig4"), beam={"n_elements": 20, "n_modes": 0}, time={"t_end": 1.2}),
}


def shapes_of(run):
    return np.empty(0) if run.shape_table is None else run.shape_table


@pytest.mark.parametrize("name", SCENES)
def test_a_run_goes_on_from_any_step_to_the_same_bits(name):
    """Everything that is remembered comes back, counts of steps and rollbacks among it."""
    scene, saved = SCENES[name], []
    with Simulation(scene) as whole:
        while not whole.done:
            whole.step()
            saved.append(whole._master.run_state())
    run, records, last = whole.run, whole.recorder.steps(), len(saved) - 1
    assert last > 100
    # After steps that ended on an event, and in between.
    at_events = np.searchsorted(run.time, [event.time for event in run.events])
    assert len(at_events) > 0
    chosen = {int(k) for k in at_events[:: max(1, len(at_events) // 2)]} | {0, last // 2}
    for k in sorted(k for k in chosen if k < last):
        with Simulation(scene) as rest:
            rest._master.go_on(saved[k])
            steps, shapes = records[: k + 2], shapes_of(run)  # the row at the start, and one per step
            events = run.events[: int(steps["events"][-1])]
            rest.recorder.keep(steps, events, shapes[shapes[:, 0] <= steps["time"][-1]] if len(shapes) else shapes)
            rest.finish()
        assert rest._master.run_state() == saved[-1]
        assert rest.recorder.steps().tobytes() == records.tobytes()
        assert rest.run.events == run.events
        assert shapes_of(rest.run).tobytes() == shapes_of(run).tobytes()
        clocks = {"setup_time", "wall_time"}
        assert [(key, rest.run.summary[key]) for key in run.summary.keys() - clocks] == [
            (key, run.summary[key]) for key in run.summary.keys() - clocks
        ]
