"""A short check of a foreign FMU before the run: is it what it and the scene say?

Each check is tried on steps of H, H/10, … and holds if it does for one of them: an FMU may need short steps, or have
steps of its own that are not shorter than some. Each starts from the FMU's initial state, by a restored state or a new
instance. The process in which that happens may not come to its end (`springbeam.bodies.isolated`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from math import isfinite
from typing import Any, NamedTuple

from ..scene.partners import ForeignFmu
from .abilities import Abilities
from .foreign import Findings, ForeignBody, moments
from .protocol import NO_FORCE, FmuError, Force, StepRefused

#: Sizes tried, over H; steps of a record.
_SIZES, _RECORD = (1.0, 0.1, 1e-2, 1e-3, 1e-4), 64
#: How far, relatively, an output may be from what it should be: of integrators of order 1 less is left of 64 steps.
_TOLERANCE, _ROUNDING = 0.04, 1e-9
#: How far a response may be from that of a mass; what it is must be seen in so many digits.
_RESPONSE, _AGREE = 0.1, 0.01
#: Forces tried: each so many times the one before [N]; a change is seen if it is so large a part of the value.
_STRONGER, _STRONGEST, _SEEN = 1e3, 1e15, 1e-6


class Sample(NamedTuple):
    """The motion after a step, the sum of the energies that are told, and the work done on the end."""

    x: float
    v: float
    once: float
    twice: float
    energy: float
    work: float


class Bench:
    """Makes steps of the FMU from its initial state, and notes what is wrong.

    Parameters
    ----------
    spec, upper
        The table, and whether it is that of the upper body.
    start_time, H
        Of the run, and a macro step [s].
    stage
        Takes a note of what is done next.
    """

    def __init__(
        self, spec: ForeignFmu, upper: bool, start_time: float, H: float, stage: Callable[[str], None]
    ) -> None:
        self.spec, self._start, self._H, self.stage = spec, start_time, H, stage
        #: What is upward for the force C.
        self.upward = 1.0 if upper else -1.0
        self.faults: list[str] = []
        self._body: ForeignBody | None = None
        #: What it can do, as far as is known.
        self.abilities = Abilities(
            velocity=spec.velocity is not None,
            integrals=0 if spec.integral is None else 1 if spec.integral_2 is None else 2,
            slopes=0,
            impulse=spec.impulse is not None,
            energies=spec.kinetic_energy is not None and spec.potential_energy is not None,
        )
        body = self.renewed()
        self.says = says = body.fmu.says
        state, any_size = body.abilities.state, bool(says.canHandleVariableCommunicationStepSize)
        serialized = state and bool(says.canSerializeFMUstate)
        self.abilities = replace(self.abilities, state=state, serialized=serialized, any_size=any_size)
        self.sizes = [H * share for share in _SIZES] if any_size else [H]

    def renewed(self, **abilities: Any) -> ForeignBody:
        """Return the body of a new instance that is taken to have other ``abilities``."""
        self.close()
        self.stage("instantiation")
        self.abilities = replace(self.abilities, **abilities)
        found = Findings(self.abilities, 1.0, 0.0, self._H)
        self._body = body = ForeignBody(self.spec, self.upward > 0.0, self._start, found)
        self.stage("saving the state")
        body.mark()
        return body

    def close(self) -> None:
        """Free the instance."""
        if self._body is not None:
            self._body.close()

    def run(self, size: float, forces: Sequence[Force], impulse: float = 0.0) -> list[Sample]:
        """Return the samples at the start and after each step of ``size`` [s] under a force C and an ``impulse``."""
        body = self._body
        if body is None or (body.fmu.moved and not body.abilities.state):
            body = self.renewed()
        body.rewind()
        samples = [self._sample(body)]
        if impulse:
            body.apply_impulse(impulse)
        self.stage("a step")
        for i, given in enumerate(forces):
            try:
                body.advance(self._start + i * size, size, given)
            except StepRefused as refused:
                raise FmuError(f"{self.spec.fmu}: {refused}") from None
            samples.append(self._sample(body))
        return samples

    def _sample(self, body: ForeignBody) -> Sample:
        sample = Sample(*body.motion(), sum(body.energies()), body.state.received)
        if not isfinite(sample.energy):
            raise FmuError(f"{self.spec.fmu}: tells energies that are not finite: {body.energies()}")
        return sample

    def change(self, size: float, force: Force, impulse: float = 0.0) -> float:
        """Return what ``force`` or ``impulse`` changes over a step: the velocity, without one the displacement."""
        moved, free = (self.run(size, [given], kick)[1] for given, kick in ((force, impulse), (NO_FORCE, 0.0)))
        change, value = (moved.v - free.v, free.v) if self.spec.velocity else (moved.x - free.x, free.x)
        return change if abs(change) > _SEEN * abs(value) else 0.0

    def fault(self, what: str) -> None:
        self.faults.append(f"{self.spec.fmu}: {what}")


def examine(bench: Bench) -> Findings:
    """Examine an FMU here and now. Raises FmuError."""
    spec, H = bench.spec, bench.sizes[0]
    _check_state(bench)
    mass = _mass(bench)
    start = bench.run(H, [])[0]
    #: Steps move its end by this much, against how far it is from 0 and comes by itself [m].
    length = max(1e-3 * abs(start.x), abs(start.v) * H, 1e-6)
    _check_outputs(bench, mass * length)
    _try_slopes(bench, mass * length)
    if bench.abilities.impulse and bench.abilities.velocity:
        mass = _check_impulse(bench, spec.mass or mass, length / H)
    velocity = start.v if bench.abilities.velocity else _velocity(bench)
    bench.close()
    return Findings(bench.abilities, mass, velocity, H, tuple(bench.faults))


def _check_state(bench: Bench) -> None:
    if not bench.abilities.state:
        return
    H, push = bench.sizes[0], (1.0, 0.0, 0.0)
    first = bench.run(H, [push, push])
    bench.run(H, [(-1.0, 0.0, 0.0)] * 3)
    second = bench.run(H, [push, push])
    if first != second:
        k, (a, b) = next((k, pair) for k, pair in enumerate(zip(first, second, strict=True)) if pair[0] != pair[1])
        bench.fault(
            f"canGetAndSetFMUstate = true, but from one state {k} equal steps lead to {a.x!r} m and {a.v!r} m/s, "
            f"and then to {b.x!r} m and {b.v!r} m/s"
        )
        bench.renewed(state=False, serialized=False)  # what follows starts from new instances


def _extrapolated(bench: Bench, inertia: Callable[[float], float | None]) -> float | None:
    """Return ``inertia`` of a step's size [s] as that goes to 0, from the shortest steps that tell it (Romberg)."""
    found = None
    for size in reversed(bench.sizes):
        told = [inertia(size * share) for share in ((1.0, 0.5, 0.25) if bench.abilities.any_size else (1.0,))]
        column = [value for value in told if value is not None]
        if len(column) < len(told):
            continue
        agree = abs(column[-1] - column[0]) <= _AGREE * abs(column[0])
        for factor in (2.0, 4.0)[: len(column) - 1]:
            column = [(factor * finer - coarser) / (factor - 1.0) for coarser, finer in pairwise(column)]
        found = column[0]
        if agree:
            break
    return found


