"""Sweeps on a real local cluster of worker processes."""

from __future__ import annotations

import json
import os
import signal
import socket
import threading
import time

import numpy as np
import psutil
import pytest
from commands import command

from springbeam.run.runner import simulate
from springbeam.scene import SceneError, load_scene, scene_from_dict, with_changes
from springbeam.studies import sweep
from springbeam.studies.sweep.design import Axis, design, parse_axis, varied

METRICS = ("y_min", "first_stop_impact", "energy_residual")


@pytest.fixture(scope="module")
def client():
    with sweep.cluster(None, workers=2) as client:
        yield client


def small(t_end=0.08, macro_step=2e-3):
    changes = {"beam": {"n_elements": 5}, "time": {"t_end": t_end}, "coupling": {"macro_step": macro_step}}
    return with_changes(load_scene("soft"), **changes)


def planned(*texts, samples=0, seed=0, sampling="latin_hypercube", scene=None, metrics=METRICS):
    axes = tuple(parse_axis(text) for text in texts)
    return sweep.Sweep(scene or small(), axes, design(axes, samples, seed, sampling), metrics)


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("spring.mass=0.5,1,2", (0.5, 1, 2)),
        ("spring.mass=1:3:3", (1.0, 2.0, 3.0)),
        ("spring.mass=3:1:3", (3.0, 2.0, 1.0)),
        ("spring.mass=0.01:100:5:log", (0.01, 0.1, 1.0, 10.0, 100.0)),
        ("beam.n_elements=10:40:4", (10, 20, 30, 40)),
        ("coupling.scheme=energy,hermite", ("energy", "hermite")),
        ("beam.reduced_integration=true,false", (True, False)),
    ],
)
def test_an_axis(text, values):
    axis = parse_axis(text)
    assert axis.values == pytest.approx(values, rel=1e-14) if isinstance(values[0], float) else axis.values == values
    assert [type(v) for v in axis.values] == [type(v) for v in values]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("spring.mass", "TABLE.KEY=VALUES"),
        ("mass=1:2:3", "TABLE.KEY=VALUES"),
        ("spring.mass=", "TABLE.KEY=VALUES"),
        ("spring.mas=1,2", "did you mean mass"),
        ("sprang.mass=1,2", "did you mean spring"),
        ("spring.mass=1:2:1", "COUNT of at least 2"),
        ("spring.mass=1:1:4", "LOW and HIGH different"),
        ("spring.mass=0:1:4:log", "greater than 0"),
        ("spring.mass=1:2:3:4", "LOW:HIGH:COUNT"),
        ("spring.mass=a:b:3", "LOW:HIGH:COUNT"),
        ("spring.mass=1:inf:3", "LOW:HIGH:COUNT"),
    ],
)
def test_a_wrong_axis_is_named(text, words):
    with pytest.raises(SceneError, match=words) as error:
        parse_axis(text)
    assert text in str(error.value)


def test_a_range_wants_samples():
    with pytest.raises(SceneError, match="--samples"):
        design([parse_axis("spring.mass=1:2")], 0, 0, "random")


def test_the_product_has_the_last_axis_fastest():
    axes = [Axis("spring", "mass", (1, 2)), Axis("spring", "damping", (0.0, 0.1, 0.2))]
    assert design(axes, 0, 0, "random") == [(1, 0.0), (1, 0.1), (1, 0.2), (2, 0.0), (2, 0.1), (2, 0.2)]


@pytest.mark.parametrize("order", [1, -1])
@pytest.mark.parametrize("tolerance", ["relative_tolerance", "absolute_tolerance"])
def test_a_macro_step_beside_a_tolerance_is_refused_with_both_named(tolerance, order):
    texts = ["coupling.macro_step=1e-3,2e-3", f"coupling.{tolerance}=1e-3,1e-4"]
    with pytest.raises(SceneError, match=rf"--vary coupling\.macro_step.* --vary coupling\.{tolerance}"):
        planned(*texts[::order])


def test_what_the_accuracy_picks_cannot_be_varied():
    with pytest.raises(SceneError, match=r"--vary coupling\.degree: accuracy = 0\.001 picks"):
        planned("coupling.degree=0,1", scene=with_changes(small(), accuracy=1e-3))


