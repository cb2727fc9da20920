"""An FMU of others as a body. Missing abilities are replaced where possible, otherwise rejected by name.

* No velocity: the mean over the last step.
* No integrals: those of the cubic through the ends of the step (of the line without velocities). Only degree 0, where
  no condition needs them, is then possible.
* No energies: the energy of the body is the work that it has received, W = ∫ F ẇ dτ. The ledger is then that of the
  interface: the work of C on both ends and the energy of the law.
* A solver of order 1 (Euler) in K internal steps answers a force F over a step h by F h/m of velocity, but by
  (1 ∓ 1/K) F h²/2m of displacement: a tie of such ends would amplify a difference of their velocities in each step, and
  a soft contact would create energy. The end is taken where x + ε v says, ε = h/2 − Δx/Δv ≈ ± h/2K as measured, which
  answers as it should. That is of order 1 beside x, as the FMU's own motion is.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from math import exp
from pathlib import Path
from typing import Any, NamedTuple

from ..scene.partners import ForeignFmu
from . import force
from .elements import EndLoaded
from .fmu import Fmu
from .fmu_body import FmuBody
from .isolated import RemotePort
from .port import Port
from .protocol import NO_FORCE, SIZES_REMEMBERED, Abilities, Body, BodyFailed, Energies, FmuError, Force, Motion
from .units import Unit

#: Relative tolerance of a holding force.
_AT_REST = 1e-12
#: Share of the motion without a holding force that it may leave.
_STAYS = 1e-6
#: Share of its displacement, or of its motion in a step, by which a measurement of ε moves an end; else as much in m.
_NUDGE = 1e-6
_NUDGE_AT_REST = 1e-9
#: After how many macro steps of free flight exp(−1/2) is left of the jumps of ε v by impulses. An end does not jump;
#: that it does not drift away from the FMU's own displacement either, they are reduced where no force answers that,
#: and slowly at first: ends that have parted do not meet again by it.
_FORGOTTEN = 256.0


@dataclass(frozen=True)
class Findings:
    """Findings of `springbeam.bodies.probe` about an FMU."""

    abilities: Abilities
    mass: float = 1.0  #: that a force meets at first [kg]
    velocity: float = 0.0  #: at the start [m/s]
    H: float = 0.0  #: a macro step, for trial steps [s]
    faults: tuple[str, ...] = ()  #: what it says, or a scene says of it, and is not so
    warnings: tuple[str, ...] = ()  #: what a run has to say of it
    lag: float = 0.0  #: ε of a macro step [s]; 0 where its solver is of order 2 and more, or where it is not corrected
    units: Mapping[str, Unit] = field(default_factory=dict)  #: of the variables that the scene names, by key
    acceleration: str | None = None  #: the variable that has it


def _promised(spec: ForeignFmu, says: Any) -> Abilities:
    """Return the abilities of an FMU by its description and its table."""
    state = bool(says.canGetAndSetFMUstate)
    return Abilities(
        state=state,
        any_size=bool(says.canHandleVariableCommunicationStepSize),
        velocity=spec.velocity is not None,
        integrals=spec.integrals,
        slopes=2 if says.canInterpolateInputs else 0,
        impulse=spec.impulse is not None,
        energies=None not in (spec.kinetic_energy, spec.potential_energy),
    )


def opened(spec: ForeignFmu, times: tuple[float, float], findings: Findings | None) -> tuple[Port, Findings]:
    """Return an FMU at the start of ``times``, and its ``findings``, by default its description. Raises FmuError.

    ``times`` are when its first step begins and when its last one ends [s].
    """
    fmu = Fmu(None, Path(spec.fmu), spec.parameters, *times)
    findings = findings or Findings(_promised(spec, fmu.says))
    try:
        for key, name in spec.named.items():
            _check(fmu, name, key, "input" if key in spec.INPUTS else "output")
        units = {"time": fmu.time_unit, **{key: fmu.unit(name, key) for key, name in spec.named.items()}}
        findings = replace(findings, units=units, **_acceleration(spec, fmu, units))
        outputs = _outputs(spec, findings)
        port = Port(
            fmu,
            (spec.force,),
            () if spec.impulse is None else (spec.impulse,),
            tuple(outputs.values()),
            findings.abilities.slopes,
            always=True,  # derivatives of one step may act in the next if they are not set again
            repeats=findings.abilities.state,
            units={name: units[key].factor for key, name in {**spec.named, **outputs}.items()},
        )
        return port, findings
    except BaseException:
        fmu.close()
        raise


def _check(fmu: Fmu, name: str, key: str, wanted: str) -> None:
    """Raise FmuError if a variable cannot be what the scene's ``key`` says."""
    try:
        causality = fmu.real(name).causality
    except FmuError as error:
        raise FmuError(f"{error}; it is the scene's {key}") from None
    if causality != wanted and (causality, wanted) != ("local", "output"):
        raise FmuError(f"{fmu.path}: variable {name!r} is {causality}, and {key} must be an {wanted}")


