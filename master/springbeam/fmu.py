"""The two FMUs as bodies: the only module that imports FMPy."""

from __future__ import annotations

import atexit
import os
import shutil
import tempfile
from ctypes import byref, c_double, c_int, c_uint
from functools import lru_cache
from math import isfinite
from pathlib import Path
from typing import Any

import fmpy
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

from .scene import Beam, Scene, Spring
from .subsystem import NO_FORCE, Energies, Force, Motion, StepRefused
from .trajectory import SHAPE_POINTS

_INTEGRATORS = {"modal": 1, "generalized_alpha": 2}
_DISCARD, _ERROR = 2, 3


class FmuError(RuntimeError):
    """An FMU cannot be found, loaded or initialised; the message names the file and the cause."""


def fmu_directory() -> Path:
    """Where ``beam.fmu`` and ``spring.fmu`` are: $SPRINGBEAM_FMUS, the installed package, or the checkout."""
    chosen = os.environ.get("SPRINGBEAM_FMUS")
    if chosen:
        return Path(chosen)
    here = Path(__file__).resolve().parent
    installed = here / "fmus"
    return installed if installed.is_dir() else here.parents[1] / "fmus"


@lru_cache(maxsize=8)
def _unpacked(path: Path, modified: int) -> tuple[Path, ModelDescription]:
    try:
        description = read_model_description(str(path))
        folder = Path(tempfile.mkdtemp(prefix="springbeam-"))
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        fmpy.extract(str(path), unzipdir=str(folder))
    except Exception as error:  # FMPy raises bare Exceptions for whatever is wrong with an archive
        raise FmuError(f"{path}: not a usable FMU: {error}") from error
    return folder, description


class _Fmu:
    """One instance of a co-simulation FMU, its state and its scalar inputs and outputs."""

    def __init__(self, name: str, path: Path, parameters: dict[str, float | int | bool], start_time: float) -> None:
        self.path, self._name = path, name
        self._messages: list[str] = []
        self._slave = self._load()
        self._parameters = parameters
        self._state = fmi2FMUstate()
        self._moved = False
        #: doStep calls, and how often the state was set back.
        self.steps = self.rewinds = 0
        self.initialise(start_time, parameters)

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

    def initialise(self, time: float, parameters: dict[str, float | int | bool]) -> None:
        """Set parameters and start values and leave initialization mode at ``time`` [s]."""
        slave = self._slave
        try:
            slave.setupExperiment(startTime=time)
            for name, value in parameters.items():
                reference = [self.reference(name)]
                kind = self._variables[name].type
                if kind == "Boolean":
                    slave.setBoolean(reference, [bool(value)])
                elif kind == "Real":
                    slave.setReal(reference, [float(value)])
                else:
                    slave.setInteger(reference, [int(value)])
            slave.enterInitializationMode()
            slave.exitInitializationMode()
        except FMICallException as error:
            cause = self._cause(error)
            self.close()
            raise FmuError(f"{self.path}: cannot be initialised: {cause}") from error

    def reset(self, time: float, parameters: dict[str, float | int | bool]) -> None:
        """Start again at ``time`` with the given parameters."""
        self._slave.reset()
        self.initialise(time, parameters)
        self._moved = True

    def reference(self, name: str) -> int:
        try:
            return int(self._variables[name].valueReference)
        except KeyError:
            raise FmuError(f"{self.path}: has no variable {name!r}") from None

    def references(self, *names: str) -> Any:
        """Value references of Real variables; read once here, so that a wrong one is found before the run."""
        found = (c_uint * len(names))(*[self.reference(name) for name in names])
        for name in names:
            if self._variables[name].type != "Real":
                raise FmuError(f"{self.path}: variable {name!r} is {self._variables[name].type}, expected Real")
        try:
            self.get(found, (c_double * len(names))())
        except FMICallException as error:
            raise FmuError(f"{self.path}: cannot read {', '.join(names)}: {self._cause(error)}") from error
        return found

    def mark(self) -> None:
        self._slave.fmi2GetFMUstate(self._slave.component, byref(self._state))
        self._moved = False

    def rewind(self) -> None:
        if self._moved:
            self._slave.fmi2SetFMUstate(self._slave.component, self._state)
            self._moved = False
            self.rewinds += 1

    def set(self, references: Any, values: Any) -> None:
        self._slave.fmi2SetReal(self._slave.component, references, len(references), values)
        self._moved = True

    def set_derivatives(self, references: Any, orders: Any, values: Any) -> None:
        self._slave.fmi2SetRealInputDerivatives(self._slave.component, references, len(references), orders, values)
        self._moved = True

    def get(self, references: Any, values: Any) -> Any:
        self._slave.fmi2GetReal(self._slave.component, references, len(references), values)
        return values

    def step(self, time: float, size: float) -> None:
        self.steps += 1
        self._moved = True
        try:
            self._slave.fmi2DoStep(self._slave.component, time, size, 0)
        except FMICallException as error:
            if error.status not in (_DISCARD, _ERROR):
                raise FmuError(f"{self.path}: {self._cause(error)} at t = {time:.9g} s") from error
            reached = ""
            if error.status == _DISCARD:
                reached = f" (reached t = {self._slave.getRealStatus(fmi2LastSuccessfulTime):.9g} s)"
            raise StepRefused(f"{self._name}: {self._cause(error)}{reached}") from error

    def close(self) -> None:
        slave, self._slave = getattr(self, "_slave", None), None
        if slave is None:
            return
        if self._state:
            slave.fmi2FreeFMUstate(slave.component, byref(self._state))
        slave.freeInstance()

    def _log(self, environment: Any, instance: bytes, status: int, category: bytes, message: bytes) -> None:
        if status > 0:
            self._messages = [*self._messages[-3:], message.decode("utf-8", "replace")]

    def _cause(self, error: Exception) -> str:
        messages, self._messages = self._messages, []
        return messages[-1] if messages else str(error)


