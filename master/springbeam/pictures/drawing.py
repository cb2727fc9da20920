"""What the pictures, the report and the animation share, whatever draws them: colours, words, units, thinning.

Colours are those of Okabe and Ito, told apart with any colour vision.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from ..results.trajectory import EVENT_KINDS, Trajectory
from ..scene import Scene

BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
YELLOW, BLUE, VERMILLION, PURPLE = "#F0E442", "#0072B2", "#D55E00", "#CC79A7"
GREY, STONE = "#777777", "#B8B8B8"

PHASE_SHADES = {"free": "#FFFFFF", "tied": "#D6EAF7", "touch": "#FFF1B8", "seated": "#CFE8DD"}
OTHER_SHADES = ("#EADCE7", "#E4E4E4", "#F7DCC8")
PHASE_WORDS = {
    "free": "free",
    "tied": "tied (u = y < Ψ)",
    "touch": "touch (y ≥ Ψ)",
    "seated": "seated (at φ)",
}


class Look(NamedTuple):
    """Colour and words of a quantity or a kind of event."""

    colour: str
    words: str


EVENT_LOOKS = {
    "impact": Look(VERMILLION, "impact tip–spring"),
    "stop_impact": Look(BLACK, "impact on foundation"),
    "release": Look(BLUE, "release"),
    "retie": Look(PURPLE, "retie"),
    "separation": Look(GREEN, "separation"),
    "seated": Look(GREY, "seated"),
    "unseated": Look(GREY, "unseated"),
}
assert tuple(EVENT_LOOKS) == EVENT_KINDS
#: Of columns of `Trajectory`, in the order in which they are drawn.
POSITIONS = {"u_tip": Look(BLUE, "tip u(t, L)"), "y": Look(VERMILLION, "spring top y")}
VELOCITIES = {"v_tip": Look(BLUE, "tip v(t, L)"), "z": Look(VERMILLION, "spring top z")}
FORCES = {
    "contact_force": Look(SKY, "contact C, as applied"),
    "contact_force_smoothed": Look(BLUE, "contact C, smoothed"),
    "compliance_force": Look(GREEN, "part λ(Ψ − u)₊ᵖ"),
    "foundation_force": Look(BLACK, "foundation N"),
}
ENERGIES = {
    "e_beam": Look(SKY, "beam"),
    "e_spring": Look(ORANGE, "spring"),
    "e_contact": Look(YELLOW, "contact"),
    "e_dissipated": Look(PURPLE, "dissipated"),
    "e_impact_loss": Look(GREY, "impact losses"),
    "e_load": Look(GREEN, "loads (potential)"),
}
#: Of fields of `Event`.
IMPULSES = {
    "impulse_contact": Look(BLUE, "on the tip"),
    "impulse_foundation": Look(BLACK, "of the foundation"),
}
#: Columns of pixels of a time axis, roughly; more points than a few per column cannot be seen.
PIXEL_COLUMNS = 1000
#: Forces and energies below this part of the largest one are not seen beside it.
INVISIBLE = 5e-3


class Unit(NamedTuple):
    """A unit with an SI prefix: values are multiplied by ``factor`` before they are drawn."""

    factor: float
    name: str


def readable_unit(values: Iterable[np.ndarray], unit: str) -> Unit:
    """The prefix with which the largest of ``values`` reads well: 0.015 m as 15 mm, 4.5e9 J as 4.5 GJ."""
    largest = max((float(np.max(np.abs(v), initial=0.0)) for v in values), default=0.0)
    if largest == 0.0 or 0.1 <= largest < 1e4:
        return Unit(1.0, unit)
    power = min(max(int(np.floor(np.log10(largest) / 3.0)), -4), 4)
    return Unit(10.0 ** (-3 * power), f"{'pnµm kMGT'[power + 4].strip()}{unit}")


def decimated(time: np.ndarray, values: np.ndarray, columns: int = PIXEL_COLUMNS) -> np.ndarray:
    """Indices of the rows to draw: of each of ``columns`` equal spans of time the first, last, lowest and highest.

    A line through them covers the same pixels as one through all rows. ``time`` does not decrease.
    """
    if len(time) <= 4 * columns:
        return np.arange(len(time))
    edges = np.searchsorted(time, np.linspace(time[0], time[-1], columns + 1)[1:-1])
    keep = []
    for span in np.split(np.arange(len(time)), edges):
        if len(span):
            part = values[span]
            keep += [span[0], span[int(np.argmin(part))], span[int(np.argmax(part))], span[-1]]
    return np.unique(keep)


def alternates(values: np.ndarray) -> bool:
    """Whether ``values`` mostly jump up and down from row to row: the steps are longer than what they should show."""
    if len(values) < 20:
        return False
    jumps = np.diff(values)
    reversals = np.mean(jumps[1:] * jumps[:-1] < 0.0)
    usual_range = np.subtract(*np.quantile(values, (0.95, 0.05)))
    return bool(reversals > 0.6 and np.mean(np.abs(jumps)) > 0.15 * usual_range)


#: The mark of pictures whose run says of itself that it is `springbeam.scene.resolution.not_resolved`.
NOT_RESOLVED = "NOT RESOLVED by the macro step: see the warnings"


def mark(trajectory: Trajectory) -> str:
    """`NOT_RESOLVED`, or nothing if the run has resolved its motion."""
    return "" if trajectory.summary.get("resolved", True) else NOT_RESOLVED


def alternating(trajectory: Trajectory) -> list[str]:
    """Words for the quantities that alternate from step to step."""
    looks = POSITIONS | VELOCITIES | FORCES
    return [looks[name].words for name in present(trajectory, looks) if alternates(trajectory[name])]


def phase_intervals(
    time: np.ndarray, phase: np.ndarray, columns: int = PIXEL_COLUMNS
) -> list[tuple[str, float, float]]:
    """``(phase, start, end)`` in turn; a row's phase holds until the next row.

    More intervals than can be seen are replaced by the phases at ``columns`` equally spaced times.
    """
    starts = np.flatnonzero(np.r_[True, phase[1:] != phase[:-1]])
    if len(starts) > columns:
        samples = np.linspace(time[0], time[-1], columns + 1)
        at = np.searchsorted(time, 0.5 * (samples[1:] + samples[:-1]), side="right") - 1
        return phase_intervals(samples, phase[np.append(at, at[-1])], columns + 1)
    ends = np.r_[time[starts[1:]], time[-1]]
    return [(str(phase[i]), float(time[i]), float(end)) for i, end in zip(starts, ends, strict=True) if end > time[i]]


def present(trajectory: Trajectory, names: Iterable[str]) -> list[str]:
    """Those of ``names`` that the run has columns of."""
    return [name for name in names if name in trajectory.columns]


def levels(scene: Scene) -> dict[str, float]:
    """Heights [m] of the spring's rest Ψ and the foundation φ, those that the scene has."""
    heights = {}
    if scene.spring is not None:
        heights["Ψ"] = scene.spring.equilibrium
    if scene.stop is not None:
        heights["φ"] = scene.stop.position
    return heights


