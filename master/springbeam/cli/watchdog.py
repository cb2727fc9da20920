"""End the command on Ctrl-C while an FMU of ours does not return.

Python acts on a signal between two instructions of the main thread, which a call into a library that never returns
keeps from ever coming. Its C handler, however, writes the signal to the wakeup descriptor at once, and ctypes lets
other threads run during a call. FMUs of others are in processes of their own (`springbeam.bodies.isolated`).
"""

from __future__ import annotations

import os
import select
import signal
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, NoReturn

import typer

from ..bodies.fmu import call_under_way
from .common import STOPPED

#: Longest time that a signal waits for the main thread [s].
PATIENCE = 5.0


class _Watchdog(threading.Thread):
    """Ends the process when the main thread does not act on a SIGINT or SIGTERM within `PATIENCE`."""

    def __init__(self, last_words: Callable[[str], str]) -> None:
        super().__init__(name="watchdog", daemon=True)
        self._last_words = last_words
        self.signals, self.wakeup = socket.socketpair()
        self.signals.setblocking(False)
        self.wakeup.setblocking(False)
        self.over = threading.Event()
        # Held while the process is ended: a main thread that returns just then waits. Re-entrant, for the handler of
        # one signal may interrupt that of another.
        self._deciding = threading.RLock()
        self._answers = 0

    def interrupt(self, *_: Any) -> NoReturn:
        """Handle either signal, in the main thread."""
        with self._deciding:
            with suppress(BlockingIOError):
                while self.signals.recv(4096):
                    pass
            self._answers += 1
        raise KeyboardInterrupt

    def run(self) -> None:
        while True:
            answers = self._answers
            select.select([self.signals], [], [])
            if self.over.wait(PATIENCE):
                return
            with self._deciding:
                unanswered, _, _ = select.select([self.signals], [], [], 0.0)
                if unanswered and self._answers == answers:
                    self._end()

    def _end(self) -> NoReturn:
        try:
            frame = sys._current_frames().get(threading.main_thread().ident or 0)
            cause = f"{call_under_way(frame)} has not returned within {PATIENCE:g} s"
            typer.echo(f"error: interrupted: {self._last_words(cause)}", err=True)
        finally:
            os._exit(STOPPED)


@contextmanager
def watched(last_words: Callable[[str], str]) -> Iterator[None]:
    """Let SIGINT and SIGTERM end the process with exit code 3, within the block, also while an FMU does not return.

    Parameters
    ----------
    last_words
        Called with the cause, in another thread; it does what can be done without the FMU and returns the message.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    found = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    ours = {number: handler for number, handler in found.items() if callable(handler)}  # the others are ignored
    watchdog = _Watchdog(last_words)
    before = signal.set_wakeup_fd(watchdog.wakeup.fileno(), warn_on_full_buffer=False)
    for number in ours:
        signal.signal(number, watchdog.interrupt)
    watchdog.start()
    try:
        yield
    finally:
        for number, handler in ours.items():
            signal.signal(number, handler)
        signal.set_wakeup_fd(before)
        watchdog.over.set()
        watchdog.wakeup.close()  # which the thread sees
        watchdog.join()
        watchdog.signals.close()
