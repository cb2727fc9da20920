"""The C functions of one instance of an FMU, in FMI 2.0 and in FMI 3.0; with `fmu`, all that imports FMPy.

Both versions do the same by other names and arguments, and here is all that differs: names are those of FMI 3.0, and
`Fmi2` knows what FMI 2.0 calls them. FMUs often lack functions that the standard asks for. Those that a run needs are
looked for at once, the others when they are called.
"""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable, Sequence
from ctypes import Array, byref, c_bool, c_char_p, c_double, c_int, c_size_t, c_void_p, cdll
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

from fmpy import freeLibrary, platform, platform_tuple, sharedLibraryExtension
from fmpy.fmi2 import defaultCallbacks, fmi2CallbackFunctions, fmi2CallbackLoggerTYPE, fmi2LastSuccessfulTime
from fmpy.fmi3 import fmi3IntermediateUpdateCallback, fmi3LogMessageCallback
from fmpy.model_description import ModelDescription

from .protocol import FmuError

#: Values of fmi2Status and fmi3Status.
WARNING, DISCARD, ERROR, FATAL = 1, 2, 3, 4
#: A function with its arguments, which returns its status.
Call = Callable[[], int]
_NUMBER, _WHOLE, _YES_OR_NO, _TEXT = (int, float), (int,), (bool, int), (str,)


class Kind(NamedTuple):
    """A type of variables."""

    function: str  #: what it is called in the functions that get and set it
    ctype: Any
    taken: tuple[type, ...]  #: of the values that it takes


class Functions:
    """The functions of an instance, which is made here.

    Parameters
    ----------
    description, folder
        Of the FMU, and where it is unpacked.
    name
        Of the instance.
    log
        Takes the status and the text of each message.

    Raises
    ------
    OSError
        If the library cannot be loaded, lacks a function that is needed, or makes no instance.
    """

    VERSION: ClassVar[str]
    PREFIX: ClassVar[str]
    FOLDER: ClassVar[str]  #: of the libraries of this platform
    REAL: ClassVar[str]  #: the kind of the variables of a motion
    KINDS: ClassVar[dict[str, Kind]]
    NEEDED: ClassVar[tuple[str, ...]] = ("FreeInstance", "EnterInitializationMode", "ExitInitializationMode", "DoStep")

    def __init__(self, description: ModelDescription, folder: Path, name: str, log: Callable[[int, str], None]) -> None:
        says = description.coSimulation
        self._log = log
        self._reached = c_double()
        path = folder / "binaries" / self.FOLDER / f"{says.modelIdentifier}{sharedLibraryExtension}"
        if not path.is_file():
            raise OSError(f"it has no binary for this platform, {path.relative_to(folder)}")
        self._library = cdll.LoadLibrary(str(path))
        if missing := [function for function in self._needed(says) if not hasattr(self._library, function)]:
            raise OSError(f"its library lacks {', '.join(missing)}; export it with a tool that follows the standard")
        self._instance = c_void_p(self._instantiate(description, folder, name))
        if not self._instance:
            raise OSError(f"{self.PREFIX}Instantiate made no instance")

    def _instantiate(self, description: ModelDescription, folder: Path, name: str) -> int | None:
        raise NotImplementedError

    def _needed(self, says: Any) -> list[str]:
        """Return the names of functions without which what the FMU ``says`` it can do cannot be had."""
        real = self.KINDS[self.REAL].function
        names = [*self.NEEDED, f"Get{real}", f"Set{real}"]
        if says.canGetAndSetFMUstate:
            names += ["GetFMUState", "SetFMUState", "FreeFMUState"]
        if says.canGetAndSetFMUstate and says.canSerializeFMUstate:
            names += ["SerializedFMUStateSize", "SerializeFMUState", "DeserializeFMUState"]
        if says.canInterpolateInputs:
            names.append("SetRealInputDerivatives")
        return [self.spelt(name) for name in names]

    def _said(self, status: int, text: bytes | None) -> None:
        self._log(status, (text or b"").decode("utf-8", "replace"))

    def spelt(self, name: str) -> str:
        """Return what this version calls a function of FMI 3.0."""
        return self.PREFIX + name

    def prepared(self, name: str, *arguments: Any) -> Call:
        """Return a function with its arguments, which are converted to C once.

        A pointer of our own to the function, without types: to convert and check arguments at each call costs as much
        as the call. An array stays where it is and a whole number what it is, so ctypes need not look at them again.
        """
        try:
            function = self._library[self.spelt(name)]
        except AttributeError:
            raise FmuError(f"its library lacks {self.spelt(name)}") from None
        function.restype = c_int
        fixed = (
            byref(argument)
            if isinstance(argument, Array)
            else type(argument).from_param(argument.value)
            if isinstance(argument, (c_int, c_size_t))
            else argument
            for argument in arguments
        )
        return partial(function, c_void_p.from_param(self._instance.value), *fixed)

    def accessor(self, verb: str, kind: str, references: Any, values: Any, n_values: int) -> Call:
        """Return what gets or sets (``verb`` "Get", "Set") variables of one kind, by arrays of C."""
        return self.prepared(verb + self.KINDS[kind].function, references, c_size_t(len(references)), values)

    def input_derivatives(
        self, each: Sequence[tuple[str, int]], references: Callable[[Sequence[str], str], Any], values: Any
    ) -> Call:
        """Return what sets derivatives of inputs, by name and order, over the next step."""
        raise NotImplementedError

    def initialising(self, time: c_double, given: Sequence[Call]) -> list[Call]:
        """Return the calls that bring a new instance to its first step at ``time``; ``given`` set its parameters."""
        raise NotImplementedError

    def stepping(self, time: c_double, size: c_double) -> Call:
        """Return what makes a step; a step that does not come to its end is discarded."""
        raise NotImplementedError

    def reached(self) -> tuple[int, float]:
        """Return how far a step came that was discarded [s], after the status of the question."""
        raise NotImplementedError

    def free(self) -> None:
        """Free the instance and its library."""
        function = self._library[f"{self.PREFIX}FreeInstance"]
        function.restype = None
        function(self._instance)
        freeLibrary(self._library._handle)


