"""An end that nothing moves."""

from __future__ import annotations

from collections.abc import Sequence

from ..scene import Load
from .protocol import NO_FORCE, Force, Motion, Prescribed


class RigidWall(Prescribed):
    """An end held at rest at ``position`` [m]: the foundation, an elastic stop, or a seated spring."""

    CHECKPOINTED = ("_motion",)

    def __init__(self, position: float) -> None:
        super().__init__(Motion(position, 0.0, 0.0, 0.0))

    def advance(self, time: float, size: float, contact: Force, foundation: Force = NO_FORCE) -> Motion:
        w = self._motion.displacement
        self._motion = Motion(w, 0.0, w * size, 0.5 * w * size * size)
        return self._motion

    def expect_loads(self, loads: Sequence[Load]) -> None: ...
