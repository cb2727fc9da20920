"""Algorithm 1: what the paper reports of it, and that the code is the printed algorithm."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pytest

from springbeam.monolithic.algorithm1 import AlgorithmFailure, simulate
from springbeam.monolithic.semi_discrete import assemble
from springbeam.results.trajectory import Trajectory
from springbeam.scene import Scene, load_scene, with_changes


def figure(number: int) -> Scene:
    return load_scene(f"paper-fig{number}", ['contact.law="paper"'])


@functools.cache
def run(number: int) -> Trajectory:
    return simulate(figure(number))


def small(**tables: dict[str, object]) -> Scene:
    """A soft beam whose tip does reach the foundation, resolved in time."""
    tables["beam"] = {"n_elements": 10, **tables.get("beam", {})}
    tables["contact"] = {"law": "paper", "impact": "tip", **tables.get("contact", {})}
    return with_changes(load_scene("soft"), **tables)


# What the paper reports -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("number", "reported", "with_this_reading"), [(2, 1.990, 1.998), (4, 2.000, 1.999)])
def test_newton_iterations_of_table_2(number: int, reported: float, with_this_reading: float) -> None:
    newton = run(number).summary["newton"]
    assert newton["spring"] == pytest.approx(with_this_reading, abs=6e-4)
    assert newton["spring"] == pytest.approx(reported, abs=0.01)
    assert newton["tolerance"] == 1e-12
    assert 0.0 < newton["time_per_step"] < 0.1


@pytest.mark.parametrize("number", [2, 4])
def test_tip_moves_up_and_down_at_each_step(number: int) -> None:
    """Section 6: "the beams move up and down almost the same speed at each time step" (ω₁h = 967)."""
    result = run(number)
    v = result.v_tip
    assert result.time[0] == 0.5
    assert len(result) == 876
    np.testing.assert_allclose(v[:5], [-1.0, 1.0, -1.0, 1.0, -1.0], atol=2e-4)
    assert np.mean(v[1:] * v[:-1] < 0.0) > 0.99
    assert np.max(np.abs(v)) <= 1.0 + 1e-12
    assert np.max(np.abs(result.u_tip)) < 4.4e-6


def test_figure_4_has_one_step_apart_and_figure_2_none() -> None:
    assert run(2).summary["steps_apart"] == 0
    stiff = run(4)
    assert stiff.summary["steps_apart"] == 1
    apart = stiff["case"] == 11
    assert 0.0 < stiff.y[apart][0] < stiff.u_tip[apart][0] < 1e-8


@pytest.mark.parametrize(("number", "without_load"), [(3, 2), (5, 4)])
def test_printed_load_cannot_be_seen(number: int, without_load: int) -> None:
    """f_b = (0, …, 0, −6) bends the tip by 6 h_x/3 × its compliance 4/(3κ) ≈ 7e-14 m; Table 2's 3.01 needs more."""
    loaded, bare = run(number), run(without_load)
    assert loaded.summary["newton"]["spring"] == pytest.approx(bare.summary["newton"]["spring"], abs=1e-12)
    assert 0.0 < np.max(np.abs(loaded.u_tip - bare.u_tip)) < 2e-11
    assert np.max(np.abs(loaded.v_tip - bare.v_tip)) < 2e-6


def test_overwritten_tip_injects_energy() -> None:
    result = run(2)
    assert result.e_total[0] == pytest.approx(1.0 / 6.0, rel=1e-12)  # ½∫x² dx
    # Nothing in the model does this work: 75 % of the initial energy.
    assert np.max(result.energy_residual) == pytest.approx(0.1253, abs=2e-4)
    assert np.max(np.abs(result["e_injected_beam"])) == pytest.approx(0.1253, abs=2e-4)


@pytest.mark.parametrize("number", [2, 4])
def test_starting_with_the_tips_velocity_blows_up(number: int) -> None:
    with pytest.raises(AlgorithmFailure) as failure:
        simulate(with_changes(figure(number), contact={"impact": "tip"}))
    so_far = failure.value.trajectory
    assert so_far is not None
    assert np.max(np.abs(so_far.z)) > 100.0
    assert np.max(so_far.e_total) > 1e9


def test_other_readings_of_y_temp_are_other_algorithms() -> None:
    guess = simulate(figure(2), y_temp="guess")
    assert np.max(np.abs(guess.y)) == 0.0  # nothing ever reaches the spring
    assert guess.summary["newton"]["spring"] == pytest.approx(4.0 / 3.0, abs=1e-3)
    assert simulate(figure(2), y_temp="both").summary["steps_apart"] > 1


# The printed algorithm --------------------------------------------------------------------------------------------


