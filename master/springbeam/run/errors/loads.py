"""The part of a load that a step leaves out: it takes the projection of the load onto polynomials of degree 2.

What is left out (`springbeam.run.loads`) hardly moves what is slow, but a mode that turns far in a step may be in
resonance with it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ...bodies.protocol import Body
from ...scene.loads import Load, TableLoad
from .ends import Terms
from .records import StepRecords

#: Radians of a term, or lines of a table, per point of the quadrature of a load over a step; its points, at least and
#: at most.
_DENSE = 1.0
_POINTS = (8, 96)
#: Slowest terms of a body that loads move, and steps of one array, which so needs little memory.
_MOVED = 40
_TOGETHER = 1024
_NORMS = [0.5, 1.5, 2.5]


def left_out(loads: Sequence[Load], body: Body, terms: Terms, steps: StepRecords, quiet: float) -> np.ndarray:
    """Return what the part of ``loads`` on a ``body`` that each step leaves out adds to its terms, (n, terms).

    0 where they move no end by ``quiet`` [m].
    """
    found = np.zeros((len(steps.size), len(terms.rates)), complex)
    forces = [(load, body.moved_by(load)) for load in loads]
    forces = [(load, force) for load, force in forces if force > 0.0]
    if not forces:
        return found
    slow = np.argsort(np.abs(terms.rates))[:_MOVED]
    turns = float(np.abs(terms.rates[slow]).max()) + max(_changes(load) for load, _ in forces)
    points = int(np.clip(_DENSE * turns * float(steps.size.max()), *_POINTS))
    nodes, shares = np.polynomial.legendre.leggauss(points)
    P = np.polynomial.legendre.legvander(nodes, 2)
    moved = 0.0
    for size, rows in _by_size(steps.size):
        left = 0.5 * size * (1.0 - nodes)
        grown = np.exp(np.outer(left, terms.rates[slow])) * terms.impulse[slow]
        for some in np.array_split(rows, len(rows) // _TOGETHER + 1):
            signal = sum(force * load.value(steps.ends["time"][some, None] - left) for load, force in forces)
            missing = (signal - (signal * shares) @ P * _NORMS @ P.T) * shares * (0.5 * size)
            moved += float(np.abs(missing).sum())
            found[np.ix_(some, slow)] = missing @ grown
    bound = moved * float(np.abs(terms.shown[0] * terms.impulse)[slow].sum())
    return found if bound > quiet else np.zeros_like(found)


def _by_size(sizes: np.ndarray) -> Iterator[tuple[float, np.ndarray]]:
    """Yield each of ``sizes`` once, and the numbers of those that are equal to it."""
    order = np.argsort(sizes, kind="stable")
    for rows in np.split(order, np.flatnonzero(np.diff(sizes[order])) + 1):
        yield float(sizes[rows[0]]), rows


def _changes(load: Load) -> float:
    """Return how many radians it turns, or lines of its table it has, in a second."""
    if isinstance(load, TableLoad):
        return len(load.record.x) / float(np.ptp(load.record.x))
    return load.rate
