"""Find keys of a scene by measured curves: least squares over runs, with confidence intervals.

The unknowns are logarithms of the keys over their guesses, so that a key keeps its sign. Curves of different units are
weighed by their spread, and then by what is left of each. An interval holds if what is left is noise that has the same
size along a curve and does not remember its past. The clock of the measurement may be off by a shift, which is one
unknown more unless it is given.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from rich.text import Text
from scipy.optimize import least_squares
from scipy.stats import t as student

from ..run.accuracy import simulate
from ..run.outcome import RunStopped
from ..scene import ArgumentError, Scene, SceneError, key_kind
from ..scene.scene import split_key
from ..signals.curves import signal
from ..signals.measured import Measured, read_measured, reading_of, time_shifts
from .design import design, parse_axis
from .study import Study
from .tables import Findings, Row, table

_CASE = "fit"
#: The unknown that moves the clock of the measurement [s], beside keys.
SHIFT = "shift"
#: Share of the run by which the clock may move from where a search begins before points leave the run.
_MARGIN = 0.02
#: Places at which the clock is tried, and evaluations of each such trial.
_TRIED, _FIRST_LOOK = 4, 8
#: Relative steps of the derivatives, and where the search ends.
_STEP, _TOLERANCE = 1e-4, 1e-12
#: Share of a residual that a run which cannot be made counts, so that the search turns back.
_REFUSED = 1e3
#: A combination of keys that changes the curves less than this, beside the others, is not determined by them.
_UNDETERMINED = 1e-5
_CONFIDENCE = 0.95


class Fit(Study):
    """Keys that make runs of a scene agree with a measurement."""

    kind: ClassVar[str] = "fit"
    announced: ClassVar[str] = "some 25 runs for each key, five times as many where the clock is to be found"

    scene: Scene
    file: str  #: path of the measurement
    digest: str  #: of its content
    vary: tuple[str, ...]  #: KEY=GUESS
    names: tuple[str, ...] = ()  #: NAME=COLUMN
    read: tuple[str, ...] = ()  #: KEY=VALUE of how the file is read
    shift: float | None = None  #: by which the clock of the measurement is moved [s]; found if it is left out

    @classmethod
    def of(cls, scene: Scene, path: Path, vary: Sequence[str], **settings: Any) -> Fit:
        """Return the study of a file. Raises OSError if it cannot be read."""
        digest = sha256(path.read_bytes()).hexdigest()
        return cls(scene=scene, file=str(path), digest=digest, vary=tuple(vary), **settings)

    def cases(self) -> dict[str, Row]:
        """Return the one search. Raises SceneError for keys, guesses or columns that are not there."""
        self.at(self.guesses())
        self.data()
        return {_CASE: {}}

    def guesses(self) -> dict[str, float]:
        """Return the keys and where the search begins."""
        axes = [parse_axis(text) for text in self.vary]
        (values, *more), names = design(axes, 0, 0, "random"), [axis.name for axis in axes]
        for name, guess in zip(names, values, strict=True):
            key = split_key(name)
            if key is None or key_kind(*key) is not float:
                raise ArgumentError(f"--vary {name}: takes no real numbers, and cannot be fitted")
            if more or guess == 0.0:
                raise ArgumentError(
                    f"--vary {name}: a guess is one value that has the sign and roughly the size of what is sought, as "
                    "in spring.linear_stiffness=800; 0 has none"
                )
        return dict(zip(names, map(float, values), strict=True))

    def data(self) -> Measured:
        """Return the measured curves."""
        return read_measured(self.file, self.scene, mapping(self.names), reading_of(self.read))

    def record(self, case: Row) -> Row:
        """Return the values found, their intervals, and every run on the way. Raises SceneError for too few points."""
        data, guesses, free = self.data(), self.guesses(), self.shift is None
        run = simulate(self.at(guesses))
        # While keys are wrong the curves may fit best a period too late: a few places are tried.
        starts = [self.shift] if self.shift is not None else time_shifts(run, data)[0][:_TRIED]
        starts += [0.0] * int(free and data.covered(run).mean() > 0.5)
        parts = {shift: data.covered(run, shift, _MARGIN * free) for shift in starts}
        parts = {shift: part for shift, part in parts.items() if part.sum() > len(guesses) + free}
        if not parts:
            raise ArgumentError(
                f"{self.file}: fewer of its points lie in the run than are needed to find {', '.join(guesses)}"
                f"{' and the shift of its clock' * free}; make time.t_end longer, give more points, or another --shift"
            )
        searches = [
            _Search(self, data, part, guesses | {SHIFT: shift} if free else guesses, shift)
            for shift, part in parts.items()
        ]
        record = min(searches, key=lambda search: search.least(most=_FIRST_LOOK).cost).found()
        if record["undetermined"] and 0.0 in parts:  # the keys alone may be
            searches.append(_Search(self, data, parts[0.0], guesses, 0.0))
            record = searches[-1].found()
        return {**record, "runs": [run for search in searches for run in search.runs]}

    def findings(self, records: Mapping[str, Row]) -> Findings:
        """Show the values with their intervals, or which of them the data does not determine.

        The table has a row per run: the keys, and the root mean square of what is left of each curve.
        """
        record = records[_CASE]
        keys = [(row["key"], row["value"], row["low"], row["high"]) for row in record["keys"]]
        left = [(name, rms, share) for name, (rms, share) in record["left"].items()]
        shown: list[Any] = [
            table(("key", "value:.8g", "95 % from:.6g", "to:.6g"), keys),
            table(("curve", "left, rms:.4g", "of its spread:.2%"), left),
            f"{len(record['runs'])} runs; {record['message']}",
        ]
        shown += [Text(f"not determined: {why}", style="bold red") for why in record["undetermined"]]
        told = {name: record[name] for name in ("keys", "left", "undetermined")}
        return Findings(told, shown, code=1 if record["undetermined"] else 0, tables={self.kind: record["runs"]})


def mapping(names: Sequence[str]) -> dict[str, str]:
    """Return what ``NAME=COLUMN`` say. Raises SceneError for anything else."""
    found = {}
    for text in names:
        name, _, column = (part.strip() for part in text.partition("="))
        if not name or not column:
            raise ArgumentError(f"--map {text}: must be NAME=COLUMN, as in CH1=a_tip")
        found[name] = column
    return found


class _Search:
    """One search from guesses of keys, and of `SHIFT` if the clock moves; ``runs`` are the rows of its runs.

    The points that take part are ``part`` of the data, wherever the clock moves.
    """

    def __init__(self, fit: Fit, data: Measured, part: np.ndarray, guesses: Mapping[str, float], shift: float) -> None:
        self._fit, self._data, self._part, self._guesses, self._shift = fit, data, part, guesses, shift
        self._spread = {name: float(np.std(values)) or 1.0 for name, values in data.values.items()}
        self._weights = {name: 1.0 / spread for name, spread in self._spread.items()}
        self.runs: list[Row] = []

    def values(self, unknowns: np.ndarray) -> dict[str, float]:
        """Return the keys at ``unknowns``."""
        duration = float(np.ptp(self._data.time))
        return {
            name: guess + x * duration if name == SHIFT else guess * float(np.exp(np.clip(x, -700.0, 700.0)))
            for (name, guess), x in zip(self._guesses.items(), unknowns.tolist(), strict=True)
        }

    def left(self, unknowns: np.ndarray) -> np.ndarray:
        """Return what is left of the curves, weighed."""
        values = self.values(unknowns)
        shift = values.get(SHIFT, self._shift)
        try:
            run = simulate(self._fit.at(values))
        except (RunStopped, SceneError) as refused:
            self.runs.append({**values, "error": str(refused)})
            return np.full(len(self._data.values) * int(self._part.sum()), _REFUSED)
        curves = run.at(np.clip(self._data.time[self._part] + shift, run.time[0], run.time[-1]))
        off = {name: signal(curves, name) - measured[self._part] for name, measured in self._data.values.items()}
        rms = {f"left_{name}": float(np.sqrt(np.mean(part**2))) for name, part in off.items()}
        self.runs.append({**values, **rms, "error": ""})
        return np.concatenate([self._weights[name] * part for name, part in off.items()])

    def least(self, start: np.ndarray | None = None, most: int = 60) -> Any:
        """Search from ``start``, or from the guesses, by at most so many evaluations."""
        begin = np.zeros(len(self._guesses)) if start is None else start
        ends = dict.fromkeys(("xtol", "ftol", "gtol"), _TOLERANCE)
        return least_squares(self.left, begin, jac="3-point", diff_step=_STEP, max_nfev=most, **ends)

    def found(self) -> Row:
        """Search, then once more with each curve weighed by what is left of it, and judge what was found."""
        first = self.least().x
        self.left(first)
        self._weights = {
            name: 1.0 / max(self.runs[-1][f"left_{name}"], 1e-9 * spread) for name, spread in self._spread.items()
        }
        result = self.least(first)
        self.left(result.x)
        keys, undetermined = self._judged(result)
        left = {name: self.runs[-1][f"left_{name}"] for name in self._spread}
        return {
            "keys": keys,
            "undetermined": undetermined,
            "left": {name: (rms, rms / self._spread[name]) for name, rms in left.items()},
            "message": str(result.message).rstrip("."),
            "runs": self.runs,
        }

    def _judged(self, result: Any) -> tuple[list[Row], list[str]]:
        """Return the keys with their intervals, and what the data does not determine."""
        names, values = list(self._guesses), self.values(result.x)
        lengths = np.linalg.norm(result.jac, axis=0)
        undetermined = [f"{name} does not change the curves" for name, size in zip(names, lengths, strict=True)
                        if size <= _UNDETERMINED * float(lengths.max(initial=0.0)) or size == 0.0]  # fmt: skip
        freedom = len(result.fun) - len(names)
        if undetermined:
            return [{"key": name, "value": values[name], "low": None, "high": None} for name in names], undetermined
        _, sizes, directions = np.linalg.svd(result.jac / lengths, full_matrices=False)
        if sizes[-1] < _UNDETERMINED * sizes[0]:
            shares = np.abs(directions[-1])
            together = [name for name, share in zip(names, shares, strict=True) if share > 0.1 * shares.max()]
            undetermined.append(f"{' and '.join(together)} change the curves in the same way: fix one of them")
        inverse = directions.T / np.maximum(sizes, 1e-300)
        deviation = np.sqrt(2.0 * result.cost / freedom * (inverse**2).sum(axis=1)) / lengths
        half = np.diag(float(student.ppf(0.5 + 0.5 * _CONFIDENCE, freedom)) * deviation)
        keys = []
        for name, off in zip(names, half, strict=True):
            low, high = sorted(self.values(result.x + side * off)[name] for side in (-1.0, 1.0))
            if name != SHIFT and off.max() > np.log(2.0):
                undetermined.append(f"{name} may be anything from {low:.3g} to {high:.3g}")
            keys.append({"key": name, "value": values[name], "low": low, "high": high})
        return keys, undetermined