class Fmi2(Functions):
    """FMI 2.0."""

    VERSION, PREFIX, FOLDER, REAL = "2.0", "fmi2", platform, "Real"
    KINDS: ClassVar = {
        "Real": Kind("Real", c_double, _NUMBER),
        "Integer": Kind("Integer", c_int, _WHOLE),
        "Enumeration": Kind("Integer", c_int, _WHOLE),
        "Boolean": Kind("Boolean", c_int, _YES_OR_NO),
        "String": Kind("String", c_char_p, _TEXT),
    }
    NEEDED = ("Instantiate", "SetupExperiment", *Functions.NEEDED)

    def spelt(self, name: str) -> str:
        return super().spelt(name).replace("FMUState", "FMUstate").replace("Deserialize", "DeSerialize")

    def _instantiate(self, description: ModelDescription, folder: Path, name: str) -> int | None:
        # Logger and callbacks must outlive the instance.
        self._logger = fmi2CallbackLoggerTYPE(lambda _1, _2, status, _category, text: self._said(status, text))
        self._callbacks = fmi2CallbackFunctions()
        self._callbacks.logger = self._logger
        self._callbacks.allocateMemory = defaultCallbacks.allocateMemory
        self._callbacks.freeMemory = defaultCallbacks.freeMemory
        instantiate = self._library["fmi2Instantiate"]
        instantiate.restype = c_void_p
        resources, co_simulation, no = (folder / "resources").as_uri(), c_int(1), c_int(0)
        made: int | None = instantiate(
            *(name.encode(), co_simulation, description.guid.encode(), resources.encode()),
            *(byref(self._callbacks), no, no),
        )
        return made

    def input_derivatives(
        self, each: Sequence[tuple[str, int]], references: Callable[[Sequence[str], str], Any], values: Any
    ) -> Call:
        n = len(each)
        names, orders = [name for name, _ in each], (c_int * n)(*[order for _, order in each])
        return self.prepared("SetRealInputDerivatives", references(names, self.REAL), c_size_t(n), orders, values)

    def initialising(self, time: c_double, given: Sequence[Call]) -> list[Call]:
        no, nothing = c_int(0), c_double(0.0)
        set_up = self.prepared("SetupExperiment", no, nothing, time, no, nothing)
        enter, leave = self.prepared("EnterInitializationMode"), self.prepared("ExitInitializationMode")
        return [set_up, *given, enter, leave]

    def stepping(self, time: c_double, size: c_double) -> Call:
        return self.prepared("DoStep", time, size, c_int(0))

    def reached(self) -> tuple[int, float]:
        try:
            status = self.prepared("GetRealStatus", c_int(fmi2LastSuccessfulTime), byref(self._reached))()
        except FmuError:
            status = DISCARD
        return status, self._reached.value


