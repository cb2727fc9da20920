"""A load that is a function of a Python program."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from ..lazily import Later
from .loads import FOR_EVER, Load
from .tables import OfProgram

if TYPE_CHECKING:
    import numpy as np
else:
    np = Later("numpy")


class FunctionLoad(OfProgram, Load):
    """A load that is a function of time: ``with_changes(scene, loads=[FunctionLoad(on="tip", function=f)])``.

    ``function`` returns the value at one time [s], in the unit of the load; steps end at the times ``breaks`` [s], at
    which it jumps or has a kink. ``derivative``, of the function, is for the motion of a wall; ``fastest``, the rate of
    its fastest oscillation [rad/s], for references and steps in which it turns by more than a radian.
    """

    signal: str = "function"
    function: Callable[[float], float]
    derivative: Callable[[float], float] | None = None
    breaks: Annotated[tuple[float, ...], Field(strict=False)] = ()
    fastest: float = 0.0

    @property
    def rate(self) -> float:
        return self.fastest

    @property
    def _bends(self) -> tuple[float, ...]:
        return self.breaks

    def curve(self, t: "np.ndarray") -> Any:
        return _each(self.function, t)

    def slope(self, t: "np.ndarray") -> Any:
        if self.derivative is None:
            raise ValueError(f'a FunctionLoad on = "{self.on}" has no derivative, by which a wall moves; give it one')
        return _each(self.derivative, t)


def _each(function: Callable[[float], float], times: "np.ndarray") -> "np.ndarray":
    # A reference asks for the value at the end of all times, too.
    values = [function(time) if abs(time) < FOR_EVER else 0.0 for time in np.ravel(times).tolist()]
    return np.reshape(np.array(values, dtype=float), np.shape(times))
