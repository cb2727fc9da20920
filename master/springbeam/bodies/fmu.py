"""One instance of a co-simulation FMU and its state.

FMPy makes the calls outside of steps. It checks each argument of each call, which takes as long as the call: the calls
of a step are bound to their arguments here, and `advance.cpp` makes those of one advance together.
"""

from __future__ import annotations

import atexit
import difflib
from collections import Counter
from collections.abc import Callable, Hashable, Mapping, Sequence
from contextlib import suppress
from ctypes import byref, c_double, c_int, c_size_t, c_uint, c_void_p, cast
from functools import cache, partial
from math import prod
from pathlib import Path
from struct import Struct
from typing import Any, NoReturn, TypeVar

from fmpy.fmi1 import FMICallException

from .archive import own_fmu
from .functions import DISCARD, ERROR, FATAL, WARNING, Advance, advances, opened
from .protocol import FmuError, StepRefused
from .units import Unit, unit_of

_STATUS = ("OK", "warning", "discard", "error", "fatal", "pending")


#: Number of instances of a file that have returned fmi2Fatal in this process.
_fatal: Counter[Path] = Counter()


#: A value of a parameter.
Value = float | int | bool | str
#: A function with its arguments, which returns its status.
Call = Callable[[], int]
_T = TypeVar("_T")


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
    start_time, stop_time
        When its first step begins, and when the last one ends, where that is known [s].
    """

    def __init__(
        self,
        name: str | None,
        path: Path,
        parameters: Mapping[str, Value],
        start_time: float,
        stop_time: float | None = None,
    ) -> None:
        self.path = path
        self._own = name is not None
        self._stop_time = stop_time
        self._name = path.stem if name is None else name
        self._message = ""  #: the last that the FMU has logged
        self._worst = 0  #: status of the calls that have failed
        self._closed = False
        #: The state as marked, before a trial step, and as initialised, of our own FMUs.
        self._state = c_void_p()
        self._before_trial = c_void_p()
        self._start = None
        self._key: Hashable = None  #: what the instance was made of, of those of `of`
        #: Parameters by how FMPy sets them and by value reference.
        self._parameters: dict[str, dict[int, Value]] = {}
        #: Returns ``kind(fmu, *arguments)``, made once: as an instance is kept, so are the calls bound for it.
        self.once = cache(self._made)
        self._slave: Any = self._load()
        try:
            for parameter, value in parameters.items():
                self._give(parameter, value)
            self._initialise(start_time)
            if self._own:
                self._start = self._asked("cannot save the state", self._slave.getFMUState)
        except BaseException:
            self.close()
            raise

    def _load(self) -> Any:
        if not self.path.is_file():
            remedy = "; ./build.sh fmus builds it, SPRINGBEAM_FMUS names another folder" if self._own else ""
            what = "a directory; an FMU is a file, its ZIP archive" if self.path.is_dir() else "not found"
            raise FmuError(f"{self.path}: {what}{remedy}")
        description, library = opened(self.path, self.path.stat().st_mtime_ns, _fatal[self.path])
        identifier = description.coSimulation.modelIdentifier
        if self._own and identifier != self._name:
            raise FmuError(f"{self.path}: model identifier {identifier!r}, expected {self._name!r}")
        #: What it says it can do, and the version of FMI.
        self.says = description.coSimulation
        self.version = library.VERSION
        self._variables = {v.name: v for v in description.modelVariables}
        self._units = {unit.name: unit for unit in description.unitDefinitions}
        clocks = [v.name for v in description.modelVariables if v.causality == "independent"]
        #: The unit of its time.
        self.time_unit = self.unit(clocks[0], "time") if clocks else Unit()
        try:
            return library.instance(self._name, self._log, not self._own)
        except Exception as error:  # FMPy's own have no other type
            raise FmuError(f"{self.path}: cannot be instantiated: {self._cause(error)}") from error

    def _made(self, kind: Callable[..., _T], *arguments: Any) -> _T:
        return kind(self, *arguments)

    def _asked(self, what: str, function: Callable[..., _T], *arguments: Any) -> _T:
        """Return what ``function`` does; FmuError names ``what`` the FMU cannot do if that fails, or is missing."""
        try:
            return function(*arguments)
        except FMICallException as error:
            raise self.failed(error.status, what) from None
        except OSError as error:
            raise FmuError(f"{self.path}: {what}: {error}") from None

    def _give(self, name: str, value: Value) -> None:
        """Note the value of a parameter or a start value. Raises FmuError if it cannot be set."""
        variable = self.variable(name)
        if variable.variability == "constant":
            raise FmuError(f"{self.path}: variable {name!r} is constant, not a parameter")
        if variable.causality not in ("parameter", "input") and variable.initial not in ("exact", "approx"):
            raise FmuError(f"{self.path}: variable {name!r} is {variable.causality}, not a parameter")
        kind = self._slave.ENUMERATION if variable.type == "Enumeration" else variable.type
        if not self._slave.holds(kind, value):
            raise FmuError(f"{self.path}: {name} = {value!r}: variable {name!r} is {variable.type} and cannot be that")
        self._parameters.setdefault(f"set{kind}", {})[self._references([name], variable.type)[0]] = value

    def _initialise(self, time: float) -> None:
        """Set parameters and start values and leave initialization mode at ``time`` [s]."""

        def set_parameters() -> None:
            for setter, given in self._parameters.items():
                getattr(self._slave, setter)(list(given), list(given.values()))

        second = self.time_unit.factor
        end = None if self._stop_time is None else self._stop_time / second
        self._asked("cannot be initialised", self._slave.initialise, time / second, end, set_parameters)

    # -- calls bound to their arguments --------------------------------------------------------------------------------

    def _function(self, name: str) -> Any:
        """Return a pointer of our own to a function, without types. Raises FmuError if the library lacks it."""
        return self._asked("cannot be used", self._slave.dll.__getitem__, self._slave.PREFIX + name)

    def bound(self, name: str, *arguments: Any) -> Call:
        """Return a function with its arguments, which are converted once; those by `byref` keep their address.

        Raises FmuError if the library lacks it.
        """
        function = self._function(name)
        function.restype = c_int
        return partial(function, c_void_p.from_param(self._slave.component), *arguments)

    def of_state(self, *, of_trial: bool = False) -> tuple[Call, Call]:
        """Return the functions that save and restore the state: that of the mark, or that before a trial step."""
        name = self._slave.STATE
        state = self._before_trial if of_trial else self._state
        return self.bound(f"Get{name}", byref(state)), self.bound(f"Set{name}", state)

    def reading(self, names: Sequence[str], size: int = 1) -> Callable[[], tuple[float, ...]]:
        """Return a function that reads variables of ``size`` real numbers each; it has read them once.

        The arguments are converted to C once. Raises FmuError for a variable that cannot be read.
        """
        values = (c_double * (len(names) * size))()
        references = self._references(names, self._slave.REAL, size)
        counts = [c_size_t.from_param(n) for n in (len(references), len(values))]
        last = counts[1:] if self._slave.COUNTED else []
        read = self.bound(f"Get{self._slave.REAL}", byref(references), counts[0], byref(values), *last)
        unpacked = partial(Struct(f"{len(values)}d").unpack, values)

        def reported() -> tuple[float, ...]:
            if (status := read()) > WARNING:
                raise self.failed(status, f"cannot read {', '.join(names)}")
            return unpacked()

        reported()
        return reported

    def write(self, values: Mapping[str, float]) -> None:
        """Set real inputs by name, between two steps."""
        kind = self._slave.REAL
        setter = getattr(self._slave, f"set{kind}")
        self._asked(f"cannot set {', '.join(values)}", setter, self._references([*values], kind), [*values.values()])

    def advancing(
        self,
        inputs: Sequence[str],
        impulse: Sequence[str],
        slopes: int,
        outputs: Sequence[str],
        always: bool,
        units: Mapping[str, float],
    ) -> tuple[Call, Any, Any]:
        """Return a function that makes an advance, and the C arrays of its arguments and of its results.

        Arguments are time, size, the inputs, the ``impulse`` if it has one, and derivatives 1 … ``slopes`` of each
        input, one input after another, all in SI units; ``units`` are those of variables that have others. An advance
        returns 0 or a `Failure`.
        """
        slave = self._slave
        each = [(name, order) for name in inputs for order in range(1, slopes + 1)]
        derivatives = [slave.DERIVATIVES[order - 1].format(name) for name, order in each]
        named = {"set": f"Set{slave.REAL}", "step": "DoStep", "get": f"Get{slave.REAL}"}
        if each:
            named["set_derivatives"] = slave.SET_DERIVATIVES
        of_inputs, of_derivatives, of_outputs = (
            self._references(names, slave.REAL) for names in ((*inputs, *impulse), derivatives, outputs)
        )
        second = self.time_unit.factor
        of_given = [second, second, *(units.get(name, 1.0) for name in (*inputs, *impulse))]
        of_given += [units.get(name, 1.0) / second**order for name, order in each]
        given = (c_double * len(of_given))()
        reported = (c_double * len(outputs))()
        advance = Advance(
            slave.component, n_inputs=len(of_inputs), n_derivatives=len(each), n_outputs=len(outputs), inputs=of_inputs,
            derivatives=of_derivatives, outputs=of_outputs, orders=(c_int * len(each))(*[order for _, order in each]),
            units_given=(c_double * len(given))(*of_given), given=given, reported=reported, always=always,
            units_reported=(c_double * len(outputs))(*[units.get(name, 1.0) for name in outputs]),
            **{key: cast(self._function(name), c_void_p) for key, name in named.items()},
        )  # fmt: skip
        library = self._asked("cannot be used", advances)
        return partial(library[f"advance{self.version[0]}"], byref(advance)), given, reported

    @property
    def variables(self) -> list[Any]:
        """Descriptions of the variables of the FMU."""
        return list(self._variables.values())

    def unit(self, name: str, key: str) -> Unit:
        """Return the unit of a variable that is a scene's ``key``. Raises FmuError if it is none, or not known."""
        variable = self.variable(name)
        declared = variable.unit or (variable.declaredType and variable.declaredType.unit)
        try:
            return unit_of(key, declared, self._units.get(declared))
        except ValueError as error:
            raise FmuError(f"{self.path}: variable {name!r} {error}; it is the scene's {key}") from None

    def variable(self, name: str) -> Any:
        """Return the description of a variable. Raises FmuError if there is none of this name."""
        try:
            return self._variables[name]
        except KeyError:
            close = difflib.get_close_matches(name, self._variables, n=1)
            meant = f"; did you mean {close[0]!r}?" if close else ""
            raise FmuError(f"{self.path}: has no variable {name!r}{meant}") from None

    def real(self, name: str) -> Any:
        """Return the description of a real variable. Raises FmuError if it is of another type."""
        self._references([name], self._slave.REAL)
        return self.variable(name)

    def _references(self, names: Sequence[str], kind: str, size: int = 1) -> Any:
        """Return value references of variables of one type and size, as an array of C. Raises FmuError."""
        for name in names:
            if (variable := self.variable(name)).type != kind:
                raise FmuError(f"{self.path}: variable {name!r} is {variable.type}, expected {kind}")
            if prod(variable.shape or ()) != size:
                raise FmuError(f"{self.path}: variable {name!r} is an array; only single numbers can be used")
        return (c_uint * len(names))(*[int(self.variable(name).valueReference) for name in names])

    # -- errors --------------------------------------------------------------------------------------------------------

    def refuse(self, status: int, time: float, otherwise: str = "") -> NoReturn:
        """Raise StepRefused, or FmuError, for a step from ``time`` [s] that has returned ``status``."""
        if status not in (DISCARD, ERROR):
            raise self.failed(status, f"cannot step at t = {time * self.time_unit.factor:.9g} s")
        self._worst = max(self._worst, status)
        cause = self._cause(otherwise or f"{self._slave.PREFIX}DoStep returned {_STATUS[status]}")
        # Also after fmi2Error a saved state may be restored and the step tried again (FMI 2.0.4, section 2.1.3).
        raise StepRefused(f"{self._name}: {cause}")

    def failed(self, status: int, what: str) -> FmuError:
        """Return the error of a call that returned ``status``, with what the FMU has logged."""
        self._worst = max(self._worst, status)
        return FmuError(f"{self.path}: {what}: {self._cause(f'it returned {_STATUS[status]}')}")

    def _log(self, status: int, text: bytes | None) -> None:
        if status > 0:
            self._message = " ".join((text or b"").decode("utf-8", "replace").split())

    def _cause(self, otherwise: Exception | str) -> str:
        message = self._message
        self._message = ""
        return message or str(otherwise)

    # -- its state, and how long it lives ------------------------------------------------------------------------------

    @classmethod
    def of(cls, name: str, parameters: Mapping[str, Value], start_time: float) -> Fmu:
        """Return an instance of our FMU ``name``, new or given back; both step to the same bits. Raises FmuError."""
        path = own_fmu(name)
        key = (path, path.stat().st_mtime_ns if path.is_file() else None, start_time, *parameters.items())
        if (fmu := _kept.pop(key, None)) is None:
            fmu = cls(name, path, parameters, start_time)
            fmu._key = key
            return fmu
        fmu._message = ""
        try:
            fmu._asked("cannot restore the state", fmu._slave.setFMUState, fmu._start)
        except FmuError:
            fmu.close()
            raise
        return fmu

    @property
    def faultless(self) -> bool:
        """Whether every call so far has succeeded."""
        return not self._closed and self._worst <= WARNING

    def give_back(self) -> None:
        """Keep one of `of` for a later run, as making it takes longer than a short run; close it after a fault."""
        if not self.faultless:
            self.close()
            return
        _kept[self._key] = self
        while len(_kept) > MOST_KEPT:
            _kept.pop(next(iter(_kept))).close()

    def close(self) -> None:
        """Free the instance, unless it has returned fmi2Fatal: then none of its library may be called again."""
        if self._closed:
            return
        self._closed = True
        for state in (self._state, self._before_trial, self._start):
            if state and self._worst < FATAL:
                with suppress(FmuError):
                    self._asked("cannot free a state", self._slave.freeFMUState, state)
        if self._worst == FATAL:
            _fatal[self.path] += 1
        else:
            with suppress(OSError):
                self._slave.freeInstance()


#: Most instances that are kept: those of two scenes.
MOST_KEPT = 4
#: Returned instances, by their name and parameters; the last one was returned last.
_kept: dict[Hashable, Fmu] = {}


@atexit.register
def release() -> None:
    """Free the instances that are kept."""
    while _kept:
        _kept.popitem()[1].close()
