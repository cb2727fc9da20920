"""The displacement-driven exchange: its gain is 2m/(ZH), and it converges, or not, as that says."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import pytest
from bodies import DuffingBody, beam_body

from springbeam import RunStopped, SceneError, load_scene, simulate, with_changes
from springbeam.coupling import conditions
from springbeam.coupling.fixed_point import Diverged, FixedPoint
from springbeam.coupling.tie import Tie
from springbeam.scene import Beam
from springbeam.stability.predict import predict

Z = 10.0  # √(KAG·ρA) of the beam below [N·s/m]; its waves take 1e-3 s per element and 0.2 s there and back
BEAM = Beam(young_modulus=100.0, shear_modulus=100.0, n_elements=100, initial_velocity_slope=-1.0)


def solved(solver, mass, H):
    """One step from the meeting of the moving tip and a linear spring at rest."""
    beam, spring = the_beam(), DuffingBody(mass=mass, k1=3.0, k2=0.0)
    for body in (beam, spring):
        body.mark()
    try:
        return solver.solve(beam, spring, 0.0, H, (0.0, 0.0, 0.0), beam.motion())[0]
    finally:
        beam.rewind()


@lru_cache(maxsize=1)
def the_beam():
    return beam_body(BEAM)


@pytest.mark.parametrize("mass", [1.0, 0.01])
@pytest.mark.parametrize("H", [5e-3, 1e-2, 2e-2])
def test_the_gain_is_that_of_the_impedance(mass, H):
    solver = FixedPoint(True, 1e-12)
    solved(solver, mass, H)
    assert solver.gain == pytest.approx(2.0 * mass / (Z * H), rel=0.015)


def test_the_shortest_step_meets_the_tip_mass():
    solver = FixedPoint(True, 1e-12)
    solved(solver, 1.0, 1e-5)
    h = 1.0 / BEAM.n_elements
    assert solver.gain == pytest.approx(2.0 * math.sqrt(3.0) / h, rel=0.01)


@pytest.mark.parametrize(("mass", "H"), [(0.01, 3e-3), (0.01, 5e-3), (0.01, 2e-2)])
def test_plain_iteration_takes_as_many_rounds_as_the_gain_says(mass, H):
    """From 1 to some 1e-12 by a factor of the gain each: log(1e-12)/log(gain), to a few rounds."""
    plain = FixedPoint(False, 1e-12)
    force = solved(plain, mass, H)
    assert plain.iterations == pytest.approx(math.log(1e-12) / math.log(2.0 * mass / (Z * H)), abs=4)
    relaxed = FixedPoint(True, 1e-12)
    assert solved(relaxed, mass, H) == pytest.approx(force, rel=1e-9)
    assert relaxed.iterations == 2
    assert force == pytest.approx(solved(Tie(conditions("energy", 0), 0, 1e-12), mass, H), rel=1e-9)


@pytest.mark.parametrize(("mass", "H"), [(0.1, 1.9e-2), (1.0, 2e-2), (1.0, 1e-3)])
def test_plain_iteration_diverges_above_a_gain_of_1_and_aitken_does_not_care(mass, H):
    assert 2.0 * mass / (Z * H) > 1.0
    with pytest.raises(Diverged, match=r"diverges: after .* iterations"):
        solved(FixedPoint(False, 1e-12), mass, H)
    relaxed = FixedPoint(True, 1e-12)
    assert solved(relaxed, mass, H) == pytest.approx(solved(Tie(conditions("energy", 0), 0, 1e-12), mass, H), rel=1e-9)
    assert relaxed.iterations == 2


def test_a_gain_just_below_1_is_bounded_by_the_number_of_rounds():
    solver = FixedPoint(False, 1e-12)
    with pytest.raises(Diverged, match="does not converge: after 200 iterations"):
        solved(solver, 0.01, 2.08e-3)
    assert 0.9 < solver.gain < 1.0


SHORT = {"time": {"t_end": 0.2}}


def test_a_run_stops_at_once_and_names_the_gain():
    scene = with_changes(load_scene("soft"), **SHORT, coupling={"scheme": "fixed_point", "macro_step": 1e-3})
    with pytest.raises(RunStopped, match=r"displacement-driven exchange diverges.*by 173") as stopped:
        simulate(scene)
    assert stopped.value.time == 0.0
    few = with_changes(scene, beam={"n_modes": 4})  # the gain is that of Z, whatever the modes
    assert predict(few).displacement_gain == pytest.approx(200.0)


def test_a_run_that_converges_is_that_of_the_energy_scheme():
    coarse = with_changes(load_scene("soft"), **SHORT, coupling={"macro_step": 1e-3})
    energy = simulate(coarse)
    relaxed = simulate(with_changes(coarse, coupling={"scheme": "aitken"}))
    assert [e.kind for e in relaxed.events] == [e.kind for e in energy.events]
    np.testing.assert_allclose(relaxed.y, energy.y, atol=1e-11)
    assert relaxed.summary["max_energy_residual"] < 1e-11
    assert relaxed.summary["spring_steps"] > 2 * energy.summary["spring_steps"]


@pytest.mark.parametrize("scheme", ["fixed_point", "aitken"])
def test_what_it_cannot_couple_is_refused(scheme):
    coupling = {"scheme": scheme}
    with pytest.raises(SceneError, match="degree = 1"):
        with_changes(load_scene("soft"), coupling={**coupling, "degree": 1})
    with pytest.raises(SceneError, match=r"needs a \[beam\] and a \[spring\]"):
        with_changes(load_scene("beam-on-stop"), coupling=coupling)
    with pytest.raises(SceneError, match="compliance"):
        with_changes(load_scene("soft"), contact={"law": "compliance"}, coupling=coupling)
