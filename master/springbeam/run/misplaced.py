"""How far the ends of a soft contact are from where its law would have them.

The law asks for a force along the path of the ends, the step applies a polynomial of degree d. Their difference, and
what it changes of the law's force, move the ends: both bodies and the law, linearised about the run, tell by how much
(``docs/coupling.md``, "How far ends are misplaced"). The beam is the sum of the lowest modes of its mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache, lru_cache
from itertools import product
from math import inf
from typing import Any

import numpy as np

from ..contact.laws import SoftLaw
from ..results.paths import Path
from ..results.steps import force as applied
from ..results.trajectory import Event, EventKind
from ..scene import Beam, Scene
from ..scene.statics import bending_stiffness, shear_stiffness
from .stepping import Pair

#: Places where the law is asked, and their shares: Gauss points.
_POINTS, _SHARES = np.polynomial.legendre.leggauss(4)
_INSIDE = 0.5 * (_POINTS + 1.0), 0.5 * _SHARES
#: Modes of the beam, and elements of a mesh that has the lowest ones of any finer one.
_MODES, _ELEMENTS = 20, 50
#: Ways that an end is off from which on nothing more is to be learnt.
_LOST = 1e3


#: ω² [1/s²], 2 ζ ω [1/s] and the displacement of the tip [1/√kg] of modes of unit mass, (n,) each.
Modes = tuple[np.ndarray, np.ndarray, np.ndarray]


def misplaced(scene: Scene, pair: Pair, law: SoftLaw, steps: np.ndarray, events: Sequence[Event]) -> float:
    """Return how far an end is from where ``law`` would have it, over its largest distance from its start.

    It is that of the worse end at its worst.
    """
    made = np.flatnonzero(steps["size"] > 0.0)
    before, step = steps[made - 1], steps[made]
    parts = 1 if scene.coupling.degree == 0 else 2  # a force of a higher degree has the law's mean over a step
    defect = _defect(law, before, step, parts)
    per_mass = 1.0 / pair.lower.mass if pair.lower.mass > 0.0 else 0.0
    resists, stiffness = 0.0, np.zeros(len(step))
    if scene.spring is not None:
        resists, y = scene.spring.damping * per_mass, 0.5 * (before["y_after"] + step["y"])
        stiffness = per_mass * (scene.spring.linear_stiffness + 3.0 * scene.spring.cubic_stiffness * y**2)
    after = np.ones((3, len(step), parts)) * [[[1.0]], [[0.0]], [[0.0]]]
    after[..., -1] = _after_events(scene, steps, events, made)
    of_steps = [*np.repeat([step["size"] / parts, stiffness], parts, axis=1), *after.reshape(3, -1), *defect]
    first = int(np.argmax(defect[0] != 0.0))  # up to there nothing is off
    ways = [float(np.abs(steps[name] - steps[name][0]).max()) or inf for name in ("u_tip_after", "y_after")]
    *_, tip = modes = _modes(scene, pair)
    moves = cache(lambda H: _moves(modes, H))
    # Errors of displacements and velocities of the modes, and of both ends.
    x, u, y, z, found = np.zeros(2 * len(tip)), 0.0, 0.0, 0.0, 0.0
    for H, k, stays, turns, most, missed, early, stiffer, rate in zip(
        *(v[first:].tolist() for v in of_steps), strict=True
    ):
        # The midpoint rule; a force acts by its mean, and moves a free mass by ``shift``/m besides.
        half, shift, gap, (free, pushed, shifted, flexible) = 0.5 * H, 0.5 * H * H * (early - missed), y - u, moves(H)
        slow = 1.0 / (1.0 + half * (resists + half * k))
        x = free @ x + shift * shifted
        u = float(tip @ x[: len(tip)])
        y -= shift * per_mass
        mean = slow * (z - half * k * y)
        follows = 0.5 * stiffer + rate / H
        force = missed + (0.5 * stiffer - rate / H) * gap + follows * (y + H * mean - u)
        force /= 1.0 + follows * (flexible + H * half * slow * per_mass)
        mean -= half * slow * per_mass * force
        x, u = x + force * pushed, u + force * flexible
        y, z = y + H * mean, 2.0 * mean - z
        y, z = stays * y, stays * z + max(-most, min(turns * y, most))
        found = max(found, abs(u) / ways[0], abs(y) / ways[1])
        if found > _LOST:
            break
    return found


def _defect(law: SoftLaw, before: np.ndarray, step: np.ndarray, parts: int) -> np.ndarray:
    """Return four means over equal parts of each step, (4, parts), one part after the other.

    They are what the law asks for beyond the force of the step, once evenly weighted and once by 2 (1 − s), s the share
    of the part [N], and how the law's force grows with the penetration [N/m] and with its rate [N·s/m].
    """
    size = step["size"]
    start = before["y_after"] - before["u_tip_after"], before["z_after"] - before["v_tip_after"]
    end = step["y"] - step["u_tip"], step["z"] - step["v_tip"]
    moments = (step[f"y_{name}"] - step[f"u_tip_{name}"] for name in ("integral", "integral_2"))
    mean, twice = (moment / size**n for n, moment in enumerate(moments, 1))
    path: Any = Path.through(start, end, size, (mean, twice))  # type: ignore[arg-type]
    found = np.zeros((4, len(step), parts))
    for part, (at, share) in product(range(parts), zip(*_INSIDE, strict=True)):
        s = (part + at) / parts
        p, rate = path.at(s), path.slope(s) / size
        closed = np.flatnonzero((p > 0.0) | (not law.one_sided))
        force, grows = -applied(step, s * size), np.zeros((2, len(step)))
        for i, *both in zip(closed.tolist(), p[closed].tolist(), rate[closed].tolist(), strict=True):
            _, *slopes = law.resistance(*both) if law.damped else (0.0, 0.0, 0.0)
            force[i] += law.force(*both)
            grows[:, i] = law.slope(both[0]) + slopes[0], slopes[1]
        found[..., part] += share * np.array([force, 2.0 * (1.0 - at) * force, *grows])
    return found.reshape(4, -1)


def _after_events(scene: Scene, steps: np.ndarray, events: Sequence[Event], made: np.ndarray) -> np.ndarray:
    """Return what the events at the end of each of the steps ``made`` leave of the lower end's error, (3, len(made)).

    It is the share of displacement and velocity, none while the end is seated, and by how much each unit of
    displacement changes the velocity [1/s], at most by the jump of the stroke [m/s]: the end is struck earlier or
    later, under the acceleration before and after that.
    """
    shares, (turns, most) = np.where(steps["phase"] >= 3.0, 0.0, 1.0), np.zeros((2, len(made)))
    struck = [n for n, event in enumerate(events, 1) if event.kind is EventKind.STOP_IMPACT]
    if struck and scene.stop is not None:
        rows, e = np.searchsorted(steps["events"], struck), scene.stop.restitution
        np.multiply.at(shares, rows, -e)
        at = np.searchsorted(made, rows, side="right") - 1
        gained = (steps["z"][made] - steps["z_after"][made - 1]) / steps["size"][made]
        turns[at] = (e * gained[at] + np.append(gained, 0.0)[at + 1]) / steps["z"][made[at]]
        most[at] = (1.0 + e) * np.abs(steps["z"][made[at]])
    return np.array([np.multiply.reduceat(shares, made) if len(made) else turns, turns, most])


def _modes(scene: Scene, pair: Pair) -> Modes:
    """Return the beam's modes; a body that is not our own is a free mass."""
    if scene.beam is None:
        return np.zeros(1), np.zeros(1), np.full(1, pair.upper.mass**-0.5 if pair.upper.mass > 0.0 else 0.0)
    omega, tip = tip_modes(scene.beam)
    return omega**2, scene.beam.alpha_b * omega**2, tip


