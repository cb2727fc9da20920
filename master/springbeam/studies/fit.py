"""Find keys of a scene by measured curves: least squares over runs, with confidence intervals and a verdict.

Curves of different units are weighed by their spread, and then by what is left of each. The clock of the measurement
may be off by a shift, which is eliminated inside each residual (`studies/least.py`) unless it is given. Runs all over
the range of the keys show where searches begin: a wrong minimum looks like a right one from inside.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, partial
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np
from rich.text import Text
from scipy.special import chdtri, fdtri, stdtrit

from ..run.outcome import RunStopped
from ..scene import ArgumentError, Scene, SceneError, key_kind, with_changes
from ..scene.scene import split_key
from ..scene.tables import TOLERANCE_KEYS
from ..signals.measured import ALIKE, EQUAL, Measured, aligned, correlated, read_measured, reading_of
from .accuracy import simulate
from .design import parse_axis, with_keys
from .least import SHIFT, Minimum, Search
from .study import Make, Study
from .tables import Findings, Row, table

_DISAGREES = 1
_STOPPED = 3
#: The range of a key goes from its guess over this to its guess times this.
_RANGE = 3.0
#: Runs all over the range, and searches from the best of them; the second time if what is left is no noise.
_STARTS = (16, 64)
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
#: Chance that what is called no noise is noise.
_CHANCE = 1e-3
#: Lags of the autocorrelation that are judged, and the fewest points of which they can be.
_LAGS = 20
_FEWEST = 12
#: What is left of a curve, over its spread: no more than this is rounding of a search, no less than that is no fit.
_ROUNDING = 1e-9
_APART = 0.5
#: An error of the run itself is at most so many times what shorter steps change.
_OWN = 4.0
#: Makes a tolerance or an accuracy tighter, as half the macro step does.
_TIGHTER = 0.1
#: Share of the run within which shifts of the clock belong together.
_NEAR = 0.01
#: Unknowns are alike that differ by no more, relative to the keys.
_SAME = 1e-4
#: A key is not determined if its interval is wider than this factor to each side.
_WIDE = 2.0


class Left(NamedTuple):
    """What is left of a curve at the values found."""

    off: np.ndarray  #: run less measurement, shape (n,)
    rms: float
    share: float  #: ``rms`` over the spread of what was measured
    own: float = 0.0  #: rms of what shorter steps change
    noise: float | None = None  #: rms of the noise, by a measurement that was repeated
    free: float = 1.0  #: how many independent points of noise there are


class Found(NamedTuple):
    """The values found, and the evidence that the data determines them."""

    keys: list[Row]  #: ``key``, ``value``, ``low`` and ``high`` of its interval
    ranges: Mapping[str, tuple[float, float]]  #: in which keys were sought
    left: Mapping[str, Left]  #: by curve
    alike: Sequence[str]  #: which unknowns change nothing, or the curves in the same way
    rivals: Sequence[Row]  #: values elsewhere in the ranges that fit as well
    ended: bool  #: whether no further step of the search would gain anything


def undetermined(found: Found) -> list[str]:
    """Return why keys are not determined by the data; nothing if they are.

    They are determined if the search has ended in a minimum, what is left of every curve is noise (no more than half of
    its spread, and white, or as large as the noise of a repeated measurement) or an error of the run itself, no other
    start in their ranges has led to values that fit as well, and every interval lies inside its range and within a
    factor of two of its value.
    """
    why = [f"{name}: {doubt}" for name, left in found.left.items() if (doubt := no_noise(left))]
    if found.ended:
        why += found.alike
    for rival in found.rivals:
        values = ", ".join(f"{name} = {value:.5g}" for name, value in rival.items())
        why.append(f"{values} fits as well; measure another curve, or give a narrower range")
    any_wide = False
    for row in found.keys:
        name, value, low, high = row.values()
        if low is None or name == SHIFT:
            continue
        least, most = found.ranges[name]
        if max(abs(high), abs(low)) > _WIDE * abs(value) or min(abs(high), abs(low)) < abs(value) / _WIDE:
            any_wide = True
            why.append(f"{name} may be anything from {low:.3g} to {high:.3g}")
        elif low <= least or high >= most:
            why.append(
                f"{name}: its interval reaches the end of the range from {least:g} to {most:g}; give another range, "
                f"as --vary {name}={least:g}:{most:g}"
            )
    if not found.ended and not any_wide:  # in a valley that wide, its end is of no interest
        why.append("the search has not ended in a minimum; give a narrower range")
    return why


def no_noise(left: Left) -> str:
    """Return why what is left of a curve is no noise; nothing if it is, or no larger than the error of the run."""
    if left.share <= _ROUNDING or (left.share <= _APART and left.rms <= _OWN * left.own):
        return ""
    if left.noise is not None:
        if left.rms**2 <= left.noise**2 * float(fdtri(left.free, left.free, 1.0 - _CHANCE)):
            return ""
        return f"what is left is {left.rms / left.noise:.3g} times the noise of the repeated measurement"
    if left.share > _APART:
        return f"what is left is {left.share:.0%} of its spread; the curves do not agree"
    if len(left.off) < _FEWEST:
        return f"{len(left.off)} points are too few to decide whether the residual is noise; --repeat a measurement"
    if not is_white(left.off):
        return (
            f"what is left ({left.share:.2g} of its spread) is no noise: it remembers its past; something else in the "
            "scene is wrong, or --repeat shows that the noise does so"
        )
    return ""


def is_white(off: np.ndarray) -> bool:
    """Return whether a series does not remember its past, by Ljung and Box (1978) at a level of 1e-3.

    A short series is not called white.
    """
    if len(off) < _FEWEST:
        return False
    lags = min(_LAGS, len(off) // 4)
    size = len(off) - 1.0 - np.arange(lags)
    statistic = len(off) * (len(off) + 2.0) * float(np.sum(_autocorrelation(off)[1 : lags + 1] ** 2 / size))
    return statistic <= float(chdtri(lags, _CHANCE))


def remembered(off: np.ndarray) -> float:
    """Return how many points of a series count as one: 1 + 2 Σ ρ up to the first ρ that is not positive."""
    past = _autocorrelation(off)[1:]
    end = int(np.argmax(past <= 0.0)) if (past <= 0.0).any() else len(past)
    return 1.0 + 2.0 * float(past[:end].sum())


def _autocorrelation(off: np.ndarray) -> np.ndarray:
    centred = off - off.mean()
    found = correlated(centred, centred)[len(off) - 1 :]
    return np.asarray(found / max(float(found[0]), 1e-300))


class Fit(Study):
    """What is sought by which measurement."""

    kind: ClassVar[str] = "fit"
    announced: ClassVar[str] = "about {} runs"

    scene: Scene
    file: Path  #: the measured columns, time first
    vary: tuple[str, ...]  #: ``KEY=GUESS`` or ``KEY=LOW:HIGH`` each
    names: tuple[str, ...] = ()  #: ``NAME=COLUMN`` each: which column of a run a measured one is
    read: tuple[str, ...] = ()  #: ``KEY=VALUE`` each: how the file is read
    shift: float | None = None  #: by which the clock of the measurement is moved [s]; found if it is left out
    repeat: Path | None = None  #: a second measurement of the same, which shows the noise

    @cached_property
    def data(self) -> Measured:
        """What is measured. Raises SceneError if the file cannot be used."""
        return read_measured(self.file, self.scene, mapping(self.names), reading_of(self.read))

    @cached_property
    def repeated(self) -> Measured | None:
        """The second measurement."""
        if self.repeat is None:
            return None
        return read_measured(self.repeat, self.scene, mapping(self.names), reading_of(self.read))

    @cached_property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """From where to where each key is sought."""
        found = dict[str, tuple[float, float]]()
        for text in self.vary:
            axis = parse_axis(text)
            key = split_key(axis.name)
            if key is None or key_kind(*key) is not float:
                raise ArgumentError(f"--vary {axis.name}: takes no real numbers, and cannot be fitted")
            if axis.name in found:
                raise ArgumentError(f"--vary {axis.name}: given twice")
            low, high = (axis.low, axis.high) if not axis.values else (min(axis.values), max(axis.values))
            if len(axis.values) > 1 or low * high <= 0.0:
                raise ArgumentError(
                    f"--vary {axis.name}: a guess is one value that has the sign and roughly the size of what is "
                    "sought, as in spring.linear_stiffness=800, or a range of one sign, as 500:1200; 0 has no size"
                )
            low, high = (low / _RANGE, low * _RANGE) if axis.values else (low, high)
            found[axis.name] = (min(low, high), max(low, high))
        if not found:
            raise ArgumentError("--vary: nothing varies; give at least one KEY=GUESS")
        return found

    @property
    def _logarithms(self) -> tuple[np.ndarray, np.ndarray]:
        """The ranges of the unknowns: 1 + ln of a key over its smaller end."""
        wide = [abs(math.log(high / low)) for low, high in self.ranges.values()]
        return np.ones(len(wide)), 1.0 + np.array(wide)

    def _values(self, unknowns: np.ndarray) -> Row:
        """Return the keys at ``unknowns``."""
        return {
            name: min(ends, key=abs) * math.exp(x - 1.0)
            for (name, ends), x in zip(self.ranges.items(), unknowns.tolist(), strict=True)
        }

    def _starts(self) -> list[np.ndarray]:
        """Return unknowns all over the ranges, the middle (a guess) first: the R sequence (Roberts 2018)."""
        low, high = self._logarithms
        golden = 2.0
        for _ in range(50):  # the root of x^(k+1) = x + 1
            golden = (1.0 + golden) ** (1.0 / (len(low) + 1.0))
        turn = golden ** -(1.0 + np.arange(len(low)))
        return [low + (high - low) * ((0.5 + k * turn) % 1.0) for k in range(_STARTS[-1])]

    def cases(self) -> dict[str, Row]:
        """Return the runs with which the search begins. Raises SceneError if nothing can be found."""
        cases = [self._values(start) for start in self._starts()[: _STARTS[0]]]
        with_keys(self.scene, cases[0])
        data = self.data
        free = self.shift is None
        begin = self.scene.contact_time or 0.0
        end = self.scene.time.t_end
        inside = int(np.sum((data.time + (self.shift or 0.0) >= begin) & (data.time + (self.shift or 0.0) <= end)))
        if free:
            last = np.searchsorted(data.time, data.time + (end - begin), side="right")
            inside = int(np.max(last - np.arange(len(last))))
        if inside <= len(self.ranges) + free:
            raise ArgumentError(
                f"{self.file}: fewer of its points lie in the run than are needed to find {', '.join(self.ranges)}"
                f"{' and the shift of its clock' * free}; make time.t_end longer, give more points, or another --shift"
            )
        _ = self.repeated
        return {_name(case): case for case in cases}

    def expected(self, done: int = 0) -> int:
        """Return the number of runs if the first look finds what is left to be noise; beyond that, the largest."""
        differences = 1 + len(self.ranges)
        first = _STARTS[0] + (_LOOKS[0] * (1 + _FIRST_LOOK) + 2) * differences
        return first if done <= first else self.most + len(_STARTS) * len(_JUDGES)

    @property
    def most(self) -> int:
        """Number of runs that a search makes at most."""
        return _STARTS[-1] + _MOST_RUNS * len(self.ranges)

    def settings(self) -> dict[str, Any]:
        """Return the identity of a fit; measurements count by their content."""
        several = [data for data in (self.data, self.repeated) if data is not None]
        held = [hashlib.sha256(part.tobytes()) for data in several for part in (data.time, *data.values.values())]
        return super().settings() | {"measured": [part.hexdigest() for part in held]}

    def record(self, case: Row) -> Row:
        """Run one case; return what is left of the curves at the shift that fits best, or why it cannot be run."""
        keys = {name: case[name] for name in self.ranges}
        try:
            scene = with_keys(self.scene, keys)
            run = simulate(_finer(scene) if case.get("finer") else scene)
        except (RunStopped, SceneError) as refused:
            return {**keys, "error": str(refused)}
        data = self.repeated if case.get("repeat") else self.data
        assert data is not None
        given = (-math.inf, math.inf) if self.shift is None else (self.shift, self.shift)
        found = aligned(run, data, case.get("lowest", given[0]), case.get("highest", given[1]))
        left = {f"left_{name}": rms(off) for name, off in found.off.items()}
        ends = {"begin": float(run.time[0]), "end": float(run.time[-1])}
        return {
            **keys,
            SHIFT: found.shift,
            **left,
            "error": "",
            **ends,
            "off": found.off,
            "slope": found.slope,
            "others": found.others,
        }

    def made(self, make: Make, known: Mapping[str, Row]) -> dict[str, Row]:
        """Search; return all runs."""
        self._found(lambda case: make({_name(case): case})[_name(case)])
        return dict(known)

    def findings(self, records: Mapping[str, Row]) -> Findings:
        """Return the values found with their intervals, and why the data does not determine them (exit code 1)."""
        found = self._found(lambda case: records[_name(case)])
        kept = ("off", "slope", "others", "begin", "end")
        runs = [{name: value for name, value in row.items() if name not in kept} for row in records.values()]
        if found is None:
            first = next(iter(records.values()))["error"]
            error = f"none of {len(runs)} runs in the range could be made; the first: {first}"
            return Findings({"keys": []}, code=_STOPPED, error=error, tables={self.kind: runs})
        why = undetermined(found)
        left = {name: (left.rms, left.share) for name, left in found.left.items()}
        shown: list[Any] = [
            table(("key", "value:.8g", "95 % from:.6g", "to:.6g"), [list(row.values()) for row in found.keys]),
            table(("curve", "left, rms:.4g", "of its spread:.2%"), [(name, *sizes) for name, sizes in left.items()]),
            f"{len(runs)} runs",
            *(Text(f"not determined: {doubt}", style="bold red") for doubt in why),
        ]
        document = {"keys": found.keys, "left": left, "undetermined": why}
        return Findings(document, shown, code=_DISAGREES * bool(why), tables={self.kind: runs})

    # Search

    def _found(self, make: Callable[[Row], Row]) -> Found | None:
        """Search from the best of runs all over the ranges; return what was found, ``None`` if nothing can be run."""
        made = set[str]()

        def trial(case: Row) -> Row:
            if case.keys() & _JUDGES:
                return make(case)
            made.add(_name(case))
            return make(case) if len(made) <= self.most else {"error": "the search has made as many runs as it may"}

        starts = self._starts()
        begun = list[Search]()
        looked = list[Search]()
        chosen = list[Search]()
        found: Found | None = None
        done = 0
        for until, looks in zip(_STARTS, _LOOKS, strict=True):
            begun += [search for at in starts[done:until] if (search := self._begun(trial, at)) is not None]
            waiting = sorted((search for search in begun if search not in chosen), key=partial(_promise, begun))
            first = waiting[: looks - 1]
            looked += [search.least(_FIRST_LOOK) for search in first]
            other = self._elsewhere(trial, min(looked, key=_cost)) if looked else None
            second = [other] if other is not None else waiting[looks - 1 : looks]
            looked += [search.least(_FIRST_LOOK) for search in second]
            looked.sort(key=_cost)
            chosen += first + second
            done = until
            if looked:
                found = self._judged(trial, looked)
                if found.ended and not any(map(no_noise, found.left.values())):
                    break
        return found and found._replace(ended=found.ended and len(made) <= self.most)

    def _begun(
        self, trial: Callable[[Row], Row], at: np.ndarray, shifts: Mapping[str, float] | None = None
    ) -> Search | None:
        """Return the search from a run, ``None`` if it cannot be made or covers too few points."""
        free = self.shift is None

        def run(unknowns: np.ndarray, lowest: float, highest: float) -> Row:
            return trial(self._values(unknowns) | ({"lowest": lowest, "highest": highest} if free else {}))

        row = trial(self._values(at) | dict(shifts or {}))
        if row["error"]:
            return None
        search = Search(run, self.data, self._logarithms, at, row, free=free)
        return search if search.part.sum() > len(at) + free else None

    def _elsewhere(self, trial: Callable[[Row], Row], last: Search) -> Search | None:
        """Return a search that begins with the keys to which ``last`` has led, and another shift of the clock.

        Keys can make up for a clock that is a period late, as a damping for a decay. ``None`` where no other shift is.
        """
        if self.shift is not None:
            return None
        row = trial(self._values(last.at))
        away = 0.4 * last.period
        several = [(misfit, shift) for shift, misfit in row.get("others", ()) if abs(shift - last.row[SHIFT]) > away]
        if not several:
            return None
        _, shift = min(several)
        return self._begun(trial, last.at, {"lowest": shift - 0.25 * away, "highest": shift + 0.25 * away})

    def _judged(self, trial: Callable[[Row], Row], looked: Sequence[Search]) -> Found:
        """Go on with the best of searches and with those that may end as well; return the evidence for the best.

        ``looked`` are sorted by their costs.
        """
        first = self._ended(trial, looked[0])
        others = [other for other in looked[1:] if other.cost <= _RIVAL * first.cost]
        others = [other for other in others if _apart(other.at, first) or _moved(other.row, first.row)]
        minima = [first, *(self._ended(trial, other) for other in others)]
        best = min(minima, key=_cost)
        # What noise can make of one cost: the F test of all unknowns (Bates & Watts 1988, section 1.3).
        size = best.derivatives.shape[1]
        chance = float(fdtri(size, best.freedom, _CONFIDENCE)) * size / best.freedom
        as_well = [other for other in minima if other.cost <= (1.0 + chance) * best.cost and _apart(other.at, best)]
        names = [*self.ranges, *[SHIFT] * (self.shift is None)]
        alike = best.alike(names, float(np.ptp(self.data.time))) if best.ended else []
        changed = self._changed(trial, best)
        left = self._left(best, changed)
        if self.repeated is not None:
            left = {name: self._beside_noise(trial, best, name, part) for name, part in left.items()}
        # Points that remember their past count as fewer.
        counted = max(1.0 if is_white(part.off) else remembered(part.off) for part in left.values())
        half = math.sqrt(counted) * _half(best) + _OWN * np.abs(best.moved_by(changed))
        keys = self._intervals(best, [math.inf] * size if alike else half.tolist())
        return Found(keys, self.ranges, left, alike, [self._values(other.at) for other in as_well], best.ended)

    def _left(self, best: Minimum, changed: Mapping[str, np.ndarray]) -> dict[str, Left]:
        """Return what is left of the curves, by their names, beside what shorter steps have ``changed``."""
        found = {}
        for name, curve in best.row["off"].items():
            off = np.array(curve, float)[best.part]
            found[name] = Left(off, rms(off), rms(off) / self.data.spread(name), rms(changed[name]))
        return found

    def _changed(self, trial: Callable[[Row], Row], best: Minimum) -> dict[str, np.ndarray]:
        """Return what shorter steps change in the curves, 0 if the scene cannot be run with them."""
        keys = {name: best.row[name] for name in self.ranges}
        shift = best.row[SHIFT]
        finer = trial(keys | {"lowest": shift, "highest": shift, "finer": True})
        if finer["error"]:
            finer = best.row
        return {
            name: np.array(finer["off"][name], float)[best.part] - np.array(curve, float)[best.part]
            for name, curve in best.row["off"].items()
        }

    def _ended(self, trial: Callable[[Row], Row], search: Search) -> Minimum:
        """Return the minimum to which a search leads, several curves weighed by what is left of each.

        Where another shift of the clock fits these keys as well, and is smaller, the search goes on from there.
        """
        search = search.least(_MOST)
        if self.shift is None:
            anywhere = self._begun(trial, search.at)
            if anywhere is not None and _moved(anywhere.row, search.row) and _as_good(anywhere, search):
                search = anywhere.least(_MOST)
        if len(self.data.values) > 1:
            search = search.evenly().least(_MOST)
        return search.minimum()

    def _intervals(self, best: Minimum, half: Sequence[float]) -> list[Row]:
        """Return the values at a minimum, with intervals of a half width unless that is infinite."""
        width = np.nan_to_num(half[: len(self.ranges)], posinf=0.0)
        values, *ends = (self._values(best.at + side * width) for side in (0.0, -1.0, 1.0))
        found = [(value, *sorted(end[name] for end in ends)) for name, value in values.items()]
        names = list(self.ranges)
        if self.shift is None:
            names.append(SHIFT)
            found.append((best.shift, best.shift - half[-1], best.shift + half[-1]))
        return [
            {"key": name, "value": value, "low": low if known else None, "high": high if known else None}
            for name, (value, low, high), known in zip(names, found, np.isfinite(half), strict=True)
        ]

    def _beside_noise(self, trial: Callable[[Row], Row], best: Minimum, name: str, left: Left) -> Left:
        """Return what is left of a curve with the noise: what two measurements differ in beside the run, over √2."""
        assert self.repeated is not None
        keys = {name: best.row[name] for name in self.ranges}
        row = trial(keys | {"repeat": True})
        times = self.repeated.time + row[SHIFT]
        ours = self.data.time[best.part] + best.row[SHIFT]
        # The nearest point: between two, noise would be smaller.
        nearest = np.searchsorted(0.5 * (times[1:] + times[:-1]), ours)
        apart = np.array(row["off"][name], float)[nearest] - np.array(best.row["off"][name], float)[best.part]
        apart = apart[np.isfinite(apart)] / math.sqrt(2.0)
        return left._replace(noise=rms(apart), free=len(apart) / remembered(apart))


def _promise(begun: Sequence[Search], search: Search) -> tuple[bool, float]:
    """Return what sorts searches: first those whose neighbours all cost more, then others, by their cost."""
    nearest = sorted(begun, key=lambda other: float(np.linalg.norm(other.at - search.at)))
    around = nearest[1 : 2 * len(search.at) + 1]
    return any(other.cost < search.cost for other in around), search.cost


def rms(values: Any) -> float:
    """Return the root mean square of numbers, of which NaN (or ``None``) does not count."""
    return float(np.sqrt(np.nanmean(np.array(values, float) ** 2)))


def _cost(search: Search | Minimum) -> float:
    return search.cost


def _half(best: Minimum) -> np.ndarray:
    """Return half of the width of the intervals of the unknowns."""
    return float(stdtrit(best.freedom, 0.5 + 0.5 * _CONFIDENCE)) * best.deviations


def _apart(at: np.ndarray, best: Minimum) -> bool:
    """Return whether unknowns are away from a minimum: not in its intervals, three times as wide."""
    return bool(np.any(np.abs(at - best.at) > 3.0 * _half(best)[: len(at)] + _SAME))


def _moved(row: Row, other: Row) -> bool:
    """Return whether the clocks of two runs are apart."""
    return bool(abs(row[SHIFT] - other[SHIFT]) > _NEAR * (row["end"] - row["begin"]))


def _as_good(search: Search, other: Search) -> bool:
    """Return whether a search begins at a cost that is not larger than that of another."""
    return search.cost <= (1.0 + EQUAL) * other.cost + ALIKE


def _finer(scene: Scene) -> Scene:
    """Return a scene with half the macro step, or a tighter accuracy or tolerances."""
    if scene.accuracy is not None:
        return with_changes(scene, accuracy=_TIGHTER * scene.accuracy)
    coupling = scene.coupling
    if not coupling.adaptive:
        return with_changes(scene, coupling={"macro_step": 0.5 * coupling.H})
    tolerances = ((name, getattr(coupling, name)) for name in TOLERANCE_KEYS)
    return with_changes(scene, coupling={name: _TIGHTER * given for name, given in tolerances if given is not None})


def _name(case: Row) -> str:
    """Return the name of a case, which is all that it takes."""
    return " ".join(str(value) for value in case.values())


def mapping(names: Sequence[str]) -> dict[str, str]:
    """Return what ``NAME=COLUMN`` say. Raises SceneError for anything else."""
    found = {}
    for text in names:
        name, _, column = (part.strip() for part in text.partition("="))
        if not name or not column:
            raise ArgumentError(f"--map {text}: must be NAME=COLUMN, as in CH1=a_tip")
        found[name] = column
    return found
