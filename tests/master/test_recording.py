"""Records and result files: columns follow from records, a kill loses one block at most, nothing is overwritten."""

import math
import os
import shutil
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pyarrow import parquet
from runs import PAIR, SCENES, block
from scenes import group

from springbeam import simulate
from springbeam.monolithic.event_driven import integrate as reference
from springbeam.results import recording
from springbeam.results.columns import first_not_finite
from springbeam.results.directory import (
    ANIMATIONS,
    PARQUET,
    PICTURES,
    REPORT,
    TABLES,
    ResultsExist,
    ResultsInUse,
    ResultsUnreadable,
    RunDirectory,
)
from springbeam.results.files import export, load_summary, load_trajectory
from springbeam.results.recording import FileRecorder, MemoryRecorder
from springbeam.results.records import EVENT, STEP_COLUMNS
from springbeam.run.log import Log
from springbeam.run.outcome import RunStopped


def filed(path, *blocks, scene=PAIR):
    recorder = FileRecorder(scene, RunDirectory.create(path))
    for kept in blocks or (block(),):
        recorder.keep(*kept)
    recorder.finish({"status": "done", "macro_steps": 3})
    recorder.close()
    return recorder


# -- columns ------------------------------------------------------------------------------------------------------


RECORDED = group("recorded")


@pytest.mark.parametrize("name", RECORDED)
def test_columns_are_those_of_the_reference(name):
    """At every fifth row but those within a step of an event or of the start, which may stand for two moments."""
    run = simulate(RECORDED[name])
    moments = [0.0, *(event.time for event in run.events)]
    near = np.abs(run.time[::5, None] - moments).min(axis=1) < 1.2 * run.scene.coupling.H
    rows = np.arange(len(run))[::5][~near]
    exact = reference(run.scene, sample_times=run.time[rows])
    there = np.searchsorted(exact.time, run.time[rows])
    assert (run.phase[rows] == exact.phase[there]).all()
    assert run.columns.keys() == exact.columns.keys()
    for column in run.columns.keys() - {"time", "phase"}:
        error = np.abs(run[column][rows] - exact[column][there]).max()
        assert error <= 1e-5 * np.abs(exact[column]).max() + 1e-12, column


@pytest.mark.parametrize("name", STEP_COLUMNS)
def test_a_number_that_is_not_finite_is_found_with_its_place(name):
    steps, _, _ = block(40)
    assert first_not_finite(PAIR, steps, steps[:1]) is None
    if name in ("phase", "events"):  # set by the run, never computed
        return
    for value in (math.nan, math.inf):
        bad = steps.copy()
        bad[name][[23, 30]] = value
        row, said = first_not_finite(PAIR, bad, steps[:1])
        assert row == 23
        assert said.endswith(("= nan", "= inf", "= -inf"))


# -- what recorders do --------------------------------------------------------------------------------------------


def all_of(run):
    """All of a run, to the last bit."""
    parts = (*(run.shapes or ()), () if run.steps is None else run.steps)
    rows = [(name, values.tolist()) for name, values in run.columns.items()]
    return rows, run.events, [np.asarray(part).tobytes() for part in parts]


def test_a_run_without_records_is_kept_by_its_columns(tmp_path):
    """That of a reference, or of Algorithm 1."""
    steps, events, shapes = block(30)
    run = MemoryRecorder(PAIR)
    run.keep(steps, events, shapes)
    made = replace(run.trajectory(), steps=None)
    assert all_of(load_trajectory(recording.save(made, tmp_path / "run", replace=False))) == all_of(made)
    assert [file.name for file in export(tmp_path / "run", "csv")] == [*TABLES]


# -- killed -------------------------------------------------------------------------------------------------------