def _mass(bench: Bench) -> float:
    """Return what a force meets at first [kg]."""
    bench.stage("response to a force")
    name = bench.spec.force

    def inertia(size: float) -> float | None:
        force = 1.0
        while force <= _STRONGEST:
            if change := bench.change(size, (force, 0.0, 0.0)):
                return force * size / change * (1.0 if bench.spec.velocity else 0.5 * size)
            force *= _STRONGER
        return None

    found = _extrapolated(bench, inertia)
    if found is None:
        raise FmuError(f"{bench.spec.fmu}: a force of up to {_STRONGEST:g} N in {name!r} does not move its end")
    mass = found * bench.upward
    if mass <= 0.0:
        where = "down" if found * bench.spec.force_sign < 0.0 else "up"
        bench.fault(f"a positive {name!r} pushes the end {where}; set force_sign = {-bench.spec.force_sign}")
    return abs(mass)


def _check_outputs(bench: Bench, impetus: float) -> None:
    """Check velocity, integrals and energies; ``impetus`` is a mass times a length to move it by [kg·m]."""
    bench.stage("outputs under a force")
    wrong: dict[str, str] = {}
    for size in bench.sizes:
        force = impetus / (_RECORD * size) ** 2
        path = bench.run(size, [(force, 0.0, 0.0)] * _RECORD)
        found = _told_and_due(bench.spec, path, size)
        wrong = {name: text for name, text in found.items() if size == bench.sizes[0] or name in wrong}
        if not wrong:
            return
    for text in wrong.values():
        bench.fault(text)


