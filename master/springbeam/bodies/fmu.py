"""One instance of a co-simulation FMU and its state."""

from __future__ import annotations

import atexit
import difflib
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from ctypes import byref, c_char, c_double, c_size_t, c_uint, c_void_p
from functools import lru_cache
from math import prod
from pathlib import Path
from typing import Any, NoReturn

from fmpy.model_description import ModelDescription, read_model_description

from .archive import UnsafeArchive, unpack
from .functions import DISCARD, ERROR, FATAL, VERSIONS, WARNING, Call, Functions
from .protocol import FmuError, StepRefused

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

    clock: Any  #: an array of C: time and size [s] of the step that `do_step` makes
    do_step: Call

    def __init__(self, name: str | None, path: Path, parameters: Mapping[str, Value], start_time: float) -> None:
        self.path, self._own = path, name is not None
        self._name = path.stem if name is None else name
        self._messages: list[str] = []
        self._functions = functions = self._load()
        self._closed = False
        self.prepared, self.real = functions.prepared, functions.REAL
        self.version = functions.VERSION  #: of FMI
        self._state = c_void_p()
        self._start = c_void_p()  #: as initialised, if it is kept
        self._worst = 0  #: status of the calls that have failed for good
        self._refused = False  #: whether a step was not made
        #: Whether anything happened since the state was marked.
        self.moved = False
        #: doStep calls, and how often the state was set back.
        self.steps = self.rewinds = 0
        self._start_time = c_double()
        self.stepping((c_double * 2)())
        if self.says.canGetAndSetFMUstate:
            self.get_state = self.prepared("GetFMUState", byref(self._state))
            self.set_state = self.prepared("SetFMUState", self._state)
        try:
            self._initialising = functions.initialising(self._start_time, self._prepared_parameters(parameters))
            self.initialise(start_time)
        except BaseException:
            self.close()
            raise

    def _load(self) -> Functions:
        if not self.path.is_file():
            remedy = "; ./build.sh fmus builds it, SPRINGBEAM_FMUS names another folder" if self._own else ""
            raise FmuError(f"{self.path}: not found{remedy}")
        folder, description = _unpacked(self.path, self.path.stat().st_mtime_ns)
        version = VERSIONS.get(description.fmiVersion)
        if description.coSimulation is None or version is None:
            kind = "co-simulation" if description.coSimulation else "model exchange"
            raise FmuError(
                f"{self.path}: an FMU for {kind} of FMI {description.fmiVersion}; export it for co-simulation, as FMI "
                f"{' or '.join(VERSIONS)}"
            )
        identifier = description.coSimulation.modelIdentifier
        if self._own and identifier != self._name:
            raise FmuError(f"{self.path}: model identifier {identifier!r}, expected {self._name!r}")
        #: What it says it can do.
        self.says = description.coSimulation
        self._variables = {v.name: v for v in description.modelVariables}
        try:
            return version(description, folder, self._name, self._log)
        except OSError as error:
            raise FmuError(f"{self.path}: cannot be instantiated: {self._cause(error)}") from error

    def _prepared_parameters(self, parameters: Mapping[str, Value]) -> list[Call]:
        """Return the calls that set the parameters. Raises FmuError for one that cannot be set so."""
        kinds = self._functions.KINDS
        given: dict[str, dict[str, Any]] = {}  # by kind and name, as C takes them
        for name, value in parameters.items():
            variable = self.variable(name)
            kind, what = variable.type, f"{self.path}: {name} = {value!r}: variable {name!r} is {variable.type}"
            if kind not in kinds:
                raise FmuError(f"{what}, which cannot be set here")
            if variable.causality not in ("parameter", "input") and variable.initial != "exact":
                raise FmuError(f"{self.path}: variable {name!r} is {variable.causality}, not a parameter")
            if not isinstance(value, kinds[kind].taken):
                raise FmuError(what)
            if isinstance(value, int) and kinds[kind].ctype(value).value != value:
                raise FmuError(f"{what}, too small for it")
            given.setdefault(kind, {})[name] = value.encode() if isinstance(value, str) else value
        #: Where the value of a parameter is.
        self._parameters: dict[str, tuple[Any, int]] = {}
        calls = []
        for kind, of_kind in given.items():
            values: Any = (kinds[kind].ctype * len(of_kind))(*of_kind.values())
            references = self.references(list(of_kind), kind)
            calls.append(self._functions.accessor("Set", kind, references, values, len(of_kind)))
            self._parameters.update((name, (values, i)) for i, name in enumerate(of_kind))
        return calls

    def initialise(self, time: float) -> None:
        """Set parameters and start values and leave initialization mode at ``time`` [s]."""
        self._start_time.value = time
        for call in self._initialising:
            if (status := call()) > WARNING:
                raise self.failed(status, "cannot be initialised")

    def reset(self, time: float, changed: Mapping[str, float]) -> None:
        """Start again at ``time`` with some parameters changed."""
        for name, value in changed.items():
            values, i = self._parameters[name]
            values[i] = value
        self._must("cannot be reset", "Reset")
        self.initialise(time)
        self.moved = True

    @property
    def faultless(self) -> bool:
        """Whether every call so far did what it was asked for."""
        return not self._closed and self._worst <= WARNING and not self._refused

    def accessor(self, verb: str, names: Sequence[str], values: Any, size: int = 1) -> Call:
        """Return what gets or sets (``verb``) variables of ``size`` real numbers each by ``values``, an array of C."""
        references = self.references(names, self.real, size)
        return self._functions.accessor(verb, self.real, references, values, len(names) * size)

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

    def input_derivatives(self, names: Sequence[str], orders: int, values: Any) -> Call:
        """Return what sets derivatives 1 … ``orders`` of inputs over the next step, those of one after another."""
        each = [(name, order) for name in names for order in range(1, orders + 1)]
        return self._functions.input_derivatives(each, self.references, values)

    def keep_start(self) -> None:
        """Remember the present state as the one `return_to_start` sets."""
        self._must("cannot save the state", "GetFMUState", byref(self._start))
        self._at_start = self.clock, self.do_step

    def return_to_start(self) -> None:
        """Set the state of `keep_start`, as a new instance has it."""
        self._must("cannot restore the state", "SetFMUState", self._start)
        self.moved, self.steps, self.rewinds = False, 0, 0
        self.clock, self.do_step = self._at_start
        self._messages.clear()

    def stepping(self, clock: Any) -> None:
        """Let `do_step` make steps as the first two numbers of ``clock`` say."""
        self.clock, self.do_step = (
            clock,
            self._functions.stepping(*(c_double.from_buffer(clock, 8 * i) for i in (0, 1))),
        )

    def refuse(self, status: int) -> NoReturn:
        """Raise StepRefused, or BodyFailed, for a step (fmi2DoStep) that has returned ``status``."""
        time = self.clock[0]
        if status not in (DISCARD, ERROR):
            raise self.failed(status, f"cannot step at t = {time:.9g} s")
        self._refused = True
        cause = self._cause(f"{self._functions.spelt('DoStep')} returned {_STATUS[status]}")
        reached = ""
        if status == DISCARD:
            known, time_reached = self._functions.reached()
            if known >= ERROR:
                raise self.failed(known, f"{cause}, and does not say how far it came")
            reached = f" (reached t = {time_reached:.9g} s)" if known <= WARNING else ""
        # Also after fmi2Error a saved state may be restored and the step tried again (FMI 2.0.4, section 2.1.3).
        raise StepRefused(f"{self._name}: {cause}{reached}")

    def failed(self, status: int, what: str) -> FmuError:
        """Return the error of a call that returned ``status``, with what the FMU has logged."""
        self._worst = max(self._worst, status)
        return FmuError(f"{self.path}: {what}: {self._cause(f'it returned {_STATUS[status]}')}")

    def _must(self, what: str, name: str, *arguments: Any) -> None:
        """Call a function that is called seldom. Raises FmuError."""
        if (status := self.prepared(name, *arguments)()) > WARNING:
            raise self.failed(status, what)

    def serialized(self) -> bytes:
        """Return the present state as the FMU writes it. Raises FmuError."""
        what, state, size = "cannot save the state", c_void_p(), c_size_t()
        self._must(what, "GetFMUState", byref(state))
        self._must(what, "SerializedFMUStateSize", state, byref(size))
        content = (c_char * size.value)()
        self._must(what, "SerializeFMUState", state, content, size)
        self._must(what, "FreeFMUState", byref(state))
        return content.raw

    def deserialize(self, content: bytes) -> None:
        """Go on from what `serialized` of an equal FMU returned. Raises FmuError."""
        what, state, size = "cannot restore the state", c_void_p(), c_size_t(len(content))
        self._must(what, "DeserializeFMUState", (c_char * len(content)).from_buffer_copy(content), size, byref(state))
        self._must(what, "SetFMUState", state)
        self._must(what, "FreeFMUState", byref(state))

    def close(self) -> None:
        """Free the instance, unless it has returned fmi2Fatal: then none of its library may be called again."""
        if self._closed:
            return
        self._closed = True
        for state in (self._state, self._start):
            if state and self._worst < FATAL:
                self._worst = self.prepared("FreeFMUState", byref(state))()
        if self._worst == FATAL:
            _unpacked.cache_clear()  # the next instance takes a copy of the library of its own
        else:
            self._functions.free()

    def _log(self, status: int, text: str) -> None:
        if status > 0:
            self._messages = [*self._messages[-3:], text]

    def _cause(self, otherwise: Exception | str) -> str:
        messages, self._messages = self._messages, []
        return messages[-1] if messages else str(otherwise)
