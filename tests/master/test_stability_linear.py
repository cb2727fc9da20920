"""Amplification matrices: exact propagators, the schemes against their solvers, known constants."""

import numpy as np
import pytest

from springbeam.monolithic.semi_discrete import modal_beam
from springbeam.scene import load_scene, with_changes
from springbeam.scene.statics import tip_inertia
from springbeam.studies.predict import (
    predict,
)


def omega_max(p):
    return float(np.sqrt(p.beam.omega2.max()))


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
    assert (p["modes"], p["slow_modes"], p["static_shapes"]) == (5, 3, 3)
