"""Loads that act on the interface end of a body, where they are forces like that of the contact."""

from __future__ import annotations

from collections.abc import Sequence

from ..scene import Load
from .force import combined
from .protocol import NO_FORCE, Body, Force


class EndLoaded(Body):
    """A body that takes loads on its end; if it is a mass there, also the acceleration of its base."""

    _on_end: Force = NO_FORCE

    def expect_loads(self, loads: Sequence[Load]) -> None:
        #: What a unit of each load is at the end [N].
        self._at_end = [-self.mass if load.on == "base" else 1.0 for load in loads]

    def set_loads(self, forces: Sequence[Force]) -> None:
        self._on_end = combined(self._at_end, forces)

    def load_on_end(self) -> Force:
        return self._on_end
