"""The two FMUs as bodies. One module, though longer than others: every step of a run passes through all of it."""

from __future__ import annotations

import atexit
from collections.abc import Callable, Hashable, Sequence
from ctypes import c_double
from functools import partial
from math import isfinite
from struct import Struct
from typing import Any, ClassVar, NamedTuple, NoReturn

import msgspec
import numpy as np
from typing_extensions import Self

from ..scene import Beam, Load, Spring
from ..scene.statics import SHAPE_POINTS
from .archive import own_fmu
from .elements import EndLoaded
from .fmu import Fmu
from .force import combined
from .functions import DISCARD, WARNING, Failure
from .protocol import NO_FORCE, BeamBody, Body, Energies, Felt, FmuError, Force, Motion, StepRefused

#: The numbers by which the beam FMU knows its alternatives.
_INTEGRATORS = {"modal": 1, "generalized_alpha": 2}
_MASS_MATRICES = {"consistent": 1, "averaged": 2}
_AT_REST = 2


class Reals:
    """Real numbers of an FMU, read and written together; the arguments are converted to C once.

    Each variable has ``size`` values.
    """

    def __init__(self, fmu: Fmu, *names: str, size: int = 1) -> None:
        n = len(names) * size
        self.names = names
        self._fmu = fmu
        self.values: Any = (c_double * n)()  #: as last read or written
        self._unpacked = partial(Struct(f"{n}d").unpack, self.values)
        self._read, self._write = (fmu.accessor(verb, names, self.values, size) for verb in ("Get", "Set"))
        if names:
            self.get()  # a wrong reference is found before the run

    def get(self) -> tuple[float, ...]:
        if (status := self._read()) > WARNING:
            raise self._fmu.failed(status, f"cannot read {', '.join(self.names)}")
        return self._unpacked()

    def set(self, values: Sequence[float]) -> None:
        self.values[:] = values
        self._fmu.moved = True
        if (status := self._write()) > WARNING:
            raise self._fmu.failed(status, f"cannot set {', '.join(self.names)}")


class FmuState(NamedTuple):
    """What changes of a body beside the state inside the FMU."""

    motion: Motion = Motion(0.0, 0.0, 0.0, 0.0)
    told: tuple[float, ...] = ()  #: motion and energies as the FMU has told them
    pending: float = 0.0  #: upward impulse that the FMU applies at the start of its next step [N·s]
    dissipated: float = 0.0  #: before the FMU was last started again [J]


#: What FMI 3.0 lets an FMU ask for after a step, and is not given.
_ASKED = {
    Failure.ENDS: "fmi3DoStep asks that the simulation end (terminateSimulation)",
    Failure.EARLY: "fmi3DoStep returned early, which it was not allowed to (earlyReturn)",
    Failure.EVENT: "fmi3DoStep asks for event mode, which it was told is not used (eventHandlingNeeded)",
}

#: ``Motion(*values)`` and its like in a third of the time.
_motion_of: Callable[[type[Motion], tuple[float, ...]], Motion] = tuple.__new__
_energies_of: Callable[[type[Energies], tuple[float, ...]], Energies] = tuple.__new__
_felt_of: Callable[[type[Felt], tuple[float, ...]], Felt] = tuple.__new__
_state_of: Callable[[type[FmuState], tuple[Motion, tuple[float, ...], float, float]], FmuState] = tuple.__new__


