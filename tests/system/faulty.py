"""FMUs that fail on cue: the real ones, with every call of their C functions written down, and one of them faulted.

The script is below the master, in place of the functions of the shared library, so that whatever is called is seen.
"""

import ctypes
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

from springbeam.bodies import fmu as fmus
from springbeam.bodies import functions
from springbeam.bodies.fmu import release
from springbeam.run import detection
from springbeam.run.master import Master
from springbeam.run.stepping import Pair

OK, WARNING, DISCARD, ERROR, FATAL = range(5)
NAMES = {"Discard": DISCARD, "Error": ERROR, "Fatal": FATAL}
STATUSES = NAMES | {"unknown": 99}
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
    #: A name of `STATUSES`, "Warning" (of a call that does its work), "raise", "hang", or what is put into the values:
    #: "nan", "inf", "1e300".
    kind: str
    once: bool = False
    skip: int = 3
    happened: int = 0

    def after(self, fmu, function, where):
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
    given_to_c: list = field(default_factory=list)  #: functions that must outlive the pointers to them

    @contextmanager
    def at(self, where):
        before = self.where
        self.where = where
        try:
            yield
        finally:
            self.where = before

    def check(self):
        """Every instance is used as FMI allows, and freed once; but for one that returned fmi2Fatal, never touched."""
        release()
        for fmu in ("beam", "spring"):
            allowed = None
            alive = False
            for name, function, status in self.calls:
                if name != fmu:
                    continue
                if function == "fmi2Instantiate":
                    assert not alive or allowed == set()
                    alive = True
                    allowed = None
                    continue
                if function in WITHOUT_INSTANCE:
                    continue
                assert alive, f"{function} of {fmu} after it was freed"
                assert allowed is None or function in allowed, f"{function} of {fmu} is not allowed here"
                if function == "fmi2FreeInstance":
                    alive = False
                elif status >= FATAL:
                    allowed = set()
                elif status == ERROR:
                    allowed = AFTER_ERROR
                elif status == DISCARD and function == "fmi2DoStep":
                    allowed = AFTER_DISCARDED_STEP
                elif function in ("fmi2SetFMUstate", "fmi2Reset"):
                    allowed = None
            assert alive == (allowed == set()), f"{fmu} was not freed"


def hang():
    """Call a C function that never returns, not even for a signal: the second lock of a mutex."""
    print("hanging", flush=True)
    library = ctypes.CDLL(None)
    mutex = ctypes.create_string_buffer(256)
    library.pthread_mutex_init(mutex, None)
    library.pthread_mutex_lock(mutex)
    library.pthread_mutex_lock(mutex)
    raise AssertionError("returned")


#: Arguments of what an advance calls, from C: an exception would not come through.
_ACCESS = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_void_p)
FROM_C = {
    "fmi2SetReal": _ACCESS,
    "fmi2GetReal": _ACCESS,
    "fmi2SetRealInputDerivatives": (*_ACCESS, ctypes.c_void_p),
    "fmi2DoStep": (ctypes.c_void_p, ctypes.c_double, ctypes.c_double, ctypes.c_int),
}


class Library(functions.Library):
    """A shared library with the script between it and its callers."""

    _script = None

    def __getitem__(self, name):
        function = super().__getitem__(name)

        def call(*arguments):
            function.restype = call.restype
            function.argtypes = getattr(call, "argtypes", None)
            return self._called(name, function, arguments)

        call.restype = ctypes.c_int
        if name in FROM_C:
            type_ = ctypes.CFUNCTYPE(ctypes.c_int, *FROM_C[name])
            typed = ctypes.cast(function, type_)
            call._as_parameter_ = type_(lambda *arguments: self._called(name, typed, arguments))
            self._script.given_to_c.append(call)
        return call

    def _called(self, name, function, arguments):
        fmu = Path(self._name).stem
        script = self._script
        fault = next((f for f in script.faults if f.after(fmu, name, script.where)), None)
        if fault is None:
            result = function(*arguments)
        elif fault.kind == "raise":
            raise ZeroDivisionError("nobody expected this")
        elif fault.kind == "hang":
            hang()
        elif fault.kind in STATUSES:
            result = STATUSES[fault.kind]
        elif fault.kind == "Warning":
            function(*arguments)
            result = WARNING
        else:
            result = function(*arguments)
            values = arguments[3]
            if isinstance(values, int):
                values = (ctypes.c_double * arguments[2]).from_address(values)
            values = getattr(values, "_obj", values)  # an array, or `byref` of one
            values[0 if fault.skip % 2 else len(values) - 1] = float(fault.kind)
        script.calls.append((fmu, name, result if isinstance(result, int) else OK))
        return result


def installed(monkeypatch, *faults):
    """The script of all FMUs loaded from now on; it follows where the master is.

    That is "start", the phase of the step attempted, "location" while an event is being located, "rollback" while
    the bodies go back to the mark, "row" while a row is written.
    """
    script = Script(faults)
    release()  # what is kept would not be loaded
    monkeypatch.setattr(fmus, "opened", lru_cache(fmus.opened.__wrapped__))  # what is loaded is not scripted
    monkeypatch.setattr(functions, "Library", type("Scripted", (Library,), {"_script": script}))

    def watch(owner, name, where):
        function = getattr(owner, name)

        def watched(*arguments, **options):
            with script.at(where(*arguments)):
                return function(*arguments, **options)

        monkeypatch.setattr(owner, name, watched)

    def phase(_, state, *_arguments):
        return script.where if script.where == "location" else state.phase.name

    watch(Pair, "attempt", phase)
    for owner, name, where in (
        (Pair, "rewind", "rollback"),
        (Master, "_record", "row"),
        (detection, "locate", "location"),
    ):
        watch(owner, name, lambda *_, where=where: where)
    return script