def test_a_kill_at_any_byte_leaves_all_blocks_but_the_last(tmp_path, monkeypatch):
    """Files with the first bytes, so many of them, of what a run writes to them one after the other."""
    writes = []
    append = recording.append

    def noted(file, content):
        writes.append((Path(file.name).name, content))
        append(file, content)

    monkeypatch.setattr(recording, "append", noted)
    recorder = FileRecorder(PAIR, RunDirectory.create(tmp_path / "whole"))
    done = {0: 0}  #: records by the bytes that are written with them
    for rows, begin, t_end in ((5, 0, 0.1), (4, 5, 0.2), (12, 9, 0.9)):
        recorder.keep(*block(rows, t_end=t_end, begin=begin))
        done[sum(len(content) for _, content in writes)] = begin + rows
    recorder.close()
    whole = load_trajectory(tmp_path / "whole")
    killed = Path(shutil.copytree(tmp_path / "whole", tmp_path / "killed"))
    borders = np.cumsum([len(content) for _, content in writes])
    for at in (*borders, *np.random.default_rng(1).integers(0, max(done), size=60)):
        files = dict.fromkeys(("shapes.bin", "events.bin", "steps.bin"), b"")
        left = at
        for name, content in writes:
            files[name] += content[:left]
            left -= min(left, len(content))
        for name, content in files.items():
            (killed / name).write_bytes(content)
        there = load_trajectory(killed)
        assert len(there) >= max(rows for end, rows in done.items() if end <= at)
        assert there.steps is None or there.steps.tobytes() == whole.steps[: len(there)].tobytes()
        assert there.events == whole.events[: len(there.events)]
        assert np.array_equal(there.shapes[0], whole.shapes[0][: len(there)])
    assert all_of(whole) == all_of(load_trajectory(tmp_path / "whole"))


# -- damaged files ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "cut"),
    [("steps.bin", 1), ("steps.bin", 10_000), ("shapes.bin", 1), ("events.bin", 1)],
)
def test_a_run_that_is_done_and_lacks_a_part_does_not_pass_as_whole(tmp_path, name, cut):
    filed(tmp_path / "run")
    path = tmp_path / "run" / name
    size = path.stat().st_size
    os.truncate(path, max(size - cut, 0))
    with pytest.raises(ResultsUnreadable, match=rf"{name}: {max(size - cut, 0)} bytes, {size} bytes were written"):
        load_trajectory(tmp_path / "run")
    path.unlink()
    with pytest.raises(ResultsUnreadable, match=rf"{name}: missing"):
        load_trajectory(tmp_path / "run")


def test_tables_are_written_again_from_the_arrays(tmp_path):
    filed(tmp_path / "run")
    paths = [tmp_path / "run" / name for name in TABLES]
    whole = [path.read_bytes() for path in paths]
    for path in paths:
        path.unlink()
    assert all_of(load_trajectory(tmp_path / "run"))
    assert export(tmp_path / "run", "csv") == paths
    assert [path.read_bytes() for path in paths] == whole
    # The arrays cannot be made anew.
    os.truncate(tmp_path / "run" / "events.bin", 100)
    with pytest.raises(ResultsUnreadable, match=r"events\.bin: 100 bytes, \d+ bytes were written$"):
        export(tmp_path / "run", "csv")


@pytest.mark.parametrize("scene", [PAIR, SCENES["spring"]])
def test_tables_are_exported_as_parquet(tmp_path, scene):
    run = filed(tmp_path / "run", block(30, scene), scene=scene)
    files = export(tmp_path / "run", "parquet")
    assert [file.name for file in files] == list(PARQUET[: 3 + (scene.beam is not None)])
    there = load_trajectory(run.directory.path)
    tables = [parquet.read_table(file).to_pydict() for file in files]
    assert tables[0] == {name: values.tolist() for name, values in there.columns.items()}
    assert tables[1]["v_tip"] == [event.v_tip for event in there.events]
    assert scene.beam is None or tables[3]["u_20"] == there.shapes[1][:, 20].tolist()