def near_levels(scene: Scene, moving: Sequence[np.ndarray]) -> dict[str, float]:
    """Those of `levels` that do not dwarf what moves [m]: at most one and a half times its range away from it."""
    low, high = min(float(np.min(part)) for part in moving), max(float(np.max(part)) for part in moving)
    reach = 1.5 * (high - low)
    return {symbol: height for symbol, height in levels(scene).items() if low - reach <= height <= high + reach}


def first_contact(trajectory: Trajectory) -> float:
    """When the tip first meets something [s]; without such an event, the start."""
    times = (event.time for event in trajectory.events if event.kind in ("impact", "stop_impact"))
    return next(times, float(trajectory["time"][0]))


def much_smaller(trajectory: Trajectory, names: list[str]) -> list[str]:
    """The one of two whose motion cannot be seen beside the other's, if it moves at all."""
    ranges = {name: float(np.ptp(trajectory[name])) for name in names}
    return [name for name, size in ranges.items() if 0.0 < size < 0.02 * max(ranges.values())]


def energy_scale(trajectory: Trajectory) -> float:
    """The largest energy of the run [J], against which its residual is judged; 1 if there is none."""
    columns = trajectory.columns
    stored = sum(np.abs(columns[name]) for name in ("e_beam", "e_spring", "e_contact") if name in columns)
    return float(max(np.max(stored), abs(columns["e_total"][0]))) or 1.0


def sizes_beside_the_largest(trajectory: Trajectory, names: Iterable[str]) -> tuple[list[str], dict[str, float]]:
    """The columns that can be seen beside the largest of them, and the largest value of each that cannot."""
    sizes = {name: float(np.max(np.abs(trajectory[name]))) for name in names}
    seen = [name for name, size in sizes.items() if size >= INVISIBLE * max(sizes.values())]
    return seen, {name: size for name, size in sizes.items() if size > 0.0 and name not in seen}


def stackable(trajectory: Trajectory, parts: Iterable[str]) -> bool:
    """Whether the energies ``parts`` can be stacked: there are some, and none is negative but by rounding."""
    least = min((float(np.min(trajectory[name])) for name in parts), default=-1.0)
    return least >= -1e-9 * float(np.max(trajectory["e_total"]))


def stem_foot(sizes: np.ndarray) -> float | None:
    """Where stems of ``sizes`` begin on a logarithmic axis; ``None`` where a linear one shows them all.

    Impulses of rounding size would stretch the axis over the ones that matter.
    """
    if np.any(sizes <= 0.0) or np.max(sizes) <= 30.0 * np.min(sizes):
        return None
    return 0.3 * max(float(np.min(sizes)), 1e-8 * float(np.max(sizes)))
