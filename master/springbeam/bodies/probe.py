"""A short check of a foreign FMU before the run, against its description and the scene.

Each check is tried with steps of H, H/10, … and passes if it does for one of them: an FMU may need short steps, or have
internal steps of a least size. Each starts from the FMU's initial state, by a restored state or a new instance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from ..scene.partners import ForeignFmu
from .foreign import Findings, ForeignBody, moments
from .protocol import NO_FORCE, FmuError, Force, StepRefused

#: Sizes tried, over H.
_SIZES = (1.0, 0.1, 1e-2, 1e-3, 1e-4)
#: Steps of a record.
_RECORD = 64
#: Largest relative error of an output; integrators of order 1 have less after 64 steps.
_TOLERANCE = 0.04
_ROUNDING = 1e-9
#: Largest relative difference of a response from that of a mass.
_RESPONSE = 0.1
#: Largest relative difference of two measurements of a response.
_AGREE = 0.01
#: Largest relative difference of the responses to a step and to a half of it: of a free mass they are in proportion.
_ALIKE = 0.2
#: Steps whose gains of velocity under one force vary smoothly, unless internal steps end beside them.
_GRADUAL = 16
#: Largest relative difference of the displacement by a force from that of a mass of order 2: of order 1 it is 1/K.
_SECOND_ORDER = 0.05
#: Forces tried [N].
_FORCES = (1.0, 1e3, 1e6, 1e9, 1e12, 1e15)
#: Smallest relative change of a value that counts.
_SEEN = 1e-6
_T = TypeVar("_T")


class _TriedBody(ForeignBody):
    PATIENCE = 20.0
    OCCASION = " of the check before the run"


class Bench:
    """Make steps of the FMU from its initial state, and note faults.

    Parameters
    ----------
    spec, upper
        The table, and whether it is that of the upper body.
    times
        When the run starts and ends [s].
    H
        A macro step [s].
    """

    def __init__(self, spec: ForeignFmu, upper: bool, times: tuple[float, float], H: float) -> None:
        start, end = times
        self.spec = spec
        self._start = start
        self.faults = list[str]()
        self.warnings = list[str]()
        self._made = partial(_TriedBody, spec, upper, (start, max(end, start + _RECORD * H)))
        #: The present instance; its ``abilities`` are the known ones.
        self.body = self._made(None)
        self.sizes = [H * share for share in _SIZES] if self.body.abilities.any_size else [H]

    def renew(self, **abilities: Any) -> None:
        """Make a new instance, with other assumed ``abilities``."""
        self.body.close()
        self.body = self._made(Findings(replace(self.body.abilities, **abilities)))

    def run(self, size: float, forces: Sequence[Force], impulse: float = 0.0) -> np.ndarray:
        """Make a step of ``size`` [s] under each force C, after an ``impulse``.

        Return rows before the first step and after each, shape (n + 1, 6): the motion, the sum of the known energies,
        and the work done on the end.
        """
        if self.body.steps_made > 0 and not self.body.abilities.state:
            self.renew()
        body = self.body
        body.rewind()
        if impulse:
            body.apply_impulse(impulse)

        def row() -> list[float]:
            return [*body.motion(), sum(body.energies()), body.received]

        rows = [row()]
        for i, given in enumerate(forces):
            body.advance(self._start + i * size, size, given)
            rows.append(row())
        return np.array(rows)

    def response(self, size: float, force: Force, impulse: float = 0.0) -> tuple[float, float]:
        """Return the changes of displacement and velocity by ``force`` over a step, or ``impulse``; 0 if not seen.

        Without a velocity, its change shows in the displacement of a second step.
        """
        after = [] if self.spec.velocity else [NO_FORCE]
        moved, free = (
            self.run(size, [given, *after], kick)[:, :2] for given, kick in ((force, impulse), (NO_FORCE, 0.0))
        )
        by = moved - free
        if self.spec.velocity:
            faster = by[1, 1]
            scale = abs(free[1, 1])
        else:
            faster = (by[2, 0] - by[1, 0]) / size
            scale = abs(free[2, 0]) / size
        return float(by[1, 0]), float(faster) if abs(faster) > _SEEN * scale else 0.0

    def extrapolated(self, inertia: Callable[[float], float | None]) -> float | None:
        """Return the limit of ``inertia`` as the step's size [s] goes to 0, from the shortest steps that show it."""
        halvings = range(2 if self.body.abilities.any_size else 1)

        def column_of(size: float) -> list[float | None]:
            return list(self.taken(inertia, [size / 2**halving for halving in halvings]))

        limit = None
        for column in self.taken(column_of, reversed(self.sizes)):
            if None not in column:
                first = column[0] or 0.0
                last = column[-1] or 0.0
                limit = 2.0 * last - first
                if abs(last - first) <= _AGREE * abs(first):
                    break
        return limit

    def wrong(self, check: Callable[[float], set[str]]) -> set[str]:
        """Return the faults that ``check`` of a step's size [s] finds at every size that the FMU takes."""
        common: set[str] | None = None
        for wrong in self.taken(check, self.sizes):
            common = wrong if common is None else common & wrong
            if not common:
                break
        return common or set()

    def taken(self, tried: Callable[[float], _T], sizes: Iterable[float]) -> Iterator[_T]:
        """Yield the result of ``tried`` for the ``sizes`` [s] at which the FMU steps.

        Raises the StepRefused of the longest if it steps at none.
        """
        refused = dict[float, StepRefused]()
        stepped = False
        for size in sizes:
            try:
                value = tried(size)
            except StepRefused as failure:
                refused[size] = failure
                self.renew()  # what has failed may not be used on
            else:
                stepped = True
                yield value
        if refused and not stepped:
            raise refused[max(refused)]


