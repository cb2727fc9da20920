"""What a run shows of how well its macro steps follow the motion, for `springbeam.scene.resolution`."""

from __future__ import annotations

from math import inf, sqrt

import numpy as np

from ..results.columns import MOST_SHOWN, normal_compliance
from ..results.dense import between_rows
from ..scene import Scene
from ..scene.laws import stiffest
from ..scene.loads import TableLoad
from ..scene.resolution import not_resolved, oscillating, window_of
from .loads import ON_BEAM, ON_SPRING
from .stepping import Pair

#: Warning of a run in which a force was too large for its column.
_NOT_SHOWN = (
    f"compliance_force is larger than {MOST_SHOWN:g} N at times and is written as that, tie_reaction with it; "
    "the motion does not depend on either. A smaller contact.stiffness or contact.exponent keeps them in range"
)
#: Points of the quadrature over a step for each radian of a mode and each line of a table.
_DENSE = 1.0
#: Fewest and most points of that quadrature.
_POINTS = (8, 96)
#: Steps that are looked at together: what is held of them is small.
_TOGETHER = 1024
#: Share of an end's way that is not worth computing.
_NEGLIGIBLE = 1e-3
#: Modes of a body that a table may move.
_MODES = 20
#: Columns whose sum is the energy that both bodies and the contact law store [J].
_STORED = ("beam_kinetic", "beam_potential", "spring_kinetic", "spring_potential", "law_stored")


def not_shown(scene: Scene, pair: Pair, steps: np.ndarray) -> str | None:
    """Return a warning if a compliance force beside a rigid law was too large for its column."""
    if pair.law is not None or pair.lasting or not scene.coupled:
        return None
    too_large = (normal_compliance(scene, steps["u_tip_after"], steps[:1]) > MOST_SHOWN).any()
    return _NOT_SHOWN if too_large else None


def why_not_resolved(scene: Scene, pair: Pair, steps: np.ndarray, misplaced: float | None) -> str | None:
    """Return in words why a run whose ends are ``misplaced`` is not resolved; ``None`` if it is."""
    sizes = steps["size"][steps["size"] > 0.0]
    late = float(np.sqrt(np.mean(sizes**3) / np.mean(sizes))) if scene.coupling.adaptive and len(sizes) else None
    return not_resolved(
        scene,
        misplaced or 0.0,
        oscillations=oscillating(scene, _oscillations(pair, steps)),
        left_out=left_out(pair, steps),
        between_rows=between_rows(scene, steps),
        H=late,
    )


def _oscillations(pair: Pair, steps: np.ndarray) -> list[tuple[str, float, float]]:
    """Return (table, frequency [rad/s], damping ratio) of each body that says so, where it has been stiffest."""
    found = []
    for table, body, column in (("beam", pair.upper, "u_tip_after"), ("spring", pair.lower, "y_after")):
        known = body.oscillation(steps[column]) if len(steps) else None
        if known is not None:
            found.append((table, *known))
    return found


def unknown(scene: Scene, pair: Pair) -> str | None:
    """Return a warning that names what cannot be judged, since a body does not say how stiff it is."""
    places = {"beam": (scene.upper, pair.upper), "spring": (scene.lower, pair.lower)}
    silent = [f"[{table}]" for table, (there, body) in places.items() if there and body.oscillation() is None]
    if not silent:
        return None
    said = (
        f"the body in {' and '.join(silent)} does not say its stiffness and damping; how far ends are misplaced, and "
        "how far it turns in a macro step, is not known"
    )
    if scene.contact.force_window is None and scene.coupled:
        said += "; contact.force_window says over which time the peak contact force is a mean"
    return said


def coarse_force(pair: Pair) -> str | None:
    """Return a warning that names a body of unknown acceleration or damping, so that C is that of the steps."""
    places = (("beam", pair.upper), ("spring", pair.lower))
    silent = [f"[{table}]" for table, body in places if body in pair.without_acceleration]
    if not silent:
        return None
    return (
        f"the body in {' and '.join(silent)} does not say its acceleration, or how damping changes it; the force "
        "between joined ends, and when they part, is only as exact as the force of a step: name its variable in "
        "acceleration, or take a smaller coupling.macro_step"
    )


def force_window(scene: Scene, pair: Pair, steps: np.ndarray) -> float:
    """Return over which time the contact force is averaged before its peak is taken [s].

    It is ``contact.force_window``, or `springbeam.scene.resolution.WINDOW` of a period: that of a contact by a soft law
    that opens where it has taken all the energy, whose peak is the law's; else the slowest of the upper body alone;
    that of both together where that does not oscillate; the run where nothing does.
    """
    if scene.contact.force_window is not None:
        return scene.contact.force_window
    upper = pair.upper
    lower = pair.lower
    if pair.opens_softly and pair.law is not None:
        deepest = float((steps["y"] - steps["u_tip"]).max(initial=0.0))
        energy = sum(steps[name] for name in _STORED)
        stiffness = max(stiffest(pair.law, float(np.max(energy, initial=0.0))), pair.law.slope(deepest))
        omega = sqrt(stiffness * (1.0 / upper.inertia + 1.0 / lower.inertia))
    else:
        omega, _ = upper.oscillation() or (0.0, 0.0)
        omega = omega or _together(pair, steps)
    return window_of(scene, omega)