def test_first_step_is_the_printed_system() -> None:
    """(62), (53), (54) and lines 16–19 written out densely for one step."""
    scene = small(spring={"damping": 0.3}, beam={"alpha_b": 1e-3}, coupling={"macro_step": 1e-3}, time={"t_end": 1e-3})
    result = simulate(scene)
    h, stiffness = 1e-3, 1e4
    d = assemble(scene.beam)  # type: ignore[arg-type]
    M, K = d.M.toarray(), d.K.toarray()
    A, B = 4.0 * M + (h**2 + 2e-3 * h) * K, 4.0 * M + (2e-3 * h - h**2) * K
    q, v, e = np.zeros(d.size), -d.slope_shape, d.tip_vector

    def compliance(w: float) -> float:
        return stiffness * max(-w, 0.0) ** 3

    new = q
    for _ in range(50):
        new = np.linalg.solve(A, B @ q + 4.0 * h * M @ v + h**2 * e * (compliance(new[-1]) + compliance(0.0)))
    assert new[-1] < 0.0  # line 14
    y_temp, z = new[-1], -1.0
    y = y_temp
    for _ in range(50):
        mean = 0.5 * (y + y_temp)
        force = -3.0 * mean + 0.2 * 0.5 * (y**2 + y_temp**2) * mean - 0.3 * (y - y_temp) / h
        force -= 0.5 * (compliance(y) + compliance(y_temp))
        y = y_temp + h * z + 0.5 * h**2 * force
    interior = np.arange(d.size - 1)
    right = (B @ q + 4.0 * h * M @ v - A[:, -1] * y)[interior]
    full = np.append(np.linalg.solve(A[np.ix_(interior, interior)], right), y)
    assert result.y[1] == pytest.approx(y, abs=1e-16)
    assert result.u_tip[1] == result.y[1]
    assert result.z[1] == pytest.approx(2.0 * y / h - z, abs=1e-12)
    np.testing.assert_allclose(result.shapes[1][1], d.deflection_sampler() @ full, atol=1e-16)
    assert result.v_tip[1] == pytest.approx(2.0 * y / h + 1.0, abs=1e-12)


def test_ledger_accounts_for_all_that_is_injected() -> None:
    """ΔE = what the tip and the spring are given, what the compliance pair does on u ≠ y, and N on the way to φ."""
    scene = small(spring={"damping": 0.5, "external_force": -0.3}, beam={"alpha_b": 1e-3}, time={"t_end": 0.2})
    result = simulate(scene, y_temp="guess")
    du, dy = np.diff(result.u_tip), np.diff(result.y)
    penetration = np.maximum(-result.y, 0.0) ** 3 * 1e4
    # λ_nc is 0 on a step that starts after line 12; its force on the spring is then booked as 0.
    spring_side = np.where(result["case"][1:] == 11, 0.0, 0.5 * (penetration[1:] + penetration[:-1]))
    pair = result.compliance_force[1:] * du - spring_side * dy + result.foundation_force[1:] * dy
    injected = result["e_injected_beam"] + result["e_injected_spring"]
    assert np.max(np.abs(injected)) > 1e-6
    np.testing.assert_allclose(result.energy_residual[1:], injected[1:] + np.cumsum(pair), atol=1e-12)


def test_foundation_stops_the_pair() -> None:
    result = simulate(small(time={"t_end": 0.3}, coupling={"macro_step": 1e-3}), y_temp="guess")
    hit = result.phase == "seated"
    assert np.any(hit)
    assert np.all(result.y[hit] == -0.015)
    assert np.all(result.u_tip[hit] == -0.015)
    assert np.min(result.y) == -0.015
    assert [event.kind for event in result.events][:2] == ["impact", "stop_impact"]
    assert result.foundation_force[np.argmax(hit)] > 0.0


def test_elastic_approach_conserves_energy_until_contact() -> None:
    """Lines 1–4: the midpoint rule conserves the energy of the free beam."""
    scene = small(beam={"initial_deflection_slope": 0.02, "approach": "elastic"}, coupling={"macro_step": 1e-3})
    result = simulate(with_changes(scene, time={"t_end": 0.03}), y_temp="guess")
    free = result.time < result.events[0].time
    assert 5 < np.sum(free) < len(result)
    assert np.max(np.abs(result.energy_residual[free])) < 1e-13
    assert result.time[0] == 0.0
    assert np.all(result.phase[free] == "free")


def test_on_a_resolved_beam_each_step_triples_the_velocity() -> None:
    """Tied, u ≈ y + h v on line 9, so lines 16–19 and 29 make z + 2v of z and v + 2z of v, whatever the step."""
    for h in (1e-3, 1e-4):
        scene = small(time={"t_end": 3.0 * h}, coupling={"macro_step": h}, stop={"position": -1.0})
        result = simulate(scene)
        np.testing.assert_allclose(result.z[1:] / result.z[:-1], 3.0, atol=100.0 * h)
        np.testing.assert_allclose(result.v_tip, result.z, atol=1e-9 / h)


def test_unknown_readings_are_refused() -> None:
    with pytest.raises(ValueError, match="y_temp = 'none': one of equation"):
        simulate(small(), y_temp="none")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "changes",
    [
        {"loads": [{"on": "tip", "amplitude": 1.0}]},
        {"beam": {"fidelity": "quasi_static"}},
    ],
)
def test_what_the_paper_does_not_have_is_refused(changes: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"knows no .* needs a dynamic"):
        simulate(with_changes(load_scene("soft"), **changes))


def test_start_velocity_follows_the_scene() -> None:
    short = {"time": {"t_end": 4e-3}, "coupling": {"macro_step": 4e-3}}
    for impact, expected in (("rest", 0.0), ("tip", -1.0), ("inelastic", 0.0)):
        assert simulate(small(contact={"impact": impact}, **short)).z[0] == expected
