"""The simple partners: a mass on spring and damper beside a Taylor series, a wall that stays where it is."""

import pytest
from bodies import DuffingBody

from springbeam.bodies.elements import SpringDamper
from springbeam.bodies.protocol import NO_FORCE


@pytest.mark.parametrize("damping", [0.0, 0.7])
def test_a_spring_damper_moves_and_stores_as_its_series(damping):
    """Below another body, under its force and that of the foundation: motion, integrals, energies, what holds it."""
    start = {"damping": damping, "external_force": -1.5}
    element = SpringDamper(2.0, 30.0, displacement=0.1, velocity=-0.4, **start)
    series = DuffingBody(2.0, 30.0, 0.0, y=0.1, z=-0.4, damping=damping, external=-1.5)
    element.take_place(upper=False)
    for contact, foundation in (((3.0, -20.0, 400.0), NO_FORCE), ((-1.0, 5.0, 0.0), (2.0, 7.0, -90.0))):
        found, exact = (body.advance(0.0, 0.05, contact, foundation) for body in (element, series))
        assert found == pytest.approx(exact, rel=1e-12)
    assert element.energies() == pytest.approx(series.energies(), rel=1e-11)
    assert element.holding_force(0.2, -0.3) == pytest.approx(series.holding_force(0.2, -0.3), rel=1e-14)