def test_a_latin_hypercube_has_one_sample_in_each_of_its_rows():
    axes = [parse_axis("spring.mass=1:1000:log"), parse_axis("spring.damping=0:1"), parse_axis("beam.n_elements=1,2,4")]
    values = design(axes, 30, 7, "latin_hypercube")
    rows = np.sort(np.floor(30.0 * np.log([v[0] for v in values]) / np.log(1000.0)))
    np.testing.assert_array_equal(rows, np.arange(30))
    assert sorted(v[2] for v in values) == [1] * 10 + [2] * 10 + [4] * 10
    assert design(axes, 30, 7, "latin_hypercube") == values
    assert design(axes, 30, 8, "latin_hypercube") != values


def test_rows_are_what_single_runs_give_and_failures_are_rows(client, tmp_path):
    plan = planned("spring.mass=0.5,1,-1", "spring.linear_stiffness=1:100:3:log")
    counts = sweep.run(plan, tmp_path / "s", client)
    assert counts == {"done": 6, "stopped": 0, "refused": 3, "lost": 0}
    rows = sweep.rows(tmp_path / "s")
    assert rows["index"] == list(range(9))
    for k in range(9):
        if rows["status"][k] == "refused":
            assert rows["spring.mass"][k] == -1
            assert "[spring] mass = -1" in rows["error"][k]
            assert rows["y_min"][k] is None
            continue
        run = simulate(varied(plan.scene, plan.axes, plan.values[k]))
        assert rows["y_min"][k] == run.y.min()
        assert rows["energy_residual"][k] == run.summary["max_energy_residual"]
        assert rows["first_stop_impact"][k] == next(e.time for e in run.events if e.kind == "stop_impact")


def test_a_sweep_goes_on_where_it_was_left_and_does_not_depend_on_workers(client, tmp_path):
    plan = planned("spring.mass=0.5:2", "spring.damping=0:1", samples=12)
    whole, parted = tmp_path / "whole", tmp_path / "parted"
    sweep.run(plan, whole, client)

    class Enough(Exception):
        pass

    def stop(done, total, failed):
        if done == 5:
            raise Enough

    with pytest.raises(Enough):
        sweep.run(plan, parted, client, stop)
    # What had come was not yet written: only rows on disk count as finished.
    parts = sweep._Parts(plan, parted / "parts")
    for index in range(4):
        parts.add(index, sweep.row(plan.scene, plan.axes, plan.values[index], plan.metrics))
    parts.flush()
    seen = []
    with sweep.cluster(None, workers=1) as one:
        sweep.run(plan, parted, one, lambda done, total, failed: seen.append(done))
    assert seen == list(range(4, 13))
    assert (whole / sweep.TABLE).read_bytes() == (parted / sweep.TABLE).read_bytes()
    again = []
    sweep.run(plan, parted, client, lambda done, total, failed: again.append(done))
    assert again == [12]


def test_a_finished_sweep_opens_without_workers(client, tmp_path, monkeypatch):
    plan = planned("spring.mass=0.5,-1")
    assert sweep.finished(plan, tmp_path) is None
    counts = sweep.run(plan, tmp_path, client)
    assert sweep.finished(plan, tmp_path) == counts == {"done": 1, "stopped": 0, "refused": 1, "lost": 0}
    with pytest.raises(sweep.SweepError):
        sweep.finished(planned("spring.mass=0.5,2"), tmp_path)


def test_another_sweep_is_not_mixed_in(client, tmp_path):
    sweep.run(planned("spring.mass=1,2"), tmp_path / "s", client)
    with pytest.raises(sweep.SweepError, match="another sweep"):
        sweep.run(planned("spring.mass=1,3"), tmp_path / "s", client)
    (tmp_path / "t").mkdir()
    (tmp_path / "t" / "thesis.txt").write_text("mine")
    with pytest.raises(sweep.SweepError, match="not empty"):
        sweep.run(planned("spring.mass=1,2"), tmp_path / "t", client)


def test_a_killed_worker_loses_no_row(tmp_path):
    plan = planned("spring.damping=0:1:12", scene=small(0.5, 1e-3))
    with sweep.cluster(None, workers=2) as client:
        workers = [int(pid) for pid in client.run(os.getpid).values()]
        reached = threading.Event()

        def kill():
            reached.wait(60.0)
            os.kill(workers[0], signal.SIGKILL)

        killer = threading.Thread(target=kill)
        killer.start()
        counts = sweep.run(plan, tmp_path / "s", client, lambda done, total, failed: done < 3 or reached.set())
        killer.join()
        assert workers[0] not in [int(pid) for pid in client.run(os.getpid).values()]
    assert counts["done"] == 12
    with sweep.cluster(None, workers=1) as client:
        sweep.run(plan, tmp_path / "calm", client)
    assert (tmp_path / "s" / sweep.TABLE).read_bytes() == (tmp_path / "calm" / sweep.TABLE).read_bytes()


