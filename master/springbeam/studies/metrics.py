"""Metrics: numbers that studies keep of a run, and its cost.

A metric is named: one of `METRICS`, or one's own, ``NAME=module:function``, a Python function of the run.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from operator import attrgetter
from typing import Any

import numpy as np

from ..motion.events import EventKind
from ..results.dense import MOTION, inside
from ..results.inner import largest
from ..results.spans import Extremes
from ..results.totals import LOSS_NAMES, TOTALS
from ..results.trajectory import BODY_COLUMNS, COLUMNS, Trajectory
from ..scene import ArgumentError
from ..scene.messages import nearest
from ..signals.driven import drive_of, poincare, settled
from ..signals.spectra import without_peak

#: The transient of a driven motion that does not settle, as a share of the run.
_TRANSIENT = 2.0 / 3.0


@dataclass(frozen=True)
class Metric:
    """A number of a run, or several; ``None`` where the scene has no such thing, or it did not happen."""

    unit: str  #: "" for a count
    words: str
    of: Callable[[Trajectory], Any]
    asked: bool = False  #: kept only where it is named
    several: bool = False
    takes: tuple[str, ...] = ()  #: columns

    def __call__(self, run: Trajectory) -> Any:
        return None if self.lacking(run) else self.of(run)

    def lacking(self, run: Trajectory) -> str:
        """Return why the run has no such number, in words if that is not obvious, else nothing."""
        absent = [name for name in self.takes if name not in run.columns]
        return f"the run has no column {', '.join(absent)}" if absent else without_peak(run, self.takes)


def _end(column: str, run: Trajectory) -> Any:
    return float(run[column][-1]) if column in run.columns else None


def _extreme(column: str, pick: Callable[[Extremes], float], run: Trajectory) -> Any:
    if column not in run.columns:
        return None
    if column in BODY_COLUMNS:
        return pick(largest(run, column))
    if run.steps is None or column not in MOTION:  # which is known at its rows only
        return pick(Extremes.of_rows(run.time, run[column]))
    return pick(inside(run.scene.contact.rigid, run.steps, column).extremes[column])


def _magnitude(found: Extremes) -> float:
    return max(found.highest, -found.lowest)


def _first(kind: EventKind, run: Trajectory) -> Any:
    return next((event.time for event in run.events if event.kind == kind), None)


def _number(kind: EventKind, run: Trajectory) -> Any:
    return float(sum(event.kind == kind for event in run.events))


def _total(name: str, run: Trajectory) -> Any:
    return float(run.summary[name]) if name in run.summary else None


def _settled(column: str, run: Trajectory) -> Any:
    tail = settled(run)
    return None if tail is None or column not in run.columns else tail.amplitude(run, column)


def _stroboscopic(run: Trajectory) -> list[float] | None:
    load = drive_of(run)
    begin = float(run.time[0])
    end = float(run.time[-1])
    if load is None or run.steps is None:
        return None
    tail = settled(run)
    late = max(begin + _TRANSIENT * (end - begin), begin if tail is None else tail.since)
    times, points = poincare(run, 1.0 / load.frequency, load.start)
    return points[times >= late, 0].tolist()


#: Columns with a unit, whose largest magnitudes are metrics.
_UNITS = {name: column.unit for name, column in (COLUMNS | BODY_COLUMNS).items() if column.unit and name != "time"}

METRICS: dict[str, Metric] = {
    "u_tip_min": Metric("m", "lowest position of the tip", partial(_extreme, "u_tip", attrgetter("lowest"))),
    "u_tip_max": Metric("m", "highest position of the tip", partial(_extreme, "u_tip", attrgetter("highest"))),
    "u_tip_end": Metric("m", "the tip at the end", partial(_end, "u_tip")),
    "y_min": Metric("m", "lowest position of the spring's top", partial(_extreme, "y", attrgetter("lowest"))),
    "y_max": Metric("m", "highest position of the spring's top", partial(_extreme, "y", attrgetter("highest"))),
    "y_end": Metric("m", "the spring's top at the end", partial(_end, "y")),
    "z_max": Metric("m/s", "largest speed of the spring's top", partial(_extreme, "z", _magnitude)),
    "gap_max": Metric("m", "largest gap", partial(_extreme, "gap", attrgetter("highest"))),
    **{name: Metric(unit, words, partial(_total, name)) for name, (words, unit) in TOTALS.items()},
    **{name: Metric("J", f"energy lost by {words}", partial(_total, name)) for name, words in LOSS_NAMES.items()},
    "dissipated": Metric("J", "energy lost to damping", partial(_end, "e_dissipated")),
    "impact_loss": Metric("J", "energy lost in impacts", partial(_end, "e_impact_loss")),
    "energy_residual": Metric(
        "", "largest change of the sum of all energies, relative", partial(_total, "max_energy_residual")
    ),
    "macro_steps": Metric("", "macro steps", partial(_total, "macro_steps")),
    **{f"first_{kind}": Metric("s", f"first event {kind}", partial(_first, kind)) for kind in EventKind},
    **{f"number_of_{kind}": Metric("", f"events {kind}", partial(_number, kind)) for kind in EventKind},
    **{
        f"max_{name}": Metric(
            unit, f"largest magnitude of {name}", partial(_extreme, name, _magnitude), asked=True, takes=(name,)
        )
        for name, unit in _UNITS.items()
    },
    **{
        f"settled_{name}": Metric(
            unit,
            f"half the range of {name} once the driven motion has settled",
            partial(_settled, name),
            asked=True,
            takes=(name,),
        )
        for name, unit in _UNITS.items()
        if not name.startswith("e_")
    },
    "stroboscopic": Metric(
        "m", "tip, or spring's top, once a period of the drive, late", _stroboscopic, asked=True, several=True
    ),
}
#: Those that are kept where none is named.
USUAL = tuple(name for name, metric in METRICS.items() if not metric.asked)
#: Metrics in the picture of a sweep without ``--metric``.
PRINCIPAL = (
    *("contact_force_max", "contact_impulse", "contact_duration", "rebound_velocity", "deepest_tip", "stop_strokes"),
    *("y_min", "u_tip_end", "y_end"),
)


def heading(name: str) -> str:
    """Return a metric with its unit; one's own has none."""
    unit = METRICS[name].unit if name in METRICS else ""
    return f"{name} [{unit}]" if unit else name


