"""A number that is known exactly, and its value by the FMUs; sections of such numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...bodies.protocol import StepRefused
from ...run.outcome import RunStopped

EPS = float(np.finfo(float).eps)
UNIT_FORCE = (1.0, 0.0, 0.0)


@dataclass(frozen=True)
class Check:
    """One number that is known exactly, and its value by the FMUs.

    Parameters
    ----------
    quantity
        What is compared, with its unit.
    exact, computed
        The two values; ``computed`` is ``None`` where the FMUs gave none.
    bound
        Largest \\|computed − exact\\| that passes.
    reason
        Where the bound comes from.
    """

    quantity: str
    exact: float | None
    computed: float | None
    bound: float
    reason: str

    @property
    def error(self) -> float | None:
        """computed − exact."""
        return None if self.exact is None or self.computed is None else self.computed - self.exact

    @property
    def passed(self) -> bool:
        """Whether the error is within the bound; NaN is not."""
        return self.error is not None and abs(self.error) <= self.bound


@dataclass(frozen=True)
class Section:
    """An exact solution, and the cases in which the FMUs compute it, each by itself."""

    title: str
    solution: Callable[..., Iterator[Check]]
    cases: tuple[tuple[Any, ...], ...]  #: what the solution is called with

    def __call__(self) -> Iterator[Check]:
        """Yield the checks of all cases; a case that cannot be computed is a failed check."""
        for case in self.cases:
            try:
                yield from self.solution(*case)
            except (StepRefused, RunStopped) as error:
                given = f"{', '.join(map(str, case))}: " * bool(case)
                yield Check("not computed", None, None, 0.0, f"{given}{error}")


def section(title: str, *cases: tuple[Any, ...]) -> Callable[[Callable[..., Iterator[Check]]], Section]:
    """Return what makes a `Section` of an exact solution; without ``cases`` it is called once."""
    return lambda solution: Section(title, solution, cases or ((),))
