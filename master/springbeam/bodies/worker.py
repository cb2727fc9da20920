"""The process of a foreign FMU: it does what `springbeam.bodies.isolated` asks for, until nobody is there to ask."""

from __future__ import annotations

import os
import signal
import sys
import tempfile
import threading
from multiprocessing.connection import Connection
from typing import Any

from ..scene import SceneError
from .foreign import ForeignBody
from .protocol import BodyFailed, StepRefused


def main() -> None:
    """Answer requests; see `springbeam.bodies.isolated.FmuProcess.ask`."""
    tempfile.tempdir = sys.argv[1]
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the master's
    ends: list[Any] = [Connection(int(end)) for end in sys.argv[2:]]
    requests, answers = ends
    threading.Thread(target=_end_with_the_master, daemon=True).start()
    body: Any = None

    def call(name: str, *arguments: Any) -> Any:
        nonlocal body
        if name != "make":
            return getattr(body, name)(*arguments)
        body = ForeignBody(*arguments)
        return body.mass, body.abilities

    while True:
        value = None
        try:
            for asked in requests.recv():
                value = call(*asked)
        except EOFError:
            return
        except (BodyFailed, StepRefused, SceneError) as failure:
            value = failure
        answers.send((value, None if body is None else body.told()))


def _end_with_the_master() -> None:
    """End when the master does, which keeps standard input open; also while the FMU does not return."""
    sys.stdin.read()
    os._exit(1)


if __name__ == "__main__":
    main()