class _FmuBody:
    """What both bodies do alike; a subclass names its variables."""

    _MOTION: tuple[str, ...]
    _ENERGIES: tuple[str, ...]
    _IMPULSE: str
    _FORCES: tuple[str, ...]

    def __init__(self, fmu: _Fmu) -> None:
        self.fmu = fmu
        self._motion_refs, self._motion_values = fmu.references(*self._MOTION), (c_double * 4)()
        self._energy_refs = fmu.references(*self._ENERGIES)
        self._energy_values = (c_double * len(self._ENERGIES))()
        n = len(self._FORCES)
        self._force_refs, self._force_values = fmu.references(*self._FORCES), (c_double * n)()
        names = [name for name in self._FORCES for _ in (1, 2)]
        self._slope_refs, self._slope_values = fmu.references(*names), (c_double * (2 * n))()
        self._slope_orders = (c_int * (2 * n))(*[1, 2] * n)
        self._impulse_refs, self._impulse_values = fmu.references(self._IMPULSE), (c_double * 1)()
        self._pending = self._marked_pending = 0.0
        self.mass = self._mass()
        self._current = self._marked_motion = self._read_motion()

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
        self.fmu.rewind()
        self._pending, self._current = self._marked_pending, self._marked_motion

    def motion(self) -> Motion:
        return self._current

    def apply_impulse(self, impulse: float) -> None:
        # The FMU applies it at the start of its next step; motion and energies already show it.
        self._pending += impulse
        self._impulse_values[0] = self._pending
        self.fmu.set(self._impulse_refs, self._impulse_values)
        self._current = self._current._replace(velocity=self._current.velocity + impulse / self.mass)

    def _advance(self, time: float, size: float, forces: tuple[Force, ...]) -> None:
        for i, (value, slope, bend) in enumerate(forces):
            self._force_values[i] = value
            self._slope_values[2 * i], self._slope_values[2 * i + 1] = slope, bend
        self.fmu.set(self._force_refs, self._force_values)
        if any(f[1] != 0.0 or f[2] != 0.0 for f in forces):
            self.fmu.set_derivatives(self._slope_refs, self._slope_orders, self._slope_values)
        self.fmu.step(time, size)
        self._pending = 0.0
        self._current = self._read_motion()

    def _read_motion(self) -> Motion:
        motion = Motion(*self.fmu.get(self._motion_refs, self._motion_values))
        if not isfinite(sum(motion)):
            raise StepRefused(f"{self.fmu.path.name}: not finite: {motion}")
        return motion

    def _stored(self) -> tuple[float, float, float]:
        """(kinetic, potential, dissipated) [J]; the kinetic energy with the impulse that is still pending."""
        kinetic, potential, dissipated = self.fmu.get(self._energy_refs, self._energy_values)[:3]
        if self._pending != 0.0:
            before = self._current.velocity - self._pending / self.mass
            kinetic += 0.5 * self._pending * (before + self._current.velocity)
        return kinetic, potential, dissipated

    def close(self) -> None:
        self.fmu.close()


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
        parameters: dict[str, float | int | bool] = beam.model_dump(exclude={"approach"})
        parameters["integrator"] = _INTEGRATORS[beam.integrator]
        parameters["initial_deflection_slope"] = deflection_slope
        fmu = _Fmu("beam", fmu_directory() / "beam.fmu", parameters, start_time)
        n = len(SHAPE_POINTS)
        self._shape_refs = fmu.references(*[f"deflection[{i}]" for i in range(1, n + 1)])
        self._shape_values = (c_double * n)()
        super().__init__(fmu)

    def _mass(self) -> float:
        return float(self.fmu.get(self.fmu.references("tip_mass"), (c_double * 1)())[0])

    def advance(self, time: float, size: float, contact: Force, foundation: Force = NO_FORCE) -> None:
        self._advance(time, size, (contact,))

    def energies(self) -> Energies:
        kinetic, strain, dissipated = self._stored()
        return Energies(kinetic, strain, dissipated, self._energy_values[3])

    def shape(self) -> np.ndarray:
        """Deflection [m] at `SHAPE_POINTS`, shape (21,)."""
        return np.array(self.fmu.get(self._shape_refs, self._shape_values))


