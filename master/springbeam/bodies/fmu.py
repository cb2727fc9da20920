"""One instance of a co-simulation FMU: the only module that imports FMPy."""

from __future__ import annotations

import atexit
import difflib
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from ctypes import byref, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p
from functools import lru_cache, partial
from pathlib import Path
from struct import Struct
from types import FrameType
from typing import Any

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
from .checkpointed import Checkpointed
from .protocol import FmuError, StepRefused

#: Types of variables: in C, and of the values that they take.
_KINDS: dict[str, tuple[Any, tuple[type, ...]]] = {
    "Real": (c_double, (int, float)),
    "Integer": (c_int, (int,)),
    "Boolean": (c_int, (bool, int)),
    "String": (c_char_p, (str,)),
}
#: Values of fmi2Status.
WARNING, DISCARD, ERROR, FATAL = 1, 2, 3, 4
_STATUS = ("OK", "warning", "discard", "error", "fatal", "pending")


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
        if names:
            self.get()  # a wrong reference is found before the run

    def get(self) -> tuple[float, ...]:
        if (status := self._read()) > WARNING:
            raise self._fmu.failed(status, f"cannot read {self._names}")
        return self._unpacked()

    def set(self, values: Sequence[float]) -> None:
        self.values[:] = values
        self._fmu.moved = True
        if (status := self._write()) > WARNING:
            raise self._fmu.failed(status, f"cannot set {self._names}")


#: A value of a parameter.
Value = float | int | bool | str