class FmuBody(Body):
    """What both bodies do alike; a subclass names its variables."""

    _MOTION: tuple[str, ...]
    _ENERGIES: tuple[str, ...]
    _IMPULSE: tuple[str, ...]
    _FORCES: tuple[str, ...]
    _constants: dict[str, float]  #: of the scene, by the inputs that hold them from the start
    _bears_loads = False  #: whether the last of the energies is the work of the loads
    #: Highest derivative of a force that is handed over, and whether derivatives that are all 0 are, too.
    _SLOPES: int = 2
    _ALWAYS_SLOPED = False
    state: Any

    def __init__(self, fmu: Fmu) -> None:
        self.fmu = fmu
        try:
            self._prepare(fmu)
        except BaseException:
            fmu.close()
            raise

    def _prepare(self, fmu: Fmu) -> None:
        self._impulse = Reals(fmu, *self._IMPULSE)
        self._prepare_step(())
        self.mass = self._mass()
        if not isfinite(self.mass):
            raise FmuError(f"{fmu.path}: the mass of its end is {self.mass}")
        self._begin()

    def _prepare_step(self, loads: Sequence[str]) -> None:
        """Prepare what a step sets, the forces and ``loads``, inputs of the FMU, and what it reads."""
        fmu, names = self.fmu, (*self._FORCES, *loads)
        self._outputs = Reals(fmu, *self._MOTION, *self._ENERGIES)
        Reals(fmu, *names)  # a wrong reference is found before the run
        made = fmu.advancing(names, self._SLOPES, self._outputs.names, self._ALWAYS_SLOPED)
        self._advance, self._given, told = made
        self._write = partial(Struct(f"{len(self._given)}d").pack_into, self._given, 0)
        self._told = partial(Struct(f"{len(told)}d").unpack, told)
        #: The loads of a step, and two derivatives of each.
        self._loads: tuple[tuple[float, ...], tuple[float, ...]] = ((0.0,) * len(loads), (0.0,) * (2 * len(loads)))

    def expect_loads(self, loads: Sequence[Load]) -> None:
        #: By input of the FMU: what is added to it by a unit of which load.
        self._shares: dict[str, list[tuple[int, float]]] = {}
        for number, load in enumerate(loads):
            for name, share in self._inputs_of(load):
                self._shares.setdefault(name, []).append((number, share))
        self._ENERGIES, self._bears_loads = (*self._ENERGIES[:3], "load_work"), True
        self._prepare_step(tuple(self._shares))
        self._tell()

    def _inputs_of(self, load: Load) -> list[tuple[str, float]]:
        """Return the inputs of the FMU that ``load`` acts by, and how much of it each takes."""
        raise NotImplementedError

    def set_loads(self, forces: Sequence[Force]) -> None:
        super().set_loads(forces)
        values, slopes = [], []
        for name, shares in self._shares.items():
            f, df, ddf = combined([share for _, share in shares], [forces[number] for number, _ in shares])
            values.append(f + self._constants.get(name, 0.0))
            slopes += [df, ddf]
        self._loads = (tuple(values), tuple(slopes))

    def _mass(self) -> float:
        raise NotImplementedError

    @property
    def steps(self) -> int:
        """doStep calls so far."""
        return self.fmu.steps

    @property
    def rewinds(self) -> int:
        """How often the state was set back."""
        return self.fmu.rewinds

    def mark(self) -> None:
        fmu = self.fmu
        if (status := fmu.get_state()) > WARNING:
            raise fmu.failed(status, "cannot save the state")
        fmu.moved = False
        self._marked = self.state

    def rewind(self) -> None:
        fmu = self.fmu
        if fmu.moved:
            if (status := fmu.set_state()) > WARNING:
                raise fmu.failed(status, "cannot restore the state")
            fmu.moved = False
            fmu.rewinds += 1
            self.state = self._marked

    def save(self) -> bytes:
        fmu = self.fmu
        return msgspec.msgpack.encode((super().save(), fmu.steps, fmu.rewinds, fmu.serialized()))

    def restore(self, saved: bytes) -> None:
        kept = msgspec.msgpack.decode(saved, type=tuple[bytes, int, int, bytes])
        state, self.fmu.steps, self.fmu.rewinds, content = kept
        super().restore(state)
        self.fmu.deserialize(content)

    def motion(self) -> Motion:
        motion: Motion = self.state.motion
        return motion

    def apply_impulse(self, impulse: float) -> None:
        # The FMU applies it at the start of its next step; motion and energies already show it.
        motion, pending = self.state.motion, self.state.pending + impulse
        self._impulse.set((pending,))
        struck = motion._replace(velocity=motion.velocity + impulse / self.mass)
        self.state = self.state._replace(motion=struck, pending=pending)

    def _step(self) -> Motion:
        """Step as was written: time [s], size [s], forces and loads, and their derivatives; return the motion."""
        fmu = self.fmu
        moved, fmu.moved = fmu.moved, True
        if code := self._advance():
            self._stop(*Failure.of(code), moved)
        fmu.steps += 1
        return self._take(self._told())

    def _stop(self, failure: Failure, status: int, moved: bool) -> NoReturn:
        """Say why a step was not made: see `Failure`. ``moved``: whether anything had happened before it."""
        fmu, (time, _, *forces) = self.fmu, self._given
        if failure is Failure.INPUTS_NOT_FINITE:
            fmu.moved = moved
            raise StepRefused(f"{fmu.path.name}: the force it should step under is not finite: {forces}")
        if failure is Failure.SET:
            raise fmu.failed(status, f"cannot set {', '.join(self._FORCES)} and loads")
        if failure is Failure.SET_DERIVATIVES:
            raise fmu.failed(status, "cannot set input derivatives")
        fmu.steps += 1
        if failure is Failure.GET:
            raise fmu.failed(status, f"cannot read {', '.join(self._outputs.names)}")
        if failure is Failure.OUTPUTS_NOT_FINITE:
            self._check(self._told())
        fmu.refuse(max(status, DISCARD), time, _ASKED.get(failure, ""))

    def _begin(self) -> None:
        """Read the motion that the FMU was initialised to."""
        try:
            self._tell()
        except StepRefused as refused:
            raise FmuError(f"{self.fmu.path}: starts with a motion that is {refused}") from refused
        super().mark()

    def _take(self, told: tuple[float, ...]) -> Motion:
        """Take what the FMU has told as the present motion and energies, with no impulse pending; return the motion."""
        motion = _motion_of(Motion, told[:4])
        self.state = _state_of(FmuState, (motion, told, 0.0, self.state.dissipated))
        return motion

    def _tell(self) -> Motion:
        """Read the motion, and the energies that belong to it."""
        told = self._outputs.get()
        self._check(told)
        return self._take(told)

    def _check(self, told: tuple[float, ...]) -> None:
        """Raise StepRefused if the FMU has told a number that is not finite."""
        if not all(map(isfinite, told)):
            values = ", ".join(f"{name} = {value}" for name, value in zip(self._outputs.names, told, strict=True))
            raise StepRefused(f"not finite: {values} of {self.fmu.path.name}")

    def _stored(self) -> tuple[float, ...]:
        """Return the energies [J]; the kinetic one has the impulse that is still pending."""
        motion, told, pending, *_ = self.state
        energies: tuple[float, ...] = told[len(self._MOTION) :]
        if pending != 0.0:
            before = motion.velocity - pending / self.mass
            return (energies[0] + 0.5 * pending * (before + motion.velocity), *energies[1:])
        return energies

    def close(self) -> None:
        self.fmu.close()


