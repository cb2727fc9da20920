"""Interface laws of the references against exact solutions: free masses that meet, masses on a link, tied ends."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from references import kinds, linear, matrices
from scipy.integrate import quad, solve_ivp

from springbeam.monolithic.event_driven import simulate
from springbeam.monolithic.laws import law_of
from springbeam.scene import with_changes
from springbeam.studies import exact, verify
from springbeam.studies.verify.check import Section

TIP, TOP, STIFFNESS = 0.5, 2.0, 1e4  #: kg, kg, N/m^q
REDUCED = TIP * TOP / (TIP + TOP)


@pytest.mark.parametrize(
    "section",
    [verify.compliant_impact, verify.hunt_crossley, verify.linked_masses, verify.damped_link, verify.tied_masses],
    ids=lambda section: section.solution.__name__,
)
def test_the_reference_meets_the_exact_solutions_of_a_run(section: Section, monkeypatch: pytest.MonkeyPatch) -> None:
    """The bounds are errors of a coupling and of IDA, of which the reference has neither."""
    monkeypatch.setattr(verify.laws, "simulate", simulate)
    for check in section():
        assert abs(check.error or 0.0) <= 1e-3 * check.bound, check


# Normal compliance ------------------------------------------------------------------------------------------------


def test_the_closed_forms_are_those_of_the_oscillator_and_of_the_quadrature() -> None:
    """q = 1: half a period of √(λ/μ), damping without closed form as Hertz's in the limit; q = 1.5: ∫ dp/v."""
    omega = np.sqrt(STIFFNESS / REDUCED)
    linear = exact.impact(REDUCED, 3.0, STIFFNESS, 1.0)
    assert linear.duration == pytest.approx(np.pi / omega, rel=1e-14)
    assert linear.penetration == pytest.approx(3.0 / omega, rel=1e-14)
    hertz = exact.impact(REDUCED, 3.0, STIFFNESS, 1.5)
    # p = p_max (1 − s²) takes the singularity of 1/ṗ at p_max away.
    half, _ = quad(lambda s: 2.0 * s * hertz.penetration / 3.0 / np.sqrt(1.0 - (1.0 - s * s) ** 2.5), 0.0, 1.0)
    assert hertz.duration == pytest.approx(2.0 * half, rel=1e-9)
    weak = exact.impact(REDUCED, 3.0, STIFFNESS, 1.5, 1e-4)
    assert weak.penetration == pytest.approx(hertz.penetration, rel=2e-4)
    # e = 1 − 2χv/3 + …, whatever q.
    assert weak.rebound == pytest.approx(3.0 * (1.0 - 2e-4), rel=1e-7)


def pulled_apart(t_end: float) -> tuple[float, float, float]:
    """When the contact slackens and ends [s], and the energy it takes [J]: a load pulls the lower mass away.

    μ p̈ = −C − μ g with g = 20 m/s², p from 0 at 3 m/s; integrated apart from the package, piece by piece.
    """
    stiffness, q, chi, g, speed = 1e3, 1.5, 2.0, 20.0, 3.0

    def slack(_: float, x: np.ndarray) -> float:
        return float(x[1] + 1.0 / chi)

    def apart(_: float, x: np.ndarray) -> float:
        return float(x[0])

    slack.terminal = apart.terminal = True  # type: ignore[attr-defined]
    slack.direction = apart.direction = -1.0  # type: ignore[attr-defined]

    def pressed(_: float, x: np.ndarray) -> list[float]:
        force = stiffness * max(x[0], 0.0) ** q
        return [x[1], -force * (1.0 + chi * x[1]) / REDUCED - g, force * chi * x[1] ** 2]

    options = {"method": "DOP853", "rtol": 3e-14, "atol": 1e-16}
    first = solve_ivp(pressed, (0.0, t_end), [0.0, speed, 0.0], events=slack, **options)
    (p, rate, lost), begin = first.y[:, -1], first.t[-1]
    # Without force: a parabola; all that is stored is lost.
    fall = (rate + np.sqrt(rate**2 + 2.0 * g * p)) / g
    return begin, begin + fall, lost + stiffness * p ** (q + 1.0) / (q + 1.0)


def test_ends_that_part_faster_than_the_contact_recovers() -> None:
    """C stops at 0 where ṗ = −1/χ, before the penetration ends; what is stored then is lost."""
    contact = {"law": "compliance", "stiffness": 1e3, "exponent": 1.5, "damping": 2.0}
    scene = exact.free_masses(TIP, TOP, 3.0, 0.2, contact, macro_step=1e-3)
    result = simulate(with_changes(scene, spring={"external_force": -20.0 * TOP}))
    slack, end, lost = pulled_apart(0.2)
    assert kinds(result) == ["impact", "separation"]
    assert result.events[1].time == pytest.approx(end, rel=1e-11)
    assert end - slack > 0.02
    assert result.e_dissipated[-1] == pytest.approx(lost, rel=1e-10)
    assert result.summary["largest_relative_energy_residual"] < 1e-11
    between = (result.time > slack + 1e-12) & (result.time < end - 1e-12)
    assert set(result.phase[between]) == {"touch"}
    assert np.all(result.contact_force[between] == 0.0)
    assert np.min(result.contact_force) > -1e-10


# Links ------------------------------------------------------------------------------------------------------------