class Fmu(Checkpointed):
    """One instance of a co-simulation FMU and its state.

    Parameters
    ----------
    name
        The model identifier that it must have, of one of our own; ``None`` for an FMU that others made.
    path
        The file.
    parameters
        Parameters and start values.
    start_time
        [s].
    """

    CHECKPOINTED = ("steps", "rewinds")

    def __init__(self, name: str | None, path: Path, parameters: Mapping[str, Value], start_time: float) -> None:
        self.path, self._own = path, name is not None
        self._name = path.stem if name is None else name
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
            remedy = "; ./build.sh fmus builds it, SPRINGBEAM_FMUS names another folder" if self._own else ""
            raise FmuError(f"{self.path}: not found{remedy}")
        folder, description = _unpacked(self.path, self.path.stat().st_mtime_ns)
        if description.coSimulation is None or description.fmiVersion != "2.0":
            kind = "co-simulation" if description.coSimulation else "model exchange"
            raise FmuError(
                f"{self.path}: not an FMI 2.0 co-simulation FMU but one of FMI {description.fmiVersion}, {kind}; "
                "export it as FMI 2.0 for co-simulation"
            )
        identifier = description.coSimulation.modelIdentifier
        if self._own and identifier != self._name:
            raise FmuError(f"{self.path}: model identifier {identifier!r}, expected {self._name!r}")
        #: What it says it can do.
        self.says = description.coSimulation
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
                modelIdentifier=identifier,
                instanceName=self._name,
            )
            slave.instantiate(callbacks=self._callbacks)
        except Exception as error:  # FMPy raises bare Exceptions for a missing or foreign binary
            raise FmuError(f"{self.path}: cannot be instantiated: {self._cause(error)}") from error
        return slave

    def _prepare_start(self, parameters: Mapping[str, Value]) -> None:
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
        for name in parameters:
            variable = self.variable(name)
            if variable.type not in _KINDS:
                raise FmuError(f"{self.path}: variable {name!r} is {variable.type}, which cannot be set here")
            if variable.causality not in ("parameter", "input") and variable.initial != "exact":
                raise FmuError(f"{self.path}: variable {name!r} is {variable.causality}, not a parameter")
        for kind, (ctype, taken) in _KINDS.items():
            names = [name for name in parameters if self.variable(name).type == kind]
            if not names:
                continue
            n = len(names)
            for name in names:
                if not isinstance(parameters[name], taken):
                    raise FmuError(f"{self.path}: {name} = {parameters[name]!r}: variable {name!r} is {kind}")
            given = [parameters[name] for name in names]
            values: Any = (ctype * n)(*[value.encode() if isinstance(value, str) else value for value in given])
            references = (c_uint * n)(*[self.reference(name, kind) for name in names])
            self._set_parameters.append(self.prepared(f"fmi2Set{kind}", references, c_size_t(n), values))
            self._parameters.update((name, (values, i)) for i, name in enumerate(names))

    def initialise(self, time: float) -> None:
        """Set parameters and start values and leave initialization mode at ``time`` [s]."""
        self._start_time.value = time
        for call in (self._set_up, *self._set_parameters, self._enter, self._exit):
            if (status := call()) > WARNING:
                raise self.failed(status, "cannot be initialised")

    def reset(self, time: float, changed: Mapping[str, float]) -> None:
        """Start again at ``time`` with some parameters changed."""
        for name, value in changed.items():
            values, i = self._parameters[name]
            values[i] = value
        if (status := self._reset()) > WARNING:
            raise self.failed(status, "cannot be reset")
        self.initialise(time)
        self.moved = True

    @property
    def usable(self) -> bool:
        """Whether no call has failed for good."""
        return self._slave is not None and self._worst <= WARNING

    def prepared(self, name: str, *arguments: Any) -> Callable[[], int]:
        """An FMI function of this instance with its arguments, which are converted to C once; returns its status.

        A pointer of our own to the function that FMPy has loaded: FMPy's wrapper converts and checks types at each
        call, which costs as much as the call.
        """
        function = self._slave.dll[name]
        function.restype = c_int
        return partial(function, c_void_p(self._slave.component), *arguments)

    def variable(self, name: str) -> Any:
        """Return what the FMU says of a variable. Raises FmuError if it has none of this name."""
        try:
            return self._variables[name]
        except KeyError:
            close = difflib.get_close_matches(name, self._variables, n=1)
            meant = f"; did you mean {close[0]!r}?" if close else ""
            raise FmuError(f"{self.path}: has no variable {name!r}{meant}") from None

    def reference(self, name: str, kind: str) -> int:
        """Value reference of a variable of type ``kind``."""
        variable = self.variable(name)
        if variable.type != kind:
            raise FmuError(f"{self.path}: variable {name!r} is {variable.type}, expected {kind}")
        return int(variable.valueReference)

    def input_derivative(self, name: str, order: int) -> Callable[[float], None]:
        """Return what sets the derivative of an input over the next step."""
        value = c_double()
        reference, orders = (c_uint * 1)(self.reference(name, "Real")), (c_int * 1)(order)
        call = self.prepared("fmi2SetRealInputDerivatives", reference, c_size_t(1), orders, byref(value))

        def set_to(derivative: float) -> None:
            value.value, self.moved = derivative, True
            if (status := call()) > WARNING:
                raise self.failed(status, f"cannot set derivative {order} of {name}")

        return set_to

    def mark(self) -> None:
        if (status := self._get_state()) > WARNING:
            raise self.failed(status, "cannot save the state")
        self.moved = False

    def rewind(self) -> None:
        if (status := self._set_state()) > WARNING:
            raise self.failed(status, "cannot restore the state")
        self.moved = False
        self.rewinds += 1

    def step(self, time: float, size: float) -> None:
        """fmi2DoStep, after its inputs have been set. Raises StepRefused."""
        self.steps += 1
        self._time.value, self._size.value = time, size
        status = self._do_step()
        if status <= WARNING:
            return
        if status not in (DISCARD, ERROR):
            raise self.failed(status, f"cannot step at t = {time:.9g} s")
        cause = self._cause(f"fmi2DoStep returned {_STATUS[status]}")
        reached = ""
        if status == DISCARD:
            if (known := self._get_reached()) >= ERROR:
                raise self.failed(known, f"{cause}, and does not say how far it came")
            reached = f" (reached t = {self._reached.value:.9g} s)" if known <= WARNING else ""
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
        if self._state and self._worst < FATAL:
            self._worst = self._free_state()
        if self._worst == FATAL:
            _unpacked.cache_clear()  # the next instance takes a copy of the library of its own
        else:
            slave.freeInstance()

    def _log(self, environment: Any, instance: bytes, status: int, category: bytes, message: bytes) -> None:
        if status > 0:
            self._messages = [*self._messages[-3:], message.decode("utf-8", "replace")]

    def _cause(self, otherwise: Exception | str) -> str:
        messages, self._messages = self._messages, []
        return messages[-1] if messages else str(otherwise)


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
        fmu = owner._fmu if isinstance(owner, Reals) else getattr(owner, "fmu", owner)
        if isinstance(fmu, Fmu):
            function = _CALLED_BY.get(frame.f_code.co_name, frame.f_code.co_name)
            time = getattr(fmu, "_time", None)  # none while it is being loaded
            return f"{function} of {fmu.path.name}" + ("" if time is None else f" at t = {time.value:.9g} s")
        frame = frame.f_back
    return "the program" if innermost is None else f"{innermost.f_code.co_filename}, line {innermost.f_lineno},"
