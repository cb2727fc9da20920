"""Result files: exact, complete up to an interruption, never NaN, never overwritten unasked."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from fractions import Fraction
from itertools import cycle

import numpy as np
import pytest
from commands import written
from hypothesis import given, settings
from hypothesis import strategies as st
from runs import PAIR, SCENES

from springbeam.results.directory import (
    ANIMATIONS,
    PICTURES,
    REPORT,
    ResultsExist,
    ResultsInUse,
    ResultsUnreadable,
    RunDirectory,
)
from springbeam.results.file_recorder import FileRecorder
from springbeam.results.reading import load_events, load_summary, load_trajectory
from springbeam.results.recording import MemoryRecorder, NonFiniteValue
from springbeam.results.trajectory import COLUMNS, EVENT_COLUMNS, Event, columns_of
from springbeam.scene import SceneError

SHAPE = np.linspace(0.0, 1.0, 21) ** 2


def a_row(scene=PAIR, time=0.25, **values):
    """A row in the order of the scene's columns."""
    numbers = {name: (i + 1) / 7.0 for i, name in enumerate(columns_of(scene))}
    return tuple({**numbers, "time": time, "phase": "tied", **values}.values())


def record(recorder, rows=3, event=None):
    for i in range(rows):
        recorder.row(a_row(recorder.scene, time=0.1 * i, phase="tied" if i % 2 else "free"))
        if recorder.scene.beam is not None:
            recorder.shape(0.1 * i, SHAPE * i)
    if event is not None:
        recorder.event(event)


def filed(path, **arguments):
    recorder = FileRecorder(PAIR, RunDirectory.create(path))
    record(recorder, **arguments)
    recorder.finish({"status": "done", "macro_steps": 3})
    return recorder


# -- columns ------------------------------------------------------------------------------------------------------


OF_CONTACT = {
    *("contact_force", "contact_force_smoothed", "compliance_force", "tie_reaction", "velocity_mismatch", "e_contact"),
}


@pytest.mark.parametrize(
    ("has", "without"),
    [
        ("all", set()),
        ("no stop", {"foundation_force"}),
        ("no spring", {"y", "z", "e_spring", *OF_CONTACT}),
        ("beam", {"y", "z", "e_spring", *OF_CONTACT, "gap", "foundation_force"}),
        ("spring", {"u_tip", "v_tip", "e_beam", *OF_CONTACT, "gap", "foundation_force"}),
    ],
)
def test_columns_of_absent_bodies_are_left_out_in_order(has, without):
    assert list(columns_of(SCENES[has])) == [name for name in COLUMNS if name not in without]


# -- what both recorders do ---------------------------------------------------------------------------------------


@pytest.fixture(params=["memory", "file"])
def make(request, tmp_path):
    def recorder(scene=PAIR, columns=None):
        if request.param == "memory":
            return MemoryRecorder(scene, columns)
        return FileRecorder(scene, RunDirectory.create(tmp_path / "run"), columns)

    def trajectory(recorder):
        if isinstance(recorder, MemoryRecorder):
            return recorder.trajectory()
        return load_trajectory(recorder.directory.path)

    recorder.trajectory = trajectory
    return recorder


@pytest.mark.parametrize("scene", SCENES.values(), ids=SCENES)
def test_what_is_recorded_comes_back(make, scene):
    recorder = make(scene)
    event = Event(0.05, "stop_impact", y=-0.015 if scene.spring else None, impulse_foundation=0.1, energy_loss=1e-3)
    record(recorder, rows=300, event=event)
    recorder.finish({"status": "done"})
    result = make.trajectory(recorder)
    assert list(result.columns) == list(columns_of(scene))
    assert np.array_equal(result.time, [0.1 * i for i in range(300)])
    assert list(result.phase[:3]) == ["free", "tied", "free"]
    assert result.e_total[7] == (list(columns_of(scene)).index("e_total") + 1) / 7.0
    assert result.events == [event]
    assert result.summary["status"] == "done"
    assert result.scene == scene
    if scene.beam is None:
        assert result.shapes is None
        with pytest.raises(ValueError, match="without a beam"):
            recorder.shape(0.0, SHAPE)
    else:
        times, shapes = result.shapes
        assert np.array_equal(times, result.time)
        assert np.array_equal(shapes, np.outer(np.arange(300), SHAPE))


