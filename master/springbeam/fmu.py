"""The two FMUs as bodies: the only module that imports FMPy."""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from ctypes import byref, c_double, c_int, c_size_t, c_uint, c_void_p, sizeof
from functools import lru_cache, partial
from math import isfinite
from pathlib import Path
from struct import Struct
from types import FrameType
from typing import Any, ClassVar

import numpy as np
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import (
    FMU2Slave,
    defaultCallbacks,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
    fmi2FMUstate,
    fmi2LastSuccessfulTime,
)
from fmpy.model_description import ModelDescription, read_model_description

from .archive import UnsafeArchive, unpack
from .memory import Memory
from .quasi_static import QuasiStaticBeam
from .scene import Beam, Scene, Spring
from .subsystem import NO_FORCE, BodyFailed, Energies, Force, Motion, StepRefused
from .trajectory import SHAPE_POINTS

_INTEGRATORS = {"modal": 1, "generalized_alpha": 2}
_WARNING, _DISCARD, _ERROR, _FATAL = 1, 2, 3, 4
_STATUS = ("OK", "warning", "discard", "error", "fatal", "pending")
#: ``Motion(*values)`` and ``Energies(*values)`` in a third of the time.
_motion_of: Callable[[type[Motion], tuple[float, ...]], Motion] = tuple.__new__
_energies_of: Callable[[type[Energies], tuple[float, ...]], Energies] = tuple.__new__


class FmuError(BodyFailed):
    """An FMU cannot be found, loaded or initialised, or a call has failed; the message names file and cause."""


def fmu_directory() -> Path:
    """Where ``beam.fmu`` and ``spring.fmu`` are: $SPRINGBEAM_FMUS, the installed package, or the checkout."""
    chosen = os.environ.get("SPRINGBEAM_FMUS")
    if chosen:
        return Path(chosen)
    here = Path(__file__).resolve().parent
    installed = here / "fmus"
    return installed if installed.is_dir() else here.parents[1] / "fmus"


def fingerprints(scene: Scene) -> dict[str, str]:
    """SHA-256 of the files of the FMUs that ``scene`` contains. Raises FmuError if one is missing."""
    found = {}
    for name in scene.fmus:
        path = fmu_directory() / f"{name}.fmu"
        try:
            found[name] = hashlib.sha256(path.read_bytes()).hexdigest()
        except OSError as error:
            raise FmuError(f"{path}: {error.strerror}; ./build.sh fmus builds it") from error
    return found


