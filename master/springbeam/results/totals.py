"""Results of a run: forces, durations, velocities, impulses and energy losses.

They go into ``summary.json``, and each is a metric of sweeps. The impulse of a step is that of the applied polynomial
without the part of the mismatch of velocities (`impulse`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval

from ..motion.events import Event
from ..motion.paths import EPS
from ..scene import Scene
from .contact_times import foundation_contacts, kicks, tip_contacts
from .dense import Extremes
from .records import FORCE_COLUMNS, impulse, joined


class Quantity(NamedTuple):
    """Meaning and unit of a result; ``unit`` is "" for a count."""

    words: str
    unit: str


#: The numbers of `totals`, in the order in which they are shown.
TOTALS = {
    "contact_impulse": Quantity("impulse of the contact, ∫ C dt and impacts", "N·s"),
    "contact_force_max": Quantity("peak contact force, mean over the window", "N"),
    "contact_force_window": Quantity("window of the peak contact force", "s"),
    "contact_force_max_time": Quantity("beginning of that window", "s"),
    "contact_duration": Quantity("longest contact", "s"),
    "contact_duration_total": Quantity("all contacts together", "s"),
    "number_of_contacts": Quantity("contacts", ""),
    "bounce_time": Quantity("time from the first contact until the last opening", "s"),
    "last_impact_time": Quantity("last impact", "s"),
    "rebound_velocity": Quantity("upward velocity of the tip after the last contact", "m/s"),
    "deepest_tip": Quantity("lowest position of the tip", "m"),
    "deepest_tip_time": Quantity("time of the lowest position", "s"),
    "stop_strokes": Quantity("impacts on the foundation", ""),
    "foundation_impulse": Quantity("impulse of the foundation", "N·s"),
}
#: Causes of energy losses [J], by summary key.
LOSS_NAMES = {
    "loss_beam": "damping of the beam",
    "loss_spring": "damping of the spring",
    "loss_contact": "the contact law",
    "loss_impact": "impacts of tip and spring",
    "loss_stop": "impacts on the stop",
}
#: Numbers of `TOTALS` that belong to others.
BESIDE = ("contact_force_window", "contact_force_max_time", "deepest_tip_time")
#: Impulses that differ by less than this share of the total are equal: well above rounding.
_ALIKE = 1e-13


def in_words(summary: Mapping[str, Any]) -> Iterator[tuple[str, str, str]]:
    """Yield words, value and error of the numbers in a ``summary`` that are not 0, and of any count.

    The error is "" where the run is not judged, or has none.
    """
    errors = summary.get("errors", {}).get("quantities", {})
    units = {name: unit for name, (_, unit) in TOTALS.items()} | dict.fromkeys(LOSS_NAMES, "J")
    for name, unit in units.items():
        if name in BESIDE or summary.get(name) is None or (unit and not summary[name]):
            continue
        words = TOTALS[name].words if name in TOTALS else f"energy lost by {LOSS_NAMES[name]}"
        if name == "contact_force_max":
            words = words.replace("the window", f"{summary['contact_force_window']:.4g} s")
        digits = ".5g" if name in TOTALS else ".4g"
        error = errors.get(name, 0.0)
        yield words, f"{summary[name]:{digits}} {unit}".rstrip(), f"± {error:.1g}" if error > 0.0 else ""


def totals(
    scene: Scene, steps: np.ndarray, events: Iterable[Event], window: float, tip: Extremes
) -> dict[str, float | int]:
    """Return the numbers of `TOTALS` that the scene has, and the energies lost in impacts [J].

    Parameters
    ----------
    scene
        As run.
    steps
        Of the whole run, of dtype `springbeam.results.records.STEP`.
    events
        Of the whole run.
    window
        Over which the contact force is averaged [s]; the run may be shorter.
    tip
        Of the positions of the tip.
    """
    events = list(events)
    found: dict[str, float | int] = {}
    beam = scene.upper is not None
    spring = scene.lower is not None
    stop = scene.stop is not None and not scene.elastic_stop
    if scene.coupled or (beam and stop):
        found |= _contact(scene, steps, events, window)
    if beam:
        found |= {"deepest_tip": tip.lowest, "deepest_tip_time": tip.lowest_time}
    if stop:
        found["stop_strokes"] = sum(event.kind.strikes for event in events)
        held = impulse(steps, "foundation_force").sum()
        found["foundation_impulse"] = held + sum(event.impulse_foundation for event in events)
        found["loss_stop"] = sum(event.energy_loss for event in events if event.kind.strikes)
    if beam and spring:
        found["loss_impact"] = sum(e.energy_loss for e in events if not e.kind.strikes)
    if impacts := [event.time for event in events if event.kind.collision or event.kind.strikes]:
        found["last_impact_time"] = impacts[-1]
    return {
        name: float(value) if name not in TOTALS or TOTALS[name].unit else int(value) for name, value in found.items()
    }


def _contact(scene: Scene, steps: np.ndarray, events: list[Event], window: float) -> dict[str, float | int]:
    largest, since = peak_force(steps, events, window)
    found: dict[str, float | int] = {
        "contact_impulse": _gained(steps, events).sum(),
        "contact_force_max": largest,
        "contact_force_window": window,
        "contact_force_max_time": since,
    }
    if scene.contact.lasting and scene.coupled:
        return found
    end = float(steps["time"][-1])
    intervals = tip_contacts(scene, events, end) if scene.coupled else foundation_contacts(events, end)
    lengths = [until - since for since, until in intervals]
    found |= {"contact_duration": max(lengths, default=0.0), "contact_duration_total": sum(lengths)}
    found["number_of_contacts"] = len(intervals)
    if intervals and intervals[-1][1] == end and joined(steps[-1]):
        found["bounce_time"] = intervals[-1][0] - intervals[0][0]
    opened = max((until for _, until in intervals if until < end), default=None)
    if left := [event.v_tip for event in events if event.time == opened and event.v_tip is not None]:
        found["rebound_velocity"] = left[-1]
    return found


def _gained(steps: np.ndarray, events: Iterable[Event]) -> np.ndarray:
    """Return the impulse of the contact over each of ``steps`` and its events [N·s]."""
    return np.asarray(impulse(steps) + kicks(steps["time"], events))


def peak_force(steps: np.ndarray, events: Iterable[Event], window: float) -> tuple[float, float]:
    """Return the largest mean of C [N] over windows of ``window`` [s] in the run, and when the first of these begins.

    A run that is shorter is one window, without a force after it. An impact at the edge of a window belongs to it if
    that makes the mean larger.
    """
    rows = steps["time"]
    # The impulse up to each row, including impacts there, and the powers of the time since then up to the next row;
    # before the run and after it there is no force.
    begins = np.append(rows[0] - 2.0 * window, rows)
    passed = np.zeros((4, len(begins)))
    passed[0, 1:] = np.cumsum(_gained(steps, events))
    passed[1:, 1:-1] = [steps[name][1:] / power for name, power in zip(FORCE_COLUMNS, (1.0, 2.0, 6.0), strict=True)]

    def upto(times: np.ndarray, side: Literal["left", "right"], *orders: int) -> np.ndarray:
        """Return derivatives of ∫ C dt before the impulses of ``times`` [s] (left) or after them (right)."""
        row = np.searchsorted(begins, times, side) - 1
        since = times - begins[row]
        powers = passed[:, row]
        return np.array([polyval(since, polyder(powers, order), tensor=False) for order in orders])

    # Inside steps the mean is largest where C is the same at both edges of the window: between `edges` both forces are
    # of degree 2. The root of a τ² + b τ + c at which it falls is 2 c / (√(b² − 4 a c) − b), also where a is 0.
    edges = np.sort(np.concatenate([rows, rows - window]))
    half = 0.5 * np.diff(edges)
    middle = edges[:-1] + half
    c, b, twice_a = upto(middle + window, "right", 1, 2, 3) - upto(middle, "right", 1, 2, 3)
    with np.errstate(divide="ignore", invalid="ignore"):
        root = 2.0 * c / (np.sqrt(b**2 - 2.0 * twice_a * c) - b)
    inside = np.where(np.abs(root) < half, middle + root, edges[:-1])
    first = np.maximum(np.concatenate([rows - window, rows, inside]), rows[0])
    last = np.minimum(np.concatenate([rows, rows + window, inside + window]), rows[-1])
    # Where the ends pull at each other, a window that the run cuts short would have the larger mean.
    rounding = 4.0 * EPS * np.abs(rows).max()
    whole = last - first >= min(window, rows[-1] - rows[0]) - rounding
    first = first[whole]
    last = last[whole]
    (most,) = np.maximum(upto(last, "left", 0), upto(last, "right", 0))
    (least,) = np.minimum(upto(first, "left", 0), upto(first, "right", 0))
    found = most - least
    largest = found.max()
    since = first[found >= largest - _ALIKE * np.abs(passed[0]).max()].min()  # of a constant force all are alike
    return max(0.0, float(largest)) / window, float(since)