def test_columns_may_be_chosen(make):
    recorder = make(PAIR, ("time", "phase", "y"))
    recorder.row((0.0, "free", 1.5))
    recorder.row([np.float64(1.0), "seated", np.float32(0.25)])
    recorder.finish({})
    result = make.trajectory(recorder)
    found = {name: values.tolist() for name, values in result.columns.items()}
    assert found == {"time": [0, 1], "phase": ["free", "seated"], "y": [1.5, 0.25]}


def test_nothing_that_is_not_finite_reaches_a_file(make):
    recorder = make()
    recorder.row(a_row(time=0.0))
    bad = cycle((math.nan, math.inf, -math.inf))
    for column in set(COLUMNS) - {"phase", "time"}:
        with pytest.raises(NonFiniteValue, match=rf"^{column} = .* at t = 0\.75 s") as refusal:
            recorder.row(a_row(time=0.75, **{column: next(bad)}))
        assert (refusal.value.column, refusal.value.time) == (column, 0.75)
    with pytest.raises(NonFiniteValue, match="time = inf"):
        recorder.row(a_row(time=math.inf))
    with pytest.raises(NonFiniteValue, match=r"u_4 = inf at t = 0\.5 s"):
        recorder.shape(0.5, np.where(np.arange(21) == 4, np.inf, 0.0))
    with pytest.raises(NonFiniteValue, match="time"):
        recorder.shape(math.nan, SHAPE)
    with pytest.raises(NonFiniteValue, match=r"energy_loss of event 'impact' = nan at t = 0\.5 s"):
        recorder.event(Event(0.5, "impact", energy_loss=math.nan))
    with pytest.raises(NonFiniteValue, match="u_tip of event"):
        recorder.event(Event(0.5, "impact", u_tip=-math.inf))
    recorder.finish({"residual": math.nan, "history": [1.0, math.inf]})
    result = make.trajectory(recorder)
    assert len(result) == 1
    assert result.events == []
    assert len(result.shapes[0]) == 0


@pytest.mark.parametrize(
    "bad",
    [
        lambda r: r.row((0.0, 1.0)),
        lambda r: r.row(a_row(phase="tied,")),
        lambda r: r.row(a_row(phase="")),
        lambda r: r.event(Event(0.0, "bang")),
        lambda r: r.shape(0.0, np.zeros(20)),
    ],
    ids=["short", "phase", "no phase", "kind", "points"],
)
def test_what_a_file_cannot_hold_is_refused(make, bad):
    recorder = make()
    with pytest.raises(ValueError, match=r"row|phase|kind|shape"):
        bad(recorder)


# -- files --------------------------------------------------------------------------------------------------------

finite = st.floats(allow_nan=False, allow_infinity=False)


@settings(max_examples=60)
@given(values=st.lists(st.tuples(finite, finite), min_size=1, max_size=40))
def test_numbers_survive_a_file_bit_for_bit(tmp_path_factory, values):
    path = tmp_path_factory.mktemp("run")
    recorder = FileRecorder(PAIR, RunDirectory(path), ("time", "phase", "y"))
    for time, y in values:
        recorder.row((time, "tied", y))
        recorder.event(Event(time, "release", y=y, impulse_contact=y))
        recorder.shape(time, np.full(21, y))
    recorder.finish({})
    result = load_trajectory(path)
    expected = np.array(values)
    assert np.column_stack([result.time, result.y]).tobytes() == expected.tobytes()
    assert np.array([(e.time, e.impulse_contact) for e in result.events]).tobytes() == expected.tobytes()
    assert np.column_stack([result.shapes[0], result.shapes[1][:, 20]]).tobytes() == expected.tobytes()


def test_files_are_plain_csv_and_json(tmp_path):
    filed(tmp_path / "run", event=Event(0.1, "impact", y=0.5, z=-1.0, energy_loss=0.25))
    text = (tmp_path / "run" / "trajectory.csv").read_bytes().decode()
    lines = text.split("\n")
    assert lines[0].split(",") == list(COLUMNS)
    assert Fraction(lines[1].split(",")[1]) == Fraction(repr(2 / 7))
    assert "\r" not in text
    assert (tmp_path / "run" / "events.csv").read_text().splitlines() == [
        ",".join(EVENT_COLUMNS),
        "0.1,impact,0.5,-1.0,,,0.0,0.0,0.25",
    ]
    summary = json.loads((tmp_path / "run" / "summary.json").read_text(encoding="utf-8"))
    assert summary["macro_steps"] == 3
    assert summary["scene"]["spring"]["cubic_stiffness"] == -0.2
    assert sorted(p.name for p in (tmp_path / "run").iterdir()) == WRITTEN


