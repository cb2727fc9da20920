"""A short check of a foreign FMU before the run: is it what it and the scene say?

Each check is tried on steps of H, H/10, … and holds if it does for one of them: an FMU may need short steps, or have
steps of its own that are not shorter than some. Each starts from the FMU's initial state, by a restored state or a new
instance. The process in which that happens may not come to its end (`springbeam.bodies.isolated`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from ctypes import c_double
from itertools import pairwise
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple

from ..scene.partners import ForeignFmu
from .abilities import Abilities
from .fmu import Fmu, Reals
from .foreign import Findings, check_names
from .functions import WARNING
from .protocol import FmuError, Force

#: Sizes tried, over H; steps of a record.
_SIZES, _RECORD = (1.0, 0.1, 1e-2, 1e-3, 1e-4), 64
#: How far, relatively, an output may be from what it should be: of integrators of order 1 less is left of 64 steps.
_TOLERANCE, _ROUNDING = 0.04, 1e-9
#: How far a response may be from that of a mass; what it is must be seen in so many digits.
_RESPONSE, _AGREE = 0.1, 0.01
#: Forces tried: each so many times the one before [N]; a change is seen if it is so large a part of the value.
_STRONGER, _STRONGEST, _SEEN = 1e3, 1e15, 1e-6


_NONE: Force = (0.0, 0.0, 0.0)


class Sample(NamedTuple):
    """What the FMU tells after a step, 0 where it has no name."""

    x: float
    v: float
    once: float
    twice: float
    energy: float


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
        self.spec, self._start, self.stage = spec, start_time, stage
        #: Upward force over the value of the input.
        self.upward = spec.force_sign * (1.0 if upper else -1.0)
        self.fmu = self._new()
        says = self.fmu.says
        self.state = bool(says.canGetAndSetFMUstate)
        self.any_size = bool(says.canHandleVariableCommunicationStepSize)
        self.sizes = [H * share for share in _SIZES] if self.any_size else [H]
        self.slopes = 0  #: highest input derivative that is set
        self.faults: list[str] = []

    def _new(self) -> Fmu:
        self.stage("instantiation")
        spec = self.spec
        fmu = Fmu(None, Path(spec.fmu), spec.parameters, self._start)
        check_names(fmu, spec)
        motion = (spec.displacement, spec.velocity, spec.integral, spec.integral_2)
        self._named = [name is not None for name in motion]
        self._outputs = Reals(fmu, *(name for name in (*motion, *spec.energies) if name is not None))
        self._force = Reals(fmu, spec.force)
        self._impulse = None if spec.impulse is None else Reals(fmu, spec.impulse)
        self._slopes: Any = (c_double * 2)()
        if fmu.says.canInterpolateInputs:
            self._set_slopes = {n: fmu.input_derivatives((spec.force,), n, self._slopes) for n in (1, 2)}
        self._fresh, self._marked = True, False
        return fmu

    def again(self) -> None:
        """Return to the initial state."""
        if self._fresh:
            return
        if self.state and self._marked:
            self.fmu.rewind()
        elif self.fmu.says.canBeInstantiatedOnlyOncePerProcess:
            self.fmu.reset(self._start, {})
        else:
            self.fmu.close()
            self.fmu = self._new()
        self._fresh = True

    def read(self) -> Sample:
        told = iter(self._outputs.get())
        x, v, once, twice = (next(told) if named else 0.0 for named in self._named)
        sample = Sample(x, v, once, twice, sum(told))
        if not isfinite(sum(sample)):
            raise FmuError(f"{self.fmu.path}: tells numbers that are not finite: {tuple(sample)}")
        return sample

    def run(self, size: float, forces: Sequence[Force], impulse: float = 0.0) -> list[Sample]:
        """Return the samples at the start and after each step of ``size`` [s] under values and slopes of its input."""
        self.again()
        if self.state and not self._marked:
            self.stage("saving the state")
            self.fmu.mark()
            self._marked = True
        samples, self._fresh = [self.read()], False
        if impulse and self._impulse is not None:
            self._impulse.set((impulse,))
        self.stage("a step")
        for i, (value, *slopes) in enumerate(forces):
            self._force.set((value,))
            if self.slopes > 0:
                self._slopes[:] = slopes
                if (status := self._set_slopes[self.slopes]()) > WARNING:
                    raise self.fmu.failed(status, f"cannot set derivatives of {self.spec.force}")
            self.fmu.step(self._start + i * size, size)
            if impulse and self._impulse is not None:
                self._impulse.set((0.0,))
            samples.append(self.read())
        return samples

    def change(self, size: float, force: Force, impulse: float = 0.0) -> float:
        """Return what ``force`` or ``impulse`` changes over a step: the velocity, without one the displacement."""
        moved, free = (self.run(size, [given], kick)[1] for given, kick in ((force, impulse), (_NONE, 0.0)))
        change, value = (moved.v - free.v, free.v) if self.spec.velocity else (moved.x - free.x, free.x)
        return change if abs(change) > _SEEN * abs(value) else 0.0

    def fault(self, what: str) -> None:
        self.faults.append(f"{self.spec.fmu}: {what}")


def examine(bench: Bench) -> Findings:
    """Examine an FMU here and now. Raises FmuError, or StepRefused where a step fails."""
    spec, H = bench.spec, bench.sizes[0]
    _check_state(bench)
    mass = _mass(bench)
    start = bench.run(H, [])[0]
    #: Steps move its end by this much, against how far it is from 0 and comes by itself [m].
    length = max(1e-3 * abs(start.x), abs(start.v) * H, 1e-6)
    _check_outputs(bench, mass * length)
    slopes = _slopes_followed(bench, mass * length)
    if spec.impulse is not None and spec.velocity is not None:
        mass = _check_impulse(bench, spec.mass or mass, length / H)
    velocity = start.v if spec.velocity is not None else _velocity(bench)
    abilities = Abilities(
        state=bench.state,
        serialized=bench.state and bool(bench.fmu.says.canSerializeFMUstate),
        any_size=bench.any_size,
        velocity=spec.velocity is not None,
        integrals=0 if spec.integral is None else 1 if spec.integral_2 is None else 2,
        slopes=slopes,
        impulse=spec.impulse is not None,
        energies=spec.kinetic_energy is not None and spec.potential_energy is not None,
    )
    bench.fmu.close()
    return Findings(abilities, mass, velocity, tuple(bench.faults))


def _check_state(bench: Bench) -> None:
    if not bench.state:
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
        bench.state = False  # what follows starts from new instances


def _extrapolated(bench: Bench, inertia: Callable[[float], float | None]) -> float | None:
    """Return ``inertia`` of a step's size [s] as that goes to 0, from the shortest steps that tell it (Romberg)."""
    found = None
    for size in reversed(bench.sizes):
        told = [inertia(size * share) for share in ((1.0, 0.5, 0.25) if bench.any_size else (1.0,))]
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
        raise FmuError(f"{bench.fmu.path}: a force of up to {_STRONGEST:g} N in {name!r} does not move its end")
    mass = found * bench.upward
    if mass <= 0.0:
        pressed = "presses the lower body up" if found > 0.0 else "presses the upper body down"
        bench.fault(f"a positive {name!r} {pressed}; set force_sign = {-bench.spec.force_sign}")
    return abs(mass)


