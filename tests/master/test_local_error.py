"""The error that a step tells of itself, of two masses that are apart."""

import pytest
from bodies import DuffingBody, Upper

from springbeam.bodies.protocol import NO_FORCE, Motion
from springbeam.coupling.protocol import Step
from springbeam.run.adaptive import AdaptiveSteps
from springbeam.run.stepping import Pair
from springbeam.scene import load_scene, with_changes


@pytest.mark.parametrize(("share", "holds"), [(0.99, True), (1.01, False)])
def test_no_more_than_rounding_is_forgiven(share, holds):
    """The tip at 1 m moves by 1 nm, and may be 1e-3 of that and 16 ulp of 1 m, 3.6e-15 m, beside the cubic."""
    scene = with_changes(load_scene("soft"), coupling={"relative_tolerance": 1e-3, "absolute_tolerance": 1e-30})
    way, rest, start = 1e-9, Motion(0.0, 0.0, 0.0, 0.0), Motion(1.0, 0.0, 0.0, 0.0)
    beside = share * (1e-3 * way + 16.0 * 2.0**-52)
    pair = Pair(scene, Upper(1.0, y=1.0), DuffingBody(1.0))
    # In a step of 1 s from rest to rest: ∫ of the cubic is the mean of its ends, ∫∫ (7 f0 + 3 f1)/20.
    end = Motion(1.0 + way, 0.0, 1.0 + way / 2.0 + beside, 0.5 + 0.15 * way + beside / 2.0)
    step = Step(0.0, 1.0, NO_FORCE, NO_FORCE, (start, rest), (end, rest))
    assert AdaptiveSteps(scene, pair, 0.0, 9.0).holds(pair.initial_state(0.0), step, "") is holds