class FmuSpring(_FmuBody):
    """``spring.fmu`` as a body; contact law and foundation are the master's."""

    _MOTION = ("displacement", "velocity", "displacement_integral", "displacement_integral_2")
    _ENERGIES = ("kinetic_energy", "potential_energy", "dissipated_energy")
    _IMPULSE = "impulse"
    _FORCES = ("contact_force", "foundation_force")

    def __init__(self, spring: Spring, start_time: float) -> None:
        self._spring = spring
        self._parameters: dict[str, float | int | bool] = spring.model_dump(exclude={"initial_velocity"})
        self._parameters["displacement"] = spring.equilibrium
        self._parameters["velocity"] = spring.initial_velocity
        super().__init__(_Fmu("spring", fmu_directory() / "spring.fmu", self._parameters, start_time))

    def _mass(self) -> float:
        return self._spring.mass

    def advance(self, time: float, size: float, contact: Force, foundation: Force = NO_FORCE) -> None:
        self._advance(time, size, (contact, foundation))

    def energies(self) -> Energies:
        kinetic, potential, dissipated = self._stored()
        return Energies(kinetic, potential, dissipated, -self._spring.external_force * self._current.displacement)

    def restart(self, time: float, displacement: float, velocity: float) -> None:
        """Start again at ``time`` [s] from y [m] and z [m/s], by the exact start values of the FMU."""
        self.fmu.reset(time, {**self._parameters, "displacement": displacement, "velocity": velocity})
        self._pending = 0.0
        self._current = self._read_motion()


def load_bodies(scene: Scene, start_time: float) -> tuple[FmuBeam | None, FmuSpring | None]:
    """The FMUs that ``scene`` contains, at ``start_time`` [s], where the beam is as the approach leaves it."""
    beam = None
    if scene.beam is not None:
        slope = scene.beam.initial_deflection_slope + start_time * scene.beam.initial_velocity_slope
        beam = FmuBeam(scene.beam, start_time, slope)
    try:
        return beam, None if scene.spring is None else FmuSpring(scene.spring, start_time)
    except BaseException:
        if beam is not None:
            beam.close()
        raise
