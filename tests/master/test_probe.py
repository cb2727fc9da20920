"""How the check of a foreign FMU goes from one size of steps to the next, with checks made up."""

from types import SimpleNamespace

import pytest

from springbeam.bodies.probe import Bench

SIZES = [1.0, 0.1, 0.01]
BENCH = SimpleNamespace(sizes=SIZES, body=SimpleNamespace(abilities=SimpleNamespace(any_size=True)))


@pytest.mark.parametrize(("short", "wrong"), [({}, []), ({"a": "3", "c": "3"}, ["a: 3"]), ({"b": "3"}, [])])
def test_what_holds_at_one_size_is_right(short, wrong):
    found = dict(zip(SIZES, ({"a": "1", "b": "1"}, {"a": "2", "c": "2"}, short), strict=True))
    assert Bench.wrong(BENCH, found.__getitem__) == wrong


def test_an_inertia_is_that_of_no_step():
    """A parabola is exact; where the shortest steps show nothing, or where they do not agree, longer ones do."""
    assert Bench.extrapolated(BENCH, lambda h: 3.0 + h - 2.0 * h**2) == pytest.approx(3.0, rel=1e-13)
    assert Bench.extrapolated(BENCH, lambda h: None if h < 0.05 else 3.0 + h) == pytest.approx(3.0, rel=1e-13)
    assert Bench.extrapolated(BENCH, lambda h: 3.0 if h > 0.02 else h) == 3.0
    assert Bench.extrapolated(BENCH, lambda _: None) is None