def test_summaries_take_numpy_and_name_what_json_has_no_number_for(tmp_path):
    given = {
        "count": (np.int64(3), 3),
        "size": (np.float64(0.5), 0.5),
        "flag": (np.bool_(True), True),
        "list": (np.array([0.0, math.nan]), [0.0, "NaN"]),
        "path": (tmp_path, str(tmp_path)),
        "nested": ({"worst": -math.inf}, {"worst": "-Infinity"}),
        "nothing": (None, None),
    }
    FileRecorder(PAIR, RunDirectory.create(tmp_path)).finish({name: value for name, (value, _) in given.items()})
    summary = load_summary(tmp_path)
    del summary["scene"]
    assert summary == {name: read for name, (_, read) in given.items()}


def test_all_that_is_recorded_can_be_loaded_while_the_run_goes_on(tmp_path):
    recorder = FileRecorder(PAIR, RunDirectory.create(tmp_path))
    for rows in (0, 1, 2, 3):
        record(recorder, rows=min(rows, 1), event=Event(0.0, "impact", y=0.5))
        result = load_trajectory(tmp_path)
        assert list(result.columns) == list(COLUMNS)
        assert (len(result), len(result.events), result.shapes[1].shape) == (rows, rows + 1, (rows, 21))
        assert result.summary["status"] == "running"
    recorder.close()


# -- damaged files ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("cut", [1, 2, 7, 40])
@pytest.mark.parametrize("name", ["trajectory.csv", "shapes.csv", "events.csv"])
def test_an_incomplete_last_line_is_left_out(tmp_path, name, cut):
    """Cut anywhere: half a number would read as another number."""
    run = filed(tmp_path / "run", event=Event(0.1, "impact", y=1.0 / 3.0, z=-2.0 / 3.0, u_tip=0.1, v_tip=1.0 / 7.0))
    whole = load_trajectory(run.directory.path)
    path = run.directory.path / name
    path.write_bytes(path.read_bytes()[:-cut])
    cut_short = load_trajectory(run.directory.path)
    lost = {file: int(file == name) for file in ("trajectory.csv", "shapes.csv", "events.csv")}
    assert len(cut_short) == 3 - lost["trajectory.csv"]
    assert len(cut_short.shapes[0]) == 3 - lost["shapes.csv"]
    assert len(cut_short.events) == 1 - lost["events.csv"]
    assert np.array_equal(cut_short.y, whole.y[: len(cut_short)])


@pytest.mark.parametrize(
    ("name", "damage", "message"),
    [
        ("trajectory.csv", lambda text: text.replace("0.1,", "0.1.1,", 1), r"trajectory\.csv: .*row"),
        ("trajectory.csv", lambda text: text.replace("\n0.1,", "\n0.1,0.5,", 1), r"csv: after the header: .* row 2$"),
        ("trajectory.csv", lambda text: text.replace("\n0.1,", "\nnan,", 1), r"trajectory\.csv: time .* not finite"),
        ("trajectory.csv", lambda text: "", r"trajectory\.csv: empty"),
        ("trajectory.csv", lambda text: text.replace("time,", "t,"), r"trajectory\.csv: line 1: no column time"),
        ("trajectory.csv", lambda text: text.replace("\n0.1", "\n0.\udcff1"), r"trajectory\.csv: .*row"),
        (
            "trajectory.csv",
            lambda text: text.replace(",free", ",freed"),
            r"trajectory\.csv: 'freed' is no phase; phases are",
        ),
        (
            "events.csv",
            lambda text: text + 999 * text.partition("\n")[2] + "\udcff\n",
            r"events\.csv: line 1002: not an",
        ),
        ("events.csv", lambda text: text.replace("impact", "bang"), r"events\.csv: line 2: not an event"),
        ("events.csv", lambda text: text.replace("0.5", "five"), r"events\.csv: line 2: .*five"),
        ("events.csv", lambda text: text.replace("time,", "t,"), r"events\.csv: line 1"),
        ("shapes.csv", lambda text: text.replace("u_0", "w_0"), r"shapes\.csv: line 1"),
        ("summary.json", lambda text: text[:-20], r"summary\.json: not JSON: .* line"),
        ("summary.json", lambda text: "[]", r"summary\.json: no scene"),
        ("summary.json", lambda text: '{"scene": {}}', r"\[time\]: missing table"),
        *((name, None, rf"{name}: No such file or directory") for name in ("trajectory.csv", "events.csv")),
        ("summary.json", None, r"summary\.json: missing; .* is not a run directory"),
    ],
)
def test_damage_is_named_by_file(tmp_path, name, damage, message):
    run = filed(tmp_path / "run", event=Event(0.1, "impact", y=0.5))
    path = run.directory.path / name
    if damage is None:
        path.unlink()
    else:
        path.write_text(damage(path.read_text(encoding="utf-8")), encoding="utf-8", errors="surrogateescape")
    with pytest.raises((ResultsUnreadable, SceneError), match=message):
        load_trajectory(run.directory.path)


