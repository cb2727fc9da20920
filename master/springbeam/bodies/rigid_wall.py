"""An end that nothing moves."""

from __future__ import annotations

from collections.abc import Sequence

from ..scene import Load
from .protocol import NO_FORCE, Body, Force, Motion


class RigidWall(Body):
    """An end held at rest at ``position`` [m]: the foundation, an elastic stop, or a seated spring."""

    CHECKPOINTED = ("_size",)

    mass = float("inf")

    def __init__(self, position: float) -> None:
        self._position = position
        self._size = 0.0

    def mark(self) -> None: ...

    def rewind(self) -> None: ...

    def advance(self, time: float, size: float, contact: Force, foundation: Force = NO_FORCE) -> Motion:
        self._size = size
        return self.motion()

    def motion(self) -> Motion:
        w, h = self._position, self._size
        return Motion(w, 0.0, w * h, 0.5 * w * h * h)

    def apply_impulse(self, impulse: float) -> None: ...

    def expect_loads(self, loads: Sequence[Load]) -> None: ...
