"""A number that is known exactly, and its value by the FMUs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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
        Largest \\|computed − exact\\| that passes; ``None`` if the number is reported, not judged.
    reason
        Where the bound comes from, or why there is none.
    """

    quantity: str
    exact: float | None
    computed: float | None
    bound: float | None
    reason: str

    @property
    def error(self) -> float | None:
        """computed − exact."""
        return None if self.exact is None or self.computed is None else self.computed - self.exact

    @property
    def passed(self) -> bool | None:
        """Whether the error is within the bound; ``None`` if the check is not judged. NaN does not pass."""
        if self.bound is None:
            return None
        return self.error is not None and abs(self.error) <= self.bound