def _acceleration(spec: ForeignFmu, fmu: Fmu, units: dict[str, Unit]) -> dict[str, Any]:
    """Return the variable of the acceleration of the end: that of the scene or the velocity's derivative.

    Its unit is added to ``units``.
    """
    rates = (variable for variable in fmu.variables if variable.derivative is not None)
    of_velocity = (variable.name for variable in rates if variable.derivative.name == spec.velocity)
    name = spec.acceleration or next(of_velocity, None)
    if name is None:
        return {}
    with suppress(FmuError):
        units["acceleration"] = fmu.unit(name, "acceleration")
        return {"acceleration": name}
    return {}


def _outputs(spec: ForeignFmu, findings: Findings) -> dict[str, str]:
    """Return the names of the outputs after a step by their keys: first of the motion, then of the energies."""
    keys = (*spec.MOTION, *(spec.ENERGIES if findings.abilities.energies else ()))
    names = {key: name for key, name in spec.named.items() if key in keys}
    return names if findings.acceleration is None else names | {"acceleration": findings.acceleration}


class ForeignState(NamedTuple):
    """State of a foreign body outside of the FMU."""

    motion: Motion
    reported: tuple[float, ...] = ()  #: motion and energies as far as the FMU has returned them
    pending: float = 0.0  #: upward impulse that the FMU applies at the start of its next step [N·s]
    received: float = 0.0  #: work of all forces and impulses on the end so far, but not of loads [J]
    load_work: float = 0.0  #: of the loads so far [J]
    time: float = 0.0  #: of the present state [s]
    size: float = 0.0  #: of the last step [s]
    free: float = 0.0  #: for how long no force and no impulse has acted on its end [s]
    held: tuple[float, float] | None = None  #: where its end rests on the foundation [m], and the force there [N]