def test_nothing_listens_beyond_loopback(client):
    ours = psutil.Process()
    listening = [
        connection.laddr.ip
        for process in (ours, *ours.children(recursive=True))
        for connection in process.net_connections(kind="inet")
        if connection.status == psutil.CONN_LISTEN
    ]
    assert listening
    assert set(listening) == {"127.0.0.1"}


def test_command(tmp_path):
    out = tmp_path / "out"
    arguments = ["sweep", "duffing", "--vary", "spring.mass=0.5:2:4:log", "--vary", "spring.damping=0,0.1"]
    arguments += ["--set", "time.t_end=1.0", "--workers", "1", "--out", str(out)]
    result = command(*arguments)
    assert result.exit_code == 0, result.output
    assert "8 done" in result.stdout
    assert json.loads((out / "sweep.json").read_text())["runs"] == 8
    assert (out / "sweep.png").stat().st_size > 10_000
    assert len(sweep.rows(out)["index"]) == 8


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--vary", "spring.mas=1,2"], "did you mean mass"),
        ([], "nothing varies"),
        (["--vary", "spring.mass=1,2", "--metric", "speed"], "--metric speed"),
        (["--vary", "spring.mass=1,2", "--scheduler", "127.0.0.1:1"], "cannot be reached"),
    ],
)
def test_bad_input(tmp_path, arguments, words):
    result = command("sweep", "duffing", *arguments, "--out", tmp_path / "out")
    assert result.exit_code == 2
    assert words in result.stderr


def test_the_stroboscope_sees_one_point_of_a_forced_oscillation_and_two_of_a_doubled_period(client, tmp_path):
    """A damped oscillator: A sin(2πft) at phase 0 is −A sin φ, its peak A; the bumper doubles the period at 45 Hz."""
    drive = {"on": "spring", "signal": "harmonic", "frequency": 2.0, "amplitude": 3.0, "start": 0.05}
    spring = {"mass": 1.0, "linear_stiffness": 40.0, "damping": 4.0}
    scene = scene_from_dict(
        {"time": {"t_end": 30.0}, "spring": spring, "coupling": {"macro_step": 0.02}, "loads": [drive]}
    )
    found = sweep.row(scene, (), (), (), once_a_period=True)
    w = 4.0 * np.pi
    exact = 3.0 / (40.0 - w * w + 4.0j * w)
    assert len(found["stroboscopic"]) == 20
    assert found["stroboscopic"] == pytest.approx([exact.imag] * 20, abs=1e-9)
    assert found["peak_response"] == pytest.approx(abs(exact), rel=8e-3)  # of rows: (ωH)²/8 of it
    axes = (parse_axis("loads.0.frequency=35,45"),)
    todo = sweep.Sweep(
        load_scene("vibro-impact"), axes, design(axes, 0, 0, "random"), ("u_tip_max",), stroboscopic=True
    )
    assert sweep.run(todo, tmp_path, client)["done"] == 2
    columns = sweep.rows(tmp_path)
    once, doubled = (np.unique(np.round(np.array(points), 5)) for points in columns["stroboscopic"])
    assert (len(once), len(doubled)) == (1, 2)
    assert sweep.stroboscopic.draw(columns, axes, tmp_path)
    assert (tmp_path / "bifurcation.png").stat().st_size > 5000
    with pytest.raises(SceneError, match=r"--stroboscopic: the scene has no drive"):
        sweep.Sweep(load_scene("pulse"), axes, [(1.0,)], (), stroboscopic=True)


def test_an_existing_cluster_is_used(tmp_path):
    from distributed import LocalCluster

    with (
        LocalCluster(n_workers=1, threads_per_worker=1, host="127.0.0.1", dashboard_address="127.0.0.1:0") as local,
        sweep.cluster(local.scheduler_address, None) as client,
    ):
        assert sweep.run(planned("spring.mass=1,2"), tmp_path / "s", client)["done"] == 2
    with socket.socket() as nobody:
        nobody.bind(("127.0.0.1", 0))
        began = time.monotonic()
        with (
            pytest.raises(sweep.SweepError, match="cannot be reached"),
            sweep.cluster(f"127.0.0.1:{nobody.getsockname()[1]}", None),
        ):
            pass
        assert time.monotonic() - began < 60.0
