"""Accelerations, clamp forces and stresses of a run: of the reference, of statics, and of the spring's equation."""

import numpy as np
import pytest
import scenes
from references import reference

from springbeam import load_scene, simulate, with_changes
from springbeam.pictures import panels
from springbeam.studies.metrics import METRICS

SOFT = scenes.named("tied/base")
#: The rounding of forces that follow from accelerations: ε (ω_max/ω₁)² is 2e-12 of the beam.
ROUNDING = 1e-10


@pytest.mark.parametrize("name", scenes.group("tied"))
def test_they_converge_to_the_reference_of_the_same_mesh(name):
    """The multiplier of a tie is of order 8 with degree 2; the clamp follows the motion, exact but for rounding."""
    errors = []
    for size in (4e-4, 2e-4):
        scene = with_changes(scenes.named(f"tied/{name}"), coupling={"macro_step": size})
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


#: Force and moment of the loads about the clamp [N, N·m].
CLAMPED = {
    "uniform": (6.0, 6.0),
    "hat": (2.0, 2.0 * (2.0 - 0.5 / 3.0)),
    "growing": (5.0, 20.0 / 3.0),
    "at a place": (7.0, 3.5),
    "at the tip": (2.0, 4.0),
    "base moves": (-6.0, -6.0),
}


@pytest.mark.parametrize("name", CLAMPED)
@pytest.mark.parametrize("simulated", [simulate, reference])
def test_the_clamp_bears_what_loads_a_beam_at_rest(name, simulated):
    """On the beam and on its reference."""
    force, moment = CLAMPED[name]
    run = simulated(scenes.named(f"clamped/{name}"))
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


#: No contact.
ALONE = {"spring": None, "stop": None}


@pytest.mark.parametrize(
    "changes",
    [
        {"contact": {"law": "link", "stiffness": 1e4, "damping": 300.0}},
        {"loads": [{"on": "beam", "at": 0.4, "amplitude": -3.0}, {"on": "base", "amplitude": 2.0}]} | ALONE,
        {"loads": [{"on": "tip", "signal": "harmonic", "frequency": 9.0, "phase": 2.0}]} | ALONE,
    ],
)
@pytest.mark.parametrize("integrator", ["modal", "midpoint"])
def test_what_acts_at_the_start_is_in_the_first_row(changes, integrator):
    """Tip and clamp were those of a beam without it. The damper of the link acts since the spring does not move yet."""
    beam = {"n_elements": 5, "integrator": integrator}
    scene = with_changes(load_scene("soft"), beam=beam, time={"t_end": 1e-3}, coupling={"macro_step": 1e-3})
    scene = with_changes(scene, **changes)
    run = simulate(scene)
    exact = reference(scene, sample_times=[0.0, 1e-3])
    for name in ("a_tip", "clamp_force", "clamp_moment"):
        assert run[name][0] == pytest.approx(exact[name][0], abs=ROUNDING * np.abs(exact[name]).max())


#: A beam that turns as its clamp does not let it: the clamp feels 50 times as much at the start as later.
TURNS = with_changes(load_scene("steel-bumper"), time={"t_end": 2e-3})


def test_what_a_turning_beam_feels_at_its_start_is_no_largest_value():
    run = simulate(TURNS)
    later = run.time > 0.0
    inside = run.without_start()
    for name in ("clamp_force", "clamp_moment", "bending_stress"):
        largest = np.abs(run[name][later]).max()
        assert np.abs(run[name]).max() > 3.0 * largest
        assert METRICS[f"max_{name}"].of(run) == largest
        panel = next(panel for panel in panels.inside(run) if name in {curve.name for curve in panel.curves})
        assert np.abs(panel.curves[0].values).max() == largest
    assert np.abs(inside.shear_force).max() < 0.1 * np.abs(run.shear_force).max()


def test_a_start_that_the_clamp_allows_counts():
    run = simulate(with_changes(SOFT, beam={"initial_velocity_slope": 0.0}, loads=[{"on": "tip", "amplitude": -1.0}]))
    assert run.without_start() is run
    leaning = {"initial_velocity_slope": 0.0, "initial_deflection_slope": 0.01, "approach": "elastic"}
    assert simulate(with_changes(SOFT, beam=leaning, time={"t_end": 1e-3})).without_start().time[0] > 0.0