def _check_outputs(bench: Bench, impetus: float) -> None:
    """Check velocity, integrals and energies; ``impetus`` is a mass times a length to move it by [kg·m]."""
    bench.stage("outputs under a force")
    spec, wrong = bench.spec, {}
    for size in bench.sizes:
        force = impetus / (_RECORD * size) ** 2
        path = bench.run(size, [(force, 0.0, 0.0)] * _RECORD)
        found = _told_and_due(spec, path, size, force * bench.upward)
        wrong = {name: text for name, text in found.items() if size == bench.sizes[0] or name in wrong}
        if not wrong:
            return
    for text in wrong.values():
        bench.fault(text)


def _told_and_due(spec: ForeignFmu, path: Sequence[Sample], h: float, force: float) -> dict[str, str]:
    """Return what does not fit the displacement, by key; ``path`` is made of steps of ``h`` [s] under ``force`` [N]."""
    steps = list(pairwise(path))
    here = f"over {len(steps)} steps of {h:.3g} s"
    moved, reach = path[-1].x - path[0].x, max(abs(s.x) for s in path)
    change = sum(abs(b.x - a.x) for a, b in steps)
    curved = 1.0 if spec.velocity else 0.0
    wrong = {}
    due = sum(0.5 * h * (a.v + b.v) for a, b in steps)
    off = sum(abs(b.x - a.x - 0.5 * h * (a.v + b.v)) for a, b in steps)
    if spec.velocity and off > _TOLERANCE * change + _ROUNDING * reach * len(steps):
        wrong["velocity"] = (
            f"velocity {spec.velocity!r} is not the rate of displacement {spec.displacement!r}: {here} that moves by "
            f"{moved:.6g} m, and the integral of the velocity is {due:.6g} m"
        )
    once = [0.5 * h * (a.x + b.x) + curved * h**2 * (a.v - b.v) / 12.0 for a, b in steps]
    twice = [
        h**2 * (7.0 * a.x + 3.0 * b.x) / 20.0 + h**3 * (a.v / 20.0 - b.v / 30.0)
        if curved
        else h**2 * (2.0 * a.x + b.x) / 6.0
        for a, b in steps
    ]
    for key, told, dues, unit in (
        ("integral", [s.once for s in path[1:]], once, h),
        ("integral_2", [s.twice for s in path[1:]], twice, h * h),
    ):
        name = getattr(spec, key)
        off = sum(abs(a - b) for a, b in zip(told, dues, strict=True))
        if name and off > unit * (_TOLERANCE * change + _ROUNDING * reach * len(steps)):
            wrong[key] = (
                f"{key} {name!r} is not that of displacement {spec.displacement!r} over each step: {here} the last is "
                f"{told[-1]:.6g} and should be {dues[-1]:.6g}"
            )
    work, gained = force * moved, path[-1].energy - path[0].energy
    if spec.kinetic_energy and spec.potential_energy:
        largest = max(abs(s.energy) for s in path)
        off = sum(abs(b.energy - a.energy - force * (b.x - a.x)) for a, b in steps)
        if off > _TOLERANCE * abs(force) * change + _ROUNDING * largest * len(steps):
            wrong["energies"] = (
                f"the energies named do not account for the work on the end: {here} that is {work:.6g} J, they gain "
                f"{gained:.6g} J; name dissipated_energy and load_potential as well, or no energies"
            )
    return wrong