def test_a_folder_that_is_no_run_is_said_to_be_none(tmp_path):
    with pytest.raises(ResultsUnreadable, match="not a run directory"):
        load_trajectory(tmp_path)


def test_events_are_read_one_at_a_time(tmp_path):
    run = filed(tmp_path / "run", event=Event(0.1, "impact", y=0.5))
    with run.directory.events.open("a") as file:
        file.write("broken line\n")
    events = load_events(run.directory.path)
    assert next(events).kind == "impact"
    with pytest.raises(ResultsUnreadable, match="line 3"):
        next(events)


# -- directories --------------------------------------------------------------------------------------------------


WRITTEN = ["events.csv", "shapes.csv", "steps.bin", "summary.json", "trajectory.csv"]
RESULT_FILES = [*WRITTEN, "run.checkpoint", PICTURES[2], REPORT, ANIMATIONS[0]]


@pytest.mark.parametrize("name", RESULT_FILES)
def test_results_are_not_overwritten_unasked(tmp_path, name):
    (tmp_path / name).write_text("precious")
    with pytest.raises(ResultsExist, match=name):
        RunDirectory.create(tmp_path)
    assert (tmp_path / name).read_text() == "precious"


def test_replaced_results_stay_until_there_is_something_to_record(tmp_path):
    before = dict.fromkeys([*RESULT_FILES, "notes.txt"], "precious")
    for name, text in before.items():
        (tmp_path / name).write_text(text)
    recorder = FileRecorder(PAIR, RunDirectory.create(tmp_path, replace=True))
    assert not recorder.begun
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == before
    record(recorder)
    assert recorder.begun
    recorder.finish({"status": "done"})
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([*WRITTEN, "notes.txt"])
    assert len(load_trajectory(tmp_path)) == 3


@pytest.mark.skipif(os.name == "nt", reason="no locks")
def test_two_processes_do_not_write_into_one_directory(tmp_path):
    recorder = FileRecorder(PAIR, RunDirectory.create(tmp_path))
    record(recorder)
    saved = recorder.save()
    # A lock belongs to the open file: this process stands for another one.
    with pytest.raises(ResultsInUse, match="another process"):
        RunDirectory.create(tmp_path, replace=True)
    with pytest.raises(ResultsInUse, match="another process"):
        FileRecorder(PAIR, RunDirectory(tmp_path)).restore(saved)
    recorder.close()
    FileRecorder(PAIR, RunDirectory(tmp_path)).restore(saved)


def test_numbered_directories_are_new_each_time_also_in_parallel(tmp_path):
    with ThreadPoolExecutor(8) as pool:
        made = list(pool.map(lambda _: RunDirectory.create_numbered(tmp_path / "results" / "soft").path, range(12)))
    assert {path.name for path in made} == {"soft", *(f"soft-{i}" for i in range(2, 13))}


def test_a_directory_is_made_with_its_parents_and_only_an_empty_one_discarded(tmp_path):
    empty = RunDirectory.create(tmp_path / "new" / "empty")
    assert empty.path.is_dir()
    empty.discard()
    assert not empty.path.exists()
    run = filed(tmp_path / "run")
    run.directory.discard()
    assert len(load_trajectory(tmp_path / "run")) == 3


