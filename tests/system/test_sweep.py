"""Sweeps on a real local cluster of worker processes."""

import numpy as np
import pytest
from commands import swept
from runs import a_trajectory

from springbeam.motion.events import Event, EventKind
from springbeam.run.runner import run_in_memory
from springbeam.scene import load_scene, with_changes
from springbeam.studies import sweep
from springbeam.studies.design import parse_axis, with_keys
from springbeam.studies.metrics import METRICS as METRICS_THERE_ARE
from springbeam.studies.picture import readable

METRICS = ("y_min", "first_stop_impact", "energy_residual")


def small(t_end=0.08, macro_step=2e-3):
    changes = {"beam": {"n_elements": 5}, "time": {"t_end": t_end}, "coupling": {"macro_step": macro_step}}
    return with_changes(load_scene("soft"), **changes)


def planned(*texts, scene=None, **options):
    return sweep.Sweep(scene=scene or small(), vary=texts, metric=METRICS, **options)


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("spring.mass=0.5,1,2", (0.5, 1, 2)),
        ("spring.mass=1:3:3", (1.0, 2.0, 3.0)),
        ("spring.mass=3:1:3", (3.0, 2.0, 1.0)),
        ("spring.mass=0.01:100:5:log", (0.01, 0.1, 1.0, 10.0, 100.0)),
        ("beam.n_elements=10:40:4", (10, 20, 30, 40)),
        ("beam.n_elements=1:6:4", (1, 3, 4, 6)),  # 2.67 and 4.33 between
        ("coupling.scheme=energy,jacobi", ("energy", "jacobi")),
        ("beam.reduced_integration=true,false", (True, False)),
        ("spring.force_sign=1,-1", (1, -1)),
    ],
)
def test_an_axis(text, values):
    axis = parse_axis(text)
    assert axis.values == pytest.approx(values, rel=1e-14) if isinstance(values[0], float) else axis.values == values
    assert [type(v) for v in axis.values] == [type(v) for v in values]


def test_each_metric_is_the_number_that_it_names():
    """Columns that run from one value to another, one of them downward at the largest speed; 1 … 7 events of a kind."""
    ends = {"u_tip": (-3.0, 2.0), "y": (5.0, -4.0), "z": (-2.0, 1.0), "gap": (-7.0, 6.0), "a_y": (-10.0, 9.0)}
    ends |= {"e_dissipated": (0.0, 8.0), "e_impact_loss": (0.0, 9.0)}
    events = [Event(0.05 * n + 0.001 * k, kind) for n, kind in enumerate(EventKind, 1) for k in range(n)]
    run = a_trajectory(events=events, **{name: np.linspace(*values, 400) for name, values in ends.items()})
    expected = {"u_tip_min": -3.0, "u_tip_max": 2.0, "u_tip_end": 2.0, "y_min": -4.0, "y_max": 5.0, "y_end": -4.0}
    expected |= {"z_max": 2.0, "max_z": 2.0, "max_y": 5.0, "gap_max": 6.0, "dissipated": 8.0, "impact_loss": 9.0}
    expected |= {f"number_of_{kind}": float(n) for n, kind in enumerate(EventKind, 1)}
    expected |= {f"first_{kind}": 0.05 * n for n, kind in enumerate(EventKind, 1)}
    assert {name: METRICS_THERE_ARE[name](run) for name in expected} == expected


@pytest.mark.filterwarnings("error:The input coordinates to pcolormesh")  # of values that do not ascend
def test_rows_are_what_single_runs_give_and_failures_are_rows(tmp_path):
    plan = planned("spring.mass=0.5,1,-1", "spring.linear_stiffness=1:100:3:log")
    records = plan.computed()
    assert plan.findings(records).document["runs"] == {"done": 6, "stopped": 0, "refused": 3, "lost": 0}
    plan.findings(records).written(tmp_path, pictures=True)
    assert (tmp_path / "sweep.png").stat().st_size > 10_000
    rows = swept(tmp_path)
    assert rows["index"] == list(range(9))
    for k, values in enumerate(plan.cases().values()):
        assert [rows[name][k] for name in values] == list(values.values())
        if rows["status"][k] == "refused":
            assert rows["spring.mass"][k] == -1
            assert "[spring] mass = -1" in rows["error"][k]
            assert rows["y_min"][k] is None
            continue
        run = run_in_memory(with_keys(plan.scene, values))
        assert rows["y_min"][k] == run.y.min()
        assert rows["energy_residual"][k] == run.summary["max_energy_residual"]
        assert rows["first_stop_impact"][k] == next(e.time for e in run.events if e.kind == "stop_impact")


def test_a_table_and_a_picture_have_units_that_read_well():
    rows = [{"t": 0.02, "x": [-2e-4, None], "m": 1e-3, "law": "tie"}, {"t": 0.01, "x": None, "m": 2e-3, "law": "link"}]
    changed, headings = readable(rows, {"t": "s", "x": "m", "m": "kg", "law": ""})
    assert headings == {"t": "t [ms]", "x": "x [µm]", "m": "m [kg]", "law": "law"}
    assert changed[0] == {"t": pytest.approx(20.0), "x": [pytest.approx(-200.0), None], "m": 1e-3, "law": "tie"}
    assert changed[1] == {"t": pytest.approx(10.0), "x": None, "m": 2e-3, "law": "link"}
