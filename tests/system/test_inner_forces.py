"""Accelerations, clamp forces and stresses of a run: of the reference, of statics, and of the spring's equation."""

import numpy as np
import pytest
import scenes

from springbeam import simulate, with_changes
from springbeam.monolithic.event_driven import integrate as reference
from springbeam.studies.metrics import METRICS

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


@pytest.mark.parametrize(("steps", "most", "rows_miss"), [(60, 4e-3, 0.015), (40, 0.025, 0.04)])
def test_largest_inner_forces_are_those_of_the_curve(steps, most, rows_miss):
    """A load of 5 N at 9 Hz on two modes, with 13 and 9 steps a period of the load; rows miss the peaks by (ωH)²/8.

    The curve misses a part of order 4, by the companion run no more than that either.
    """
    scene = scenes.named("driven at 9 Hz")
    fine, run = (simulate(with_changes(scene, coupling={"macro_step": 0.5 / n})) for n in (4000, steps))
    missed = []
    for name in ("clamp_force", "clamp_moment", "bending_stress"):
        exact = METRICS[f"max_{name}"](fine)
        found = METRICS[f"max_{name}"](run)
        assert found == pytest.approx(exact, rel=most)
        between = np.abs(run.at(np.linspace(0.0, 0.5, 5001))[name]).max()
        assert between == pytest.approx(found, rel=1e-3)
        missed.append(1.0 - np.abs(run[name]).max() / exact)
        assert run.summary["errors"]["quantities"][f"max_{name}"] > 0.5 * abs(found - exact)
    assert max(missed) > rows_miss
