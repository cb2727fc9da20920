"""Runs beside the event-driven reference, a case a line: the events, the motion and the energy."""

from pathlib import Path

import bodies
import numpy as np
import pytest
from scenes import kinds, scene_from_dict, soft

from springbeam import simulate, with_changes
from springbeam.monolithic import event_driven
from springbeam.scene.reading import tomllib

TABLES = tomllib.loads(Path(__file__).with_name("beside_reference.toml").read_text(encoding="utf-8"))
EXACT, OURS = bodies.simulate, simulate


def named(name, **coupling):
    return with_changes(scene_from_dict(TABLES[name]), coupling=coupling)


def coupled(scheme, degree, size=1e-3):
    return {"scheme": scheme, "degree": degree, "macro_step": size}


def hermite(**changes):
    """A tie, a foundation impact, a release and a second meeting; order 6 with ω_max·H = 0.2."""
    return soft(time={"t_end": 0.3}, coupling=coupled("hermite", 2), **changes)


def fine(**changes):
    return soft(time={"t_end": 0.25}, coupling={"macro_step": 2.5e-4}, **changes)


ENDS = ["impact", "release", "impact", "separation"]
LEFT = ["impact", "seated", "unseated", "release"]
LIFTED = ["impact", "seated", "unseated"]
#: A second meeting above Ψ separates by itself: one that stuck would be wrong by the displacement itself.
SHIFTED = {"spring": {"equilibrium": 0.1, "linear_stiffness": 5.0}, "stop": {"position": 0.08}}
MASSES = {"beam": {"density": 2.5}, "spring": {"mass": 0.2, "linear_stiffness": 40.0, "cubic_stiffness": 300.0}}
SLENDER = {"second_moment_of_area": 0.05, "reduced_integration": True, "n_elements": 20}
H6 = {"times": 1e-7, "velocities": 1e-6, "losses": 1e-7, "motion": 1e-7}
H2 = {"times": 1e-6, "first": 3, "until": 0.07, "motion": 5e-7, "energy": 1e-9}
#: With bodies that are exact or our FMUs; the scene; bounds of the times [s], velocities [m/s] and losses [J] of the
#: ``first`` events (default: all), of what the stop gives in them, of the motion ``until`` a time [s] relative to that
#: of the reference, and of the energy residual. Kinds that a run ``starts`` with, or has ``within`` it.
CASES = {
    "hermite": (EXACT, hermite(), H6),
    "hermite, lossy": (EXACT, hermite(stop={"restitution": 0.3}), H6),
    "hermite, loaded": (EXACT, hermite(beam={"distributed_load": 1.0}), H6),
    # Degree 0 errs by O(H²) in the velocities handed to each event, with a sign that depends on the grid.
    "ends at once": (EXACT, named("ends at once", **coupled("energy", 1, 5e-4)), {"starts": ENDS, "motion": 5e-4}),
    "ends at once, 2": (EXACT, named("ends at once", **coupled("energy", 2, 5e-4)), {"starts": ENDS, "motion": 1e-6}),
    "seated twice, energy": (EXACT, named("seated twice", **coupled("energy", 2)), {"motion": 1e-8}),
    "seated twice, hermite": (EXACT, named("seated twice", **coupled("hermite", 2)), {"motion": 1e-8}),
    "left at once": (
        EXACT, named("left at once", **coupled("energy", 0, 5e-4)),
        {"starts": LEFT, "first": 4, "times": 1e-6, "motion": 5e-4},
    ),
    "left at once, finer": (
        EXACT, named("left at once", **coupled("energy", 0, 2.5e-4)),
        {"starts": LEFT, "first": 4, "times": 1e-6, "motion": 2e-3},
    ),
    # A harmonic base lifts it; N changes by 2 N in a macro step. A load that jumps right after has no part in it.
    "lifted, 0": (EXACT, named("lifted", degree=0), {"starts": LIFTED, "first": 3, "times": 1e-6}),
    "lifted, 1": (
        EXACT, with_changes(named("lifted", degree=1), **{"loads.1": {"start": 0.1762}}),
        {"starts": LIFTED, "first": 3, "times": 1e-6},
    ),
    # A sudden tip force, C between the tip and φ, and no spring.
    "elastic stop": (EXACT, named("elastic stop"), {"times": 1e-7, "motion": 1e-8, "energy": 1e-11}),
    "elastic stop, linear": (
        EXACT, with_changes(named("elastic stop"), contact={"exponent": 1.0}),
        {"times": 1e-7, "motion": 1e-8, "energy": 1e-11},
    ),
    "linked to a stop": (
        EXACT, with_changes(named("elastic stop"), contact={"law": "link", "exponent": 1.0}),
        {"times": 1e-7, "motion": 1e-8, "energy": 1e-11},
    ),
    "damped": (OURS, fine(beam={"alpha_b": 1e-3}, spring={"damping": 2.0}), H2),
    "lossy stop": (OURS, fine(stop={"restitution": 0.3}), H2),
    "loads": (OURS, fine(beam={"distributed_load": -0.7}, spring={"external_force": 0.2}), H2),
    "masses": (OURS, fine(**MASSES), {**H2, "until": 0.02}),
    "shifted": (OURS, fine(**SHIFTED, beam={"initial_deflection_slope": 0.1}), {**H2, "until": 0.05}),
    "slender": (OURS, fine(beam=SLENDER), H2),
    # The tip meets a spring that has come to rest: both leave with the restitution of the stop.
    "meets a seated spring": (
        OURS, named("meets a seated spring"), {"within": ["seated", "impact", "stop_impact"], "motion": 1e-9}
    ),
    "meets a seated spring, tip": (
        OURS, with_changes(named("meets a seated spring"), contact={"impact": "tip"}),
        {"within": ["seated", "impact", "stop_impact"], "motion": 1e-9},
    ),
    "past the hilltop": (OURS, named("past the hilltop"), {"motion": 1e-11}),
    "grazing": (OURS, named("grazing"), {"motion": 5e-3}),
    "struck twice in a step": (OURS, named("struck twice in a step"), {"motion": 1e-10}),  # 4e-2 by its end only
    # The path of the step finds the dip above the stop, by a third of its distance from the cubic.
    "struck where the path does not": (
        OURS,
        with_changes(
            named("struck twice in a step", macro_step=7.4591e-4), time={"t_end": 0.0097},
            beam={"density": 896.94, "young_modulus": 7.2678e7, "shear_modulus": 1.30417e7,
                  "initial_velocity_slope": -0.172325},
        ),
        {"motion": 1e-10},
    ),
    "let go of the stop": (OURS, named("let go of the stop"), {"motion": 2e-3}),  # 4e-2 if a velocity is left it
    # What the stop gives is that of the reference, with one rest more: 1.6e-3 less without it.
    "off for less than a step": (
        OURS, named("off for less than a step"), {"times": 1e-3, "motion": 2e-6, "stop": 1e-6}
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_a_run_is_that_of_the_reference(name):
    simulated, scene, bounds = CASES[name]
    run = simulated(scene)
    rows = np.searchsorted(run.time, np.unique(run.time)[:: len(run) // 250 + 1], side="right") - 1
    exact = event_driven.simulate(scene, sample_times=run.time[rows])
    starts, within = bounds.get("starts", []), bounds.get("within", [])
    assert kinds(run)[: len(starts)] == kinds(exact)[: len(starts)] == starts
    for found in (kinds(run), kinds(exact)):
        assert any(found[k : k + len(within)] == within for k in range(len(found) + 1))
    first = bounds.get("first") if "times" in bounds else 0
    pairs = list(zip(run.events[:first], exact.events[:first], strict=True))
    for ours, theirs in pairs:
        assert (ours.kind, ours.time) == (theirs.kind, pytest.approx(theirs.time, abs=bounds["times"]))
        if "velocities" in bounds:
            assert (ours.z, ours.v_tip) == pytest.approx((theirs.z, theirs.v_tip), abs=bounds["velocities"])
        assert ours.energy_loss == pytest.approx(theirs.energy_loss, abs=bounds.get("losses", np.inf))
    given = [sum(pair[k].impulse_foundation for pair in pairs) for k in (0, 1)]
    assert given[0] == pytest.approx(given[1], rel=bounds.get("stop", np.inf))
    rows = rows[run.time[rows] <= bounds.get("until", np.inf)]
    for column in {"u_tip", "y"} & set(run.columns):
        there = exact[column][np.searchsorted(exact.time, run.time[rows])]
        scale = min(np.ptp(exact[column]), np.abs(exact[column]).max())
        assert np.abs(run[column][rows] - there).max() <= bounds.get("motion", np.inf) * scale, column
    assert run.summary["max_energy_residual"] < bounds.get("energy", np.inf)