def test_the_matrix_exponential_of_two_masses_is_their_closed_form() -> None:
    """(cos 2πt ± cos 6πt)/2."""
    scene, times = exact.linked_masses(16.0 * np.pi**2, 0.0, 1.0, macro_step=0.025), np.linspace(0.0, 1.0, 41)
    found = exact.linked(scene, np.eye(1), np.array([[4.0 * np.pi**2]]), np.ones(1), np.zeros(1), times)
    slow, fast = np.cos(2.0 * np.pi * times), np.cos(6.0 * np.pi * times)
    np.testing.assert_allclose(found, 0.5 * np.column_stack([slow + fast, slow - fast]), atol=1e-12)


@pytest.mark.parametrize("alpha", [0.0, 1e-3])
@pytest.mark.parametrize(("stiffness", "damping"), [(0.0, 3.0), (1e2, 0.0), (1e4, 0.0), (1e4, 3.0)])
def test_a_beam_on_a_link_is_the_matrix_exponential(stiffness: float, damping: float, alpha: float) -> None:
    contact = {"law": "link", "stiffness": stiffness, "damping": damping}
    spring = {"damping": 0.4, "external_force": -0.5}
    scene = linear(beam={"alpha_b": alpha, "initial_deflection_slope": 0.02}, spring=spring, contact=contact, stop=None)
    times = np.array([0.01, 0.05, 0.1, 0.2])
    result = simulate(scene, sample_times=times, t_end=0.2)
    M, K, x = matrices(scene)
    expected = exact.linked(scene, M, K, 0.02 * x, -x, times)
    np.testing.assert_allclose(np.column_stack([result.u_tip, result.y]), expected, atol=2e-13)
    assert result.summary["largest_relative_energy_residual"] < 2e-12


def test_a_stiff_link_needs_no_more_steps_than_its_motion() -> None:
    """λ = 1e8: the link is part of the modes, the error that of their rounding, ε ω_max/ω_min."""
    contact = {"law": "link", "stiffness": 1e8}
    scene = linear(contact=contact, stop=None)
    result = simulate(scene, sample_times=[0.02], t_end=0.02)
    M, K, x = matrices(scene)
    expected = exact.linked(scene, M, K, 0.0 * x, -x, np.array([0.02]))
    np.testing.assert_allclose([[result.u_tip[0], result.y[0]]], expected, atol=1e-11)
    assert result.summary["counts"]["steps"] < 1000


def test_only_the_spring_strikes_the_foundation_through_a_link() -> None:
    scene = linear(contact={"law": "link", "stiffness": 1e3}, stop={"restitution": 0.5})
    strike = next(event for event in simulate(scene, t_end=0.1).events if event.kind == "stop_impact")
    assert strike.impulse_contact == 0.0
    assert strike.y == -0.015
    assert strike.u_tip != pytest.approx(strike.y, abs=1e-4)
    assert strike.impulse_foundation == pytest.approx(3.0 * strike.z, rel=1e-12)  # (1 + e)/e of m z
    assert strike.energy_loss == pytest.approx(1.5 * strike.z**2, rel=1e-10)  # ½ m z² (1/e² − 1)


# Ties -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("fidelity", ["dynamic", "quasi_static"])
def test_ends_that_move_alike_are_tied_without_an_impact(fidelity: str) -> None:
    changes = {"fidelity": fidelity, "initial_velocity_slope": 0.5}
    result = simulate(linear(contact={"law": "tie"}, beam=changes, spring={"initial_velocity": 0.5}, stop=None))
    assert result.events == []
    assert set(result.phase) == {"tied"}
    assert np.max(np.abs(result.gap)) < 1e-15
    assert np.max(np.abs(result.energy_residual)) < 1e-12


def test_a_tie_without_inertia_adds_the_beams_stiffness() -> None:
    """y = z₀/ω sin ωt, ω² = k1 + k, 1/k = L³/3EI + L/KAG = 4/300: the tip bears either sign of C."""
    scene = linear(
        contact={"law": "tie"}, beam={"fidelity": "quasi_static"}, spring={"initial_velocity": 0.3}, stop=None
    )
    result = simulate(scene)
    omega = np.sqrt(3.0 + 75.0)
    np.testing.assert_allclose(result.y, 0.3 / omega * np.sin(omega * result.time), atol=1e-12)
    assert kinds(result) == ["impact"]
    assert np.min(result.contact_force) < -1.0


def test_a_pair_at_rest_without_inertia_stays_at_rest() -> None:
    """Every function that is watched is zero, and stays so: none of them is an event."""
    result = simulate(linear(beam={"fidelity": "quasi_static"}, stop=None))
    assert np.all(result.y == 0.0)
    assert kinds(result) == ["impact"]


# All of them ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "contact"), [("compliance", "touch"), ("compliance", "slack"), ("link", "tied")])
def test_what_a_law_stores_and_takes_is_the_power_of_its_force(name: str, contact: Any) -> None:
    """C ṗ = dΦ/dt + dissipation, with dΦ/dt from Φ itself."""
    law = law_of(linear(contact={"law": name, "stiffness": 30.0, "exponent": 2.5, "damping": 0.7}))
    p, rate, h = np.array([0.1, 0.3]), np.array([-2.0, 0.5]), 1e-6
    force = law.force(p, rate) if law.acts(contact) else np.zeros_like(p)
    stored = (law.potential(p + h * rate) - law.potential(p - h * rate)) / (2.0 * h)
    np.testing.assert_allclose(force * rate, stored + law.dissipation(contact, p, rate), rtol=1e-9, atol=1e-9)