# -- going on -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scene", [PAIR, SCENES["spring"]])
def test_a_restored_recorder_writes_the_same_files(tmp_path, scene):
    event = Event(0.05, "impact", y=0.1)
    whole = FileRecorder(scene, RunDirectory.create(tmp_path / "whole"))
    record(whole, rows=5, event=event)
    record(whole, rows=7, event=event)
    whole.finish({"status": "done"})

    killed = FileRecorder(scene, RunDirectory.create(tmp_path / "killed"))
    record(killed, rows=5, event=event)
    saved = json.loads(json.dumps(killed.save()))
    record(killed, rows=3, event=event)
    killed.close()
    for file in killed.directory.path.glob("*.csv"):
        with file.open("a") as more:
            more.write("0.25,half a li")

    resumed = FileRecorder(scene, RunDirectory(tmp_path / "killed"))
    resumed.restore(saved)
    assert load_summary(tmp_path / "killed")["status"] == "running"
    assert len(load_trajectory(tmp_path / "killed")) == 5
    assert resumed.time == 0.4
    record(resumed, rows=7, event=event)
    assert resumed.save()["files"] == {path.name: (f.size, f.crc) for path, f in whole._files.items()}
    resumed.finish({"status": "done"})
    assert written(tmp_path / "killed") == written(tmp_path / "whole")


@pytest.mark.parametrize("name", ["trajectory.csv", "events.csv", "shapes.csv"])
@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda file: file.unlink(), "missing"),
        (lambda file: file.write_bytes(file.read_bytes()[:-1]), "fewer than the"),
        (lambda file: file.write_bytes(file.read_bytes().replace(b"0", b"1", 1)), "changed since it was written"),
    ],
    ids=["missing", "cut", "changed"],
)
def test_results_that_have_changed_are_not_continued_nor_touched(tmp_path, name, damage, message):
    recorder = filed(tmp_path, event=Event(0.1, "impact"))
    saved = {"time": 0.2, "files": {path.name: (f.size, f.crc) for path, f in recorder._files.items()}}
    with (tmp_path / "trajectory.csv").open("a") as file:
        file.write("more\n")
    if name == "trajectory.csv" and message == "fewer than the":
        (tmp_path / name).write_bytes((tmp_path / name).read_bytes()[: saved["files"][name][0]])
    damage(tmp_path / name)
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    with (
        pytest.raises(ResultsUnreadable, match=rf"{name}: .*{message}"),
        FileRecorder(PAIR, RunDirectory(tmp_path)) as refused,
    ):
        refused.restore(saved)
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before


# -- a full disk --------------------------------------------------------------------------------------------------


@pytest.fixture
def small_disk(tmp_path):
    """A file system of its own with room for 192 kB."""
    if not sys.platform.startswith("linux") or os.geteuid() != 0:
        pytest.skip("only root can mount a file system: a full disk is NOT TESTED here")
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=192k", "tmpfs", disk], capture_output=True, text=True)
    if mounted.returncode != 0:
        pytest.skip(f"tmpfs cannot be mounted, a full disk is NOT TESTED here: {mounted.stderr.strip()}")
    yield disk
    subprocess.run(["umount", disk], check=True)


def test_a_disk_that_fills_up_leaves_rows_that_load_and_a_summary_that_says_so(small_disk):
    def run():
        with FileRecorder(PAIR, RunDirectory.create(small_disk / "run")) as recorder:
            record(recorder, rows=1000)

    with pytest.raises(OSError, match="No space left on device"):
        run()
    result = load_trajectory(small_disk / "run")
    assert 100 < len(result) < 1000
    assert np.array_equal(result.time, [0.1 * i for i in range(len(result))])
    assert result.summary["status"] == "stopped"
    assert "No space left on device" in result.summary["cause"]
    assert result.summary["time"] == result.time[-1]


def test_a_disk_without_room_for_a_new_run_keeps_the_old_one(small_disk):
    filed(small_disk / "run")
    (small_disk / "ballast").write_bytes(bytes(1 << 17))
    with suppress(OSError), (small_disk / "ballast").open("ab") as file:
        file.write(bytes(1 << 17))
    before = {file.name: file.read_bytes() for file in (small_disk / "run").iterdir()}
    recorder = FileRecorder(PAIR, RunDirectory.create(small_disk / "run", replace=True))
    with pytest.raises(OSError, match="No space left on device"):
        record(recorder)
    assert not recorder.begun
    assert {file.name: file.read_bytes() for file in (small_disk / "run").iterdir()} == before
