"""Bodies of our FMUs: few are kept for the next run, and what a force and a load do to one."""

from math import nan

import pytest

from springbeam import load_scene
from springbeam.bodies.factory import load_bodies
from springbeam.bodies.protocol import NO_FORCE, StepRefused

pytestmark = pytest.mark.usefixtures("none_kept")


@pytest.mark.parametrize("force", [(nan, 0.0, 0.0), (0.0, 0.0, nan)])
def test_a_force_that_is_no_number_makes_no_step(force):
    for body in load_bodies(load_scene("soft"), 0.0, 2)[:2]:
        body.mark()
        with pytest.raises(StepRefused, match="the force it should step under is not finite"):
            body.advance(0.0, 1e-3, force)
        body.close()


def test_the_last_derivative_alone_acts():
    H = 1e-7  # too short for what is behind an end: its mass takes F̈ H³/6
    bent = (0.0, 0.0, 6.0 / H**3)
    beam, spring, _ = load_bodies(load_scene("soft"), 0.0, 2)
    for body, forces in ((beam, (bent,)), (spring, (NO_FORCE, bent))):
        before = body.motion().velocity
        assert body.advance(0.0, H, *forces).velocity - before == pytest.approx(1.0 / body.mass, rel=1e-4)
        body.close()
