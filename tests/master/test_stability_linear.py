"""Amplification matrices: exact propagators, the schemes against their solvers, known constants."""

from functools import lru_cache

import numpy as np
import pytest
from bodies import DuffingBody, ModalBody, solve, unit_beam
from scipy.linalg import expm

from springbeam.coupling.exchange import Exchange
from springbeam.coupling.soft import SoftSolver
from springbeam.coupling.solver import StepSolver
from springbeam.monolithic.semi_discrete import modal_beam
from springbeam.scene import load_scene, with_changes
from springbeam.scene.laws import Link
from springbeam.scene.statics import tip_inertia
from springbeam.studies.predict import (
    LinearBody,
    LinearPair,
    amplification,
    impulse_integrals,
    predict,
    spectral_radius,
)

EXCHANGES = [("jacobi", 0), ("jacobi", 1), ("gauss_seidel", 0), ("gauss_seidel", 1)]


@lru_cache(maxsize=8)
def pair(n=4, mass=1.0, stiffness=0.0, k=3.0, damping=0.0):
    """An undamped unit beam, EI = KAG = 100, and a linear spring."""
    beam = unit_beam(n)
    modes = LinearBody(beam.omega**2, np.zeros_like(beam.omega), beam.b)
    spring = LinearBody(np.array([k / mass]), np.zeros(1), np.array([mass**-0.5]))
    return LinearPair(modes, spring, stiffness, damping)


def omega_max(p):
    return float(np.sqrt(p.beam.omega2.max()))


# -- propagators ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("omega", "c", "h", "bound"),
    [
        (3.0, 0.0, 5.0, 1e-12),
        (3.0, 1.0, 0.2, 1e-14),
        (3.0, 6.0, 0.5, 1e-8),  # critical: the roots are moved apart by 1e-6
        (0.0, 2.0, 0.3, 1e-13),
        (1e4, 1e6, 0.01, 1e-11),
        (0.0, 300.0, 0.3, 1e-11),  # nothing holds it, and its damping is fast: they were NaN
        (300.0, 3.0, 0.3, 1e-11),
    ],
)
def test_integrals_of_the_impulse_response(omega, c, h, bound):
    """Against the exponential of (ξ, ξ̇, F, Ḟ, F̈, ∫ξ, ∫∫ξ), whose own rounding is |A|h ulp."""
    A = np.zeros((7, 7))
    A[0, 1] = 1.0
    A[1, 0] = -(omega**2)
    A[1, 1] = -c
    A[1, 2] = A[2, 3] = A[3, 4] = A[5, 0] = A[6, 5] = 1.0
    E = expm(A * h)
    exact = [E[1, 1], E[0, 1], E[0, 2], E[0, 3], E[0, 4], E[5, 4], E[6, 4]]
    ours = impulse_integrals(np.array([omega**2]), np.array([c]), h)[:, 0]
    assert ours == pytest.approx(exact, rel=bound, abs=bound * abs(exact[0]))


# -- schemes --------------------------------------------------------------------------------------------------------


def solved(p, scheme, degree, h):
    """The amplification matrix column by column, by the solvers of a run on bodies exact to rounding.

    A closed contact is a link.
    """
    r = len(p.beam.b)
    mass = p.spring.mass
    columns = []
    for unit in np.eye(2 * r + 2):
        beam = ModalBody(np.sqrt(p.beam.omega2), p.beam.b, unit[:r], unit[r : 2 * r])
        spring = DuffingBody(mass, float(p.spring.omega2[0]) * mass, 0.0, *(unit[2 * r :] * mass**-0.5))
        law = Link(p.stiffness, p.damping)
        if not p.soft:
            coupling = StepSolver(degree, 1e-13)
        elif scheme == "energy":
            coupling = SoftSolver(law, degree, 1e-14)
        else:
            coupling = Exchange(law, scheme == "gauss_seidel", degree)
        solve(coupling, h, beam, spring)
        columns.append(np.concatenate([beam.a, beam.v, np.array([spring.y, spring.z]) * mass**0.5]))
    return np.array(columns).T


def radius(matrix):
    return np.abs(np.linalg.eigvals(matrix)).max()


@pytest.mark.parametrize(("scheme", "degree"), EXCHANGES)
@pytest.mark.parametrize(("mass", "stiffness", "damping", "turn"), [(100.0, 1e4, 0.0, 3.0), (0.5, 0.0, 2.0, 0.5)])
def test_the_matrix_is_that_of_the_solvers(scheme, degree, mass, stiffness, damping, turn):
    """Column by column; the solvers' tolerances are 1e-13 of a motion. C = k p + c ṗ, also without k."""
    p = pair(2, mass, stiffness, damping=damping)
    h = turn / omega_max(p)
    ours = amplification(p, scheme, degree, h)
    theirs = solved(p, scheme, degree, h)
    assert np.abs(ours - theirs).max() < 1e-9 * np.abs(ours).max()
    assert spectral_radius(p, scheme, degree, h) == pytest.approx(radius(theirs), rel=1e-8)


