"""Studies, whichever: records as they come, what goes on and what does not, workers that die, Ctrl-C, a full disk."""

import json
import re

from commands import Interrupt, command, printed, swept
from worked import Deadly

from springbeam.scene import load_scene
from springbeam.studies import sweep
from springbeam.studies.study import FILE, Records

SWEEP = ["sweep", "duffing", "--vary", "spring.mass=1:2:5", "--metric", "y_min", "--set", "time.t_end=0.1"]


def plan(kind=sweep.Sweep, masses="1,2", **options):
    return kind(
        scene=load_scene("duffing", ["time.t_end=0.1"]), vary=(f"spring.mass={masses}",), metric=("y_min",), **options
    )


def test_only_cases_without_a_record_are_computed(tmp_path):
    study = plan(masses="1,2,4")
    seen = []
    with Records(study, tmp_path) as records:
        whole = study.computed(records)
    lines = (tmp_path / FILE).read_bytes().splitlines(keepends=True)
    assert len(lines) == 4
    (tmp_path / FILE).write_bytes(b"".join(lines[:2]) + lines[2][:-9])  # killed while it wrote
    with Records(study, tmp_path) as records:
        assert list(records.by_name) == ["0"]
        assert study.computed(records, report=seen.append) == whole
    assert len(seen) == 2
    assert (tmp_path / FILE).read_bytes() == b"".join(lines)


def test_a_killed_worker_loses_its_own_case_alone_and_only_if_it_dies_again(tmp_path, monkeypatch):
    """What workers unpack is gone when they are."""
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    monkeypatch.setenv("TMPDIR", str(temporary))
    monkeypatch.setattr("tempfile.tempdir", None)
    study = plan(Deadly, "1,3,2", note=str(tmp_path / "note"))
    with Records(study, tmp_path / "s") as records:
        found = study.computed(records, workers=2)
    assert [record["status"] for record in found.values()] == ["done", "lost", "done"]
    assert len(records.by_name) == 2
    assert not list(temporary.iterdir())


def test_an_interrupted_study_says_how_it_goes_on_and_does(here, unpainted, monkeypatch):
    monkeypatch.setattr(sweep.Sweep, "parallel", False)
    shown = printed(*SWEEP, "--out", "whole")
    table = r"^spring\.mass +y_min\n +\[kg\] +\[m\]\n *1 .*\n *1\.25 .*\n *1\.5 .*\n *1\.75 .*\n *2 .*\nresults "
    assert re.search(table, shown, re.M)
    interrupt = Interrupt(3)
    record = sweep.Sweep.record
    monkeypatch.setattr(sweep.Sweep, "record", lambda *arguments: interrupt() or record(*arguments))
    cut = command(*SWEEP)
    assert cut.exit_code == 3
    there = "2 of 5 records are in results/duffing-sweep"
    assert f"error: interrupted; {there}; the same command continues" in cut.stderr
    printed(*SWEEP)
    assert swept("results/duffing-sweep") == swept("whole")
    calls = interrupt.left
    assert json.loads(printed(*SWEEP, "--json"))["directory"] == "results/duffing-sweep"  # shows what is there
    assert interrupt.left == calls
    other = json.loads(printed(*SWEEP, "--seed", "3", "--json"))  # another study does not take its place
    assert other["directory"] == "results/duffing-sweep-2"


def test_a_run_that_stops_early_is_a_row_with_its_cause():
    wild = ["contact.law=compliance", "coupling.scheme=jacobi", "contact.stiffness=1e9", "coupling.macro_step=1e-2"]
    study = sweep.Sweep(scene=load_scene("soft", wild), vary=("spring.mass=1,2",), metric=("y_min",))
    for row in study.computed().values():
        assert (row["status"], row["y_min"]) == ("stopped", None)
        assert row["error"].startswith("stopped at t = ")