def _slopes_followed(bench: Bench, impetus: float) -> int:
    """Return the highest derivative of the force over a step that the motion follows."""
    if not bench.fmu.says.canInterpolateInputs:
        return 0
    bench.stage("input derivatives")
    #: Responses to F τ/h and F τ²/h² over that to F: of the velocity, of the displacement.
    due = {1: 0.5, 2: 1.0 / 3.0} if bench.spec.velocity else {1: 1.0 / 3.0, 2: 1.0 / 6.0}
    followed, seen = 0, 0.0
    for order in (1, 2):
        for size in bench.sizes:
            force = impetus / size**2
            held = bench.change(size, (force, 0.0, 0.0))
            slopes = (force / size, 0.0) if order == 1 else (0.0, 2.0 * force / size**2)
            bench.slopes = order
            try:
                share = bench.change(size, (0.0, *slopes)) / held if held else 0.0
            except FmuError:
                if order == 2:  # FMI does not say how many there must be
                    bench.slopes = 1
                    return followed
                raise
            if order == 1:
                seen = share
            if abs(share / due[order] - 1.0) <= _RESPONSE:
                followed = order
                break
        if followed < order:
            break
    bench.slopes = followed
    if followed == 0:
        bench.fault(
            f"canInterpolateInputs = true, but a force that grows over a step moves the end {seen:.3g} times as "
            f"much as one that is there from its start; it should be {due[1]:.3g}"
        )
    return followed


def _check_impulse(bench: Bench, mass: float, speed: float) -> float:
    """Return the mass that an impulse meets [kg]; the one expected is ``mass``, ``speed`` what it is to have [m/s]."""
    bench.stage("impulse")
    impulse = mass * speed

    def inertia(size: float) -> float | None:
        change = bench.change(size, _NONE, impulse)
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
    x0, whole = (sample.x for sample in bench.run(h, [_NONE]))
    if not bench.any_size:
        return (whole - x0) / h
    half = bench.run(0.5 * h, [_NONE])[1].x
    return (4.0 * half - whole - 3.0 * x0) / h
