"""Progress of a run, and its early end."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from traceback import walk_tb
from typing import Any

from ..results.trajectory import Trajectory

#: ``progress(time, phase, macro_steps)``, called once per accepted step.
Progress = Callable[[float, str, int], None]
#: Cause of a run that ends because a number has become too large.
_OVERFLOW = "a force, an energy or a position is larger than a double holds"


def cause_of(error: Exception) -> str:
    """Return why a step has failed. Raises an OverflowError again that a body of the caller's has raised."""
    if not isinstance(error, OverflowError):
        return str(error)
    *_, (frame, _) = walk_tb(error.__traceback__)
    if frame.f_globals.get("__name__", "").partition(".")[0] != __name__.partition(".")[0]:
        raise error
    return _OVERFLOW


class RunStopped(RuntimeError):
    """The run ended before t_end; everything up to ``time`` [s] has been recorded.

    ``residual`` [m] is that of the conditions that could not be met, ``None`` where the cause is another. ``run`` is
    the trajectory so far, ``None`` where it went into files.
    """

    run: Trajectory | None = None

    def __init__(self, cause: str, time: float, residual: float | None = None) -> None:
        if residual is not None and not isfinite(residual):
            residual = None
        at = "" if residual is None else f", residual {residual:.3g} m"
        super().__init__(f"stopped at t = {time:.9g} s: {cause}{at}")
        self.cause = cause
        self.time = time
        self.residual = residual

    def __reduce__(self) -> tuple[Any, ...]:
        """Let the error pass from one process to another."""
        return type(self), (self.cause, self.time, self.residual), {"run": self.run}