def _together(pair: Pair, steps: np.ndarray) -> float:
    """Return the frequency of both ends as one [rad/s], where they have been stiffest; 0 if none is known."""
    known = [body.stiffness(steps[name]) for body, name in ((pair.upper, "u_tip_after"), (pair.lower, "y_after"))]
    stiffness = sum(float(np.max(k)) for k in known if k is not None) if len(steps) else 0.0
    inertia = pair.upper.inertia + pair.lower.inertia
    return sqrt(stiffness / inertia) if 0.0 < stiffness < inf and 0.0 < inertia < inf else 0.0


# -- what steps leave out of measured loads ----------------------------------------------------------------------------


def left_out(pair: Pair, steps: np.ndarray) -> float:
    """Return how far what the ``steps`` leave out of tables moves an end, over its largest distance from its start.

    Each step takes the projection of a load onto polynomials of degree 2 (`springbeam.run.loads`). What is left out
    hardly moves what is slow; but a mode that turns far in a step may be in resonance with it. A load of known
    frequency is judged by that (`springbeam.scene.resolution.slow_oscillations`), a table here.

    The answer is to first order, of bodies that are free, without their damping: at most.
    """
    made = steps[steps["size"] > 0.0]
    if not len(made):
        return 0.0
    slowest = 1.0 / (pair.setup.end - pair.setup.start)
    shares = [0.0]
    for body, name, places in ((pair.upper, "u_tip_after", ON_BEAM), (pair.lower, "y_after", ON_SPRING)):
        tables = [load for load in pair.setup.loads if isinstance(load, TableLoad) and load.on in places]
        modes = body.modes(steps[name]) if tables else None
        if modes is not None:
            omega = np.maximum(np.sqrt(np.maximum(modes[0][:_MODES], 0.0)), slowest)
            forces = [body.moved_by(load) for load in tables]
            shares.append(_share(tables, forces, made, omega, modes[2][:_MODES] ** 2, steps[name]))
    return max(shares)


def _share(
    tables: list[TableLoad],
    forces: list[float],
    made: np.ndarray,
    omega: np.ndarray,
    weights: np.ndarray,
    places: np.ndarray,
) -> float:
    """Return the displacement of an end that was at ``places`` [m], relative to its motion.

    ``forces`` are those of loads of 1.
    """
    way = float(np.abs(places - places[0]).max())
    acting = [(load, force) for load, force in zip(tables, forces, strict=True) if force > 0.0]
    if way == 0.0 or not acting:
        return 0.0
    moved = [f * _swing(load, made, omega, weights, _NEGLIGIBLE * way / f) for load, f in acting]
    return sum(moved) / way


def _swing(load: TableLoad, made: np.ndarray, omega: np.ndarray, weights: np.ndarray, negligible: float) -> float:
    """Return Σ w |∫ δF exp(−iωt) dt|/ω at its largest, δF being what the steps ``made`` leave out of ``load``.

    What may be ``negligible`` in all is bounded, not computed.
    """
    size = made["size"]
    lines = len(load.record.x) * float(size.max()) / float(np.ptp(load.record.x))
    points = int(np.clip(_DENSE * (float(omega.max() * size.max()) + lines), *_POINTS))
    nodes, shares = np.polynomial.legendre.leggauss(points)
    P = np.polynomial.legendre.legvander(nodes, 2)
    share = negligible / len(made)
    at = np.zeros(len(omega), complex)
    most = 0.0
    bounded = 0.0
    for first in range(0, len(made), _TOGETHER):
        half = 0.5 * size[first : first + _TOGETHER, None]
        times = made["time"][first : first + _TOGETHER, None] - half + half * nodes
        force = load.value(times)
        missing = (force - (force * shares) @ P * [0.5, 1.5, 2.5] @ P.T) * shares * half
        bound = float(np.abs(missing).sum() * (weights / omega).sum())
        if bound <= share * len(half):
            bounded += bound
            continue
        total = np.zeros(len(half))
        for k, w in enumerate(omega):
            swing = at[k] + np.cumsum((missing * np.exp(-1j * w * times)).sum(axis=1))
            at[k] = swing[-1]
            total += weights[k] / w * np.abs(swing)
        most = max(most, float(total.max()))
    return most + bounded
