"""Critical macro steps measured: the FMUs coupled by the solvers of a run, without its events.

The linear closed contact of `springbeam.stability.linear`, stepped until its growth shows. `Preloaded` makes the
one-sided law λ p₊ a two-sided one: the bodies are counted from where a preload holds them in equilibrium.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from ..coupling import conditions, force
from ..coupling.compliance import Compliance
from ..coupling.exchange import Exchange
from ..coupling.tie import Tie
from ..fmu import load_bodies
from ..scene import Scene, with_changes
from ..subsystem import NO_FORCE, Body, Energies, Force, Motion
from .predict import THRESHOLD

#: Penetration in equilibrium [m], and first amplitude of the motion [m]: it may grow 1e6-fold before contact opens.
_PRELOAD, _AMPLITUDE = 1e4, 1e-3
#: Growth of the energy at which the rate is told, and how many macro steps it may take to get there.
_GROWN, _MOST_STEPS = 1e12, 30_000


class Preloaded:
    """A body counted from its equilibrium under a constant contact force, where its end is at ``offset`` [m]."""

    def __init__(self, body: Body, offset: float, preload: float) -> None:
        self._body, self._offset, self._preload = body, offset, preload
        self.mass = body.mass

    def mark(self) -> None:
        self._body.mark()

    def rewind(self) -> None:
        self._body.rewind()

    def advance(self, time: float, size: float, contact: Force, foundation: Force = NO_FORCE) -> None:
        self._body.advance(time, size, (contact[0] - self._preload, contact[1], contact[2]), foundation)

    def motion(self) -> Motion:
        w = self._body.motion()
        return w._replace(displacement=w.displacement + self._offset)

    def energies(self) -> Energies:
        return self._body.energies()

    def apply_impulse(self, impulse: float) -> None:
        self._body.apply_impulse(impulse)

    def close(self) -> None:
        self._body.close()

    def save(self) -> dict[str, Any]:
        return self._body.save()

    def restore(self, saved: dict[str, Any]) -> None:
        self._body.restore(saved)


def growth(scene: Scene) -> float:
    """Measured spectral radius of the scene's coupling: the factor by which amplitudes grow per macro step.

    The scene's pair without stop and events, tied or in closed contact (``contact.exponent`` must be 1), the spring
    without its cubic term and at its equilibrium, the tip on it. Both ends start with one velocity. The rate is that of
    the second half of the steps up to `_GROWN`.
    """
    coupling, contact = scene.coupling, scene.contact
    H, compliant = coupling.H, contact.law == "compliance"
    spring = {"cubic_stiffness": 0.0, "equilibrium": 0.0, "external_force": 0.0, "initial_velocity": 0.0}
    at_rest = {"distributed_load": 0.0, "initial_deflection_slope": 0.0, "initial_velocity_slope": 0.0}
    linear = with_changes(scene, stop=None, spring=spring, beam={**at_rest, "approach": "elastic"})
    beam, top = load_bodies(linear, 0.0)
    assert beam is not None
    assert top is not None
    pair: tuple[Body, Body] = (beam, top)
    frequency = 1.0 / H
    if compliant:
        preload = contact.stiffness * _PRELOAD
        pair = (Preloaded(beam, -0.5 * _PRELOAD, preload), Preloaded(top, 0.5 * _PRELOAD, preload))
        frequency = math.sqrt(contact.stiffness * (1.0 / beam.mass + 1.0 / top.mass))
    try:
        step = _stepper(linear, pair)
        for body in pair:
            body.apply_impulse(body.mass * _AMPLITUDE * frequency)
        energies = [_energy(pair)]
        while len(energies) <= _MOST_STEPS and energies[-1] < _GROWN * energies[0]:
            for body in pair:
                body.mark()
            step(H * (len(energies) - 1))
            energies.append(_energy(pair))
    finally:
        beam.close()
        top.close()
    n = len(energies) - 1
    return float((energies[n] / energies[n // 2]) ** (0.5 / (n - n // 2)))


def _energy(pair: tuple[Body, Body]) -> float:
    return sum(body.energies().kinetic + body.energies().potential for body in pair)


def _stepper(scene: Scene, pair: tuple[Body, Body]) -> Callable[[float], None]:
    """``step(time)`` advances both bodies by the scene's coupling."""
    coupling, contact = scene.coupling, scene.contact
    H, (beam, top) = coupling.H, pair
    if contact.law == "compliance" and coupling.scheme != "energy":
        sequential = coupling.scheme == "gauss_seidel"
        exchange = Exchange(sequential, coupling.degree, contact.stiffness, contact.exponent)
        return lambda time: _discard(exchange.solve(beam, top, time, H, (beam.motion(), top.motion())))
    guess = NO_FORCE
    tie = Tie(conditions(coupling.scheme, coupling.degree), coupling.degree, coupling.tolerance)
    law = Compliance(contact.stiffness, contact.exponent, coupling.tolerance)

    def step(time: float) -> None:
        nonlocal guess
        if contact.law == "compliance":
            p = top.motion().displacement - beam.motion().displacement
            guess = law.solve(beam, top, time, H, guess, p)
        else:
            guess = force.shifted(tie.solve(beam, top, time, H, guess, beam.motion()), H)

    return step


def _discard(_: object) -> None: ...


def measured_critical_step(scene: Scene, near: float, threshold: float = THRESHOLD, precision: float = 0.01) -> float:
    """H [s] at which `growth` passes 1 + ``threshold``, by bisection around ``near`` to ``precision`` of itself."""

    def unstable(H: float) -> bool:
        return growth(with_changes(scene, coupling={"macro_step": H})) > 1.0 + threshold

    low = high = near
    while unstable(low):
        high, low = low, low / 1.1
    while not unstable(high):
        low, high = high, high * 1.1
    while high > (1.0 + precision) * low:
        middle = math.sqrt(low * high)
        if unstable(middle):
            high = middle
        else:
            low = middle
    return math.sqrt(low * high)
