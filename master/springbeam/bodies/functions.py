"""Load FMUs of FMI 2.0 and 3.0 by FMPy, and make the calls of each step. Only this module and `fmu` import FMPy.

FMPy does what is done once. It looks at each argument of each call, which takes as long as the call: what a step calls
is bound to its arguments here, and `advance.cpp` makes the calls of one advance together.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from copy import copy
from ctypes import CDLL, POINTER, Structure, byref, c_double, c_int, c_size_t, c_uint, c_void_p, cast
from enum import IntEnum
from functools import cache, partial
from pathlib import Path
from typing import Any, ClassVar

from fmpy import fmi2, fmi3
from fmpy.model_description import ModelDescription
from typing_extensions import Self

#: Values of fmi2Status and fmi3Status.
OK, WARNING, DISCARD, ERROR, FATAL = 0, 1, 2, 3, 4
#: A function with its arguments, which returns its status.
Call = Callable[[], int]
#: Takes the status and the text of a message of an FMU.
Log = Callable[[int, bytes | None], None]


class Failure(IntEnum):
    """What went wrong in an advance, as `advance.cpp` counts it."""

    INPUTS_NOT_FINITE = 1
    SET = 2
    SET_DERIVATIVES = 3
    STEP = 4
    GET = 5
    OUTPUTS_NOT_FINITE = 6
    ENDS = 7  #: this and the next two: what fmi3DoStep has told beside its status
    EARLY = 8
    EVENT = 9

    @classmethod
    def of(cls, code: int) -> tuple[Failure, int]:
        """Return what went wrong, and the status of the call that did."""
        what, status = divmod(code, 16)
        return cls(what), status


class Advance(Structure):
    """The calls of an advance with their arguments, as `advance.cpp` has them.

    ``given`` are time, size [s], inputs and their derivatives; derivatives that are all 0 are set only ``always``.
    """

    _fields_ = (
        *((name, c_void_p) for name in ("instance", "set", "set_derivatives", "step", "get")),
        *((name, c_size_t) for name in ("n_inputs", "n_derivatives", "n_outputs")),
        *((name, POINTER(c_uint)) for name in ("inputs", "derivatives", "outputs")),
        ("orders", POINTER(c_int)),
        *((name, POINTER(c_double)) for name in ("given", "told")),
        ("always", c_int),
    )


@cache
def _advancing() -> CDLL:
    """Load what `advance.cpp` is compiled to. Raises OSError."""
    suffix = {"win32": "dll", "darwin": "dylib"}.get(sys.platform, "so")
    path = Path(__file__).with_name(f"advance.{suffix}")
    if not path.is_file():
        raise OSError(f"{path} is missing; ./build.sh fmus builds it")
    return CDLL(str(path))


class Library(CDLL):
    """The library of an FMU; a function that it lacks is missed when it is called, for many lack what no run needs."""

    def __getitem__(self, name: str) -> Any:
        try:
            return super().__getitem__(name)
        except AttributeError:
            raise OSError(f"its library lacks {name}; export it with a tool that follows the standard") from None

    def __getattr__(self, name: str) -> Any:
        try:
            return super().__getattr__(name)
        except OSError:
            return lambda *_: self[name]


class Slave:
    """An FMU whose library is loaded, once in a process, beside FMPy's class of its version; `instance` makes one.

    Parameters
    ----------
    description, folder
        Of the FMU, and where it is unpacked.

    Raises whatever FMPy does if the library cannot be loaded.
    """

    TYPES: ClassVar[Any]  #: FMPy's module with the types of C
    VERSION: ClassVar[str]
    PREFIX: ClassVar[str]
    REAL: ClassVar[str]  #: the type of the variables of a motion
    SET_DERIVATIVES: ClassVar[str]  #: the function that sets derivatives of inputs
    make: Callable[[], None]
    component: Any
    dll: Any
    instanceName: str
    _log: Log

    def __init__(self, description: ModelDescription, folder: Path) -> None:
        identifier, here = description.coSimulation.modelIdentifier, Path.cwd()
        given = {"guid": description.guid, "modelIdentifier": identifier, "unzipDirectory": str(folder)}
        try:
            super().__init__(**given)
        finally:
            os.chdir(here)  # FMPy stays in the folder of a library that cannot be loaded

    def instance(self, name: str, log: Log) -> Self:
        """Return an instance, whose messages ``log`` takes. Raises whatever FMPy does if the FMU makes none."""
        made = copy(self)
        made.instanceName, made._log = name, log
        made.make()
        return made

    def freeLibrary(self) -> None:
        """Keep the library for the next instance."""

    def _loadFunctions(self) -> None:
        self.dll = Library(self.dll._name, handle=self.dll._handle)
        super()._loadFunctions()  # type: ignore[misc]

    def holds(self, kind: str, value: Any) -> bool:
        """Return whether a variable of the type ``kind`` can have this value."""
        if isinstance(value, str) or kind == "String":
            return isinstance(value, str) and kind == "String"
        try:
            held = getattr(self.TYPES, f"{self.PREFIX}{kind}")(value).value
        except (TypeError, OverflowError):
            return False
        return isinstance(held, float) or held == value

    def bound(self, name: str, *arguments: Any) -> Call:
        """Return a function with its arguments, which are converted once. Raises OSError if the library lacks it.

        This is a pointer of our own to the function, without types; what is given by `byref` stays where it is.
        """
        function = self.dll[self.PREFIX + name]
        function.restype = c_int
        return partial(function, c_void_p.from_param(self.component), *arguments)

    def accessor(self, verb: str, references: Any, values: Any) -> Call:
        """Return what gets or sets (``verb`` "Get", "Set") real variables, by arrays of C."""
        return self.bound(verb + self.REAL, byref(references), c_size_t.from_param(len(references)), byref(values))

    def advancing(self, inputs: Any, derivatives: Any, orders: Any, outputs: Any, always: bool) -> tuple[Any, ...]:
        """Return what makes an advance, and the arrays of C from which it takes what is ``given`` and ``told``.

        It returns 0, or what `Failure.of` reads; the other arguments are those of `Advance`, as arrays of C. Raises
        OSError if the library lacks a function.
        """
        names = {"set": "Set" + self.REAL, "step": "DoStep", "get": "Get" + self.REAL}
        if len(derivatives):
            names["set_derivatives"] = self.SET_DERIVATIVES
        functions = {key: cast(self.dll[self.PREFIX + name], c_void_p) for key, name in names.items()}
        given, told = (c_double * (2 + len(inputs) + len(derivatives)))(), (c_double * len(outputs))()
        advance = Advance(
            self.component, n_inputs=len(inputs), n_derivatives=len(derivatives), n_outputs=len(outputs), inputs=inputs,
            derivatives=derivatives, outputs=outputs, orders=orders, given=given, told=told, always=always, **functions,
        )  # fmt: skip
        return partial(_advancing()[f"advance{self.VERSION[0]}"], byref(advance)), given, told


class FMU2(Slave, fmi2.FMU2Slave):  # type: ignore[misc]
    """An FMU of FMI 2.0."""

    TYPES, VERSION, PREFIX, REAL, ENUMERATION, STATE = fmi2, "2.0", "fmi2", "Real", "Integer", "FMUstate"
    SET_DERIVATIVES = "SetRealInputDerivatives"

    def make(self) -> None:
        """Instantiate the FMU."""
        callbacks = fmi2.fmi2CallbackFunctions()
        callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(lambda _1, _2, status, _3, text: self._log(status, text))
        callbacks.allocateMemory = fmi2.defaultCallbacks.allocateMemory
        callbacks.freeMemory = fmi2.defaultCallbacks.freeMemory
        self.instantiate(callbacks=callbacks)

    def initialise(self, time: float, parameters: Callable[[], None]) -> None:
        """Bring a new instance to its first step at ``time`` [s]; ``parameters`` sets them."""
        self.setupExperiment(startTime=time)
        parameters()
        self.enterInitializationMode()
        self.exitInitializationMode()


class FMU3(Slave, fmi3.FMU3Slave):  # type: ignore[misc]
    """An FMU of FMI 3.0: events stay inside it, and a step goes to its end.

    Inputs are held over a step, but for those of our FMUs, whose derivatives are inputs.
    """

    TYPES, VERSION, PREFIX, REAL, ENUMERATION, STATE = fmi3, "3.0", "fmi3", "Float64", "Int64", "FMUState"
    SET_DERIVATIVES = "SetFloat64"

    def make(self) -> None:
        self.instantiate(logMessage=lambda _environment, status, _category, text: self._log(status, text))

    def initialise(self, time: float, parameters: Callable[[], None]) -> None:
        parameters()
        self.enterInitializationMode(startTime=time)
        self.exitInitializationMode()

    def accessor(self, verb: str, references: Any, values: Any) -> Call:
        accessor: Any = super().accessor(verb, references, values)
        return partial(accessor, c_size_t.from_param(len(values)))


#: The versions of FMI that are known.
VERSIONS: dict[str, Any] = {version.VERSION: version for version in (FMU2, FMU3)}