def _moves(modes: Modes, H: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return what a step of ``H`` [s] makes of displacements and velocities of modes, (2n, 2n).

    Further what a constant force of 1 N adds to them, and 1 N·s² that moves a free mass before the step, (2n,) each,
    and how far 1 N moves the tip [m/N].
    """
    # A free mass is a mode so soft that it does not turn; 1 − cos would leave nothing of a softer one.
    stiffness, decay, tip = np.maximum(modes[0], 1e-8 / H**2), 0.5 * modes[1], modes[2]
    root = np.sqrt(decay**2 - stiffness * (1.0 + 1e-12j))  # never 0
    slower, faster = np.exp((root - decay) * H), np.exp(-(root + decay) * H)
    cosine, sine = (0.5 * (slower + faster)).real, (0.5 * (slower - faster) / root).real
    kept = cosine + decay * sine
    free = np.block([[np.diag(kept), np.diag(sine)], [np.diag(-stiffness * sine), np.diag(cosine - decay * sine)]])
    pushed = np.concatenate([(1.0 - kept) / stiffness * tip, sine * tip])
    moved = tip / (1.0 + H * (decay + 0.25 * H * stiffness))
    return free, pushed, free[:, : len(tip)] @ moved, float(tip @ pushed[: len(tip)])


@lru_cache(maxsize=16)
def tip_modes(beam: Beam) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest frequencies of the mesh [rad/s] and the tip's displacement in modes of unit mass [1/√kg].

    Elements of a higher degree and those with the averaged mass are more accurate: fine linear ones stand for them.
    Both energies are sums of squares, so that low frequencies are not lost beside the high ones of a slender beam.
    """
    linear = beam.element_degree == 1 and beam.mass_matrix == "consistent"
    n = min(beam.n_elements, _ELEMENTS) if linear else _ELEMENTS
    h, none = beam.length / n, np.zeros((n, n))
    rise, mean = np.eye(n) - np.eye(n, k=-1), 0.5 * (np.eye(n) + np.eye(n, k=-1))  # over an element, from the clamp on
    bending, shear = bending_stiffness(beam) / h, shear_stiffness(beam) * h
    if linear and not beam.reduced_integration:  # it locks
        bending += shear * (beam.length / (beam.n_elements * h)) ** 2 / 12.0
    strain = np.block([[none, bending**0.5 * rise], [shear**0.5 / h * rise, -(shear**0.5) * mean]])
    speed = (beam.density * h) ** 0.5 * np.vstack([mean, rise / 12.0**0.5])
    to_strain = np.linalg.qr(strain)[1]
    of_strain = np.linalg.inv(to_strain)
    speeds = np.kron(np.diag([beam.area**0.5, beam.second_moment_of_area**0.5]), speed) @ of_strain
    if beam.n_modes:  # the lowest, and the static shapes of a tip force, of a uniform load and of the start
        start = to_strain[:, :n] @ np.arange(1.0, n + 1.0)
        shapes = np.array([of_strain[n - 1], mean.sum(axis=0) @ of_strain[:n], start])
        space = np.linalg.qr(np.vstack([np.linalg.svd(speeds)[2][: beam.n_modes], shapes]).T)[0]
        speeds, of_strain = speeds @ space, of_strain @ space
    periods, modes = np.linalg.svd(speeds)[1:]
    return 1.0 / periods[:_MODES], (modes @ of_strain[n - 1])[:_MODES] / periods[:_MODES]
