"""Common parts of plots, report and animation: looks and words, units, thinning, thresholds of visibility.

Colours are those of Okabe and Ito, which any colour vision can distinguish. Widths and sizes are in points.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np

from ..motion.events import EventKind
from ..results.trajectory import PHASES, Trajectory
from ..scene import Scene

BLACK = "#000000"
ORANGE = "#E69F00"
SKY = "#56B4E9"
GREEN = "#009E73"
YELLOW = "#F0E442"
BLUE = "#0072B2"
VERMILLION = "#D55E00"
PURPLE = "#CC79A7"
GREY = "#777777"
STONE = "#B8B8B8"
#: Colours of curves of one kind, in turn.
COLOURS = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY, BLACK)


class Line(NamedTuple):
    """Width and dashes, which distinguish lines in addition to their colour."""

    width: float = 1.1  #: [pt]
    dashed: bool = False
    opacity: float = 1.0


class Marker(NamedTuple):
    """A shape: as a character, in the words of matplotlib and of plotly; its size [pt]."""

    sign: str
    matplotlib: str
    plotly: str
    size: float = 4.0


class Look(NamedTuple):
    """Colour and words of a phase, line of a quantity, or marker of a kind of event."""

    colour: str
    words: str
    line: Line = Line()
    marker: Marker | None = None


#: Phases and the shades behind them.
PHASE_LOOKS = {
    "free": Look("#FFFFFF", "free"),
    "tied": Look("#D6EAF7", "tied (u = y < Ψ)"),
    "touch": Look("#FFF1B8", "touch (y ≥ Ψ)"),
    "seated": Look("#CFE8DD", "seated (at φ)"),
}
EVENT_LOOKS = {
    EventKind.IMPACT: Look(VERMILLION, "impact of the tip", marker=Marker("▼", "v", "triangle-down")),
    EventKind.STOP_IMPACT: Look(BLACK, "impact on foundation", marker=Marker("▲", "^", "triangle-up")),
    EventKind.RELEASE: Look(BLUE, "release", marker=Marker("●", "o", "circle")),
    EventKind.RETIE: Look(PURPLE, "retie", marker=Marker("■", "s", "square")),
    EventKind.SEPARATION: Look(GREEN, "separation", marker=Marker("◆", "D", "diamond")),
    EventKind.SEATED: Look(GREY, "seated", marker=Marker("◀", "<", "triangle-left")),
    EventKind.UNSEATED: Look(GREY, "unseated", marker=Marker("▶", ">", "triangle-right")),
}
assert (tuple(PHASE_LOOKS), tuple(EVENT_LOOKS)) == (PHASES, tuple(EventKind))
#: What phases, events and other words of messages, reports and pages mean.
GLOSSARY = {
    "tip": "the free end of the beam, x = L; its deflection is u_tip",
    "spring top": "the mass on the spring, at y",
    "foundation": "the rigid stop below, at the height φ; [stop] in a scene file",
    "gap": "u_tip − y; without a spring u_tip − φ",
    "penetration": "p = y − u_tip, the negative gap, of a soft contact",
    "contact force": "C, which lifts the tip and presses the spring top",
    "foundation force": "N, which lifts the lower end; 0 unless it is seated",
    "rigid law, soft law": "joined ends share one position; or the force follows from the penetration",
    "free": "phase: no force acts between the tip and what lies below it",
    "tied": "phase: tip and spring top move as one, whatever the sign of the force; with the law transmission below Ψ",
    "touch": "phase: the ends are in contact, which can push and not pull",
    "seated": "phase: the lower end rests on the foundation; event: it strikes the foundation and stays there",
    "impact": "event: tip and spring top meet; ends that a rigid law joins get one velocity at once",
    "stop_impact": "event: the lower end strikes the foundation and rebounds",
    "release": "event: tied ends rise through Ψ; from then on the contact can only push",
    "retie": "event: the ends go below Ψ together and are tied again",
    "separation": "event: the ends part",
    "unseated": "event: the lower end leaves the foundation",
    "macro step": "the time H over which the contact force is one polynomial, of the degree 0, 1 or 2",
    "mismatch": "v_tip − z of joined ends",
    "window": "the time over which a force is averaged before its largest value is taken",
    "reference": "the same equations solved by another method, both bodies as one system",
    "energy residual": "change of the sum of all energies, losses and works; it should be zero",
    "not resolved": "a companion run in longer steps differs visibly",
    "settled": "a driven motion repeats itself; its period is that of the drive, or a multiple",
}
#: More events than this are not drawn through all panels.
MANY_EVENTS = 60

#: Columns of `Trajectory`, in the order in which they are drawn.
POSITIONS = {
    "u_tip": Look(BLUE, "tip u(t, L)", Line(2.2, opacity=0.75)),
    "y": Look(VERMILLION, "spring top y", Line(0.9)),
}
VELOCITIES = {"v_tip": Look(BLUE, "tip v(t, L)", Line(1.5)), "z": Look(VERMILLION, "spring top z", Line(0.8))}
ACCELERATIONS = {"a_tip": Look(BLUE, "tip", Line(1.4)), "a_y": Look(VERMILLION, "spring top", Line(0.8))}
FORCES = {
    "contact_force": Look(ORANGE, "contact C", Line(2.6, opacity=0.7)),
    "compliance_force": Look(GREEN, "of the law", Line(1.0, dashed=True)),  # in the words of the law: `panels.forces`
    "foundation_force": Look(BLACK, "foundation N", Line(0.9)),
}
ENERGIES = {
    "e_beam": Look(SKY, "beam"),
    "e_spring": Look(ORANGE, "spring"),
    "e_contact": Look(YELLOW, "contact"),
    "e_dissipated": Look(PURPLE, "dissipated"),
    "e_impact_loss": Look(GREY, "impact losses"),
    "e_load": Look(GREEN, "loads (potential)"),
}
#: Fields of `Event`. A beam on a stop has both, equal: one is drawn within the other.
IMPULSES = {
    "impulse_contact": Look(BLUE, "on the tip", marker=Marker("○", "o", "circle-open", 5.5)),
    "impulse_foundation": Look(BLACK, "of the foundation", marker=Marker("▲", "^", "triangle-up", 3.0)),
}
LEVELS = {
    "Ψ": Look(BLACK, "start of the spring Ψ", Line(0.8, dashed=True)),
    "φ": Look(BLACK, "foundation φ", Line(1.3)),
}
#: Columns of pixels of a time axis, roughly; more points than a few per column cannot be seen.
PIXEL_COLUMNS = 1000
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class Unit(NamedTuple):
    """A unit with an SI prefix: values are multiplied by ``factor`` before they are drawn."""

    factor: float
    name: str


def readable_unit(values: Iterable[np.ndarray], unit: str) -> Unit:
    """Return the prefix with which the largest of ``values`` reads well: 0.015 m as 15 mm, 4.5e9 J as 4.5 GJ."""
    largest = max((float(np.max(np.abs(v), initial=0.0)) for v in values), default=0.0)
    if largest == 0.0 or 0.1 <= largest < 1e4:
        return Unit(1.0, unit)
    power = min(max(int(np.floor(np.log10(largest) / 3.0)), -4), 4)
    return Unit(10.0 ** (-3 * power), f"{'pnµm kMGT'[power + 4].strip()}{unit}")


def power_of_ten(value: float) -> str:
    """Return a power of ten as plain text, 1e-3 as 10⁻³: a formula takes matplotlib as long as all other texts."""
    return "10" + f"{round(np.log10(value))}".translate(_RAISED)


def decimated(time: np.ndarray, values: np.ndarray, columns: int = PIXEL_COLUMNS) -> np.ndarray:
    """Return the rows to draw: the first, last, lowest and highest of each of ``columns`` equal spans of time.

    A line through them covers the same pixels as one through all rows. ``time`` does not decrease.
    """
    if len(time) <= 4 * columns:
        return np.arange(len(time))
    edges = np.searchsorted(time, np.linspace(time[0], time[-1], columns + 1)[1:-1])
    keep = set[int]()
    for begin, end in pairwise([0, *edges.tolist(), len(time)]):
        if begin < end:
            part = values[begin:end]
            keep |= {begin, begin + int(part.argmin()), begin + int(part.argmax()), end - 1}
    return np.array(sorted(keep))


class EventMark(NamedTuple):
    """The events of one kind: look and marker with how many they are, times [s] and what each lost [J]."""

    kind: EventKind
    look: Look
    marker: Marker
    times: np.ndarray
    losses: np.ndarray


def event_marks(trajectory: Trajectory) -> list[EventMark]:
    """Return the events of a run by kind, thinned; kinds that did not happen are left out."""
    marks = []
    for kind, look in EVENT_LOOKS.items():
        events = [event for event in trajectory.events if event.kind == kind]
        if events:
            times = np.array([event.time for event in events])
            rows = decimated(times, times)
            losses = np.array([event.energy_loss for event in events])[rows]
            counted = look._replace(words=f"{look.words} ({len(events)})")
            assert look.marker is not None
            marks.append(EventMark(kind, counted, look.marker, times[rows], losses))
    return marks


#: The mark of pictures of a run that is not resolved (`springbeam.run.companion`).
NOT_RESOLVED = "NOT RESOLVED by the macro step: see the warnings"


def mark(trajectory: Trajectory) -> str:
    """Return `NOT_RESOLVED`, or nothing unless the run has not resolved its motion."""
    return NOT_RESOLVED if trajectory.summary.get("resolved") is False else ""


def phase_intervals(
    time: np.ndarray, phase: np.ndarray, columns: int = PIXEL_COLUMNS
) -> list[tuple[str, float, float]]:
    """Return ``(phase, start, end)`` in turn; a row's phase holds until the next row.

    More intervals than can be seen are replaced by the phases at ``columns`` equally spaced times.
    """
    starts = np.flatnonzero(np.r_[True, phase[1:] != phase[:-1]])
    if len(starts) > columns:
        samples = np.linspace(time[0], time[-1], columns + 1)
        at = np.searchsorted(time, 0.5 * (samples[1:] + samples[:-1]), side="right") - 1
        return phase_intervals(samples, phase[np.append(at, at[-1])], columns + 1)
    ends = np.r_[time[starts[1:]], time[-1]]
    return [(str(phase[i]), float(time[i]), float(end)) for i, end in zip(starts, ends, strict=True) if end > time[i]]


def shaded_phases(trajectory: Trajectory) -> list[tuple[Look, list[tuple[float, float]]]]:
    """Return shade, words and intervals [s] of each phase; none if the run is free throughout."""
    if not drawable(trajectory):
        return []
    spans: dict[str, list[tuple[float, float]]] = {}
    for phase, start, end in phase_intervals(trajectory["time"], trajectory["phase"]):
        spans.setdefault(phase, []).append((start, end))
    if spans.keys() == {"free"}:
        return []
    scene = trajectory.scene
    words = {name: look.words for name, look in PHASE_LOOKS.items()}
    if scene.contact.soft:
        words |= {"touch": "in contact (u < y)", "tied": f"joined by the {scene.contact.law}"}
    elif scene.contact.lasting:
        words["tied"] = "tied (u = y)"
    if scene.spring is None:
        words = {name: text.replace("y", "φ") for name, text in words.items()}
    return [(Look(PHASE_LOOKS[phase].colour, words[phase]), intervals) for phase, intervals in spans.items()]


def drawable(trajectory: Trajectory) -> bool:
    """Return whether a run can be drawn over time: it has two rows at different times."""
    return len(trajectory) > 1 and bool(trajectory.time[-1] > trajectory.time[0])


def present(trajectory: Trajectory, names: Iterable[str]) -> list[str]:
    """Return those of ``names`` that the run has columns of."""
    return [name for name in names if name in trajectory.columns]


def length_along(scene: Scene) -> tuple[Unit, float]:
    """Return the unit of positions along the beam, and its length in that unit; 1 m without a beam."""
    if scene.beam is None:
        return Unit(1.0, "m"), 1.0
    unit = readable_unit([np.array([scene.beam.length])], "m")
    return unit, unit.factor * scene.beam.length


def level_side(symbol: str, beside: Collection[str]) -> Literal["bottom", "top", "center"]:
    """Return the position of the name of a level: Ψ above and φ below, alone in the middle."""
    return "center" if len(beside) < 2 else "bottom" if symbol == "Ψ" else "top"


def time_unit(trajectory: Trajectory) -> Unit:
    """Return the unit of the time axes."""
    return readable_unit([trajectory["time"]], "s")


def near_levels(scene: Scene, moving: Sequence[np.ndarray]) -> dict[str, float]:
    """Return the heights [m] of the spring's start Ψ and the foundation φ, of those within 1.5 times the range of the
    motion [m]."""
    heights = {}
    if scene.spring is not None:
        heights["Ψ"] = scene.spring.equilibrium
    if scene.stop is not None:
        heights["φ"] = scene.stop.position
    low = min(map(np.min, moving))
    high = max(map(np.max, moving))
    reach = 1.5 * (high - low)
    return {symbol: height for symbol, height in heights.items() if low - reach <= height <= high + reach}
