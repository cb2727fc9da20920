"""The ranges in which keys are sought, and starts all over them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...scene import ArgumentError, key_kind
from ...scene.messages import key_bounds
from ...scene.scene import split_key
from ..design import parse_axis
from ..tables import Row

#: The range of a key goes from its guess over this to its guess times this.
_RANGE = 3.0


@dataclass(frozen=True)
class Ranges:
    """From where to where each key is sought: ``ends`` of one sign, the lower one first.

    The unknowns of a search are 1 + ln of a key over its smaller end, so that keys keep their signs.
    """

    ends: Mapping[str, tuple[float, float]]

    @classmethod
    def parse(cls, texts: Sequence[str]) -> Ranges:
        """Read ``KEY=GUESS`` or ``KEY=LOW:HIGH`` each. Raises SceneError if they cannot be fitted."""
        ranges = dict[str, tuple[float, float]]()
        for text in texts:
            axis = parse_axis(text)
            key = split_key(axis.name)
            if key is None or key_kind(*key) is not float:
                raise ArgumentError(f"--vary {axis.name}: takes no real numbers, and cannot be fitted")
            if axis.name in ranges:
                raise ArgumentError(f"--vary {axis.name}: given twice")
            low, high = (axis.low, axis.high) if not axis.values else (min(axis.values), max(axis.values))
            if len(axis.values) > 1 or low * high <= 0.0:
                raise ArgumentError(
                    f"--vary {axis.name}: a guess is one value that has the sign and roughly the size of what is "
                    "sought, as in spring.linear_stiffness=800, or a range of one sign, as 500:1200; 0 has no size"
                )
            if axis.values:
                least, most = key_bounds(*key)
                ends = sorted((low / _RANGE, low * _RANGE))
                # A guess that is not allowed itself is refused with the scene.
                low, high = (max(ends[0], least), min(ends[1], most)) if least <= low <= most else ends
            ranges[axis.name] = (min(low, high), max(low, high))
        if not ranges:
            raise ArgumentError("--vary: nothing varies; give at least one KEY=GUESS")
        return cls(ranges)

    @property
    def limits(self) -> tuple[np.ndarray, np.ndarray]:
        """The least and the largest unknowns, shapes (k,)."""
        wide = [abs(math.log(high / low)) for low, high in self.ends.values()]
        return np.ones(len(wide)), 1.0 + np.array(wide)

    def values(self, unknowns: np.ndarray) -> Row:
        """Return the keys at ``unknowns``, shape (k,); at a limit the end of its range, not beyond by rounding."""
        keys = {
            name: min(ends, key=abs) * math.exp(x - 1.0)
            for (name, ends), x in zip(self.ends.items(), unknowns.tolist(), strict=True)
        }
        for name, ends in self.ends.items():
            keys[name] = next((end for end in ends if math.isclose(keys[name], end, rel_tol=1e-14)), keys[name])
        return keys

    def starts(self, count: int) -> list[np.ndarray]:
        """Return unknowns all over the ranges, the middle (a guess) first: the R sequence (Roberts 2018)."""
        low, high = self.limits
        golden = 2.0
        for _ in range(50):  # the root of x^(k+1) = x + 1
            golden = (1.0 + golden) ** (1.0 / (len(low) + 1.0))
        turn = golden ** -(1.0 + np.arange(len(low)))
        return [low + (high - low) * ((0.5 + k * turn) % 1.0) for k in range(count)]
