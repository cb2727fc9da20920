"""The libraries of FMUs of FMI 2.0 and 3.0, loaded by FMPy, and the differences of the versions.

Only this module and `fmu` import FMPy.
"""

from __future__ import annotations

import atexit
import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from copy import copy
from ctypes import CDLL, POINTER, Structure, byref, c_double, c_int, c_size_t, c_uint, c_void_p
from enum import IntEnum
from functools import cache, lru_cache
from itertools import count
from pathlib import Path
from typing import Any, ClassVar, NoReturn
from xml.parsers import expat

from fmpy import fmi2, fmi3, platform, platform_tuple
from fmpy.logging import addLoggerProxy
from fmpy.model_description import ModelDescription, read_model_description
from typing_extensions import Self

from .archive import UnsafeArchive, unpack
from .protocol import FmuError

#: Values of fmi2Status and fmi3Status.
OK = 0
WARNING = 1
DISCARD = 2
ERROR = 3
FATAL = 4
#: Takes the status and the text of a message of an FMU.
Log = Callable[[int, bytes | None], None]
#: Folders of the binaries that can be loaded here, by FMI 2.0 and 3.0.
PLATFORMS = (platform, platform_tuple)


#: Errors of an advance: `advance.cpp` returns 16 times these + the status of the call. The last three are requests of
#: fmi3DoStep.
Failure = IntEnum("Failure", "INPUTS_NOT_FINITE SET SET_DERIVATIVES STEP GET OUTPUTS_NOT_FINITE ENDS EARLY EVENT")


class Advance(Structure):
    """The calls of an advance with their arguments, as `advance.cpp` has them.

    ``given`` are time, size [s], inputs and their derivatives; derivatives that are all 0 are set only ``always``.
    """

    _fields_ = (
        *((name, c_void_p) for name in ("instance", "set", "set_derivatives", "step", "get")),
        *((name, c_size_t) for name in ("n_inputs", "n_derivatives", "n_outputs")),
        *((name, POINTER(c_uint)) for name in ("inputs", "derivatives", "outputs")),
        ("orders", POINTER(c_int)),
        *((name, POINTER(c_double)) for name in ("units_given", "units_reported", "given", "reported")),
        ("always", c_int),
    )


@cache
def advances() -> CDLL:
    """Load the library of `advance.cpp`. Raises OSError."""
    suffix = {"win32": "dll", "darwin": "dylib"}.get(sys.platform, "so")
    path = Path(__file__).with_name(f"advance.{suffix}")
    if not path.is_file():
        raise OSError(f"{path} is missing; ./build.sh fmus builds it")
    return CDLL(str(path))


class Library(CDLL):
    """The library of an FMU. A missing function is an error only when it is called; no run needs all of them."""

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
    """An FMU with its library, loaded once in a process, and FMPy's class of its version; `instance` makes one."""

    TYPES: ClassVar[Any]  #: FMPy's module with the types of C
    VERSION: ClassVar[str]
    PREFIX: ClassVar[str]
    REAL: ClassVar[str]  #: the type of the variables of a motion
    make: Callable[[Log, bool], None]
    dll: Any
    instanceName: str

    def instance(self, name: str, log: Log, verbose: bool) -> Self:
        """Return an instance, whose messages ``log`` takes. Raises whatever FMPy does if the FMU makes none.

        ``verbose`` turns its debug logging on, without which PythonFMU does not log what an exception says.
        """
        slave = copy(self)
        slave.instanceName = name
        slave.make(log, verbose)
        return slave

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


#: Numbers of the instances of FMI 2.0, by which each of their messages finds who takes it.
_NUMBERS = count(1)
_LOGS = dict[int, Log]()


def _number_of(name: bytes | None) -> int:
    """Return the number at the end of an instance's name; 0 if it is none of ours."""
    start, _, number = (name or b"").rpartition(b" #")
    return int(number) if start and number.isdigit() else 0


@cache
def _logger() -> Any:
    """Return callbacks whose logger expands messages as printf does.

    FMPy has one such function in a process, so it is also one that takes what it has expanded, for all instances.
    """

    def take(environment: int | None, name: bytes, status: int, category: bytes, text: bytes | None) -> None:
        # An FMU may forget its environment: then its name says which it is.
        if log := _LOGS.get(environment or _number_of(name)):
            log(status, text)
        elif text is not None:  # an instance that somebody else made with FMPy in this process
            fmi2.printLogMessage(environment, name, status, category, text)

    callbacks = fmi2.fmi2CallbackFunctions()
    callbacks.taking = callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(take)  # kept, for the proxy takes its place
    addLoggerProxy(byref(callbacks))
    return callbacks


