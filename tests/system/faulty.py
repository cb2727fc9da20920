"""FMUs that fail on cue: the real ones, with every call of their C functions written down, and one of them faulted.

The script is below the master, in place of the functions of the shared library, so that whatever is called is seen.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import pytest

from springbeam.bodies import functions
from springbeam.run import detection, simulation
from springbeam.run.paper_law import PaperLaw
from springbeam.run.rows import Rows
from springbeam.run.stepping import Pair

OK, WARNING, DISCARD, ERROR, FATAL = range(5)
NAMES = {"Discard": DISCARD, "Error": ERROR, "Fatal": FATAL}
#: FMI 2.0.4, table of section 4.2.4: what is allowed after fmi2Error, until a state is restored or the FMU is reset,
#: and after a step that was discarded.
AFTER_ERROR = {
    *("fmi2GetReal", "fmi2GetInteger", "fmi2GetBoolean", "fmi2GetString"),
    *("fmi2GetFMUstate", "fmi2SetFMUstate", "fmi2FreeFMUstate"),
    *("fmi2SerializedFMUstateSize", "fmi2SerializeFMUstate", "fmi2DeSerializeFMUstate"),
    *("fmi2GetStatus", "fmi2GetRealStatus", "fmi2Reset", "fmi2FreeInstance"),
}
AFTER_DISCARDED_STEP = AFTER_ERROR | {"fmi2Terminate"}
WITHOUT_INSTANCE = {"fmi2GetTypesPlatform", "fmi2GetVersion", "fmi2Instantiate"}


@dataclass
class Fault:
    """From its call after ``skip`` made while the master is at ``where``, ``function`` of ``fmu`` goes wrong."""

    fmu: str
    function: str
    where: str
    kind: str  #: a name of `NAMES`, "raise", "hang", or what is put into the values: "nan", "inf", "1e300"
    once: bool = False
    skip: int = 3
    happened: int = 0

    def after(self, fmu: str, function: str, where: str) -> bool:
        if (fmu, function) != (self.fmu, self.function) or (self.once and self.happened):
            return False
        if not self.happened:
            if where != self.where:
                return False
            if self.skip > 0:
                self.skip -= 1
                return False
        self.happened += 1
        return True


@dataclass
class Script:
    """Calls in their order as (FMU, function, status), and the faults."""

    faults: tuple[Fault, ...] = ()
    calls: list[tuple[str, str, int]] = field(default_factory=list)
    where: str = "start"

    @contextmanager
    def at(self, where: str) -> Iterator[None]:
        before, self.where = self.where, where
        try:
            yield
        finally:
            self.where = before

    def check(self) -> None:
        """Every instance is used as FMI allows, and freed once; but for one that returned fmi2Fatal, never touched."""
        for fmu in ("beam", "spring"):
            allowed: set[str] | None = None
            alive = False
            for name, function, status in self.calls:
                if name != fmu:
                    continue
                if function == "fmi2Instantiate":
                    assert not alive or allowed == set()
                    alive, allowed = True, None
                    continue
                if function in WITHOUT_INSTANCE:
                    continue
                assert alive, f"{function} of {fmu} after it was freed"
                assert allowed is None or function in allowed, f"{function} of {fmu} is not allowed here"
                if function == "fmi2FreeInstance":
                    alive = False
                elif status == FATAL:
                    allowed = set()
                elif status == ERROR:
                    allowed = AFTER_ERROR
                elif status == DISCARD and function == "fmi2DoStep":
                    allowed = AFTER_DISCARDED_STEP
                elif function in ("fmi2SetFMUstate", "fmi2Reset"):
                    allowed = None
            assert alive == (allowed == set()), f"{fmu} was not freed"


def hang() -> None:
    """Call a C function that never returns, not even for a signal: the second lock of a mutex."""
    print("hanging", flush=True)
    library, mutex = ctypes.CDLL(None), ctypes.create_string_buffer(256)
    library.pthread_mutex_init(mutex, None)
    library.pthread_mutex_lock(mutex)
    library.pthread_mutex_lock(mutex)
    raise AssertionError("returned")


class Function:
    """A function of the library."""

    def __init__(self, script: Script, fmu: str, name: str, function: Any) -> None:
        self.__dict__.update(_script=script, _fmu=fmu, _name=name, _function=function)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._function, name)

    def __setattr__(self, name: str, value: Any) -> None:
        setattr(self._function, name, value)

    def __call__(self, *arguments: Any) -> Any:
        script = self._script
        fault = next((f for f in script.faults if f.after(self._fmu, self._name, script.where)), None)
        if fault is None:
            result = self._function(*arguments)
        elif fault.kind == "raise":
            raise ZeroDivisionError("nobody expected this")
        elif fault.kind == "hang":
            hang()
        elif fault.kind in NAMES:
            result = NAMES[fault.kind]
        else:
            result = self._function(*arguments)
            values = getattr(arguments[3], "_obj", arguments[3])  # an array, or `byref` of one
            values[0 if fault.skip % 2 else len(values) - 1] = float(fault.kind)
        script.calls.append((self._fmu, self._name, result if isinstance(result, int) else OK))
        return result


class Library:
    """A shared library with the script between it and its callers."""

    def __init__(self, script: Script, path: str) -> None:
        self._script, self._library = script, real_cdll.LoadLibrary(path)
        self._fmu = "beam" if "beam" in path.rsplit("/", 1)[-1] else "spring"
        self._handle = self._library._handle

    def __getitem__(self, name: str) -> Function:
        return Function(self._script, self._fmu, name, self._library[name])

    def __getattr__(self, name: str) -> Function:
        return self[name]


real_cdll = functions.cdll


class Loader:
    def __init__(self, script: Script) -> None:
        self._script = script

    def LoadLibrary(self, path: str) -> Library:
        return Library(self._script, path)


def installed(monkeypatch: pytest.MonkeyPatch, *faults: Fault) -> Script:
    """The script of all FMUs loaded from now on; it follows where the master is.

    That is "start", the phase of the step attempted, "location" while an event is being located, "rollback" while
    the bodies go back to the mark, "row" while a row is written, "event" while one acts; in Algorithm 1 "paper".
    """
    script = Script(faults)
    monkeypatch.setattr(functions, "cdll", Loader(script))
    attempt, rewind, write, locate = Pair.attempt, Pair.rewind, Rows.write, detection.locate
    act, algorithm = simulation.Simulation._act, PaperLaw._step

    def attempted(self: Pair, state: Any, *arguments: Any) -> Any:
        with script.at(script.where if script.where == "location" else str(state.phase)):
            return attempt(self, state, *arguments)

    def rewound(self: Pair) -> None:
        with script.at("rollback"):
            rewind(self)

    def written(self: Rows, *arguments: Any) -> None:
        with script.at("row"):
            write(self, *arguments)

    def located(*arguments: Any) -> float:
        with script.at("location"):
            return locate(*arguments)

    def acted(self: Any, *arguments: Any) -> None:
        with script.at("event"):
            act(self, *arguments)

    def stepped(self: PaperLaw) -> Any:
        with script.at("paper"):
            return algorithm(self)

    monkeypatch.setattr(PaperLaw, "_step", stepped)
    monkeypatch.setattr(Pair, "attempt", attempted)
    monkeypatch.setattr(Pair, "rewind", rewound)
    monkeypatch.setattr(Rows, "write", written)
    monkeypatch.setattr(detection, "locate", located)
    monkeypatch.setattr(simulation.Simulation, "_act", acted)
    return script
