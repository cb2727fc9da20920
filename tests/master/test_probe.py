"""How the check of a foreign FMU goes from one size of steps to the next, with checks made up."""

from types import SimpleNamespace

import pytest

from springbeam.bodies.probe import Bench, _try_slopes

SIZES = [1.0, 0.1, 0.01]
BENCH = SimpleNamespace(sizes=SIZES, body=SimpleNamespace(abilities=SimpleNamespace(any_size=True)))


@pytest.mark.parametrize(("short", "wrong"), [(set(), set()), ({"a", "c"}, {"a"}), ({"b"}, set())])
def test_what_holds_at_one_size_is_right(short, wrong):
    found = dict(zip(SIZES, ({"a", "b"}, {"a", "c"}, short), strict=True))
    assert Bench.wrong(BENCH, found.__getitem__) == wrong


def test_an_inertia_is_that_of_no_step():
    """A parabola is exact; where the shortest steps show nothing, or where they do not agree, longer ones do."""
    assert Bench.extrapolated(BENCH, lambda h: 3.0 + h - 2.0 * h**2) == pytest.approx(3.0, rel=1e-13)
    assert Bench.extrapolated(BENCH, lambda h: None if h < 0.05 else 3.0 + h) == pytest.approx(3.0, rel=1e-13)
    assert Bench.extrapolated(BENCH, lambda h: 3.0 if h > 0.02 else h) == 3.0
    assert Bench.extrapolated(BENCH, lambda h: 3.0 if h < 0.02 else 4.0) == 3.0
    assert Bench.extrapolated(BENCH, lambda _: None) is None


class MassBench(Bench):
    """A unit mass that follows derivatives of a force up to an order."""

    def __init__(self, order):
        self.spec, self.sizes, self.faults = SimpleNamespace(velocity="v", fmu="mass"), [1.0], []
        self.order = order

    def renew(self, slopes):
        self.body = SimpleNamespace(abilities=SimpleNamespace(slopes=slopes))

    def change(self, size, force, impulse=0.0):
        terms = zip(force, (size, size**2 / 2.0, size**3 / 6.0), strict=True)
        return sum(derivative * share for derivative, share in list(terms)[: self.order + 1])


@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_force_gets_the_derivatives_that_are_followed(order):
    bench = MassBench(order)
    _try_slopes(bench, 1.0)
    assert bench.body.abilities.slopes == order
    assert len(bench.faults) == (order == 0)