#: Most bodies that are kept: those of two scenes.
_MOST_KEPT = 4
#: Closed bodies that a later run may take, by what they were made of; the last one was closed last.
_kept: dict[Hashable, OwnBody] = {}


class OwnBody(FmuBody):
    """A body of an FMU of this project. It is kept when it is closed: to make it takes longer than a short run.

    What is kept is the instance, with what follows from its parameters, and its state after initialisation.
    """

    NAME: ClassVar[str]  #: of the FMU
    state: FmuState = FmuState()
    tells = True
    _key: Hashable = None  #: what the body was made of, if it is to be kept
    _as_made: dict[str, Any]  #: the attributes then

    @classmethod
    def of(cls, *arguments: Any) -> Self:
        """Return a body made of ``arguments``, new or kept; both step to the same bits. Raises FmuError."""
        path = own_fmu(cls.NAME)
        key = (cls, path, path.stat().st_mtime_ns if path.is_file() else None, arguments)
        body = _kept.pop(key, None)
        if not isinstance(body, cls):
            body = cls(*arguments)
            body._key, body._as_made = key, dict(vars(body))
            body._guarded(body.fmu.keep_start)
        else:
            body._guarded(body.fmu.return_to_start)
            as_made = body._as_made
            vars(body).clear()
            vars(body).update(as_made, _key=key, _as_made=as_made)
        return body

    def advance(self, time: float, size: float, contact: Force, foundation: Force = NO_FORCE) -> Motion:
        (c, dc, ddc), (n, dn, ddn), (values, slopes) = contact, foundation, self._loads
        if len(self._FORCES) == 1:  # nothing but the other body presses its end
            self._write(time, size, c, *values, dc, ddc, *slopes)
        else:
            self._write(time, size, c, n, *values, dc, ddc, dn, ddn, *slopes)
        return self._step()

    def energies(self) -> Energies:
        motion, told, pending, before = self.state
        kinetic, potential, dissipated, *load = told[4:] if pending == 0.0 else self._stored()
        if not load:  # the spring has none but its external force
            of_loads = -self._constants["external_force"] * motion.displacement
        else:
            of_loads = -load[0] if self._bears_loads else load[0]
        return _energies_of(Energies, (kinetic, potential, before + dissipated, of_loads))

    def _guarded(self, call: Callable[[], None]) -> None:
        try:
            call()
        except FmuError:
            self.fmu.close()
            raise

    def close(self) -> None:
        if self._key is None or not self.fmu.faultless:
            self.fmu.close()
            return
        _kept[self._key] = self
        while len(_kept) > _MOST_KEPT:
            _kept.pop(next(iter(_kept))).fmu.close()


@atexit.register
def release() -> None:
    """Free the bodies that are kept."""
    while _kept:
        _kept.popitem()[1].fmu.close()