class ForeignBody(FmuBody, EndLoaded):
    """A foreign FMU in either place; the FMU is in a process of its own.

    Parameters
    ----------
    spec, upper
        Its table, and whether it is the upper body.
    times
        When its first step begins and when its last one ends [s].
    findings
        Findings about it; by default those of its description.
    """

    #: Longest time that a call may take [s], and what is said of when it was made.
    PATIENCE = 60.0
    OCCASION = ""
    state: ForeignState
    _port: RemotePort

    def __init__(self, spec: ForeignFmu, upper: bool, times: tuple[float, float], findings: Findings | None) -> None:
        self._port = RemotePort(spec.fmu, self.PATIENCE, self.OCCASION, opened, spec, times, findings)
        self.findings: Findings = self._port.findings
        self.abilities = self.findings.abilities
        self.warnings = self.findings.warnings
        self._lags: dict[float, float] = {}  #: ε by size of step [s]
        self._spec = spec
        self._upward = 1.0 if upper else -1.0
        self._keys = tuple(_outputs(spec, self.findings))
        self._n_motion = len({*self._keys} & {*spec.MOTION})
        self.state = ForeignState(Motion(0.0, 0.0, 0.0, 0.0), time=times[0])
        try:
            self._begin(spec.mass or self.findings.mass)
            self.mark()
        except BaseException:
            self.close()
            raise

    @property
    def received(self) -> float:  # type: ignore[override]
        return self.state.received

    def join(self, velocity: float) -> None:
        """Set the ``velocity`` [m/s] of the end to that of the end it is tied to, if the FMU does not output it."""
        if not self.abilities.velocity:
            self.state = self.state._replace(motion=self.state.motion._replace(velocity=velocity))

    def advance(self, time: float, size: float, contact: Force, foundation: Force = NO_FORCE) -> Motion:
        start = self.state.motion
        load = self._followed(self._on_end, size)
        self._measure_lag(time, size)
        end = super().advance(time, size, contact, foundation)
        exchanged = force.combined((self._upward, 1.0), (contact, foundation))
        self.state = self.state._replace(
            received=self.state.received + force.work_on(exchanged, start, end, size),
            load_work=self.state.load_work + force.work_on(load, start, end, size),
            time=time + size,
            size=size,
            free=0.0 if any(exchanged) else self.state.free + size,
        )
        return end

    def _given(self, time: float, size: float, contact: Force, foundation: Force) -> tuple[float, ...]:
        sign = self._spec.force_sign
        exchanged = force.combined((self._upward, 1.0), (contact, foundation))
        load = self._followed(self._on_end, size)
        up = sign * self._upward
        value, *slopes = self._followed(force.combined((up, up), (exchanged, load)), size)
        impulse = () if self._spec.impulse is None else (self.state.pending,)
        return (time, size, value, *impulse, *slopes[: self.abilities.slopes])

    def acceleration(self) -> float | None:
        reported = dict(zip(self._keys, self.state.reported, strict=True))
        return reported.get("acceleration") if self.state.pending == 0.0 else None

    def _trial(self, time: float, size: float, upward: float = 0.0) -> Motion:
        """See `Body._trial`; an ``upward`` force may act [N]."""
        before = self.state
        end = self._take(self._tried(time, size, (upward, 0.0, 0.0)), size)
        self.state = before
        return end

    def _measure_lag(self, time: float, size: float) -> None:
        """Measure ε of steps of ``size`` [s] once, by two trial steps."""
        if self.findings.lag == 0.0 or size in self._lags:
            return
        if len(self._lags) == SIZES_REMEMBERED:
            del self._lags[next(iter(self._lags))]
        w, v, *_ = self.state.motion
        length = _NUDGE * max(abs(w), size * abs(v)) or _NUDGE_AT_REST
        free = self._trial(time, size)
        moved = self._trial(time, size, 2.0 * self.mass * length / size**2)
        faster = moved.velocity - free.velocity
        lag = 0.5 * size - (moved.displacement - free.displacement) / faster if faster != 0.0 else 0.0
        self._lags[size] = max(-0.5 * size, min(lag, 0.5 * size))

    def _followed(self, given: Force, size: float) -> Force:
        """Return the part of a force over a step that the FMU can follow: its mean, or also its slope."""
        slopes = self.abilities.slopes
        if not any(given[slopes + 1 :]):
            return given
        return force.derivatives(force.legendre(given, size, slopes), size)

    def apply_impulse(self, impulse: float) -> None:
        if not self.abilities.impulse:
            Body.apply_impulse(self, impulse)
            return
        before = self.state.motion.velocity
        super().apply_impulse(impulse)
        received = self.state.received + 0.5 * impulse * (before + self.state.motion.velocity)
        self.state = self.state._replace(received=received, free=0.0)

    def _take(self, reported: tuple[float, ...], size: float = 0.0) -> Motion:
        """See `FmuBody._take`; missing outputs of the motion are replaced."""
        by_key = dict(zip(self._keys, reported, strict=True))
        w0, v0, *_ = self.state.motion
        w = by_key["displacement"]
        if "velocity" not in by_key:
            v0 = by_key["velocity"] = (w - w0) / size if size > 0.0 else self.findings.velocity
        v = by_key["velocity"]
        if lag := self._lags.get(size, 0.0):
            x0 = self.state.reported[self._keys.index("displacement")]
            free = self.state.free
            kept = exp(-0.5 * size * (2.0 * free + size) / (_FORGOTTEN * self.findings.H) ** 2) if free > 0.0 else 1.0
            w += lag * v + kept * (w0 - x0 - lag * v0)
        first, second = moments(w0, v0, w, v, size)
        if self.abilities.integrals:
            first = by_key.get("integral", first)
            second = by_key.get("integral_2", second)
        motion = Motion(w, v, first, second)
        self.state = self.state._replace(motion=motion, reported=reported, pending=0.0)
        return motion

    def energies(self) -> Energies:
        if not self.abilities.energies:
            return Energies(0.0, self.state.received, 0.0, 0.0)
        reported = dict(zip(self._keys, self.state.reported, strict=True))
        energies = Energies(*(reported.get(key, 0.0) for key in self._spec.ENERGIES))
        return energies._replace(load_potential=energies.load_potential - self.state.load_work)

    def holding_force(self, displacement: float, velocity: float) -> float:
        """Return the force that holds the end in its present position, found by trial steps.

        Raises BodyFailed if no constant force does, as where a body moves inside.
        """
        if self.state.held is not None and self.state.held[0] == displacement:
            return self.state.held[1]
        from scipy.optimize import newton  # takes a tenth of a second to load: only for a rest on a foundation

        size = self.state.size or self.findings.H
        load = self._on_end
        self._on_end = NO_FORCE

        def held_by(upward: float) -> Motion:
            self.rewind()
            return self.advance(self.state.time, size, NO_FORCE, (upward, 0.0, 0.0))

        free = held_by(0.0)
        # A guess of 0 would be no second point.
        guess = -self.mass * free.velocity / size or self.mass
        tolerance = _AT_REST * abs(guess)
        root, _ = newton(lambda f: held_by(f).velocity, 0.0, x1=guess, tol=tolerance, full_output=True, disp=False)
        holding = float(root)
        end = held_by(holding)
        self.rewind()
        self._on_end = load
        moved = abs(free.displacement - displacement)
        if abs(end.displacement - displacement) > _STAYS * moved and abs(end.velocity) > _STAYS * abs(free.velocity):
            raise BodyFailed(
                f"{self._port.path}: no constant force holds its end at rest on the foundation; use a [stop] "
                "restitution of 1, with which nothing comes to rest, or leave [stop] out"
            )
        self.state = self._marked = self.state._replace(held=(displacement, holding))
        return holding


def moments(w0: float, v0: float, w: float, v: float, size: float) -> tuple[float, float]:
    """Return ∫ x dτ and ∫∫ x dτ dτ over a step from (w0, v0) to (w, v), of the cubic through its ends."""
    first = size * 0.5 * (w0 + w) + size**2 * (v0 - v) / 12.0
    return first, size**2 * (7.0 * w0 + 3.0 * w) / 20.0 + size**3 * (v0 / 20.0 - v / 30.0)
