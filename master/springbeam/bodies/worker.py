"""The process of a foreign FMU: it does what `springbeam.bodies.isolated` asks for, until nobody is there to ask."""

from __future__ import annotations

import os
import pickle
import signal
import sys
import tempfile
import threading
from time import sleep
from typing import Any

from .foreign import ForeignBody
from .isolated import FAILURES
from .probe import Bench, examine


def main() -> None:
    """Answer requests from standard input on standard output; see `springbeam.bodies.isolated.FmuProcess.ask`."""
    tempfile.tempdir, parent = sys.argv[1], int(sys.argv[2])
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what the FMU prints is no answer
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the master's
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()

    def answer(*values: Any) -> None:
        answers.write(pickle.dumps(values))
        answers.flush()

    body: ForeignBody | None = None

    def call(name: str, *arguments: Any) -> Any:
        nonlocal body
        if name == "examine":
            spec, upper, start_time, H = arguments
            return examine(Bench(spec, upper, start_time, H, lambda stage: answer("stage", stage, None)))
        if name == "make":
            body = ForeignBody(*arguments)
            return body.mass
        assert body is not None
        return getattr(body, name)(*arguments)

    while True:
        try:
            calls = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        try:
            values = [call(*asked) for asked in calls]
        except FAILURES as failure:
            answer("failed", failure, None)
        else:
            answer("done", values[-1] if values else None, None if body is None else body.told())


def _end_with(parent: int) -> None:
    """End when the master does, also while the FMU does not return."""
    while os.getppid() == parent:
        sleep(1.0)
    os._exit(1)


if __name__ == "__main__":
    main()
