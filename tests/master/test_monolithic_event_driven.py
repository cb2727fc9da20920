"""The event-driven reference against exact solutions, extended precision, and scipy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from references import dips, integrated_anew, kinds, linear, soft, tip_mass
from scenes import scene_from_dict

from springbeam.monolithic.event_driven import ReferenceFailure, simulate
from springbeam.monolithic.semi_discrete import assemble
from springbeam.results.trajectory import COLUMNS, TOLD, EventKind
from springbeam.scene import Scene, load_scene, with_changes
from springbeam.studies import exact, verify


def spring_only(t_end: float, stop: dict[str, float] | None = None, **spring: float) -> Scene:
    tables: dict[str, Any] = {"time": {"t_end": t_end}, "spring": spring, "coupling": {"macro_step": 0.01}}
    return scene_from_dict(tables if stop is None else {**tables, "stop": stop})


# The scene `soft` -------------------------------------------------------------------------------------------------


#: (time, velocity afterwards) of the foundation impact and the release of `soft`, rounded to double: by a program that
#: shared nothing with the package, in 80-bit arithmetic, a Taylor series of order 46 on steps of 4 ms.
EXTENDED_PRECISION = [(0.07122400935981067, 0.298683962257942), (0.14436945620340189, 0.2019135428932935)]


def test_soft_agrees_with_extended_precision() -> None:
    """The lowest frequencies carry ε·ω_max/ω_min of their own size."""
    result = simulate(soft(50), sample_times=[0.0, 0.05, 0.15], t_end=0.15)
    assert kinds(result) == ["impact", "stop_impact", "release"]
    first = result.events[0]
    assert first.time == 0.0
    assert first.z == pytest.approx(-0.0057403607, abs=5e-11)
    assert result.y[1] == pytest.approx(-0.0087444212, abs=5e-11)
    for event, (time, velocity) in zip(result.events[1:], EXTENDED_PRECISION, strict=True):
        assert event.time == pytest.approx(time, abs=3e-14)
        assert event.z == pytest.approx(velocity, abs=2e-13)
        assert event.v_tip == pytest.approx(velocity, abs=2e-13)


def test_soft_conserves_energy_and_visits_the_phases() -> None:
    result = simulate(soft(50))
    assert result.summary["largest_relative_energy_residual"] < 1e-11
    assert kinds(result)[:6] == ["impact", "stop_impact", "release", "impact", "separation", "impact"]
    assert {"tied", "touch", "free"} <= set(result.phase)
    assert set(kinds(result)) <= set(EventKind)
    assert list(result.columns) == [name for name in (*COLUMNS, *TOLD) if name in result.columns]
    joined = np.isin(result.phase, ["tied", "touch"])
    assert np.max(np.abs(result.gap[joined])) < 1e-15
    assert np.min(result.gap) > -1e-15
    assert np.min(result.contact_force[result.phase == "touch"]) > -1e-9
    assert np.min(result.y) > -0.015 - 1e-15
    times, shapes = result.shapes
    np.testing.assert_array_equal(times, result.time)
    np.testing.assert_allclose(shapes[:, -1], result.u_tip, atol=1e-15)


CASES = {
    "damped": soft(beam={"alpha_b": 2e-3}, spring={"damping": 0.7}),
    "overdamped": soft(beam={"alpha_b": 2e-2}, spring={"damping": 5.0}),
    "seating": soft(
        beam={"distributed_load": -9.0}, spring={"external_force": -4.0}, stop={"restitution": 0.3}, time={"t_end": 0.5}
    ),
    "stiffer": soft(
        beam={"initial_deflection_slope": 0.02},
        spring={
            "equilibrium": 0.01, "mass": 0.1, "external_force": 1.0, "linear_stiffness": 150.0, "cubic_stiffness": 67.0
        },
    ),
    "elastic": soft(beam={"initial_deflection_slope": 0.02, "approach": "elastic", "young_modulus": 10.0}),
    "line 5": soft(contact={"impact": "tip"}),
    "modes": soft(40, beam={"n_modes": 6, "tip_load_coefficient": -6.0}),
    "unstable spring": soft(spring={"linear_stiffness": -3.0, "cubic_stiffness": 2000.0}),
    "compliance": soft(contact={"law": "compliance", "exponent": 1.5}),
    "compliance, seating": soft(
        beam={"alpha_b": 1e-3},
        contact={"law": "compliance", "stiffness": 1e3, "exponent": 1.0},
        spring={"damping": 1.0, "external_force": -5.0},
        stop={"restitution": 0.3},
    ),
    "tie, on a foundation": linear(
        contact={"law": "tie"}, stop={"restitution": 0.6}, beam={"alpha_b": 1e-4}, spring={"cubic_stiffness": 50.0}
    ),
    "tie, seated": linear(
        contact={"law": "tie"}, stop={"restitution": 0.0}, beam={"alpha_b": 1e-3}, spring={"external_force": -2.0}
    ),
    "link, seating": linear(
        contact={"law": "link", "stiffness": 1e4, "damping": 1.0},
        stop={"restitution": 0.3},
        spring={"external_force": -3.0},
        time={"t_end": 0.3},
    ),
    "link, damped as its modes": linear(
        contact={"law": "link", "stiffness": 1e3, "damping": 1.0}, beam={"alpha_b": 1e-3}, stop={"restitution": 0.8}
    ),
    "link, unstable spring": linear(
        contact={"law": "link"}, spring={"linear_stiffness": -3.0, "cubic_stiffness": 2000.0}
    ),
    "Hunt and Crossley": linear(
        contact={"law": "compliance", "exponent": 1.5, "damping": 0.8}, beam={"alpha_b": 1e-3}, spring={"damping": 0.2}
    ),
    "Hunt and Crossley, seating": linear(
        contact={"law": "compliance", "stiffness": 1e3, "exponent": 1.0, "damping": 2.0},
        stop={"restitution": 0.3},
        spring={"external_force": -5.0},
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_each_phase_is_integrated_as_scipy_does(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    run = integrated_anew(CASES[name], monkeypatch, 0.3)
    assert run.summary["largest_relative_energy_residual"] < 1e-11


def test_stiff_damped_beam_is_integrated_as_scipy_does(monkeypatch: pytest.MonkeyPatch) -> None:
    """steel-bumper: damped roots up to 7e7 1/s beside a first mode of 105 rad/s."""
    run = integrated_anew(load_scene("steel-bumper"), monkeypatch, 1.9e-3)
    assert kinds(run) == ["impact", "stop_impact"]
    assert run.summary["counts"]["steps"] < 600


def test_stiff_beam_of_the_paper_is_resolved(monkeypatch: pytest.MonkeyPatch) -> None:
    """κ = 3.6e10, 64 modes: 5 periods of the lowest mode take seconds."""
    run = integrated_anew(load_scene("paper-fig2"), monkeypatch, 0.50001)
    assert run.events[0].z == pytest.approx(-0.00389010363865, rel=1e-6)
    assert np.max(np.abs(run.y)) > 1e-7
    assert run.summary["largest_relative_energy_residual"] < 1e-11


# Impacts ----------------------------------------------------------------------------------------------------------


def test_meeting_conserves_momentum_and_books_the_loss() -> None:
    scene = soft(spring={"mass": 0.3, "initial_velocity": 0.2})
    first = simulate(scene, t_end=1e-3).events[0]
    tip = tip_mass(scene)
    common = (tip * -1.0 + 0.3 * 0.2) / (tip + 0.3)
    assert first.kind == "impact"
    assert first.z == pytest.approx(common, rel=1e-12)
    assert first.v_tip == pytest.approx(common, rel=1e-12)
    assert first.impulse_contact == pytest.approx(tip * (common + 1.0), rel=1e-12)
    assert first.impulse_contact == pytest.approx(-0.3 * (common - 0.2), rel=1e-12)
    reduced = tip * 0.3 / (tip + 0.3)
    assert first.energy_loss == pytest.approx(0.5 * reduced * 1.2**2, rel=1e-12)


@pytest.mark.parametrize("law", ["transmission", "tie"])
def test_foundation_reverses_both_and_takes_its_share(law: str) -> None:
    e = 0.4
    scene = soft(stop={"restitution": e}, contact={"law": law})
    impact = next(event for event in simulate(scene, t_end=0.1).events if event.kind == "stop_impact")
    tip = tip_mass(scene)
    arriving = -impact.z / e
    assert impact.v_tip == pytest.approx(impact.z, abs=1e-13)
    assert impact.impulse_contact == pytest.approx(-(1.0 + e) * tip * arriving, rel=1e-12)
    assert impact.impulse_foundation == pytest.approx(-(1.0 + e) * (tip + 1.0) * arriving, rel=1e-12)
    assert impact.energy_loss == pytest.approx(0.5 * (1.0 - e**2) * (tip + 1.0) * arriving**2, rel=1e-10)


def test_line_5_gives_the_spring_the_tips_velocity() -> None:
    first = simulate(soft(contact={"impact": "tip"}), t_end=1e-3).events[0]
    assert first.z == first.v_tip == pytest.approx(-1.0, abs=1e-12)
    assert first.energy_loss == pytest.approx(-0.5, rel=1e-12)


def test_bouncing_mass_comes_to_rest_at_the_zeno_time() -> None:
    """Free fall g on a stop from height a: first impact √(2a/g), flights 2eʲv/g, rest after (1 + e)/(1 − e) of it."""
    g, e, height = 10.0, 0.5, 0.2
    scene = spring_only(
        1.0,
        {"position": -0.2, "restitution": e},
        mass=2.0,
        linear_stiffness=0.0,
        cubic_stiffness=0.0,
        external_force=-2.0 * g,
    )
    result = simulate(scene)
    fall = np.sqrt(2.0 * height / g)
    bounces = [event for event in result.events if event.kind == "stop_impact"]
    for j, event in enumerate(bounces[:6]):
        assert event.time == pytest.approx(fall * (1.0 + 2.0 * (e - e ** (j + 1)) / (1.0 - e)), abs=1e-12)
        assert event.z == pytest.approx(e ** (j + 1) * g * fall, abs=1e-12)
    assert len(bounces) == 19  # the next one would rise by e⁴⁰ < 1e-12 of the height, and is the last
    seated = result.events[-1]
    assert seated.kind == "seated"
    # The flights left out last 2v/(g(1 − e)), and rise v²/2g ≤ seat_height.
    left_out = 2.0 * np.sqrt(2.0 * result.summary["seat_height"] / g) / (1.0 - e)
    assert 0.0 <= fall * (1.0 + e) / (1.0 - e) - seated.time <= left_out
    assert result.foundation_force[-1] == pytest.approx(2.0 * g, rel=1e-14)
    assert result.y[-1] == -0.2
    assert result.e_impact_loss[-1] == pytest.approx(2.0 * g * height, rel=1e-12)


def test_seated_pair_rests_on_the_static_forces() -> None:
    """After damping, the seated tip is held at φ: C = (φ − u_load)/compliance, N = C + k1 φ + k2 φ³ − f_s."""
    scene = soft(
        6,
        beam={"alpha_b": 0.02, "distributed_load": -20.0},
        spring={"damping": 8.0, "external_force": -1.0},
        stop={"restitution": 0.2},
        time={"t_end": 7.0},
        coupling={"macro_step": 0.5},
    )
    result = simulate(scene)
    h = 1.0 / 6.0
    static = (1.0 / 300.0 + 1.0 / 100.0) / (1.0 + h**2 / 12.0)
    d = assemble(scene.beam)  # type: ignore[arg-type]
    load = np.linalg.solve(d.K.toarray(), -20.0 * d.uniform_load)[-1]
    force = (-0.015 - load) / static
    assert result.phase[-1] == "seated"
    assert result.contact_force[-1] == pytest.approx(force, rel=1e-9)
    assert result.foundation_force[-1] == pytest.approx(force - 3.0 * 0.015 + 0.2 * 0.015**3 + 1.0, rel=1e-9)
    assert np.min(result.foundation_force) >= -1e-10


# Exact solutions --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("k1", "k2", "A"), [(150.0, 67.0, 0.5), (150.0, 67.0, 1.0), (3.0, -0.2, 0.5), (3.0, -0.2, 1.0)]
)
def test_duffing_spring_is_an_elliptic_function(k1: float, k2: float, A: float) -> None:
    scene = spring_only(10.0, equilibrium=A, linear_stiffness=k1, cubic_stiffness=k2)
    result = simulate(scene, sample_times=np.linspace(0.0, 10.0, 41))
    np.testing.assert_allclose(result.y, exact.Duffing(k1, k2, A).displacement(result.time), atol=2e-11)
    assert set(result.columns).isdisjoint({"u_tip", "contact_force", "foundation_force", "gap"})


def test_softening_spring_runs_up_to_its_barrier_and_fails_beyond() -> None:
    barrier = np.sqrt(3.0 / 0.2)
    below = simulate(spring_only(20.0, equilibrium=barrier - 1e-3, linear_stiffness=3.0, cubic_stiffness=-0.2))
    assert np.max(np.abs(below.y)) <= barrier
    scene = spring_only(20.0, linear_stiffness=3.0, cubic_stiffness=-0.2)
    unchecked = scene.model_copy(update={"lower": scene.spring.model_copy(update={"initial_velocity": 5.0})})
    with pytest.raises(ReferenceFailure):  # ½ z² = 12.5 J, the barrier is k1²/4|k2| = 11.25 J high
        simulate(unchecked)


def test_bar_on_a_stop_approaches_the_exact_impact(monkeypatch: pytest.MonkeyPatch) -> None:
    """The reference passes the checks of the coupled run."""
    monkeypatch.setattr(verify.impact, "simulate", simulate)
    checks = list(verify.bar_impact.solution(10))
    assert [check.quantity for check in checks if not check.passed] == []


# Start and input --------------------------------------------------------------------------------------------------


def test_undeformed_approach_starts_at_contact() -> None:
    scene = soft(beam={"initial_deflection_slope": 0.03}, spring={"equilibrium": 0.01}, time={"t_end": 0.1})
    result = simulate(scene)
    assert result.time[0] == pytest.approx(0.02, abs=1e-16)
    assert result.events[0].time == result.time[0]
    assert result.u_tip[0] == pytest.approx(0.01, abs=1e-16)
    np.testing.assert_allclose(result.shapes[1][0], 0.01 * np.linspace(0.0, 1.0, 21), atol=1e-14)


@pytest.mark.parametrize(
    ("speed", "e", "kind"), [(1.0, 0.5, "stop_impact"), (1.0, 0.0, "seated"), (0.0, 0.5, "seated")]
)
def test_a_tip_that_starts_on_the_stop_acts_on_it_at_once(speed: float, e: float, kind: str) -> None:
    """It arrives with −speed, or a load presses it down; the row of that time is of what follows."""
    start = {"initial_deflection_slope": 0.0, "initial_velocity_slope": -speed, "distributed_load": -5.0}
    beam = {"n_elements": 8, "approach": "elastic", **start}
    scene = with_changes(load_scene("beam-on-stop"), beam=beam, stop={"position": 0.0, "restitution": e})
    result = simulate(scene, sample_times=[0.0], t_end=1e-4)
    assert result.events[0].kind == kind
    assert result.events[0].time == 0.0
    assert result.v_tip[0] == pytest.approx(e * speed, abs=1e-14)
    assert result.phase[0] == ("seated" if kind == "seated" else "free")


def test_perturbation_shows_in_proportion() -> None:
    """An event time moves linearly with a small change of the initial velocity: the horizon can be measured."""
    scene = soft()
    base, once, twice = (
        simulate(scene, velocity_perturbation=delta, t_end=0.15).events[2].time for delta in (0.0, 1e-6, 2e-6)
    )
    assert once != base
    assert (twice - base) / (once - base) == pytest.approx(2.0, rel=1e-4)


def test_sampling_does_not_change_the_run() -> None:
    scene = soft(time={"t_end": 0.2})
    coarse = simulate(scene, sample_times=[0.0, 0.2])
    fine = simulate(scene, sample_times=np.linspace(0.2, 0.0, 301))
    assert len(coarse) == 2
    assert np.all(np.diff(fine.time) > 0.0)
    assert len(fine) == 301
    for a, b in zip(coarse.events, fine.events, strict=True):
        assert a.time == pytest.approx(b.time, abs=1e-13)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"contact": {"impact": "rest"}}, "rigid tie"),
        ({"contact": {"law": "paper"}}, "knows 'transmission', 'compliance'"),
        ({"beam": {"initial_deflection_slope": -0.1}}, "below"),
        ({"beam": {"initial_deflection_slope": 0.1, "initial_velocity_slope": 0.0}}, "never"),
    ],
)
def test_refuses_what_it_does_not_define(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        simulate(soft(**changes))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"sample_times": []}, "no row lies between the start of the run, 0.02 s, and its end, 0.1 s"),
        ({"sample_times": [0.3]}, "no row lies"),
        ({"t_end": 0.01}, "its end, 0.01 s"),
    ],
)
def test_a_run_that_cannot_be_is_refused(arguments: dict[str, Any], message: str) -> None:
    scene = soft(beam={"initial_deflection_slope": 0.03}, spring={"equilibrium": 0.01}, time={"t_end": 0.1})
    with pytest.raises(ValueError, match=message):
        simulate(scene, **arguments)


def test_a_dip_between_nodes_is_not_missed() -> None:
    """After 8 impacts it dips 7 μm past the foundation."""
    scene, times = dips(0.7, 1.0)
    found = [event.time for event in simulate(scene).events]
    assert found == pytest.approx(times, abs=1e-8)
