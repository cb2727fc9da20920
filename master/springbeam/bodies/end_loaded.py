"""Loads that act on the interface end of a body, where they are forces like that of the contact."""

from __future__ import annotations

from collections.abc import Sequence

from ..scene import Load
from .force import combined, work_on
from .protocol import NO_FORCE, Body, Force, Motion


class EndLoaded(Body):
    """A body that takes loads on its end; if it is a mass there, also the acceleration of its base."""

    _on_end: Force = NO_FORCE
    #: Work of the loads so far [J].
    _load_work: float = 0.0

    def expect_loads(self, loads: Sequence[Load]) -> None:
        #: What a unit of each load is at the end [N].
        self._at_end = [-self.mass if load.on == "base" else 1.0 for load in loads]

    def set_loads(self, forces: Sequence[Force]) -> None:
        self._on_end = combined(self._at_end, forces)

    def load_on_end(self) -> Force:
        return self._on_end

    def _book_load(self, load: Force, start: Motion, end: Motion, size: float) -> None:
        """Count the work of ``load`` over a step of ``size`` [s]; the ledger of the interface knows no loads."""
        if load is not NO_FORCE:
            self._load_work += work_on(load, start, end, size)