DAMAGE = {
    "nan in the records": ("steps.bin", lambda content: np.full(len(STEP_COLUMNS), np.nan).tobytes() + content),
    "records out of order": ("steps.bin", lambda content: content[52_800:] + content[:52_800]),
    "too few events": ("events.bin", lambda content: content[: -3 * EVENT.itemsize]),
    "an event that is none": ("events.bin", lambda content: content.replace("impact".encode("utf-32-le"), b"?" * 24)),
    "nan in the shapes": ("shapes.bin", lambda content: np.full(64, np.nan).tobytes() + content[512:]),
    "half a summary": ("summary.json", lambda content: content[:-20]),
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_damage_of_a_run_that_goes_on_is_named_by_file(tmp_path, damage):
    recorder = FileRecorder(PAIR, RunDirectory.create(tmp_path / "run"))
    recorder.keep(*block())
    recorder.close()
    name, damaged = DAMAGE[damage]
    path = tmp_path / "run" / name
    path.write_bytes(damaged(path.read_bytes()))
    with pytest.raises(ResultsUnreadable, match=name):
        load_trajectory(path.parent)


# -- directories --------------------------------------------------------------------------------------------------


WRITTEN = sorted([*TABLES, "events.bin", "shapes.bin", "steps.bin", "summary.json"])
RESULT_FILES = [*WRITTEN, PARQUET[0], PICTURES["positions"], REPORT, ANIMATIONS[0]]


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
    recorder.keep(*block(3))
    assert recorder.begun
    recorder.finish({"status": "done"})
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted([*WRITTEN, "notes.txt"])
    assert len(load_trajectory(tmp_path)) == 3


@pytest.mark.skipif(os.name == "nt", reason="no locks")
def test_two_runs_do_not_share_a_directory_from_the_moment_it_is_made(tmp_path):
    """The second one that began while the first was still loading its FMUs took its place."""
    # A claim belongs to the open directory: this process stands for another one.
    first = RunDirectory.create(tmp_path / "run")
    for replaced in (False, True):
        with pytest.raises(ResultsInUse, match="another process"):
            RunDirectory.create(tmp_path / "run", replace=replaced)
    recorder = FileRecorder(PAIR, first)
    recorder.keep(*block(3))
    recorder.close()
    with pytest.raises(ResultsExist):
        RunDirectory.create(tmp_path / "run")
    RunDirectory.create(tmp_path / "run", replace=True)  # those that were refused hold no claim


def test_numbered_directories_are_new_each_time_also_in_parallel(tmp_path):
    with ThreadPoolExecutor(8) as pool:
        made = list(pool.map(lambda _: RunDirectory.create_numbered(tmp_path / "results" / "soft").path, range(12)))
    assert {path.name for path in made} == {"soft", *(f"soft-{i}" for i in range(2, 13))}


# -- a full disk --------------------------------------------------------------------------------------------------


@contextmanager
def room(size):
    """Let files be no longer than this [bytes], which stands for the room on a disk: those of pytest are files, too."""
    resource = pytest.importorskip("resource", reason="limits of a process are POSIX")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_rows_that_find_no_room_lose_no_record(tmp_path):
    recorder = FileRecorder(PAIR, RunDirectory.create(tmp_path / "run"))
    recorder.keep(*block(240))
    with room(20_000), pytest.raises(OSError, match="File too large"):
        recorder.finish({"status": "done"})
    assert not list((tmp_path / "run").glob("trajectory.csv*"))  # nor a part of it
    assert len(load_trajectory(tmp_path / "run")) == 240
    assert load_summary(tmp_path / "run")["status"] == "done"


# -- on the way there ---------------------------------------------------------------------------------------------


def test_a_run_is_handed_over_up_to_where_it_goes_wrong():
    """A record of the second block is not finite: those before it are kept with their events."""
    recorder = MemoryRecorder(PAIR)
    judged = []

    def judge(steps, first):
        judged.append((len(steps), first["time"].tolist()))
        return np.zeros(len(steps), bool), str

    log = Log(recorder, judge)
    for begin in (0, 30):
        steps, events, shapes = block(30, begin=begin)
        steps["z"][17] = math.nan if begin else 0.0
        log.records += [step.tobytes() for step in steps]
        log.events += events
        log.shapes += list(shapes)
        with pytest.raises(RunStopped, match="z = nan at t = ") if begin else nullcontext():
            log.flush()
    kept = recorder.trajectory()
    assert (len(kept), len(kept.events), len(kept.shape_table)) == (47, kept.steps["events"][-1], 47)
    assert judged == [(30, [0.0]), (17, [0.0])]