class Fmi3(Functions):
    """FMI 3.0: events stay inside the FMU, and a step goes to its end.

    Inputs are held over a step, but for those of our FMUs, whose derivatives are inputs.
    """

    VERSION, PREFIX, FOLDER, REAL = "3.0", "fmi3", platform_tuple, "Float64"
    KINDS: ClassVar = {
        "Float64": Kind("Float64", c_double, _NUMBER),
        "Float32": Kind("Float32", ctypes.c_float, _NUMBER),
        **{
            name: Kind(name, getattr(ctypes, f"c_{name.lower()}"), _WHOLE)
            for name in ("Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64")
        },
        "Enumeration": Kind("Int64", ctypes.c_int64, _WHOLE),
        "Boolean": Kind("Boolean", c_bool, _YES_OR_NO),
        "String": Kind("String", c_char_p, _TEXT),
    }
    NEEDED = ("InstantiateCoSimulation", *Functions.NEEDED)

    def _instantiate(self, description: ModelDescription, folder: Path, name: str) -> int | None:
        self._logger = fmi3LogMessageCallback(lambda _environment, status, _category, text: self._said(status, text))
        instantiate = self._library["fmi3InstantiateCoSimulation"]
        instantiate.restype = c_void_p
        resources, no = str(folder / "resources") + os.sep, c_bool(False)
        visible = logging = event_mode = early_return = no
        made: int | None = instantiate(
            *(name.encode(), description.guid.encode(), resources.encode()),
            *(visible, logging, event_mode, early_return),
            *(None, c_size_t(0), None, self._logger, fmi3IntermediateUpdateCallback()),
        )
        return made

    def accessor(self, verb: str, kind: str, references: Any, values: Any, n_values: int) -> Call:
        n = c_size_t(len(references))
        return self.prepared(verb + self.KINDS[kind].function, references, n, values, c_size_t(n_values))

    def input_derivatives(
        self, each: Sequence[tuple[str, int]], references: Callable[[Sequence[str], str], Any], values: Any
    ) -> Call:
        names = [f"der({name}{f',{order}' if order > 1 else ''})" for name, order in each]
        return self.accessor("Set", self.REAL, references(names, self.REAL), values, len(names))

    def initialising(self, time: c_double, given: Sequence[Call]) -> list[Call]:
        no, nothing = c_bool(False), c_double(0.0)
        enter = self.prepared("EnterInitializationMode", no, nothing, time, no, nothing)
        return [*given, enter, self.prepared("ExitInitializationMode")]

    def stepping(self, time: c_double, size: c_double) -> Call:
        event, end, early = c_bool(), c_bool(), c_bool()
        out = (byref(event), byref(end), byref(early), byref(self._reached))
        call = self.prepared("DoStep", time, size, c_bool(False), *out)

        def step() -> int:
            status = call()
            if status > WARNING:
                return status
            for asked, what in (
                (end, "asks that the simulation end (terminateSimulation)"),
                (early, "returned early, which it was not allowed to (earlyReturn)"),
                (event, "asks for event mode, which it was told is not used (eventHandlingNeeded)"),
            ):
                if asked.value:
                    self._log(DISCARD, f"fmi3DoStep {what}")
                    return DISCARD
            return status

        return step

    def reached(self) -> tuple[int, float]:
        return 0, self._reached.value


#: The versions of FMI that are known.
VERSIONS: dict[str, type[Functions]] = {version.VERSION: version for version in (Fmi2, Fmi3)}