def examined(spec: ForeignFmu, upper: bool, times: tuple[float, float], H: float) -> Findings:
    """Check an FMU, once; parameters as of `Bench`.

    Raises
    ------
    FmuError
        If the FMU cannot be used in the scene, crashes, or does not return.
    """
    path = Path(spec.fmu)
    changed = path.stat().st_mtime_ns if path.is_file() else None
    return _examined(changed, spec.model_dump_json(), upper, times, H)


@lru_cache(maxsize=64)
def _examined(_changed: int | None, spec: str, upper: bool, times: tuple[float, float], H: float) -> Findings:
    bench = Bench(ForeignFmu.model_validate_json(spec), upper, times, H)
    try:
        return _examine(bench, 1.0 if upper else -1.0)
    except StepRefused as refused:
        raise FmuError(f"{bench.spec.fmu}: {refused}") from None
    finally:
        bench.body.close()


def _examine(bench: Bench, upward: float) -> Findings:
    """Check the FMU of ``bench``; a positive C acts upward (1) or downward (-1) on its end."""
    spec = bench.spec
    H = bench.sizes[0]
    promised = bench.body.abilities.slopes
    bench.renew(slopes=0)
    if bench.body.abilities.state:
        _check_state(bench)
    if bench.body.abilities.any_size and (size := _internal_steps(bench)) is not None:
        bench.renew(any_size=False)
        bench.sizes = [H]
        _check_grid(bench, size)
        if bench.faults:  # what follows would be others
            return _findings(bench)
    mass = bench.extrapolated(partial(_inertia, bench))
    if mass is None:
        raise FmuError(f"{spec.fmu}: a force of up to {_FORCES[-1]:g} N in {spec.force!r} does not move its end")
    if mass * upward <= 0.0:
        where = "down" if mass * spec.force_sign < 0.0 else "up"
        bench.faults.append(f"a positive {spec.force!r} pushes the end {where}; set force_sign = {-spec.force_sign}")
    mass = abs(mass)
    x, v = bench.run(H, [])[0, :2].tolist()
    #: Steps move its end by this much, against how far it is from 0 and comes by itself [m].
    length = max(1e-3 * abs(x), abs(v) * H, 1e-6)
    lag = _lag(bench, mass * length)
    bench.faults += sorted(bench.wrong(partial(_wrong_outputs, bench, mass * length)))
    if promised and lag == 0.0 and bench.body.abilities.order > 1:  # to order 1 no slope is followed
        _try_slopes(bench, mass * length)
    if bench.body.abilities.impulse and bench.body.abilities.velocity:
        mass = _struck_mass(bench, spec.mass or mass, length / H)
    if not bench.body.abilities.velocity:
        v = next(bench.taken(partial(_velocity, bench), [*bench.sizes[2:], *bench.sizes[1::-1]]))
    return _findings(bench, mass, v, lag)