class FmuBeam(OwnBody, BeamBody):
    """``beam.fmu`` as a body."""

    NAME = "beam"
    _MOTION = (
        "tip_displacement",
        "tip_velocity",
        "tip_displacement_integral",
        "tip_displacement_integral_2",
    )
    _ENERGIES = ("kinetic_energy", "strain_energy", "dissipated_energy", "load_potential")
    _IMPULSE = ("tip_impulse",)
    _FORCES = ("tip_force",)

    def __init__(
        self,
        beam: Beam,
        start_time: float,
        deflection_slope: float,
        loads: Sequence[Load] = (),
        held_by: float | None = None,
    ) -> None:
        """Start at ``start_time`` [s] with u = ``deflection_slope``·x, or at rest.

        ``loads`` say where point forces may act; it rests under them and a tip force ``held_by`` [N] if that is given.
        """
        self._points = sorted({load.at for load in loads if load.at is not None})
        self._constants = {"distributed_load": beam.distributed_load}
        parameters: dict[str, float | int | bool] = {name: value for name, value in beam if name not in beam.GIVEN_ONLY}
        parameters["integrator"] = _INTEGRATORS[beam.integrator]
        parameters["mass_matrix"] = _MASS_MATRICES[beam.mass_matrix]
        parameters["initial_deflection_slope"] = deflection_slope
        parameters["section_height"] = beam.section_height
        parameters |= {f"point_force_position[{k}]": at for k, at in enumerate(self._points, 1)}
        if held_by is not None:
            parameters |= {"initial_state": _AT_REST, "tip_force": held_by}
            for load in loads:
                for name, share in self._inputs_of(load) if load.on != "spring" else ():
                    parameters[name] = parameters.get(name, 0.0) + share * float(load.value(start_time))
        super().__init__(Fmu(self.NAME, own_fmu(self.NAME), parameters, start_time))

    def _prepare(self, fmu: Fmu) -> None:
        super()._prepare(fmu)
        along, points = ("deflection", "bending_moment", "shear_force"), len(SHAPE_POINTS)
        each = [f"{name}[{i}]" for name in along for i in range(1, points + 1)]  # FMI 2.0 knows no arrays
        self._shape = Reals(fmu, *each) if fmu.version == "2.0" else Reals(fmu, *along, size=points)
        self._felt = Reals(fmu, "tip_acceleration", "clamp_force", "clamp_moment", "max_bending_stress")

    def _mass(self) -> float:
        return Reals(self.fmu, "tip_mass").get()[0]

    def _inputs_of(self, load: Load) -> list[tuple[str, float]]:
        if load.on == "tip":
            return [("tip_load", 1.0)]
        if load.on == "base":
            return [("base_acceleration", 1.0)]
        if load.at is not None:
            return [(f"point_force[{self._points.index(load.at) + 1}]", 1.0)]
        shape = load.shape or [1.0]
        return [(f"distributed_load_{i}" if i else "distributed_load", s) for i, s in enumerate(shape) if s != 0.0]

    def felt(self) -> Felt:
        return _felt_of(Felt, self._felt.get())

    def shape(self) -> np.ndarray:
        """See `BeamBody.shape`."""
        self._shape.get()
        return np.array(self._shape.values)


class FmuSpring(OwnBody, EndLoaded):
    """``spring.fmu`` as a body; contact law and foundation are the master's."""

    NAME = "spring"
    _MOTION = ("displacement", "velocity", "displacement_integral", "displacement_integral_2")
    _ENERGIES = ("kinetic_energy", "potential_energy", "dissipated_energy")
    _IMPULSE = ("impulse",)
    _FORCES = ("contact_force", "foundation_force")

    def __init__(self, spring: Spring, start_time: float, displacement: float | None = None) -> None:
        """Start at ``start_time`` [s] with y = ``displacement`` [m], which is Ψ if left out."""
        self._spring, self._constants = spring, {"external_force": spring.external_force}
        parameters: dict[str, float | int | bool] = spring.model_dump(exclude={"initial_velocity"})
        parameters["displacement"] = spring.equilibrium if displacement is None else displacement
        parameters["velocity"] = spring.initial_velocity
        super().__init__(Fmu(self.NAME, own_fmu(self.NAME), parameters, start_time))

    def _mass(self) -> float:
        return self._spring.mass

    def holding_force(self, displacement: float, velocity: float) -> float:
        spring, y = self._spring, displacement
        static = spring.linear_stiffness * y + spring.cubic_stiffness * y**3 - spring.external_force
        return static + spring.damping * velocity

    def _inputs_of(self, load: Load) -> list[tuple[str, float]]:
        return [("base_acceleration" if load.on == "base" else "external_force", 1.0)]

    def expect_loads(self, loads: Sequence[Load]) -> None:
        FmuBody.expect_loads(self, loads)
        EndLoaded.expect_loads(self, loads)

    def restart(self, time: float, displacement: float, velocity: float, dissipated: float = 0.0) -> None:
        """Start again from y [m] and z [m/s], by the exact start values of the FMU."""
        self.fmu.reset(time, {"displacement": displacement, "velocity": velocity})
        self.state = FmuState(dissipated=dissipated)
        self._begin()
