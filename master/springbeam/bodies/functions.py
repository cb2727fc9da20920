"""Load FMUs of FMI 2.0 and 3.0 by FMPy, and make the calls of each step. Only this module and `fmu` import FMPy.

FMPy does what is done once. It looks at each argument of each call, which takes as long as the call: what a step calls
is bound to its arguments here.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from copy import copy
from ctypes import CDLL, Array, byref, c_bool, c_double, c_int, c_size_t, c_void_p
from functools import partial
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
    PREFIX: ClassVar[str]
    REAL: ClassVar[str]  #: the type of the variables of a motion
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

    def accessor(self, verb: str, references: Any, values: Any, n_values: int) -> Call:
        """Return what gets or sets (``verb`` "Get", "Set") real variables, by arrays of C."""
        there = byref(values) if isinstance(values, Array) else values
        return self.bound(verb + self.REAL, byref(references), c_size_t.from_param(len(references)), there)


class FMU2(Slave, fmi2.FMU2Slave):  # type: ignore[misc]
    """An FMU of FMI 2.0."""

    TYPES, VERSION, PREFIX, REAL, ENUMERATION, STATE = fmi2, "2.0", "fmi2", "Real", "Integer", "FMUstate"

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

    def stepping(self, time: c_double, size: c_double) -> Call:
        """Return what makes a step; a step that does not come to its end is discarded."""
        return self.bound("DoStep", time, size, c_int.from_param(0))


class FMU3(Slave, fmi3.FMU3Slave):  # type: ignore[misc]
    """An FMU of FMI 3.0: events stay inside it, and a step goes to its end.

    Inputs are held over a step, but for those of our FMUs, whose derivatives are inputs.
    """

    TYPES, VERSION, PREFIX, REAL, ENUMERATION, STATE = fmi3, "3.0", "fmi3", "Float64", "Int64", "FMUState"

    def make(self) -> None:
        self.instantiate(logMessage=lambda _environment, status, _category, text: self._log(status, text))

    def initialise(self, time: float, parameters: Callable[[], None]) -> None:
        parameters()
        self.enterInitializationMode(startTime=time)
        self.exitInitializationMode()

    def accessor(self, verb: str, references: Any, values: Any, n_values: int) -> Call:
        accessor: Any = super().accessor(verb, references, values, n_values)
        return partial(accessor, c_size_t.from_param(n_values))

    def stepping(self, time: c_double, size: c_double) -> Call:
        event, end, early, reached = c_bool(), c_bool(), c_bool(), c_double()
        out = (byref(event), byref(end), byref(early), byref(reached))
        call = self.bound("DoStep", time, size, c_bool(False), *out)

        def step() -> int:
            status = call()
            if status > WARNING:
                return status
            for asked, what in (
                (end, b"asks that the simulation end (terminateSimulation)"),
                (early, b"returned early, which it was not allowed to (earlyReturn)"),
                (event, b"asks for event mode, which it was told is not used (eventHandlingNeeded)"),
            ):
                if asked.value:
                    self._log(DISCARD, b"fmi3DoStep " + what)
                    return DISCARD
            return status

        return step


#: The versions of FMI that are known.
VERSIONS: dict[str, Any] = {version.VERSION: version for version in (FMU2, FMU3)}