def _told_and_due(spec: ForeignFmu, path: Sequence[Sample], h: float) -> dict[str, str]:
    """Return what does not fit the displacement, by key; ``path`` is made of steps of ``h`` [s]."""
    steps = list(pairwise(path))
    here = f"over {len(steps)} steps of {h:.3g} s"
    rounding = _ROUNDING * len(steps) * max(abs(s.x) for s in path)
    seen = _TOLERANCE * sum(abs(b.x - a.x) for a, b in steps) + rounding
    wrong = {}
    means = [0.5 * h * (a.v + b.v) for a, b in steps]
    if spec.velocity and sum(abs(b.x - a.x - mean) for (a, b), mean in zip(steps, means, strict=True)) > seen:
        wrong["velocity"] = (
            f"velocity {spec.velocity!r} is not the rate of displacement {spec.displacement!r}: {here} that moves by "
            f"{path[-1].x - path[0].x:.6g} m, and the integral of the velocity is {sum(means):.6g} m"
        )
    dues = [moments(a.x, a.v if spec.velocity else b.v, b.x, b.v, h) for a, b in steps]
    for key, order in (("integral", 1), ("integral_2", 2)):
        name = getattr(spec, key)
        told = [(s.once, s.twice)[order - 1] for s in path[1:]]
        due = [both[order - 1] for both in dues]
        if name and sum(abs(a - b) for a, b in zip(told, due, strict=True)) > h**order * seen:
            wrong[key] = (
                f"{key} {name!r} is not that of displacement {spec.displacement!r} over each step: {here} the last is "
                f"{told[-1]:.6g} and should be {due[-1]:.6g}"
            )
    if spec.kinetic_energy and spec.potential_energy:
        rounding = _ROUNDING * len(steps) * max(abs(s.energy) for s in path)
        off = sum(abs(b.energy - a.energy - (b.work - a.work)) for a, b in steps)
        if off > _TOLERANCE * sum(abs(b.work - a.work) for a, b in steps) + rounding:
            wrong["energies"] = (
                f"the energies named do not account for the work on the end: {here} that is "
                f"{path[-1].work - path[0].work:.6g} J, they gain {path[-1].energy - path[0].energy:.6g} J; name "
                "dissipated_energy and load_potential as well, or no energies"
            )
    return wrong


def _try_slopes(bench: Bench, impetus: float) -> None:
    """Find the highest derivative of the force over a step that the motion follows; ``impetus`` as above."""
    if not bench.says.canInterpolateInputs:
        return
    #: Responses to F τ/h and F τ²/h² over that to F: of the velocity, of the displacement.
    due = (0.5, 1.0 / 3.0) if bench.spec.velocity else (1.0 / 3.0, 1.0 / 6.0)
    shares: list[float] = []
    for order in (1, 2):
        bench.renewed(slopes=order)
        bench.stage("input derivatives")
        try:
            share = _response(bench, order, impetus, due[order - 1])
        except FmuError:
            if order == 1:
                raise
            break  # FMI does not say how many there must be
        shares.append(share)
        if abs(share / due[order - 1] - 1.0) > _RESPONSE:
            break
    followed = sum(abs(share / wanted - 1.0) <= _RESPONSE for share, wanted in zip(shares, due, strict=False))
    bench.renewed(slopes=followed)
    if followed == 0:
        bench.fault(
            f"canInterpolateInputs = true, but a force that grows over a step moves the end {shares[0]:.3g} times as "
            f"much as one that is there from its start; it should be {due[0]:.3g}"
        )


def _response(bench: Bench, order: int, impetus: float, due: float) -> float:
    """Return the response to F (τ/h)^order over that to F, of the first size of steps where it is as ``due``."""
    share = 0.0
    for size in bench.sizes:
        force = impetus / size**2
        held = bench.change(size, (force, 0.0, 0.0))
        grown = bench.change(size, (0.0, force / size, 0.0) if order == 1 else (0.0, 0.0, 2.0 * force / size**2))
        share = grown / held if held else 0.0
        if abs(share / due - 1.0) <= _RESPONSE:
            break
    return share


def _check_impulse(bench: Bench, mass: float, speed: float) -> float:
    """Return the mass that an impulse meets [kg]; the one expected is ``mass``, ``speed`` what it is to have [m/s]."""
    bench.stage("impulse")
    impulse = mass * speed

    def inertia(size: float) -> float | None:
        change = bench.change(size, NO_FORCE, impulse)
        return impulse / change if change else None

    found = _extrapolated(bench, inertia)
    if found is None or abs(found / mass - 1.0) > _RESPONSE:
        changes = "nothing" if found is None else f"the velocity by {impulse / found:.6g} m/s"
        bench.fault(
            f"an upward impulse of {impulse:.6g} N·s in {bench.spec.impulse!r} changes {changes}; with the mass "
            f"{mass:.6g} kg it should be {speed:.6g} m/s"
        )
        return mass
    return found


def _velocity(bench: Bench) -> float:
    """Return the velocity at the start [m/s] from displacements."""
    h = bench.sizes[min(2, len(bench.sizes) - 1)]
    x0, whole = (sample.x for sample in bench.run(h, [NO_FORCE]))
    if not bench.abilities.any_size:
        return (whole - x0) / h
    half = bench.run(0.5 * h, [NO_FORCE])[1].x
    return (4.0 * half - whole - 3.0 * x0) / h