@lru_cache(maxsize=8)
def _unpacked(path: Path, modified: int) -> tuple[Path, ModelDescription]:
    folder = Path(tempfile.mkdtemp(prefix="springbeam-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    try:
        unpack(path, folder)
        # External entities of a document type would name files of this computer; FMI's schema knows none.
        if b"<!DOCTYPE" in (folder / "modelDescription.xml").read_bytes():
            raise UnsafeArchive("modelDescription.xml: a document type declaration is not part of an FMU")
        description = read_model_description(str(folder))
    except Exception as error:  # FMPy raises bare Exceptions for whatever is wrong with an archive
        raise FmuError(f"{path}: not a usable FMU: {error}") from error
    return folder, description


class Reals:
    """Some Real variables of an FMU, read and written together; the arguments are converted to C once."""

    def __init__(self, fmu: Fmu, *names: str) -> None:
        n = len(names)
        self._names = ", ".join(names)
        self._fmu = fmu
        self.values: Any = (c_double * n)()  #: as last read or written
        self._unpacked = partial(Struct(f"{n}d").unpack, self.values)
        references = (c_uint * n)(*[fmu.reference(name, "Real") for name in names])
        self._read = fmu.prepared("fmi2GetReal", references, c_size_t(n), self.values)
        self._write = fmu.prepared("fmi2SetReal", references, c_size_t(n), self.values)
        self.get()  # a wrong reference is found before the run

    def get(self) -> tuple[float, ...]:
        if (status := self._read()) > _WARNING:
            raise self._fmu.failed(status, f"cannot read {self._names}")
        return self._unpacked()

    def set(self, values: Sequence[float]) -> None:
        self.values[:] = values
        self._fmu.moved = True
        if (status := self._write()) > _WARNING:
            raise self._fmu.failed(status, f"cannot set {self._names}")


class Fmu(Memory):
    """One instance of a co-simulation FMU and its state."""

    REMEMBERED = ("steps", "rewinds")

    def __init__(self, name: str, path: Path, parameters: dict[str, float | int | bool], start_time: float) -> None:
        self.path, self._name = path, name
        self._messages: list[str] = []
        self._slave = self._load()
        self._state = fmi2FMUstate()
        self._worst = 0  #: status of the calls that have failed for good
        #: Whether anything happened since the state was marked.
        self.moved = False
        #: doStep calls, and how often the state was set back.
        self.steps = self.rewinds = 0
        self._time, self._size = c_double(), c_double()
        self._do_step = self.prepared("fmi2DoStep", self._time, self._size, c_int(0))
        self._get_state = self.prepared("fmi2GetFMUstate", byref(self._state))
        self._set_state = self.prepared("fmi2SetFMUstate", self._state)
        self._free_state = self.prepared("fmi2FreeFMUstate", byref(self._state))
        self._reached = c_double()
        self._get_reached = self.prepared("fmi2GetRealStatus", c_int(fmi2LastSuccessfulTime), byref(self._reached))
        try:
            self._prepare_start(parameters)
            self.initialise(start_time)
        except BaseException:
            self.close()
            raise

    def _load(self) -> FMU2Slave:
        if not self.path.is_file():
            raise FmuError(f"{self.path}: not found; ./build.sh fmus builds it, SPRINGBEAM_FMUS names another folder")
        folder, description = _unpacked(self.path, self.path.stat().st_mtime_ns)
        if description.coSimulation is None or description.fmiVersion != "2.0":
            raise FmuError(f"{self.path}: not an FMI 2.0 co-simulation FMU")
        if description.coSimulation.modelIdentifier != self._name:
            raise FmuError(
                f"{self.path}: model identifier {description.coSimulation.modelIdentifier!r}, expected {self._name!r}"
            )
        self._variables = {v.name: v for v in description.modelVariables}
        # The callbacks must outlive the instance.
        self._logger = fmi2CallbackLoggerTYPE(self._log)
        self._callbacks = fmi2CallbackFunctions()
        self._callbacks.logger = self._logger
        self._callbacks.allocateMemory = defaultCallbacks.allocateMemory
        self._callbacks.freeMemory = defaultCallbacks.freeMemory
        try:
            slave = FMU2Slave(
                guid=description.guid,
                unzipDirectory=str(folder),
                modelIdentifier=self._name,
                instanceName=self._name,
            )
            slave.instantiate(callbacks=self._callbacks)
        except Exception as error:  # FMPy raises bare Exceptions for a missing or foreign binary
            raise FmuError(f"{self.path}: cannot be instantiated: {self._cause(error)}") from error
        return slave

    def _prepare_start(self, parameters: dict[str, float | int | bool]) -> None:
        """Calls that initialise, with the parameters in their arguments."""
        self._start_time = c_double()
        no = c_int(0)
        self._set_up = self.prepared("fmi2SetupExperiment", no, c_double(0.0), self._start_time, no, c_double(0.0))
        self._enter = self.prepared("fmi2EnterInitializationMode")
        self._exit = self.prepared("fmi2ExitInitializationMode")
        self._reset = self.prepared("fmi2Reset")
        #: Where the value of a parameter is.
        self._parameters: dict[str, tuple[Any, int]] = {}
        self._set_parameters = []
        kinds: dict[str, Any] = {"Real": c_double, "Integer": c_int, "Boolean": c_int}
        for kind, ctype in kinds.items():
            names = [name for name in parameters if self._variable(name).type == kind]
            if not names:
                continue
            n = len(names)
            values: Any = (ctype * n)(*[parameters[name] for name in names])
            references = (c_uint * n)(*[self.reference(name, kind) for name in names])
            self._set_parameters.append(self.prepared(f"fmi2Set{kind}", references, c_size_t(n), values))
            self._parameters.update((name, (values, i)) for i, name in enumerate(names))

    def initialise(self, time: float) -> None:
        """Set parameters and start values and leave initialization mode at ``time`` [s]."""
        self._start_time.value = time
        for call in (self._set_up, *self._set_parameters, self._enter, self._exit):
            if (status := call()) > _WARNING:
                raise self.failed(status, "cannot be initialised")

    def reset(self, time: float, changed: dict[str, float]) -> None:
        """Start again at ``time`` with some parameters changed."""
        for name, value in changed.items():
            values, i = self._parameters[name]
            values[i] = value
        if (status := self._reset()) > _WARNING:
            raise self.failed(status, "cannot be reset")
        self.initialise(time)
        self.moved = True

    @property
    def usable(self) -> bool:
        """Whether no call has failed for good."""
        return self._slave is not None and self._worst <= _WARNING

    def prepared(self, name: str, *arguments: Any) -> Callable[[], int]:
        """An FMI function of this instance with its arguments, which are converted to C once; returns its status.

        A pointer of our own to the function that FMPy has loaded: FMPy's wrapper converts and checks types at each
        call, which costs as much as the call.
        """
        function = self._slave.dll[name]
        function.restype = c_int
        return partial(function, c_void_p(self._slave.component), *arguments)

    def _variable(self, name: str) -> Any:
        try:
            return self._variables[name]
        except KeyError:
            raise FmuError(f"{self.path}: has no variable {name!r}") from None

    def reference(self, name: str, kind: str) -> int:
        """Value reference of a variable of type ``kind``."""
        variable = self._variable(name)
        if variable.type != kind:
            raise FmuError(f"{self.path}: variable {name!r} is {variable.type}, expected {kind}")
        return int(variable.valueReference)

    def mark(self) -> None:
        if (status := self._get_state()) > _WARNING:
            raise self.failed(status, "cannot save the state")
        self.moved = False

    def rewind(self) -> None:
        if (status := self._set_state()) > _WARNING:
            raise self.failed(status, "cannot restore the state")
        self.moved = False
        self.rewinds += 1

    def step(self, time: float, size: float) -> None:
        """fmi2DoStep, after its inputs have been set. Raises StepRefused."""
        self.steps += 1
        self._time.value, self._size.value = time, size
        status = self._do_step()
        if status <= _WARNING:
            return
        if status not in (_DISCARD, _ERROR):
            raise self.failed(status, f"cannot step at t = {time:.9g} s")
        cause = self._cause(f"fmi2DoStep returned {_STATUS[status]}")
        reached = ""
        if status == _DISCARD:
            if (known := self._get_reached()) >= _ERROR:
                raise self.failed(known, f"{cause}, and does not say how far it came")
            reached = f" (reached t = {self._reached.value:.9g} s)" if known <= _WARNING else ""
        # Also after fmi2Error a saved state may be restored and the step tried again (FMI 2.0.4, section 2.1.3).
        raise StepRefused(f"{self._name}: {cause}{reached}")

    def failed(self, status: int, what: str) -> FmuError:
        """The error of a call that returned ``status``, with what the FMU has logged."""
        self._worst = max(self._worst, status)
        return FmuError(f"{self.path}: {what}: {self._cause(f'it returned {_STATUS[status]}')}")

    @contextmanager
    def _calling(self, what: str) -> Iterator[None]:
        try:
            yield
        except FMICallException as error:
            raise self.failed(error.status, what) from error

    def save(self) -> dict[str, Any]:
        with self._calling("cannot save the state"):
            state = self._slave.getFMUstate()
            serialized = self._slave.serializeFMUstate(state)
            self._slave.freeFMUstate(state)
        return {**super().save(), "state": serialized}

    def restore(self, saved: dict[str, Any]) -> None:
        counts = dict(saved)
        with self._calling("cannot restore the state"):
            state = self._slave.deSerializeFMUstate(counts.pop("state", b""), fmi2FMUstate())
            self._slave.setFMUstate(state)
            self._slave.freeFMUstate(state)
        super().restore(counts)

    def close(self) -> None:
        """Free the instance, unless it has returned fmi2Fatal: then none of its library may be called again."""
        slave, self._slave = self._slave, None
        if slave is None:
            return
        if self._state and self._worst < _FATAL:
            self._worst = self._free_state()
        if self._worst == _FATAL:
            _unpacked.cache_clear()  # the next instance takes a copy of the library of its own
        else:
            slave.freeInstance()

    def _log(self, environment: Any, instance: bytes, status: int, category: bytes, message: bytes) -> None:
        if status > 0:
            self._messages = [*self._messages[-3:], message.decode("utf-8", "replace")]

    def _cause(self, otherwise: Exception | str) -> str:
        messages, self._messages = self._messages, []
        return messages[-1] if messages else str(otherwise)


class _FmuBody(Memory):
    """What both bodies do alike; a subclass names its variables."""

    REMEMBERED: ClassVar[tuple[str, ...]] = ("fmu", "_pending", "_current")

    _MOTION: tuple[str, ...]
    _ENERGIES: tuple[str, ...]
    _IMPULSE: str
    _FORCES: tuple[str, ...]
    _current: Motion
    _marked_motion: Motion

    def __init__(self, fmu: Fmu) -> None:
        self.fmu = fmu
        try:
            self._prepare(fmu)
        except BaseException:
            fmu.close()
            raise

    def _prepare(self, fmu: Fmu) -> None:
        self._motion, self._energies = Reals(fmu, *self._MOTION), Reals(fmu, *self._ENERGIES)
        self._impulse = Reals(fmu, self._IMPULSE)
        n = len(self._FORCES)
        forces = [fmu.reference(name, "Real") for name in self._FORCES]
        Reals(fmu, *self._FORCES)  # a wrong reference is found before the run
        self._inputs: Any = (c_double * (3 * n))()  # the forces, then Ḟ and F̈ of each
        self._set_forces = fmu.prepared("fmi2SetReal", (c_uint * n)(*forces), c_size_t(n), self._inputs)
        self._set_slopes = fmu.prepared(
            "fmi2SetRealInputDerivatives",
            (c_uint * (2 * n))(*[reference for reference in forces for _ in (1, 2)]),
            c_size_t(2 * n),
            (c_int * (2 * n))(*[1, 2] * n),
            byref(self._inputs, n * sizeof(c_double)),
        )
        self._pending = self._marked_pending = 0.0
        self.mass = self._mass()
        if not isfinite(self.mass):
            raise FmuError(f"{fmu.path}: the mass of its end is {self.mass}")
        self._begin()

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
        self.fmu.mark()
        self._marked_pending, self._marked_motion = self._pending, self._current

    def rewind(self) -> None:
        if self.fmu.moved:
            self.fmu.rewind()
            self._pending, self._current = self._marked_pending, self._marked_motion

    def motion(self) -> Motion:
        return self._current

    def apply_impulse(self, impulse: float) -> None:
        # The FMU applies it at the start of its next step; motion and energies already show it.
        self._pending += impulse
        self._impulse.set((self._pending,))
        self._current = self._current._replace(velocity=self._current.velocity + impulse / self.mass)

    def _advance(self, time: float, size: float, inputs: Sequence[float]) -> Motion:
        """``inputs`` at the start of the step: the forces, then Ḟ and F̈ of each."""
        fmu, n = self.fmu, len(self._FORCES)
        if not isfinite(sum(inputs)):
            raise StepRefused(f"{fmu.path.name}: the force it should step under is not finite: {list(inputs[:n])}")
        self._inputs[:] = inputs
        fmu.moved = True
        if (status := self._set_forces()) > _WARNING:
            raise fmu.failed(status, f"cannot set {', '.join(self._FORCES)}")
        if any(inputs[n:]) and (status := self._set_slopes()) > _WARNING:
            raise fmu.failed(status, "cannot set input derivatives")
        fmu.step(time, size)
        self._pending = 0.0
        self._current = motion = self._read_motion()
        return motion

    def _begin(self) -> None:
        """Read the motion that the FMU was initialised to."""
        try:
            self._current = self._marked_motion = self._read_motion()
        except StepRefused as refused:
            raise FmuError(f"{self.fmu.path}: starts with a motion that is {refused}") from refused

    def _read_motion(self) -> Motion:
        motion = _motion_of(Motion, self._motion.get())
        if not isfinite(sum(motion)):
            raise StepRefused(f"not finite: {motion} of {self.fmu.path.name}")
        return motion

    def _stored(self) -> tuple[float, ...]:
        """The energies [J]; the kinetic one with the impulse that is still pending."""
        energies = self._energies.get()
        if self._pending != 0.0:
            before = self._current.velocity - self._pending / self.mass
            return (energies[0] + 0.5 * self._pending * (before + self._current.velocity), *energies[1:])
        return energies

    def close(self) -> None:
        self.fmu.close()


#: What a method may be waiting for.
_CALLED_BY = {
    "_load": "fmi2Instantiate",
    "initialise": "initialisation",
    "step": "fmi2DoStep",
    "get": "fmi2GetReal",
    "set": "fmi2SetReal",
    "_advance": "fmi2SetReal or fmi2SetRealInputDerivatives",
    "mark": "fmi2GetFMUstate",
    "rewind": "fmi2SetFMUstate",
    "close": "fmi2FreeInstance",
}


def call_under_way(frame: FrameType | None) -> str:
    """Which FMU a thread is calling, and the time at which its last step began, in words; else the line it is in.

    ``frame`` is the innermost one of the thread. Found there when it is asked for, the call costs a run nothing.
    """
    innermost = frame
    while frame is not None:
        owner = frame.f_locals.get("self")
        fmu = owner._fmu if isinstance(owner, Reals) else owner.fmu if isinstance(owner, _FmuBody) else owner
        if isinstance(fmu, Fmu):
            function = _CALLED_BY.get(frame.f_code.co_name, frame.f_code.co_name)
            time = getattr(fmu, "_time", None)  # none while it is being loaded
            return f"{function} of {fmu.path.name}" + ("" if time is None else f" at t = {time.value:.9g} s")
        frame = frame.f_back
    return "the program" if innermost is None else f"{innermost.f_code.co_filename}, line {innermost.f_lineno},"


class FmuBeam(_FmuBody):
    """``beam.fmu`` as a body."""

    _MOTION = (
        "tip_displacement",
        "tip_velocity",
        "tip_displacement_integral",
        "tip_displacement_integral_2",
    )
    _ENERGIES = ("kinetic_energy", "strain_energy", "dissipated_energy", "load_potential")
    _IMPULSE = "tip_impulse"
    _FORCES = ("tip_force",)

    def __init__(self, beam: Beam, start_time: float, deflection_slope: float) -> None:
        """At ``start_time`` [s], with u = ``deflection_slope``·x."""
        parameters: dict[str, float | int | bool] = beam.model_dump(exclude={"approach", "fidelity"})
        parameters["integrator"] = _INTEGRATORS[beam.integrator]
        parameters["initial_deflection_slope"] = deflection_slope
        super().__init__(Fmu("beam", fmu_directory() / "beam.fmu", parameters, start_time))

    def _prepare(self, fmu: Fmu) -> None:
        super()._prepare(fmu)
        self._shape = Reals(fmu, *[f"deflection[{i}]" for i in range(1, len(SHAPE_POINTS) + 1)])

    def _mass(self) -> float:
        return Reals(self.fmu, "tip_mass").get()[0]

    def advance(self, time: float, size: float, contact: Force, foundation: Force = NO_FORCE) -> Motion:
        return self._advance(time, size, contact)

    def energies(self) -> Energies:
        return _energies_of(Energies, self._stored())

    def shape(self) -> np.ndarray:
        """Deflection [m] at `SHAPE_POINTS`, shape (21,)."""
        self._shape.get()
        return np.array(np.frombuffer(self._shape.values))


class FmuSpring(_FmuBody):
    """``spring.fmu`` as a body; contact law and foundation are the master's."""

    REMEMBERED = (*_FmuBody.REMEMBERED, "_dissipated_before")

    _MOTION = ("displacement", "velocity", "displacement_integral", "displacement_integral_2")
    _ENERGIES = ("kinetic_energy", "potential_energy", "dissipated_energy")
    _IMPULSE = "impulse"
    _FORCES = ("contact_force", "foundation_force")

    def __init__(self, spring: Spring, start_time: float) -> None:
        self._spring = spring
        parameters: dict[str, float | int | bool] = spring.model_dump(exclude={"initial_velocity"})
        parameters["displacement"] = spring.equilibrium
        parameters["velocity"] = spring.initial_velocity
        self._dissipated_before = 0.0  #: before the last `restart` [J]
        super().__init__(Fmu("spring", fmu_directory() / "spring.fmu", parameters, start_time))

    def _mass(self) -> float:
        return self._spring.mass

    def advance(self, time: float, size: float, contact: Force, foundation: Force = NO_FORCE) -> Motion:
        (c, dc, ddc), (n, dn, ddn) = contact, foundation
        return self._advance(time, size, (c, n, dc, ddc, dn, ddn))

    def energies(self) -> Energies:
        kinetic, potential, dissipated = self._stored()
        load = -self._spring.external_force * self._current.displacement
        return _energies_of(Energies, (kinetic, potential, self._dissipated_before + dissipated, load))

    def _prepare(self, fmu: Fmu) -> None:
        super()._prepare(fmu)
        self._internal_steps = Reals(fmu, "internal_steps")

    @property
    def internal_steps(self) -> int:
        """Steps that IDA took on the way here; those of steps that were taken back are not among them.

        Raises FmuError if the FMU has failed, or fails to tell.
        """
        if not self.fmu.usable:
            raise FmuError(f"{self.fmu.path}: has failed")
        steps = self._internal_steps.get()[0]
        if not isfinite(steps):
            raise FmuError(f"{self.fmu.path}: internal_steps = {steps}")
        return round(steps)

    def restart(self, time: float, displacement: float, velocity: float, dissipated: float = 0.0) -> None:
        """Start again at ``time`` [s] from y [m] and z [m/s], by the exact start values of the FMU.

        ``dissipated`` is what damping has taken until then [J].
        """
        self._dissipated_before = dissipated
        self.fmu.reset(time, {"displacement": displacement, "velocity": velocity})
        self._pending = 0.0
        self._begin()


def load_bodies(scene: Scene, start_time: float) -> tuple[FmuBeam | QuasiStaticBeam | None, FmuSpring | None]:
    """The bodies that ``scene`` contains, at ``start_time`` [s], where the beam is as the approach leaves it.

    They are FMUs, but for a beam without inertia.
    """
    beam: FmuBeam | QuasiStaticBeam | None = None
    if scene.beam is not None:
        rate = scene.beam.initial_velocity_slope
        if "beam" not in scene.fmus:
            assert scene.initial_tip is not None
            tip, velocity = scene.initial_tip + start_time * rate * scene.beam.length, rate * scene.beam.length
            beam = QuasiStaticBeam(scene.beam, scene.coupling.degree, tip, velocity)
            if scene.beam.approach == "elastic" or scene.contact.law == "compliance":
                beam.release()
        else:
            beam = FmuBeam(scene.beam, start_time, scene.beam.initial_deflection_slope + start_time * rate)
    try:
        return beam, None if scene.spring is None else FmuSpring(scene.spring, start_time)
    except BaseException:
        if beam is not None:
            beam.close()
        raise
