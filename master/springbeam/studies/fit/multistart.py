"""A fit from many starts: runs all over the ranges show where searches begin, and the best minimum is judged.

A wrong minimum looks like a right one from inside. Keys can also make up for a clock that is a period late, so that
searches begin at another shift of the clock as well.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from scipy.special import fdtri, stdtrit

from ...signals.measured import ALIKE, EQUAL, Measured, rms
from ..tables import Row
from .least import SHIFT, Minimum, Search, window
from .ranges import Ranges
from .verdict import OWN, Found, Left, is_white, no_noise, remembered

#: Runs all over the range, and searches from the best of them; the second time if what is left is no noise.
STARTS = (16, 64)
_LOOKS = (2, 4)
#: Steps of a first look by a search, and of the search that goes on.
_FIRST_LOOK = 2
_MOST = 15
#: No more runs than so many for each key are made after those all over the range.
_MOST_RUNS = 100
#: Marks of runs that judge a minimum: with shorter steps, and beside the repeated measurement.
_JUDGES = {"finer", "repeat"}
#: Searches that end at less than so many times the cost of the best one are continued as well.
_RIVAL = 4.0
_CONFIDENCE = 0.95
#: Share of a period by which another shift of the clock is away.
_AWAY = 0.4
#: Most searches that begin at other shifts, and how much larger than the best the mean square of a start may be.
_SHIFTS = 4
_PROMISING = 30.0
#: Share of the run within which shifts of the clock belong together.
_NEAR = 0.01
#: Unknowns are alike that differ by no more, relative to the keys.
_SAME = 1e-4


def most(keys: int) -> int:
    """Return the number of runs that a fit of so many keys makes at most, beside those that judge a minimum."""
    return STARTS[-1] + _MOST_RUNS * keys


def expected(keys: int, done: int) -> int:
    """Return the number of runs if the first look finds what is left to be noise; beyond that, the largest."""
    first = STARTS[0] + (_LOOKS[0] * (1 + _FIRST_LOOK) + 2) * (1 + keys)
    return first if done <= first else most(keys) + len(STARTS) * len(_JUDGES)


def name_of(case: Row) -> str:
    """Return the name of a case, which is all that it takes."""
    return ", ".join(f"{key} = {value}" for key, value in case.items())


@dataclass
class MultiStart:
    """A fit of keys to measured data."""

    ranges: Ranges  #: where keys are sought
    data: Measured
    repeated: Measured | None  #: a second measurement of the same
    free: bool  #: whether the shift of the clock of the measurement is found
    duration: float  #: of a whole run [s]
    make: Callable[[Row], Row]  #: makes the record of a case (`springbeam.studies.fit.study.Fit.record`)
    made: set[str] = field(default_factory=set)  #: the cases made so far, but for those that judge a minimum

    def found(self) -> Found | None:
        """Search from the best of runs all over the ranges; return what was found, ``None`` if nothing can be run."""
        starts = self.ranges.starts(STARTS[-1])
        begun = list[Search]()
        looked = list[Search]()
        chosen = list[Search]()
        best: Found | None = None
        done = 0
        for until, looks in zip(STARTS, _LOOKS, strict=True):
            begun += [search for at in starts[done:until] if (search := self._begun(at)) is not None]
            waiting = sorted((search for search in begun if search not in chosen), key=partial(_promise, begun))
            first = waiting[: looks - 1]
            looked += [search.least(_FIRST_LOOK) for search in first]
            second = self._elsewhere(begun, looked) if looked else []
            second = second or waiting[looks - 1 : looks]
            looked += [search.least(_FIRST_LOOK) for search in second]
            looked.sort(key=_cost)
            chosen += first + second
            done = until
            if looked:
                best = self._judged(looked)
                if best.ended and not any(map(no_noise, best.left.values())):
                    break
        return best and best._replace(ended=best.ended and len(self.made) <= most(len(self.ranges.ends)))

    def _trial(self, case: Row) -> Row:
        if not case.keys() & _JUDGES:
            self.made.add(name_of(case))
            if len(self.made) > most(len(self.ranges.ends)):
                return {"error": "the search has made as many runs as it may"}
        return self.make(case)

    def _begun(self, at: np.ndarray, more: Row | None = None) -> Search | None:
        """Return the search from a run, ``None`` if it cannot be made or covers too few points.

        ``more`` is what the case says beside the keys (`springbeam.studies.fit.study.Fit.record`).
        """
        row = self._trial(self.ranges.values(at) | (more or {}))
        if row["error"]:
            return None
        search = Search(
            lambda unknowns, window: self._trial(self.ranges.values(unknowns) | window | {"step": row["step"]}),
            self.data,
            self.ranges.limits,
            at,
            row,
            free=self.free,
        )
        return search if search.points > len(at) + self.free else None

    def _elsewhere(self, begun: Sequence[Search], looked: Sequence[Search]) -> list[Search]:
        """Return searches that begin at other shifts of the clock than all that have ``looked``, at most `_SHIFTS`.

        A motion that nearly repeats itself fits at shifts a period apart, each with keys of its own. One search begins
        with the best keys so far and their best other shift, others with keys and shift of a run that has ``begun``,
        if its mean square is no hopeless multiple of the best.
        """
        best = min(looked, key=_cost)
        last = self._begun(best.at, {"step": best.row["step"]}) if self.free else None
        if last is None:
            return []
        away = _AWAY * best.period
        taken = [search.row[SHIFT] for search in looked]

        def starts(searches: Sequence[Search]) -> list[tuple[float, float, Search]]:
            """Return mean squares, shifts away from those taken, and searches, the best first."""
            others = [(square, shift, search) for search in searches for shift, square in search.row["ranked"]]
            return sorted((one for one in others if _far(one[1], taken, away)), key=lambda one: one[0])

        promising = [one for one in starts(begun) if one[0] <= _PROMISING * best.cost]
        others = list[Search]()
        for _, shift, search in [*starts([last])[:1], *promising]:
            if len(others) < _SHIFTS and _far(shift, taken, away):
                taken.append(shift)
                other = self._begun(search.at, {"near": shift, "step": search.row["step"]})
                others += [other] if other is not None else []
        return others

    def _judged(self, looked: Sequence[Search]) -> Found:
        """Go on with the best of searches and with those that may end as well; return the evidence for the best.

        ``looked`` are sorted by their costs.
        """
        first = self._ended(looked[0])
        others = [other for other in looked[1:] if other.cost <= _RIVAL * first.cost]
        others = [other for other in others if _apart(other.at, first) or self._moved(other.row, first.row)]
        minima = [first, *(self._ended(other) for other in others)]
        best = min(minima, key=_cost)
        # What noise can make of one cost: the F test of all unknowns (Bates & Watts 1988, section 1.3).
        size = best.derivatives.shape[1]
        chance = float(fdtri(size, best.freedom, _CONFIDENCE)) * size / best.freedom
        as_well = [other for other in minima if other.cost <= (1.0 + chance) * best.cost and _apart(other.at, best)]
        names = [*self.ranges.ends, *[SHIFT] * self.free]
        alike = best.alike(names, float(np.ptp(self.data.time))) if best.ended else []
        changed = self._changed(best)
        left = self._left(best, changed)
        if self.repeated is not None:
            left = {name: self._beside_noise(best, name, part) for name, part in left.items()}
        # Points that remember their past count as fewer.
        counted = max(1.0 if is_white(part.off) else remembered(part.off) for part in left.values())
        half = math.sqrt(counted) * _half(best) + OWN * np.abs(best.moved_by(changed))
        keys = self._intervals(best, [math.inf] * size if alike else half.tolist())
        rivals = [self.ranges.values(other.at) for other in as_well]
        return Found(keys, self.ranges.ends, left, alike, rivals, best.ended, best.row[SHIFT])

    def _ended(self, search: Search) -> Minimum:
        """Return the minimum to which a search leads, several curves weighed by what is left of each.

        Where another shift of the clock fits these keys as well, and is smaller, the search goes on from there.
        """
        search = search.least(_MOST)
        if self.free:
            anywhere = self._begun(search.at, {"step": search.row["step"]})
            if anywhere is not None and self._moved(anywhere.row, search.row) and _as_good(anywhere, search):
                search = anywhere.least(_MOST)
        if len(self.data.values) > 1:
            search = search.evenly().least(_MOST)
        return search.minimum()

    def _moved(self, row: Row, other: Row) -> bool:
        """Return whether the clocks of two runs are apart."""
        return bool(abs(row[SHIFT] - other[SHIFT]) > _NEAR * self.duration)

    def _left(self, best: Minimum, changed: Mapping[str, np.ndarray]) -> dict[str, Left]:
        """Return what is left of the curves, by their names, beside what shorter steps have ``changed``."""
        return {
            name: Left(off, rms(off), rms(off) / self.data.spread(name), rms(changed[name]))
            for name, off in best.left.items()
        }

    def _changed(self, best: Minimum) -> dict[str, np.ndarray]:
        """Return what shorter steps change in the curves, 0 if the scene cannot be run with them."""
        shift = best.row[SHIFT]
        finer = self._trial(self._keys(best) | window((shift, shift, shift), best.part) | {"finer": True})
        if finer["error"]:
            finer = best.row
        return {
            name: np.array(finer["off"][name], float)[best.part] - np.array(curve, float)[best.part]
            for name, curve in best.row["off"].items()
        }

    def _keys(self, best: Minimum) -> Row:
        return {name: best.row[name] for name in self.ranges.ends}

    def _intervals(self, best: Minimum, half: Sequence[float]) -> list[Row]:
        """Return the values at a minimum, with intervals of a half width unless that is infinite."""
        width = np.nan_to_num(half[: len(self.ranges.ends)], posinf=0.0)
        values, *ends = (self.ranges.values(best.at + side * width) for side in (0.0, -1.0, 1.0))
        intervals = [(value, *sorted(end[name] for end in ends)) for name, value in values.items()]
        names = [*self.ranges.ends]
        if self.free:
            names.append(SHIFT)
            intervals.append((best.shift, best.shift - half[-1], best.shift + half[-1]))
        return [
            {"key": name, "value": value, "low": low if known else None, "high": high if known else None}
            for name, (value, low, high), known in zip(names, intervals, np.isfinite(half), strict=True)
        ]

    def _beside_noise(self, best: Minimum, name: str, left: Left) -> Left:
        """Return what is left of a curve with the noise: what two measurements differ in beside the run, over √2."""
        assert self.repeated is not None
        row = self._trial(self._keys(best) | {"repeat": True})
        times = self.repeated.time + row[SHIFT]
        ours = self.data.time[best.part] + best.row[SHIFT]
        # The nearest point: between two, noise would be smaller.
        nearest = np.searchsorted(0.5 * (times[1:] + times[:-1]), ours)
        apart = np.array(row["off"][name], float)[nearest] - left.off
        apart = apart[np.isfinite(apart)] / math.sqrt(2.0)
        return left._replace(noise=rms(apart), free=len(apart) / remembered(apart))


def _promise(begun: Sequence[Search], search: Search) -> tuple[bool, float]:
    """Return what sorts searches: first those whose neighbours all cost more, then others, by their cost."""
    nearest = sorted(begun, key=lambda other: float(np.linalg.norm(other.at - search.at)))
    around = nearest[1 : 2 * len(search.at) + 1]
    return any(other.cost < search.cost for other in around), search.cost


def _far(shift: float, others: Sequence[float], away: float) -> bool:
    return min(abs(shift - other) for other in others) > away


def _cost(search: Search | Minimum) -> float:
    return search.cost


def _half(best: Minimum) -> np.ndarray:
    """Return half of the width of the intervals of the unknowns."""
    return float(stdtrit(best.freedom, 0.5 + 0.5 * _CONFIDENCE)) * best.deviations


def _apart(at: np.ndarray, best: Minimum) -> bool:
    """Return whether unknowns are away from a minimum: not in its intervals, three times as wide."""
    return bool(np.any(np.abs(at - best.at) > 3.0 * _half(best)[: len(at)] + _SAME))


def _as_good(search: Search, other: Search) -> bool:
    """Return whether a search begins at a cost that is not larger than that of another."""
    return search.cost <= (1.0 + EQUAL) * other.cost + ALIKE
