"""Results of a run: forces, durations, velocities, impulses and energy losses.

They go into ``summary.json``, and each is a metric of sweeps. The impulse of a step is that of the applied polynomial
without the part of the mismatch of velocities (`impulse`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from ..motion.events import Event
from ..scene import Scene
from .contact_times import foundation_contacts, tip_contacts
from .law_peak import peak_of_law
from .records import impulse, joined
from .spans import Extremes
from .window_peak import gained, peak_force


class Quantity(NamedTuple):
    """Meaning and unit of a result; ``unit`` is "" for a count."""

    words: str
    unit: str


#: The numbers of `totals`, in the order in which they are shown.
TOTALS = {
    "contact_impulse": Quantity("impulse of the contact, ∫ C dt and impacts", "N·s"),
    "contact_force_max": Quantity("peak contact force; of a rigid contact the mean over the window", "N"),
    "contact_force_window": Quantity("window of the peak force of a rigid contact", "s"),
    "contact_force_max_time": Quantity("time of the peak contact force, or beginning of its window", "s"),
    "contact_duration": Quantity("longest contact", "s"),
    "contact_duration_total": Quantity("all contacts together", "s"),
    "number_of_contacts": Quantity("contacts", ""),
    "bounce_time": Quantity("time from the first contact until the last one begins, in which the run ends", "s"),
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
            window = summary.get("contact_force_window")
            words = "peak contact force" + ("" if window is None else f", mean over {window:.4g} s")
        digits = ".5g" if name in TOTALS else ".4g"
        error = errors.get(name, 0.0)
        yield words, f"{summary[name]:{digits}} {unit}".rstrip(), f"± {error:.1g}" if error > 0.0 else ""


def totals(
    scene: Scene, steps: np.ndarray, events: Iterable[Event], window: float | None, tip: Extremes
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
        Over which the force of a rigid contact is averaged [s]; the run may be shorter. ``None`` for a soft law, whose
        peak is that of the law along the path of the ends.
    tip
        Of the positions of the tip.
    """
    events = list(events)
    numbers: dict[str, float | int] = {}
    beam = scene.upper is not None
    spring = scene.lower is not None
    stop = scene.stop is not None and not scene.elastic_stop
    if scene.coupled or (beam and stop):
        numbers |= _contact(scene, steps, events, window)
    if beam:
        numbers |= {"deepest_tip": tip.lowest, "deepest_tip_time": tip.lowest_time}
    if stop:
        numbers["stop_strokes"] = sum(event.kind.strikes for event in events)
        pressed = impulse(steps, "foundation_force").sum()
        numbers["foundation_impulse"] = pressed + sum(event.impulse_foundation for event in events)
        numbers["loss_stop"] = sum(event.energy_loss for event in events if event.kind.strikes)
    if beam and spring:
        numbers["loss_impact"] = sum(e.energy_loss for e in events if not e.kind.strikes)
    if impacts := [event.time for event in events if event.kind.collision or event.kind.strikes]:
        numbers["last_impact_time"] = impacts[-1]
    return {
        name: float(value) if name not in TOTALS or TOTALS[name].unit else int(value) for name, value in numbers.items()
    }


def _contact(scene: Scene, steps: np.ndarray, events: list[Event], window: float | None) -> dict[str, float | int]:
    numbers: dict[str, float | int] = {"contact_impulse": gained(steps, events).sum()}
    if window is None:
        assert scene.soft_law is not None
        largest, since = peak_of_law(scene.soft_law, steps)
    else:
        largest, since = peak_force(steps, events, window)
        numbers["contact_force_window"] = window
    numbers |= {"contact_force_max": largest, "contact_force_max_time": since}
    if scene.contact.lasting and scene.coupled:
        return numbers
    end = float(steps["time"][-1])
    intervals = tip_contacts(scene, events, end) if scene.coupled else foundation_contacts(events, end)
    lengths = [until - since for since, until in intervals]
    numbers |= {"contact_duration": max(lengths, default=0.0), "contact_duration_total": sum(lengths)}
    numbers["number_of_contacts"] = len(intervals)
    if intervals and intervals[-1][1] == end and joined(steps[-1]):
        numbers["bounce_time"] = intervals[-1][0] - intervals[0][0]
    opened = max((until for _, until in intervals if until < end), default=None)
    if left := [event.v_tip for event in events if event.time == opened and event.v_tip is not None]:
        numbers["rebound_velocity"] = left[-1]
    return numbers