def metrics_of(texts: Sequence[str], *, several: bool = False) -> dict[str, Metric]:
    """Return the metrics that ``texts`` name.

    Raises SceneError if one is unknown, is named twice, or is ``several`` numbers where it may not be.
    """
    metrics: dict[str, Metric] = {}
    for text in texts:
        name, separator, what = (part.strip() for part in text.partition("="))
        if name in metrics:
            raise ArgumentError(f"--metric {name}: given twice")
        if separator and name in METRICS:
            raise ArgumentError(f"--metric {text}: {name} is a metric already; give yours another name")
        if name not in METRICS and not (separator and name.isidentifier()):
            raise ArgumentError(
                f"--metric {text}: unknown; {nearest(text, METRICS)}allowed: {', '.join(METRICS)}, and your own, as in "
                "shock=module:function"
            )
        metrics[name] = METRICS[name] if name in METRICS else _own(name, what)
        if metrics[name].several and not several:
            raise ArgumentError(f"--metric {name}: is several numbers of a run; springbeam sweep keeps and draws them")
    return metrics


def _own(name: str, what: str) -> Metric:
    from ..signals.curves import function_of

    function = function_of(what)
    if function is None:
        raise ArgumentError(
            f"--metric {name}={what}: must be module:function, a Python function of the run that returns one number; "
            "formulas are not read"
        )

    def of(run: Trajectory) -> float | None:
        number = function(run)
        if number is None:
            return None
        if np.size(number) != 1 or not np.isrealobj(number):
            raise ArgumentError(f"--metric {name}={what}: gives {np.size(number)} values; a metric is one real number")
        return float(np.asarray(number, dtype=float).item())

    return Metric("", what, of)


def costs(run: Trajectory) -> dict[str, int]:
    """Return the doStep calls of both FMUs, those that were rolled back included, and the rollbacks."""
    rollbacks = sum(int(run.summary.get(f"{body}_rollbacks", 0)) for body in ("beam", "spring"))
    return {"cost_do_steps": run.do_steps, "cost_rollbacks": rollbacks}
