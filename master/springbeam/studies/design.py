"""Variations of studies: keys with their values, as ``TABLE.KEY=VALUES``, and couplings."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from ..scene import ArgumentError, Scene, SceneError, key_kind, parse_value, with_changes
from ..scene.scene import split_key

#: The couplings that studies run: scheme and degree, of rigid and of soft laws.
RIGID = (("energy", 0), ("energy", 1), ("energy", 2))
SOFT = (*RIGID, ("jacobi", 0), ("jacobi", 1), ("gauss_seidel", 0), ("gauss_seidel", 1))
Sampling = Literal["random", "latin_hypercube"]
#: Values of a grid; more are a mistyped count.
_MOST = 10_000_000
#: Whole numbers beyond are none in a column of floating-point numbers.
_LARGEST_WHOLE = 2**53


@dataclass(frozen=True)
class Axis:
    """A key, as ``spring.mass``, or another number that varies: ``values``, or a range that is sampled, or both."""

    name: str
    values: tuple[Any, ...] = ()
    low: float = 0.0
    high: float = 0.0
    log: bool = False
    whole: bool = False  #: it takes whole numbers
    zero: float = 0.0  #: the share of samples at which it is 0

    def at(self, fraction: float) -> Any:
        """Return the value at a fraction in [0, 1] of the range, exactly its ends at 0 and 1; without one, a value."""
        if self.low == self.high:
            return self.values[min(int(fraction * len(self.values)), len(self.values) - 1)]
        if fraction < self.zero:
            return 0.0
        fraction = (fraction - self.zero) / (1.0 - self.zero)
        if self.log:
            value = self.low ** (1.0 - fraction) * self.high**fraction
        else:
            value = self.low * (1.0 - fraction) + self.high * fraction
        return round(value) if self.whole else float(value)

    def grid(self, count: int) -> tuple[Any, ...]:
        """Return ``count`` values from end to end of the range; one that may be 0 begins there."""
        inside = [self.at(self.zero + (1.0 - self.zero) * k / (count - 1)) for k in range(count)]
        return (0.0, *inside[1:]) if self.zero else tuple(inside)


def with_keys(scene: Scene, case: Mapping[str, Any]) -> Scene:
    """Return ``scene`` with the values of a case, by ``accuracy`` and ``table.key``; other names are labels.

    Raises SceneError if it cannot be run.
    """
    return with_changes(scene, {name: case[name] for name in case if name == "accuracy" or split_key(name)})


def parse_axis(text: str) -> Axis:
    """Read ``table.key=`` and a list ``1,2,5``, a grid ``low:high:count``, or a range to sample ``low:high``.

    ``:log`` at the end spaces a grid or a range evenly in the logarithm.

    Raises
    ------
    SceneError
        If it is none of these; the message names the allowed forms.
    """
    target, separator, values = text.partition("=")
    split = split_key(target)
    if not separator or split is None or not values.strip():
        raise _wrong(text, "must be TABLE.KEY=VALUES, as in spring.mass=0.5:2:16")
    try:
        kind = key_kind(*split)
    except SceneError as error:
        raise _wrong(text, str(error)) from None
    parts = [part.strip() for part in values.split(":")]
    if len(parts) == 1:
        listed = tuple(parse_value(value.strip()) for value in values.split(","))
        for value in listed:
            if not _is(kind, value):
                raise _wrong(text, f"{value!r} is no value of {split[1]}; a list is 1,2,5, a range LOW:HIGH:COUNT")
        return Axis(target, listed)
    log = parts[-1] == "log"
    ends = parts[:2]
    counted = parts[2 : len(parts) - log]
    try:
        low, high = map(float, ends)
        count = int(*counted)
        possible = low != high and math.isfinite(high - low) and (not log or min(low, high) > 0.0)
    except (ValueError, TypeError):
        possible = False
    if not possible or (counted and not 2 <= count <= _MOST):
        raise _wrong(
            text,
            f"a range is LOW:HIGH:COUNT with LOW and HIGH different and COUNT from 2 to {_MOST}, or LOW:HIGH with "
            "--samples; :log may follow if both are greater than 0",
        )
    axis = Axis(target, (), low, high, log, kind is int)
    return replace(axis, values=axis.grid(count)) if count else axis


def _is(kind: type, value: Any) -> bool:
    """Return whether a column of values of ``kind`` can hold ``value``, allowed or not."""
    if kind in (str, bool):
        return isinstance(value, kind)
    return isinstance(value, float) or (type(value) is int and abs(value) <= _LARGEST_WHOLE)


def _wrong(text: str, why: str) -> SceneError:
    return ArgumentError(f"--vary {text}: {why}")


def design(axes: Sequence[Axis], samples: int, seed: int, sampling: Sampling) -> list[tuple[Any, ...]]:
    """Return the values of the axes, one tuple per run.

    Without sampled ranges that is the product of all lists and grids, the last axis fastest. With ``samples`` > 0 each
    axis is sampled: ranges and grids between their ends, lists by equal shares.
    """
    if not axes:
        raise ArgumentError("--vary: nothing varies; give at least one TABLE.KEY=VALUES")
    names = [axis.name for axis in axes]
    if doubled := sorted({name for name in names if names.count(name) > 1}):
        raise ArgumentError(f"--vary {doubled[0]}: given twice")
    if samples == 0:
        if open_ranges := [axis.name for axis in axes if not axis.values]:
            raise ArgumentError(
                f"--vary {open_ranges[0]}: a range without a count is sampled; give --samples, or a count"
            )
        return list(itertools.product(*(axis.values for axis in axes)))
    if sampling == "latin_hypercube":
        from scipy.stats import qmc  # takes a second to load: only for samples

        unit = qmc.LatinHypercube(len(axes), seed=seed).random(samples)
    else:
        unit = np.random.default_rng(seed).random((samples, len(axes)))
    return [tuple(axis.at(float(x)) for axis, x in zip(axes, row, strict=True)) for row in unit]