@pytest.mark.parametrize("degree", [0, 1, 2])
@pytest.mark.parametrize(("stiffness", "turn"), [(0.0, 3.0), (1e4, 30.0)])
def test_energy_is_stable_at_any_step_so_that_nothing_is_predicted(degree, stiffness, turn):
    """The matrix of its solvers has no eigenvalue outside of the unit circle, for light and heavy springs."""
    for mass in (0.01, 100.0):
        p = pair(2, mass, stiffness)
        assert radius(solved(p, "energy", degree, turn / omega_max(p))) == pytest.approx(1.0, abs=1e-9)


# -- scenes ---------------------------------------------------------------------------------------------------------


def test_compliance_is_predicted_where_it_is_stiffest():
    """p = 1: λ itself; p = 3 at the depth that takes the energy E = 1/6 J: λ δ⁴/4 = E, stiffness 3 λ δ²."""
    soft = with_changes(load_scene("soft"), beam={"n_elements": 5}, contact={"law": "compliance", "exponent": 1.0})
    inverse = 1.0 / predict(soft)["tip_mass"] + 1.0
    assert predict(soft)["contact_frequency"] == pytest.approx((1e4 * inverse) ** 0.5)
    cubic = predict(with_changes(soft, contact={"exponent": 3.0}))
    depth2 = (4.0 / 6.0 / 1e4) ** 0.5
    assert cubic["contact_frequency"] == pytest.approx((3e4 * depth2 * inverse) ** 0.5)
    # A load of 0.5 N that begins all at once does 2 F²/k1 = 1/6 J on the spring.
    pressed = predict(with_changes(soft, contact={"exponent": 3.0}, loads=[{"on": "spring", "amplitude": -0.5}]))
    assert pressed["contact_frequency"] == pytest.approx(2.0**0.25 * cubic["contact_frequency"])
    assert cubic["exchange"] is None
    asked = predict(with_changes(soft, coupling={"scheme": "jacobi", "degree": 1, "macro_step": 1e-3}))["exchange"]
    assert (asked["scheme"], asked["degree"]) == ("jacobi", 1)
    assert (asked["spectral_radius"] > 1.0 + asked["threshold"]) == (asked["critical_step"] < 1e-3)


def test_a_scene_is_told_by_the_numbers_of_hand_calculation():
    """ρA = 6 kg/m, EI = 120 N·m², KAG = 56 N, L = 0.5 m on a spring of 3 kg and 70 N/m."""
    section = {"density": 2.0, "area": 3.0, "second_moment_of_area": 4.0, "length": 0.5, "shear_coefficient": 0.8}
    beam = {**section, "young_modulus": 30.0, "shear_modulus": 70.0 / 3.0, "n_elements": 60, "n_modes": 5}
    scene = with_changes(load_scene("soft"), beam=beam, spring={"mass": 3.0, "linear_stiffness": 70.0})
    omega = modal_beam(scene.beam).omega
    p = predict(with_changes(scene, coupling={"macro_step": 0.999 / omega[2]}))
    told = p["estimates"]
    stiffness = 1.0 / (0.125 / 360.0 + 0.5 / 56.0)
    assert (told["beam_mass"], told["tip_stiffness"]) == pytest.approx((3.0, stiffness), rel=1e-14)
    assert (told["spring_mass"], told["spring_stiffness"]) == (3.0, 70.0)
    half_period = np.pi * np.sqrt((3.0 + tip_inertia(scene.beam)) / (70.0 + stiffness))
    assert told["contact_duration"] == pytest.approx(half_period, rel=1e-14)
    assert p["impedance"] == pytest.approx(np.sqrt(56.0 * 6.0), rel=1e-14)
    assert (p["omega_1"], p["omega_max"]) == pytest.approx((omega[0], omega[-1]), rel=1e-14)
    assert p["frequencies"] == pytest.approx(omega[:3] / (2.0 * np.pi), rel=1e-14)
    assert p["frequencies"][0] == pytest.approx(told["frequency"], rel=1e-3)  # which has no mesh
    assert (p["modes"], p["resolved_modes"], p["static_shapes"]) == (5, 3, 3)


def test_a_motion_that_is_not_resolved_is_told_with_what_would_resolve_it():
    """The lowest mode turns 12.7 rad/s, a load of 50 Hz 314 rad/s."""
    load = {"on": "tip", "signal": "harmonic", "frequency": 50.0, "amplitude": 1e-3}
    given = {"beam": {"n_elements": 16}, "loads": [load], "coupling": {"macro_step": 0.1}}
    notes = predict(with_changes(load_scene("soft"), **given))["notes"]
    told = [note for note in notes if note.startswith("the motion is not resolved: ")]
    assert [" turns 31.4 rad " in told[0], "; H <= 0.00318 s " in told[0]] == [True, True]
    assert [" lowest mode turns 1.27 rad " in told[1], "; H <= 0.0785 s " in told[1]] == [True, True]


def test_a_length_in_mm_for_m_is_said_plainly():
    """The damping of such a contact takes 1.8e8/s: the smallest step tried was unstable, which
    had been a traceback of brentq."""
    given = {"scheme": "gauss_seidel", "degree": 1}
    found = predict(with_changes(load_scene("vibro-impact"), beam={"length": 1000.0}, coupling=given))
    assert any("[beam] length = 1000.0" in note and "is a length in mm?" in note for note in found["notes"])
    assert 0.0 < found["exchange"]["critical_step"] < found["macro_step"]
    assert found["exchange"]["spectral_radius"] > 1.0 + found["exchange"]["threshold"]
