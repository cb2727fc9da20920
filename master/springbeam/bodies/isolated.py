"""A foreign FMU in a process of its own, which may crash or hang: the run then ends by name and keeps what it has.

The process, `springbeam.bodies.worker`, examines the FMU and then holds its body. A request is a list of calls, of
which the last is answered. Those that need no answer, as `mark` and `rewind`, wait for the next that does, so that a
step costs one exchange (some 20 µs).
"""

from __future__ import annotations

import atexit
import os
import pickle
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Sequence
from contextlib import suppress
from functools import lru_cache
from math import inf
from pathlib import Path
from time import monotonic, sleep
from typing import Any, ClassVar

from ..scene import Load, SceneError
from ..scene.partners import ForeignFmu
from .end_loaded import EndLoaded
from .foreign import Findings
from .protocol import NO_FORCE, BodyFailed, Energies, FmuError, Force, Motion, StepRefused

#: Longest time that the check before the run may take, any call of the run, and the last one [s].
CHECK_PATIENCE, CALL_PATIENCE, _FAREWELL = 20.0, 60.0, 2.0
#: From when on Ctrl-C means the FMU, not the run [s].
LONG = 5.0
#: How often a process is looked after [s].
_LOOK = 0.2
#: Most processes that wait for another body of their FMU.
_MOST_IDLE = 4
#: What the process may say instead of an answer.
FAILURES = (BodyFailed, StepRefused, SceneError)
#: A method and its arguments.
Call = tuple[Any, ...]


def _file(path: str) -> tuple[str, int, int]:
    """Return what tells the FMU at ``path`` from others: path, time of change, and who uses it. Raises FmuError."""
    try:
        return path, Path(path).stat().st_mtime_ns, os.getpid()
    except OSError:
        raise FmuError(f"{path}: not found") from None


class FmuProcess:
    """A process for one body after another of an FMU file; `of` returns one.

    Parameters
    ----------
    file
        From `_file`.
    """

    _idle: ClassVar[list[FmuProcess]] = []

    def __init__(self, file: tuple[str, int, int]) -> None:
        self._file = file
        self._folder = tempfile.TemporaryDirectory(prefix="springbeam-")
        self._errors = (Path(self._folder.name) / "errors").open("w+b")
        command = [sys.executable, "-m", "springbeam.bodies.worker", self._folder.name, str(os.getpid())]
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=self._errors)
        self._doing, self._until, self._late = "", inf, False
        threading.Thread(target=self._look_after, daemon=True).start()
        self.ask([], "its start", inf)  # which is not the FMU's time

    @classmethod
    def of(cls, file: tuple[str, int, int]) -> FmuProcess:
        """Return a process for the FMU ``file``, one that is idle if there is one."""
        for process in cls._idle:
            if process._file == file:
                cls._idle.remove(process)
                return process
        return cls(file)

    def _look_after(self) -> None:
        while self._process.poll() is None:
            if monotonic() > self._until:
                self._late = True
                self._process.kill()
            sleep(_LOOK)

    def ask(self, calls: Sequence[Call], doing: str, patience: float) -> tuple[Any, Any]:
        """Make ``calls``; return what the last one returns, and what the body says of itself then.

        Raises
        ------
        FmuError
            If the process crashes, or does not answer within ``patience`` [s], ``doing`` this.
        BodyFailed, StepRefused, SceneError
            If the body does.
        """
        send, receive = self._process.stdin, self._process.stdout
        assert send is not None
        assert receive is not None
        began = monotonic()
        self._doing, self._until = doing, began + patience
        try:
            send.write(pickle.dumps(calls))
            send.flush()
            while True:
                kind, value, told = pickle.load(receive)
                if kind != "stage":
                    break
                self._doing = f"{value} of {doing}"
        except (EOFError, OSError, pickle.UnpicklingError):
            raise FmuError(f"{self._file[0]}: {self._why_it_ended(patience)}") from None
        except KeyboardInterrupt:
            waited = monotonic() - began
            if waited < LONG:
                raise
            said = f"interrupted, for it has not returned within {waited:.3g} s from {self._doing}"
            raise FmuError(f"{self._file[0]}: {said}") from None
        self._until = inf
        if kind == "failed":
            raise value
        return value, told

    def _why_it_ended(self, patience: float) -> str:
        code = self._process.wait()
        if self._late:
            return f"has not returned within {patience:g} s from {self._doing}"
        self._errors.seek(0)
        words = self._errors.read().decode("utf-8", "replace").split("\n")
        cause = signal.Signals(-code).name if code < 0 else f"exit code {code}"
        said = ": ".join([cause, *[line.strip() for line in words if line.strip()][-1:]])
        return f"crashed ({said}) in {self._doing}"

    @property
    def answers(self) -> bool:
        """Whether it has answered all that it was asked; if not, it is gone or busy."""
        return self._until == inf

    def give_back(self) -> None:
        """Keep the process for another body, if it answers."""
        if not self.answers or len(self._idle) >= _MOST_IDLE:
            self.end()
        else:
            self._idle.append(self)

    def end(self) -> None:
        """End the process."""
        self._process.kill()
        with suppress(OSError), self._process:  # which closes its pipes and waits for it
            self._errors.close()
        self._folder.cleanup()


