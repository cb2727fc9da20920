"""Find keys of a scene by measured curves: least squares over runs, with confidence intervals.

The unknowns are logarithms of the keys over their guesses, so that a key keeps its sign. Curves of different units are
weighed by their spread, and then by what is left of each. An interval holds if what is left is noise that has the same
size along a curve and does not remember its past. The clock of the measurement may be off by a shift, which is one
unknown more unless it is given.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.text import Text
from scipy.optimize import least_squares
from scipy.stats import t as student

from ..results.dense import at
from ..run.accuracy import simulate
from ..run.outcome import RunStopped
from ..scene import ArgumentError, Scene, SceneError, key_kind
from ..scene.scene import split_key
from ..signals.curves import signal
from ..signals.measured import Measured, read_measured, reading_of, time_shifts
from .design import design, parse_axis, with_keys
from .tables import Findings, Row, table

_STOPPED = 3
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


def fit(
    scene: Scene,
    file: Path,
    vary: Sequence[str],
    *,
    names: Sequence[str] = (),
    read: Sequence[str] = (),
    shift: float | None = None,
) -> Findings:
    """Find the keys that make runs of ``scene`` agree with a measurement, with their intervals.

    The table has a row per run: the keys, and the root mean square of what is left of each curve. The exit code is 1 if
    the data does not determine the keys. A search that is interrupted has the rows so far, and exit code 3.

    Parameters
    ----------
    scene
        What is run.
    file
        The measured columns, time first.
    vary
        ``KEY=GUESS`` each.
    names
        ``NAME=COLUMN`` each: which column of a run a measured one is.
    read
        ``KEY=VALUE`` each: how the file is read.
    shift
        By which the clock of the measurement is moved [s]; found if it is left out.

    Raises
    ------
    SceneError
        For keys, guesses or columns that are not there, and for too few points.
    RunStopped
        If the run with the guesses stops early.
    OSError
        If the file cannot be read.
    """
    guesses, data = asked(scene, file, vary, names, read)
    runs = list[Row]()
    try:
        record = _found(scene, data, guesses, shift, runs, str(file))
    except KeyboardInterrupt:
        return Findings({}, code=_STOPPED, error=f"interrupted after {len(runs)} runs", tables={"fit": runs})
    keys = [(row["key"], row["value"], row["low"], row["high"]) for row in record["keys"]]
    left = [(name, rms, share) for name, (rms, share) in record["left"].items()]
    shown: list[Any] = [
        table(("key", "value:.8g", "95 % from:.6g", "to:.6g"), keys),
        table(("curve", "left, rms:.4g", "of its spread:.2%"), left),
        f"{len(runs)} runs; {record['message']}",
    ]
    shown += [Text(f"not determined: {why}", style="bold red") for why in record["undetermined"]]
    told = {name: record[name] for name in ("keys", "left", "undetermined")}
    return Findings(told, shown, code=1 if record["undetermined"] else 0, tables={"fit": runs})


def asked(
    scene: Scene, file: Path, vary: Sequence[str], names: Sequence[str], read: Sequence[str]
) -> tuple[dict[str, float], Measured]:
    """Return where a search begins and what is measured, both checked; parameters and errors as of `fit`."""
    guesses = _guesses(vary)
    with_keys(scene, guesses)
    return guesses, read_measured(str(file), scene, mapping(names), reading_of(read))


def _guesses(vary: Sequence[str]) -> dict[str, float]:
    """Return the keys and where the search begins."""
    axes = [parse_axis(text) for text in vary]
    (values, *more), names = design(axes, 0, 0, "random"), [axis.name for axis in axes]
    for name, guess in zip(names, values, strict=True):
        key = split_key(name)
        if key is None or key_kind(*key) is not float:
            raise ArgumentError(f"--vary {name}: takes no real numbers, and cannot be fitted")
        if more or guess == 0.0:
            raise ArgumentError(
                f"--vary {name}: a guess is one value that has the sign and roughly the size of what is sought, as in "
                "spring.linear_stiffness=800; 0 has none"
            )
    return dict(zip(names, map(float, values), strict=True))


def _found(
    scene: Scene, data: Measured, guesses: Mapping[str, float], shift: float | None, runs: list[Row], file: str
) -> Row:
    """Return the values found and their intervals; each run on the way is added to ``runs``."""
    free = shift is None
    run = simulate(with_keys(scene, guesses))
    # While keys are wrong the curves may fit best a period too late: a few places are tried.
    starts = time_shifts(run, data)[0][:_TRIED] if shift is None else [shift]
    starts += [0.0] * int(free and data.covered(run).mean() > 0.5)
    parts = {start: data.covered(run, start, _MARGIN * free) for start in starts}
    parts = {start: part for start, part in parts.items() if part.sum() > len(guesses) + free}
    if not parts:
        raise ArgumentError(
            f"{file}: fewer of its points lie in the run than are needed to find {', '.join(guesses)}"
            f"{' and the shift of its clock' * free}; make time.t_end longer, give more points, or another --shift"
        )
    searches = [
        _Search(scene, data, part, {**guesses, SHIFT: start} if free else guesses, start, runs)
        for start, part in parts.items()
    ]
    record = min(searches, key=lambda search: search.least(most=_FIRST_LOOK).cost).found()
    if record["undetermined"] and 0.0 in parts:  # the keys alone may be
        record = _Search(scene, data, parts[0.0], guesses, 0.0, runs).found()
    return record


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
    """One search from guesses of keys, and of `SHIFT` if the clock moves; a row of each of its runs goes to ``runs``.

    The points that take part are ``part`` of the data, wherever the clock moves.
    """

    def __init__(
        self,
        scene: Scene,
        data: Measured,
        part: np.ndarray,
        guesses: Mapping[str, float],
        shift: float,
        runs: list[Row],
    ) -> None:
        self._scene = scene
        self._data = data
        self._part = part
        self._guesses = guesses
        self._shift = shift
        self.runs = runs
        self._spread = {name: float(np.std(values)) or 1.0 for name, values in data.values.items()}
        self._weights = {name: 1.0 / spread for name, spread in self._spread.items()}

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
            run = simulate(with_keys(self._scene, values))
        except (RunStopped, SceneError) as refused:
            self.runs.append({**values, "error": str(refused)})
            return np.full(len(self._data.values) * int(self._part.sum()), _REFUSED)
        curves = at(run, np.clip(self._data.time[self._part] + shift, run.time[0], run.time[-1]))
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