def _findings(bench: Bench, mass: float = 1.0, velocity: float = 0.0, lag: float = 0.0) -> Findings:
    """Return the findings so far."""
    faults, warnings = (
        tuple(f"{bench.spec.fmu}: {text}" for text in texts) for texts in (bench.faults, bench.warnings)
    )
    return Findings(
        bench.body.abilities, mass, velocity, bench.sizes[0], faults, warnings, lag, bench.body.findings.units
    )


def _velocity(bench: Bench, size: float) -> float:
    """Return the velocity at the start by the displacements after two steps of ``size`` [s]."""
    start, middle, end = bench.run(size, [NO_FORCE, NO_FORCE])[:, 0].tolist()
    return float((4.0 * middle - end - 3.0 * start) / (2.0 * size))


def _check_state(bench: Bench) -> None:
    def differs(size: float) -> bool:
        first, _, second = (bench.run(size, [(force, 0.0, 0.0)] * 2) for force in (1.0, -1.0, 1.0))
        return bool((first != second).any())

    if next(bench.taken(differs, bench.sizes)):
        bench.faults.append("canGetAndSetFMUstate = true, but equal steps from one restored state differ in their bits")
        bench.renew(state=False)  # what follows starts from new instances


def _inertia(bench: Bench, size: float) -> float | None:
    """Return the mass [kg] that a force C moves over a step of ``size``, negative if downward; ``None`` if it stays."""
    for force in _FORCES:
        _, faster = bench.response(size, (force, 0.0, 0.0))
        if faster:
            return force * size / faster
    return None


def _internal_steps(bench: Bench) -> float | None:
    """Return the size [s] of a step that moves the end unlike two halves; ``None`` where they move alike."""

    def unlike(size: float) -> float | None:
        whole = _inertia(bench, size)
        half = _inertia(bench, 0.5 * size)
        alike = whole is not None and half is not None and abs(whole - half) <= _ALIKE * abs(whole)
        return None if alike else size

    return next(bench.taken(unlike, reversed(bench.sizes)))


def _check_grid(bench: Bench, size: float) -> None:
    """Say that the steps of the FMU have one size; it is a fault if internal steps do not end where they do."""
    H = bench.sizes[0]
    internal = (
        f"it moves in internal steps: a step of {size:.3g} s and half of it do not move its end in proportion, and "
        "canHandleVariableCommunicationStepSize = true is false"
    )
    remedy = "[coupling] macro_step is to be a multiple of its internal step"
    force = (1.0, 0.0, 0.0)
    column = 1 if bench.spec.velocity else 0
    moved, free = (bench.run(H, [given] * _GRADUAL)[:, column] for given in (force, NO_FORCE))
    gained = np.diff(moved - free, n=2 - column)
    # Of an end that swings, differences become smaller by ω H each; of one that is a step ahead in some, larger by 2.
    if np.abs(np.diff(gained, n=6)).max() > _ALIKE * np.abs(gained).max():
        bench.faults.append(f"{internal}, nor do steps of {H:.6g} s; {remedy}")
    else:
        bench.warnings.append(f"{internal}; its steps have one size: {remedy}")


def _lag(bench: Bench, impetus: float) -> float:
    """Return ε of a macro step [s] of an FMU whose displacement answers a force as by a solver of order 1, else 0.

    One without a velocity cannot be corrected, and has order 1. ``impetus`` as of `_wrong_outputs`.
    """

    def behind(size: float) -> float | None:
        """Return ε over the ``size`` of a step."""
        moved, faster = bench.response(size, (impetus / size**2, 0.0, 0.0))
        return 0.5 - moved / (faster * size) if faster else None

    shortest = next((value for value in bench.taken(behind, reversed(bench.sizes)) if value is not None), 0.0)
    if abs(2.0 * shortest) <= _SECOND_ORDER:
        return 0.0
    H = bench.sizes[0]
    able = bench.body.abilities
    corrected = able.velocity and able.state
    lag = behind(H) or 0.0
    bench.renew(order=2 if corrected else 1, integrals=0)
    bench.warnings.append(
        f"its solver is of order 1 (as Euler's): over a step of {H:.6g} s a force moves its end by "
        f"{1.0 - 2.0 * lag:.3g} of what the velocity says; errors of order 1 in its internal step "
        "remain at any macro step, and are in no estimate: make that step shorter, or export it with another solver"
    )
    return lag * H if corrected else 0.0


