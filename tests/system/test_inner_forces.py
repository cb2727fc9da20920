"""Accelerations, clamp forces and stresses of a run: of the reference, of statics, and of the spring's equation."""

import numpy as np
import pytest
from references import reference

from springbeam import load_scene, simulate, with_changes
from springbeam.pictures import panels
from springbeam.studies.metrics import METRICS

#: From the first impact to just before the foundation is struck.
SOFT = with_changes(load_scene("soft"), time={"t_end": 0.05}, coupling={"degree": 2})
LOADS = [
    {"on": "beam", "shape": [1.0, -2.0, 0.5], "amplitude": 2.0, "signal": "harmonic", "frequency": 1.0, "phase": 0.3},
    {"on": "beam", "at": 0.5},
    {"on": "tip", "amplitude": -1.0},
    {"on": "base", "amplitude": 3.0},
    {"on": "spring", "amplitude": 0.3},
]
#: The rounding of forces that follow from accelerations: ε (ω_max/ω₁)² is 2e-12 of the beam.
ROUNDING = 1e-10


@pytest.mark.parametrize(
    "changes",
    [{}, {"loads": LOADS}, {"beam": {"tip_load_coefficient": -6.0, "distributed_load": 0.7}}],
    ids=["bare", "loads", "loads of the beam"],
)
def test_they_converge_to_the_reference_of_the_same_mesh(changes):
    """The multiplier of a tie is of order 8 with degree 2; the clamp follows the motion, exact but for rounding."""
    errors = []
    for size in (4e-4, 2e-4):
        scene = with_changes(SOFT, coupling={"macro_step": size}, **changes)
        run = simulate(scene)
        assert np.array_equal(run.a_tip, run.a_y)  # joined throughout
        times = run.time[2:-1]
        exact = reference(scene, sample_times=times)
        rows = np.searchsorted(exact.time, times)
        assert np.array_equal(exact.time[rows], times)
        off = {
            name: np.abs(run[name][2:-1] - exact[name][rows]).max() / np.abs(exact[name]).max()
            for name in ("a_tip", "a_y", "clamp_force", "clamp_moment")
        }
        assert max(off["clamp_force"], off["clamp_moment"]) < ROUNDING
        errors.append(off)
    for name in ("a_tip", "a_y"):
        assert 2.0**7.5 < errors[0][name] / errors[1][name] < 2.0**8.5


def test_at_an_event_the_tip_has_the_acceleration_before_it():
    """Where the ends part, C has vanished: the tip moves as the top below it, and swings 100 m/s² and more soon after.

    The force of a tie is of order 3 with degree 2. The impulse that gives both ends one velocity comes after.
    """
    scene = with_changes(load_scene("soft"), stop={"restitution": 0.3}, time={"t_end": 0.31}, coupling={"degree": 2})
    run = simulate(with_changes(scene, coupling={"macro_step": 1e-3}))
    parted = [event.time for event in run.events if event.kind == "separation" and event.energy_loss != 0.0]
    rows = np.searchsorted(run.time, parted, side="right") - 1
    assert len(rows) == 4
    assert np.abs(run.a_tip - run.a_y)[rows].max() < 15.0 < 0.1 * np.abs(run.a_tip[run.phase == "free"]).max()


@pytest.mark.parametrize(
    ("given", "force", "moment"),
    [
        ({"beam": {"distributed_load": 3.0}}, 6.0, 6.0),
        # The hat of the last element, 0.5 m long: a triangle about 1/3 of that from the tip.
        ({"beam": {"tip_load_coefficient": 8.0}}, 2.0, 2.0 * (2.0 - 0.5 / 3.0)),
        ({"loads": [{"on": "beam", "shape": [0.0, 1.0], "amplitude": 5.0}]}, 5.0, 20.0 / 3.0),
        ({"loads": [{"on": "beam", "at": 0.25, "amplitude": 7.0}]}, 7.0, 3.5),
        ({"loads": [{"on": "tip", "amplitude": 2.0}]}, 2.0, 4.0),
        ({"loads": [{"on": "base", "amplitude": 0.5}]}, -6.0, -6.0),
    ],
)
@pytest.mark.parametrize("simulated", [simulate, reference])
def test_the_clamp_bears_what_loads_a_beam_at_rest(given, force, moment, simulated):
    """ρA = 6 kg/m, L = 2 m; N and N·m of the load about the clamp, on the beam and on its reference."""
    beam = {"density": 2.0, "area": 3.0, "length": 2.0, "n_elements": 4, "approach": "elastic"}
    time = {"t_end": 1e-3, "initial_state": "static"}
    beam["initial_velocity_slope"] = 0.0
    scene = with_changes(load_scene("soft"), beam=beam, spring=None, stop=None, time=time)
    run = simulated(with_changes(scene, coupling={"macro_step": 1e-3}, **given))
    for row in (0, -1):
        assert (run.clamp_force[row], run.clamp_moment[row]) == pytest.approx((-force, -moment), rel=1e-10)


@pytest.mark.parametrize(("mass", "size"), [(1.0, 1e-3), (0.3, 2e-3)])
def test_ends_part_without_an_impact_and_the_contact_passes_on_what_a_free_mass_gains(mass, size):
    """What gives ends that part one velocity is of the forces of the steps, also where they part at a macro point."""
    free = {"element": "point_mass", "mass": mass}
    tables = {"stop": None, "spring": free, "time": {"t_end": 0.6}}
    scene = with_changes(load_scene("soft"), **tables, coupling={"degree": 0, "macro_step": size})
    run = simulate(scene)
    parted = [event for event in run.events if event.kind.opens]
    assert max(event.energy_loss for event in parted) > 1e-5
    assert {event.impulse_contact for event in parted} == {0.0}
    assert run.summary["contact_impulse"] == pytest.approx(-mass * run.z[-1], rel=1e-12)


#: A beam that turns as its clamp does not let it: the clamp feels 50 times as much at the start as later.
TURNS = with_changes(load_scene("steel-bumper"), time={"t_end": 2e-3})


def test_what_a_turning_beam_feels_at_its_start_is_no_largest_value():
    run = simulate(TURNS)
    later, inside = run.time > 0.0, run.without_start()
    for name in ("clamp_force", "clamp_moment", "bending_stress"):
        largest = np.abs(run[name][later]).max()
        assert np.abs(run[name]).max() > 3.0 * largest
        assert METRICS[f"max_{name}"].of(run) == largest
        panel = next(panel for panel in panels.inside(run) if name in {curve.name for curve in panel.curves})
        assert np.abs(panel.curves[0].values).max() == largest
    assert np.array_equal(inside.time, run.time[later])
    assert np.abs(inside.shear_force).max() < 0.1 * np.abs(run.shear_force).max()
    assert [len(part) for part in (inside.shapes[0], inside.bending_moment)] == 2 * [np.sum(run.shapes[0] > 0.0)]


def test_a_start_that_the_clamp_allows_counts():
    run = simulate(with_changes(SOFT, beam={"initial_velocity_slope": 0.0}, loads=LOADS[2:3]))
    assert run.without_start() is run
    leaning = {"initial_velocity_slope": 0.0, "initial_deflection_slope": 0.01, "approach": "elastic"}
    assert simulate(with_changes(SOFT, beam=leaning, time={"t_end": 1e-3})).without_start().time[0] > 0.0