@atexit.register
def _end_all() -> None:
    for process in FmuProcess._idle:
        if process._file[2] == os.getpid():
            process.end()


def examined(spec: ForeignFmu, upper: bool, start_time: float, H: float) -> Findings:
    """Return what `springbeam.bodies.probe.examine` finds; an FMU is examined once.

    Raises
    ------
    FmuError
        If the FMU cannot be used as the scene says, crashes, or does not return within `CHECK_PATIENCE`.
    """
    return _examined(_file(spec.fmu), spec.model_dump_json(), upper, start_time, H)


@lru_cache(maxsize=64)
def _examined(file: tuple[str, int, int], spec: str, upper: bool, start_time: float, H: float) -> Findings:
    process = FmuProcess.of(file)
    try:
        call = ("examine", ForeignFmu.model_validate_json(spec), upper, start_time, H)
        found: Findings = process.ask([call], "the check before the run", CHECK_PATIENCE)[0]
    except BaseException:
        process.end()
        raise
    process.give_back()
    return found


class IsolatedBody(EndLoaded):
    """A `springbeam.bodies.foreign.ForeignBody` in a process of its own; parameters as of that."""

    state: tuple[Motion, float, Energies]  #: the motion, the work received [J], and the energies

    def __init__(self, spec: ForeignFmu, upper: bool, start_time: float, found: Findings) -> None:
        self.path, self.abilities = spec.fmu, found.abilities
        self._waiting: list[Call] = []
        self._process: FmuProcess | None = FmuProcess.of(_file(spec.fmu))
        try:
            self.mass = self._ask("initialisation", "make", spec, upper, start_time, found)
        except BaseException:
            self.close()
            raise
        self.mark()

    def _ask(self, doing: str, *call: Any) -> Any:
        assert self._process is not None
        calls, self._waiting = [*self._waiting, call], []
        value, (*state, self.steps, self.rewinds) = self._process.ask(calls, doing, CALL_PATIENCE)
        self.state = tuple(state)
        return value

    def start_as_fast_as(self, velocity: float) -> None:
        """Start with this velocity [m/s], that of what it is tied to, if its own is not told but measured."""
        self._ask("its start", "start_as_fast_as", velocity)

    def mark(self) -> None:
        self._waiting.append(("mark",))
        super().mark()

    def rewind(self) -> None:
        self._waiting.append(("rewind",))
        super().rewind()

    def advance(self, time: float, size: float, contact: Force, foundation: Force = NO_FORCE) -> Motion:
        self._ask(f"its step at t = {time:.9g} s", "advance", time, size, contact, foundation)
        return self.state[0]

    def motion(self) -> Motion:
        return self.state[0]

    def expect_loads(self, loads: Sequence[Load]) -> None:
        super().expect_loads(loads)
        self._waiting.append(("expect_loads", loads))

    def set_loads(self, forces: Sequence[Force]) -> None:
        super().set_loads(forces)
        self._waiting.append(("set_loads", forces))

    def energies(self) -> Energies:
        return self.state[2]

    @property
    def received(self) -> float:  # type: ignore[override]
        return self.state[1]

    def apply_impulse(self, impulse: float) -> None:
        self._ask("taking an impulse", "apply_impulse", impulse)

    def holding_force(self, displacement: float, velocity: float) -> float:
        force: float = self._ask("a trial step", "holding_force", displacement, velocity)
        return force

    def save(self) -> bytes:
        saved: bytes = self._ask("saving its state", "save")
        return saved

    def restore(self, saved: bytes) -> None:
        self._ask("restoring its state", "restore", saved)

    def close(self) -> None:
        process, self._process = self._process, None
        if process is None:
            return
        if process.answers:
            with suppress(FmuError):
                process.ask([("close",)], "closing", _FAREWELL)
        process.give_back()