def _wrong_outputs(bench: Bench, impetus: float, h: float) -> set[str]:
    """Return the outputs that contradict the displacement over steps of ``h`` [s].

    ``impetus`` is a mass times a length to move it by [kg·m].
    """
    spec = bench.spec
    n = _RECORD
    x, v, once, twice, energy, work = bench.run(h, [(impetus / (n * h) ** 2, 0.0, 0.0)] * n).T
    moved = np.diff(x)
    gained = np.diff(energy)
    received = np.diff(work)
    means = 0.5 * h * (v[:-1] + v[1:])
    first, second = np.array(moments(x[:-1], v[:-1] if spec.velocity else v[1:], x[1:], v[1:], h))

    def differs(
        values: np.ndarray, due: np.ndarray, steps: np.ndarray, amounts: np.ndarray, factor: float = 1.0
    ) -> bool:
        allowed = _TOLERANCE * np.abs(steps).sum() + _ROUNDING * n * np.abs(amounts).max()
        return not np.abs(values - due).sum() <= factor * allowed

    outputs = {
        "velocity": ("the rate", means, moved, 1.0),
        "integral": ("that", once[1:], first, h),
        "integral_2": ("that", twice[1:], second, h * h),
    }
    wrong = {
        f"{key} {spec.named[key]!r} is not {what} of displacement {spec.displacement!r}"
        for key, (what, values, due, factor) in outputs.items()
        if key in spec.named and differs(values, due, moved, x, factor)
    }
    if bench.body.abilities.energies and differs(gained, received, received, energy):
        wrong.add(
            "the energies named do not account for work on the end; name dissipated_energy and load_potential as well, "
            "or no energies"
        )
    return wrong


def _try_slopes(bench: Bench, impetus: float) -> None:
    """Find the highest derivative of the force over a step that the motion follows; ``impetus`` as above."""
    for order in (1, 2):

        def unfollowed(size: float, order: int = order) -> set[str]:
            push = impetus / size**2
            _, held = bench.response(size, (push, 0.0, 0.0))
            _, grown = bench.response(size, (0.0, push / size, 0.0) if order == 1 else (0.0, 0.0, 2.0 * push / size**2))
            due = held / (order + 1.0)  # by F τ/h or F τ²/h²
            return set() if held and abs(grown - due) <= _AGREE * abs(due) else {"unfollowed"}

        bench.renew(slopes=order)
        try:
            wrong = bench.wrong(unfollowed)
        except (FmuError, StepRefused):
            if order == 1:
                raise
            wrong = {"refused"}  # FMI does not say how many derivatives there must be
        if wrong:
            bench.renew(slopes=order - 1)
            if order == 1:
                bench.warnings.append(
                    "canInterpolateInputs = true, but a force that grows over a step is not followed: the force has "
                    "degree 0"
                )
            break


def _struck_mass(bench: Bench, mass: float, speed: float) -> float:
    """Return the mass that an impulse moves [kg]; ``mass`` is the expected one, ``speed`` the expected change [m/s]."""
    impulse = mass * speed

    def inertia(size: float) -> float | None:
        _, faster = bench.response(size, NO_FORCE, impulse)
        return impulse / faster if faster else None

    struck = bench.extrapolated(inertia)
    if struck is not None and abs(struck / mass - 1.0) <= _RESPONSE:
        return struck
    bench.faults.append(
        f"an upward impulse of {impulse:.6g} N·s in {bench.spec.impulse!r} does not change the velocity by {speed:.6g} "
        f"m/s; with the mass {mass:.6g} kg it should"
    )
    return mass
