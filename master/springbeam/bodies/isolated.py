"""A foreign FMU in a process of its own, which may crash or hang: the run then stops and keeps its results.

The process holds the `Port` of the FMU and runs `answer`. A request is a list of calls, of which the last is answered.
Those that need no answer, as `get_state` and `set_state`, wait for the next that does, so that a step costs one
exchange (some 20 µs).
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

from .functions import OK, WARNING
from .port import CANNOT, Port
from .protocol import BodyFailed, FmuError, StepRefused

#: Time after which Ctrl-C names the FMU as the cause [s].
LONG = 5.0
#: Longest time that the last call may take [s].
_FAREWELL = 2.0
#: Most processes that wait for another body of their FMU.
_MOST_IDLE = 4
#: A method and its arguments.
Request = tuple[Any, ...]


class FmuProcess:
    """A process for one body after another of an FMU file; `of` returns one. It ends with the process that made it."""

    _idle: ClassVar[list[FmuProcess]] = []

    def __init__(self, path: str) -> None:
        self._path = path
        self._master = os.getpid()
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
        #: Whether it has answered all requests.
        self.idle = True
        #: Size of the output of FMUs before the present one [bytes].
        self._read = 0
        self.ask([], "its start", None)  # which is not the FMU's time

    @classmethod
    def of(cls, path: str) -> FmuProcess:
        """Return a process for the FMU at ``path``, one that is idle if there is one."""
        for process in cls._idle:
            if (process._path, process._master) == (path, os.getpid()):
                cls._idle.remove(process)
                process._read = process._errors.stat().st_size
                return process
        return cls(path)

    def ask(self, calls: Sequence[Request], doing: str, patience: float | None) -> Any:
        """Make ``calls``; return what the last one returns.

        Raises
        ------
        FmuError
            If the process crashes, or does not answer within ``patience`` [s], ``doing`` this.
        BodyFailed, StepRefused
            If the FMU fails.
        """
        began = monotonic()
        self.idle = False
        try:
            self._requests.send(calls)
            if not self._answers.poll(patience):
                raise FmuError(f"{self._path}: has not returned within {patience:g} s from {doing}")
            value = self._answers.recv()
        except (EOFError, OSError):
            raise FmuError(f"{self._path}: crashed ({self._last_words()}) in {doing}") from None
        except KeyboardInterrupt:
            if (waited := monotonic() - began) < LONG:
                raise
            waiting = f"interrupted, for it has not returned within {waited:.3g} s from {doing}"
            raise FmuError(f"{self._path}: {waiting}") from None
        self.idle = True
        if isinstance(value, FmuError):
            raise FmuError(": ".join([str(value), *self._printed()]))
        if isinstance(value, Exception):
            raise value
        return value

    def _last_words(self) -> str:
        code = self._process.wait()
        cause = signal.Signals(-code).name if code < 0 else f"exit code {code}"
        return ": ".join([cause, *self._printed()])

    def _printed(self) -> list[str]:
        """Return the last line that the FMU of the present body has printed, if any."""
        lines = self._errors.read_bytes()[self._read :].decode("utf-8", "replace").strip().splitlines()
        return [line.strip() for line in lines[-1:]]

    def give_back(self, again: bool) -> None:
        """Keep the process for another body in place of the one that has waited longest, or end it.

        It ends if it does not answer, or if its FMU cannot be instantiated ``again``.
        """
        if not (again and self.idle):
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
    """Answer requests of `FmuProcess.ask` in the process of an FMU, until the master is gone."""
    tempfile.tempdir, *ends = sys.argv[1:]
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the master's
    try:
        os.getcwd()
    except FileNotFoundError:  # has been removed, and an FMU may ask for it
        os.chdir(tempfile.tempdir)
    requests, answers = (Connection(int(end)) for end in ends)
    threading.Thread(target=_end_with_the_master, daemon=True).start()
    port: Any = None
    while True:
        value: Any = None
        try:
            for name, *arguments in requests.recv():
                if name == "make":
                    make, *given = arguments
                    port, value = make(*given)
                else:
                    value = getattr(port, name)(*arguments)
                if name in CANNOT and value > WARNING:
                    raise port.failed(value, CANNOT[name])
        except EOFError:
            return
        except (BodyFailed, StepRefused) as failure:
            value = failure
        answers.send(value)


def _end_with_the_master() -> None:
    """End when the master, which keeps standard input open, ends; also while the FMU does not return."""
    sys.stdin.read()
    os._exit(1)


class RemotePort(Port):
    """A `Port` in a process of its own.

    Parameters
    ----------
    path
        Of the FMU.
    patience, occasion
        Longest time that a call may take [s], and its occasion in words.
    make, arguments
        ``make(*arguments)`` returns the port and its findings.
    """

    def __init__(
        self, path: str, patience: float, occasion: str, make: Callable[..., tuple[Port, Any]], *arguments: Any
    ) -> None:
        self.path = Path(path)
        self.patience = patience
        self._occasion = occasion
        self._waiting: list[Request] = []
        self._process: FmuProcess | None = FmuProcess.of(path)
        try:
            self.findings = self._ask("initialisation", "make", make, *arguments)
        except BaseException:
            self.close()
            raise

    def _ask(self, doing: str, *call: Any) -> Any:
        assert self._process is not None
        calls = [*self._waiting, call]
        self._waiting = []
        return self._process.ask(calls, doing + self._occasion, self.patience)

    def read(self) -> Any:
        return self._ask("initialisation", "read")

    def step(self, given: Sequence[float]) -> Any:
        return self._ask(f"its step at t = {given[0]:.9g} s", "step", given)

    def trial(self, given: Sequence[float], read: Any = None) -> Any:
        return self._ask(f"a trial step at t = {given[0]:.9g} s", "trial", given)

    def get_state(self) -> int:
        self._waiting.append(("get_state",))
        return OK

    def set_state(self) -> int:
        self._waiting.append(("set_state",))
        return OK

    def close(self) -> bool:
        process = self._process
        self._process = None
        again = False
        if process is None:
            return again
        if process.idle:
            with suppress(FmuError):
                again = process.ask([("close",)], "closing", _FAREWELL)
        process.give_back(again)
        return again