class FMU2(Slave, fmi2.FMU2Slave):  # type: ignore[misc]
    """An FMU of FMI 2.0."""

    TYPES = fmi2
    VERSION = "2.0"
    PREFIX = "fmi2"
    REAL = "Real"
    ENUMERATION = "Integer"
    STATE = "FMUstate"
    #: The function that sets derivatives of inputs, what it calls those of order 1 and 2, and whether the functions
    #: that get and set also receive the number of values.
    SET_DERIVATIVES = "SetRealInputDerivatives"
    DERIVATIVES = ("{}", "{}")
    COUNTED = False

    def make(self, log: Log, verbose: bool) -> None:
        """Instantiate the FMU."""
        self._number = next(_NUMBERS)
        self.instanceName += f" #{self._number}"
        _LOGS[self._number] = log
        callbacks = fmi2.fmi2CallbackFunctions()
        callbacks.logger = _logger().logger
        callbacks.allocateMemory = fmi2.defaultCallbacks.allocateMemory
        callbacks.freeMemory = fmi2.defaultCallbacks.freeMemory
        callbacks.componentEnvironment = self._number
        self.instantiate(callbacks=callbacks, loggingOn=verbose)

    def freeInstance(self) -> None:
        super().freeInstance()
        del _LOGS[self._number]

    def initialise(self, time: float, end: float | None, parameters: Callable[[], None]) -> None:
        """Bring a new instance to its first step at ``time``; ``parameters`` sets them, ``end`` is its stop time."""
        self.setupExperiment(startTime=time, stopTime=end)
        parameters()
        self.enterInitializationMode()
        self.exitInitializationMode()


class FMU3(Slave, fmi3.FMU3Slave):  # type: ignore[misc]
    """An FMU of FMI 3.0: events stay inside it, and a step goes to its end.

    Inputs are held over a step, but for those of our FMUs, whose derivatives are inputs.
    """

    TYPES = fmi3
    VERSION = "3.0"
    PREFIX = "fmi3"
    REAL = "Float64"
    ENUMERATION = "Int64"
    STATE = "FMUState"
    SET_DERIVATIVES = "SetFloat64"
    DERIVATIVES = ("der({})", "der({},2)")
    COUNTED = True

    def make(self, log: Log, verbose: bool) -> None:
        self.instantiate(loggingOn=verbose, logMessage=lambda _environment, status, _category, text: log(status, text))

    def initialise(self, time: float, end: float | None, parameters: Callable[[], None]) -> None:
        parameters()
        self.enterInitializationMode(startTime=time, stopTime=end)
        self.exitInitializationMode()


#: The versions of FMI that are known.
VERSIONS: dict[str, Any] = {version.VERSION: version for version in (FMU2, FMU3)}


# -- loaded ------------------------------------------------------------------------------------------------------------


@lru_cache(maxsize=8)
def opened(path: Path, modified: int, fatal: int) -> tuple[ModelDescription, FMU2 | FMU3]:
    """Return the description of the FMU at ``path``, and its library. Raises FmuError.

    After ``fatal`` instances the library is another copy, because theirs must not be called again.
    """
    folder = Path(tempfile.mkdtemp(prefix="springbeam-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    try:
        unpack(path, folder, PLATFORMS)
        description = _description(folder)
        version = VERSIONS.get(description.fmiVersion)
        if description.coSimulation is None or version is None:
            kind = "co-simulation" if description.coSimulation else "model exchange"
            raise ValueError(
                f"it is for {kind} of FMI {description.fmiVersion}; export it for co-simulation, as FMI "
                f"{' or '.join(VERSIONS)}"
            )
        identifier = description.coSimulation.modelIdentifier
        with _back_again(folder):
            library = version(guid=description.guid, modelIdentifier=identifier, unzipDirectory=str(folder))
        return description, library
    except Exception as error:  # FMPy raises bare Exceptions for whatever is wrong with an archive
        raise FmuError(f"{path}: not a usable FMU: {' '.join(str(error).split())}") from error
    finally:
        if not (folder / "resources").exists():  # what is loaded needs no file any more
            shutil.rmtree(folder, ignore_errors=True)


def _description(folder: Path) -> ModelDescription:
    """Return the description in ``folder``; raise an error if it is invalid.

    UnsafeArchive if it has a document type: its entities may name files; FMI's schema has none.
    """
    path = folder / "modelDescription.xml"

    def refuse(*_: Any) -> NoReturn:
        raise UnsafeArchive("modelDescription.xml: a document type declaration is not part of an FMU")

    parser = expat.ParserCreate()  # which knows the encodings that a file may have
    parser.StartDoctypeDeclHandler = refuse
    try:
        parser.Parse(path.read_bytes(), True)
    except expat.ExpatError as error:
        raise ValueError(f"modelDescription.xml is not XML: {error}") from error
    return read_model_description(str(folder))


@contextmanager
def _back_again(folder: Path) -> Iterator[None]:
    """Return to the working directory in the end, even to one that has been removed; begin in ``folder``.

    FMPy asks for its name, which one that has been removed lacks, and stays in the folder of a library that cannot be
    loaded.
    """
    here = os.open(".", os.O_RDONLY) if os.chdir in os.supports_fd else os.getcwd()
    try:
        os.chdir(folder)
        yield
    finally:
        os.chdir(here)
        if isinstance(here, int):
            os.close(here)
