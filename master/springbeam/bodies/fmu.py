"""One instance of a co-simulation FMU and its state."""

from __future__ import annotations

import atexit
import difflib
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from ctypes import byref, c_int, c_uint, c_void_p
from functools import lru_cache
from math import prod
from pathlib import Path
from typing import Any, NoReturn

from fmpy.fmi1 import FMICallException
from fmpy.model_description import ModelDescription, read_model_description

from .archive import UnsafeArchive, unpack
from .functions import DISCARD, ERROR, FATAL, FMU2, FMU3, VERSIONS, WARNING, Call
from .protocol import FmuError, StepRefused

_STATUS = ("OK", "warning", "discard", "error", "fatal", "pending")


@lru_cache(maxsize=8)
def _opened(path: Path, modified: int) -> tuple[ModelDescription, FMU2 | FMU3]:
    """Return what the FMU at ``path`` says of itself, and its library. Raises FmuError."""
    folder = Path(tempfile.mkdtemp(prefix="springbeam-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    try:
        unpack(path, folder)
        # External entities of a document type would name files of this computer; FMI's schema knows none.
        if b"<!DOCTYPE" in (folder / "modelDescription.xml").read_bytes():
            raise UnsafeArchive("modelDescription.xml: a document type declaration is not part of an FMU")
        description = read_model_description(str(folder))
        version = VERSIONS.get(description.fmiVersion)
        if description.coSimulation is None or version is None:
            kind = "co-simulation" if description.coSimulation else "model exchange"
            raise ValueError(
                f"it is for {kind} of FMI {description.fmiVersion}; export it for co-simulation, as FMI "
                f"{' or '.join(VERSIONS)}"
            )
        return description, version(description, folder)
    except Exception as error:  # FMPy raises bare Exceptions for whatever is wrong with an archive
        raise FmuError(f"{path}: not a usable FMU: {error}") from error


#: A value of a parameter.
Value = float | int | bool | str


class Fmu:
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

    _slave: Any  #: FMPy's FMU

    def __init__(self, name: str | None, path: Path, parameters: Mapping[str, Value], start_time: float) -> None:
        self.path, self._own = path, name is not None
        self._name = path.stem if name is None else name
        self._message = ""  #: the last that the FMU has logged
        self._worst = 0  #: status of the calls that have failed
        #: Whether anything happened since the state was marked.
        self.moved = False
        #: doStep calls, and how often the state was set back.
        self.steps = self.rewinds = 0
        self._state = c_void_p()
        self._start: Any = None  #: the state as initialised, if it is kept
        self._closed = False
        self._slave = slave = self._load()
        self.real, self.version = slave.REAL, slave.VERSION  #: the type of real variables, and the version of FMI
        try:
            if self.says.canGetAndSetFMUstate:
                self.get_state = self.bound(f"Get{slave.STATE}", byref(self._state))
                self.set_state = self.bound(f"Set{slave.STATE}", self._state)
            #: Parameters by how FMPy sets them and by value reference.
            self._parameters: dict[str, dict[int, Value]] = {}
            for parameter, value in parameters.items():
                self._give(parameter, value)
            self.initialise(start_time)
        except BaseException:
            self.close()
            raise

    def _load(self) -> Any:
        if not self.path.is_file():
            remedy = "; ./build.sh fmus builds it, SPRINGBEAM_FMUS names another folder" if self._own else ""
            raise FmuError(f"{self.path}: not found{remedy}")
        description, opened = _opened(self.path, self.path.stat().st_mtime_ns)
        identifier = description.coSimulation.modelIdentifier
        if self._own and identifier != self._name:
            raise FmuError(f"{self.path}: model identifier {identifier!r}, expected {self._name!r}")
        #: What it says it can do.
        self.says = description.coSimulation
        self._variables = {v.name: v for v in description.modelVariables}
        try:
            return opened.instance(self._name, self._log)
        except Exception as error:  # FMPy's own have no other type
            raise FmuError(f"{self.path}: cannot be instantiated: {self._cause(error)}") from error

    @contextmanager
    def _asked(self, what: str) -> Iterator[None]:
        """Name the FMU if one of its functions that FMPy calls fails, or is missing."""
        try:
            yield
        except FMICallException as error:
            raise self.failed(error.status, what) from None
        except OSError as error:
            raise FmuError(f"{self.path}: {what}: {error}") from None

    def _give(self, name: str, value: Value) -> None:
        """Take the value of a parameter or a start value. Raises FmuError for one that cannot be set."""
        variable = self.variable(name)
        if variable.causality not in ("parameter", "input") and variable.initial != "exact":
            raise FmuError(f"{self.path}: variable {name!r} is {variable.causality}, not a parameter")
        kind = self._slave.ENUMERATION if variable.type == "Enumeration" else variable.type
        if not self._slave.holds(kind, value):
            raise FmuError(f"{self.path}: {name} = {value!r}: variable {name!r} is {variable.type} and cannot be that")
        self._parameters.setdefault(f"set{kind}", {})[self.references([name], variable.type)[0]] = value

    def initialise(self, time: float) -> None:
        """Set parameters and start values and leave initialization mode at ``time`` [s]."""

        def set_parameters() -> None:
            for setter, given in self._parameters.items():
                getattr(self._slave, setter)(list(given), list(given.values()))

        with self._asked("cannot be initialised"):
            self._slave.initialise(time, set_parameters)

    def reset(self, time: float, changed: Mapping[str, float]) -> None:
        """Start again at ``time`` with some parameters changed."""
        for name, value in changed.items():
            self._give(name, value)
        with self._asked("cannot be reset"):
            self._slave.reset()
        self.initialise(time)

    @property
    def faultless(self) -> bool:
        """Whether every call so far did what it was asked for."""
        return not self._closed and self._worst <= WARNING

    def bound(self, name: str, *arguments: Any) -> Call:
        """Return a function with its arguments, as FMPy's FMU does. Raises FmuError if the library lacks it."""
        with self._asked("cannot be used"):
            bound: Call = self._slave.bound(name, *arguments)
        return bound

    def accessor(self, verb: str, names: Sequence[str], values: Any, size: int = 1) -> Call:
        """Return what gets or sets (``verb``) variables of ``size`` real numbers each by ``values``, an array of C."""
        references = self.references(names, self.real, size)
        with self._asked("cannot be used"):
            accessor: Call = self._slave.accessor(verb, references, values)
        return accessor

    def advancing(self, inputs: Sequence[str], slopes: int, outputs: Sequence[str], always: bool) -> Any:
        """Return what makes an advance, and the arrays of C that it takes and leaves numbers in: see `Slave.advancing`.

        Derivatives 1 … ``slopes`` of each input follow the inputs, those of one after another.
        """
        each = [(name, order) for name in inputs for order in range(1, slopes + 1)]
        if self.version == FMU3.VERSION:
            sloped = [f"der({name}{f',{order}' if order > 1 else ''})" for name, order in each]
        else:
            sloped = [name for name, _ in each]
        orders = (c_int * len(each))(*[order for _, order in each])
        references = (self.references(names, self.real) for names in (inputs, sloped, outputs))
        set_, derivatives, read = references
        with self._asked("cannot be used"):
            return self._slave.advancing(set_, derivatives, orders, read, always)

    def variable(self, name: str) -> Any:
        """Return what the FMU says of a variable. Raises FmuError if it has none of this name."""
        try:
            return self._variables[name]
        except KeyError:
            close = difflib.get_close_matches(name, self._variables, n=1)
            meant = f"; did you mean {close[0]!r}?" if close else ""
            raise FmuError(f"{self.path}: has no variable {name!r}{meant}") from None

    def references(self, names: Sequence[str], kind: str, size: int = 1) -> Any:
        """Return value references of variables of one type and size, as an array of C. Raises FmuError."""
        for name in names:
            if (variable := self.variable(name)).type != kind:
                raise FmuError(f"{self.path}: variable {name!r} is {variable.type}, expected {kind}")
            if prod(variable.shape or ()) != size:
                raise FmuError(f"{self.path}: variable {name!r} is an array; only single numbers can be used")
        return (c_uint * len(names))(*[int(self.variable(name).valueReference) for name in names])

    def keep_start(self) -> None:
        """Remember the present state as the one `return_to_start` sets."""
        with self._asked("cannot save the state"):
            self._start = self._slave.getFMUState()

    def return_to_start(self) -> None:
        """Set the state of `keep_start`, as a new instance has it."""
        with self._asked("cannot restore the state"):
            self._slave.setFMUState(self._start)
        self.moved, self.steps, self.rewinds = False, 0, 0
        self._message = ""

    def refuse(self, status: int, time: float, otherwise: str = "") -> NoReturn:
        """Raise StepRefused, or FmuError, for a step from ``time`` [s] that has returned ``status``."""
        if status not in (DISCARD, ERROR):
            raise self.failed(status, f"cannot step at t = {time:.9g} s")
        self._worst = max(self._worst, status)
        cause = self._cause(otherwise or f"{self._slave.PREFIX}DoStep returned {_STATUS[status]}")
        # Also after fmi2Error a saved state may be restored and the step tried again (FMI 2.0.4, section 2.1.3).
        raise StepRefused(f"{self._name}: {cause}")

    def failed(self, status: int, what: str) -> FmuError:
        """Return the error of a call that returned ``status``, with what the FMU has logged."""
        self._worst = max(self._worst, status)
        return FmuError(f"{self.path}: {what}: {self._cause(f'it returned {_STATUS[status]}')}")

    def serialized(self) -> bytes:
        """Return the present state as the FMU writes it. Raises FmuError."""
        with self._asked("cannot save the state"):
            state = self._slave.getFMUState()
            content: bytes = self._slave.serializeFMUState(state)
            self._slave.freeFMUState(state)
        return content

    def deserialize(self, content: bytes) -> None:
        """Go on from what `serialized` of an equal FMU returned. Raises FmuError."""
        with self._asked("cannot restore the state"):
            state = self._slave.deserializeFMUState(content)
            self._slave.setFMUState(state)
            self._slave.freeFMUState(state)

    def close(self) -> None:
        """Free the instance, unless it has returned fmi2Fatal: then none of its library may be called again."""
        if self._closed:
            return
        self._closed = True
        for state in (self._state, self._start):
            if state and self._worst < FATAL:
                with suppress(FmuError), self._asked("cannot free a state"):
                    self._slave.freeFMUState(state)
        if self._worst == FATAL:
            _opened.cache_clear()  # the next instance takes a copy of the library of its own
        else:
            with suppress(OSError):
                self._slave.freeInstance()

    def _log(self, status: int, text: bytes | None) -> None:
        if status > 0:
            self._message = (text or b"").decode("utf-8", "replace")

    def _cause(self, otherwise: Exception | str) -> str:
        message, self._message = self._message, ""
        return message or str(otherwise)
