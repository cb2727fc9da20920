"""A foreign FMU in a process of its own, which may crash or hang: the run then ends by name and keeps what it has.

The process holds the body and runs `answer`. A request is a list of calls, of which the last is answered. Those that
need no answer, as `mark` and `rewind`, wait for the next that does, so that a step costs one exchange (some 20 µs).
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from time import monotonic
from typing import Any, ClassVar

from ..scene import SceneError
from ..scene.partners import ForeignFmu
from .elements import EndLoaded
from .foreign import Findings, ForeignBody
from .protocol import NO_FORCE, BodyFailed, Energies, FmuError, Force, Motion, StepRefused

#: From when on Ctrl-C means the FMU, not the run [s].
LONG = 5.0
#: Longest time that the last call may take [s].
_FAREWELL = 2.0
#: Most processes that wait for another body of their FMU.
_MOST_IDLE = 4
#: A method and its arguments.
Call = tuple[Any, ...]


class FmuProcess:
    """A process for one body after another of an FMU file; `of` returns one. It ends with the process that made it."""

    _idle: ClassVar[list[FmuProcess]] = []

    def __init__(self, path: str) -> None:
        self._path, self._master = path, os.getpid()
        self._folder = tempfile.TemporaryDirectory(prefix="springbeam-", ignore_cleanup_errors=True)
        self._errors = Path(self._folder.name) / "errors"
        # Two pipes: by a pair of sockets an exchange takes 1.4 times as long.
        requests, self._requests = Pipe(duplex=False)
        self._answers, answers = Pipe(duplex=False)
        ends = requests.fileno(), answers.fileno()
        program = f"from {__name__} import answer; answer()"
        command = [sys.executable, "-c", program, self._folder.name, *map(str, ends)]
        with self._errors.open("wb") as printed, requests, answers:
            # Not in a session of its own: on a busy machine Linux lets that wait, and a step takes five times as long.
            self._process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=printed, stderr=printed, pass_fds=ends
            )
        #: Whether it has answered all that it was asked.
        self.idle = True
        self.ask([], "its start", None)  # which is not the FMU's time

    @classmethod
    def of(cls, path: str) -> FmuProcess:
        """Return a process for the FMU at ``path``, one that is idle if there is one."""
        for process in cls._idle:
            if (process._path, process._master) == (path, os.getpid()):
                cls._idle.remove(process)
                return process
        return cls(path)

    def ask(self, calls: Sequence[Call], doing: str, patience: float | None) -> tuple[Any, Any]:
        """Make ``calls``; return what the last one returns, and what the body says of itself then.

        Raises
        ------
        FmuError
            If the process crashes, or does not answer within ``patience`` [s], ``doing`` this.
        BodyFailed, StepRefused, SceneError
            If the body does.
        """
        began, self.idle = monotonic(), False
        try:
            self._requests.send(calls)
            if not self._answers.poll(patience):
                raise FmuError(f"{self._path}: has not returned within {patience:g} s from {doing}")
            value, told = self._answers.recv()
        except (EOFError, OSError):
            raise FmuError(f"{self._path}: crashed ({self._last_words()}) in {doing}") from None
        except KeyboardInterrupt:
            if (waited := monotonic() - began) < LONG:
                raise
            said = f"interrupted, for it has not returned within {waited:.3g} s from {doing}"
            raise FmuError(f"{self._path}: {said}") from None
        self.idle = True
        if isinstance(value, Exception):
            raise value
        return value, told

    def _last_words(self) -> str:
        code = self._process.wait()
        cause = signal.Signals(-code).name if code < 0 else f"exit code {code}"
        lines = self._errors.read_text("utf-8", "replace").strip().splitlines()
        return ": ".join([cause, *(line.strip() for line in lines[-1:])])

    def give_back(self) -> None:
        """Keep the process for another body, if it answers, in place of the one that has waited longest."""
        if not self.idle:
            self._end()
            return
        self._idle.append(self)
        own = [process for process in self._idle if process._master == os.getpid()]  # not those of before a fork
        if len(own) > _MOST_IDLE:
            self._idle.remove(own[0])
            own[0]._end()

    def _end(self) -> None:
        self._process.kill()
        with suppress(OSError), self._process, self._requests, self._answers:  # which waits for it
            self._folder.cleanup()


def answer() -> None:
    """Do in the process of an FMU what `FmuProcess.ask` asks for, until nobody is there to ask."""
    tempfile.tempdir, *ends = sys.argv[1:]
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the master's
    requests, answers = (Connection(int(end)) for end in ends)
    threading.Thread(target=_end_with_the_master, daemon=True).start()
    body: Any = None
    while True:
        value: Any = None
        try:
            for name, *arguments in requests.recv():
                if name == "make":
                    body = ForeignBody(*arguments)
                    value = body.mass, body.abilities
                else:
                    value = getattr(body, name)(*arguments)
        except EOFError:
            return
        except (BodyFailed, StepRefused, SceneError) as failure:
            value = failure
        answers.send((value, None if body is None else body.told()))


def _end_with_the_master() -> None:
    """End when the master does, which keeps standard input open; also while the FMU does not return."""
    sys.stdin.read()
    os._exit(1)


def _forwarded(name: str, doing: str) -> Callable[..., Any]:
    """Return the method ``name`` of a body in another process, which is then ``doing`` this."""
    return lambda body, *arguments: body._ask(doing, name, *arguments)


def _later(name: str) -> Callable[..., None]:
    """Return the method ``name`` of `EndLoaded`, which a body in another process does as well, before its next call."""

    def method(body: IsolatedBody, *arguments: Any) -> None:
        getattr(EndLoaded, name)(body, *arguments)
        body._waiting.append((name, *arguments))

    return method


class IsolatedBody(EndLoaded):
    """A `springbeam.bodies.foreign.ForeignBody` in a process of its own; parameters as of that."""

    #: Longest time that a call may take [s], and what is said of when it was made.
    PATIENCE, OCCASION = 60.0, ""
    state: tuple[Motion, float, Energies]  #: the motion, the work received [J], and the energies

    def __init__(self, spec: ForeignFmu, upper: bool, start_time: float, found: Findings | None) -> None:
        self._waiting: list[Call] = []
        self._process: FmuProcess | None = FmuProcess.of(spec.fmu)
        try:
            self.mass, self.abilities = self._ask("initialisation", "make", spec, upper, start_time, found)
        except BaseException:
            self.close()
            raise
        self.mark()

    def _ask(self, doing: str, *call: Any) -> Any:
        assert self._process is not None
        calls, self._waiting = [*self._waiting, call], []
        value, told = self._process.ask(calls, doing + self.OCCASION, self.PATIENCE)
        *state, self.steps, self.rewinds = told
        self.state = tuple(state)
        return value

    mark, rewind = _later("mark"), _later("rewind")
    expect_loads, set_loads = _later("expect_loads"), _later("set_loads")
    apply_impulse = _forwarded("apply_impulse", "taking an impulse")
    holding_force = _forwarded("holding_force", "a trial step")
    save = _forwarded("save", "saving its state")
    restore = _forwarded("restore", "restoring its state")

    def advance(self, time: float, size: float, contact: Force, foundation: Force = NO_FORCE) -> Motion:
        self._ask(f"its step at t = {time:.9g} s", "advance", time, size, contact, foundation)
        return self.state[0]

    def join(self, velocity: float) -> None:
        if not self.abilities.velocity:
            self._ask("its start", "join", velocity)

    def motion(self) -> Motion:
        return self.state[0]

    def energies(self) -> Energies:
        return self.state[2]

    @property
    def received(self) -> float:  # type: ignore[override]
        return self.state[1]

    def close(self) -> None:
        process, self._process = self._process, None
        if process is None:
            return
        if process.idle:
            with suppress(FmuError):
                process.ask([("close",)], "closing", _FAREWELL)
        process.give_back()
