"""The result of a run, whoever computed it: columns, events, beam shapes, summary."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from importlib import import_module
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..motion.events import Event
from ..scene import Scene
from ..scene.messages import nearest
from ..scene.statics import SHAPE_POINTS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from pandas import DataFrame
    from xarray import Dataset


class Column(NamedTuple):
    """A column of a run: its unit, the part of a scene without which it is left out, and its meaning."""

    unit: str  #: "" of ``phase``
    part: str
    words: str


#: Columns of a whole pair, in file order; the loads of a scene follow.
COLUMNS = {
    "time": Column("s", "", "time of the row"),
    "u_tip": Column("m", "beam", "position of the tip"),
    "v_tip": Column("m/s", "beam", "velocity of the tip, or the common velocity of ends that a rigid law joins"),
    "y": Column("m", "spring", "position of the spring top"),
    "z": Column("m/s", "spring", "velocity of the spring top, or the common velocity"),
    "contact_force": Column("N", "pair", "contact force C; it lifts the tip and presses the spring"),
    "compliance_force": Column("N", "pair", "transmission: λ_nc(Ψ − u_tip)₊^p; soft laws: C; tie, unilateral: 0"),
    "tie_reaction": Column("N", "pair", "contact_force − compliance_force"),
    "foundation_force": Column("N", "stop", "force N of the foundation, upward; 0 unless seated"),
    "gap": Column("m", "gap", "u_tip − y; without a spring u_tip − φ"),
    "phase": Column("", "", "free, tied, touch or seated"),
    "e_beam": Column("J", "beam", "mechanical energy of the beam"),
    "e_spring": Column("J", "spring", "mechanical energy of the spring"),
    "e_contact": Column("J", "pair", "energy stored by the contact law"),
    "e_dissipated": Column("J", "", "energy lost to damping"),
    "e_impact_loss": Column("J", "", "energy lost in impacts"),
    "e_load": Column("J", "", "minus the work of the loads"),
    "e_total": Column("J", "", "sum of the six energies"),
    "energy_residual": Column("J", "", "change of e_total since the start; it should be zero"),
}
#: Columns after the loads, from our own bodies.
BODY_COLUMNS = {
    "a_tip": Column(
        "m/s²", "own beam", "acceleration of the tip relative to the base; of the lower end while a law joins them"
    ),
    "clamp_force": Column("N", "own beam", "force of the clamp on the beam, upward"),
    "clamp_moment": Column("N·m", "own beam", "moment of the clamp on the beam, counter-clockwise"),
    "bending_stress": Column("Pa", "section", "largest bending stress along the beam, from height or diameter"),
    "a_y": Column("m/s²", "own spring", "acceleration of the spring top relative to the base"),
}
#: What the column ``phase`` may hold.
PHASES = ("free", "tied", "touch", "seated")
#: Columns of the table of shapes: time [s], then deflections [m], bending moments [N·m] and shear forces [N] at
#: `SHAPE_POINTS`.
SHAPE_COLUMNS = ("time", *(f"{part}_{i}" for part in ("u", "moment", "shear") for i in range(len(SHAPE_POINTS))))
#: A number below this share of its table's largest is a rounded zero.
_NOISE = 1e-13


#: So many events of a kind in succession are a cascade.
_CASCADE = 4


def cascades(events: Iterable[Event]) -> Iterator[list[Event]]:
    """Yield the events in their order: those of a cascade together, each other one alone."""
    for _, some in groupby(events, key=lambda event: event.kind):
        same = list(some)
        yield from [same] if len(same) >= _CASCADE else ([event] for event in same)


def columns_of(scene: Scene) -> dict[str, str]:
    """Return the columns of ``scene`` in file order with their units, "" for ``phase``, which has none.

    They are `COLUMNS` without those of absent bodies, its loads: ``load_0`` for ``loads.0``, and `BODY_COLUMNS` without
    those of bodies that are not our own. ``gap`` is u_tip − y of a pair, u_tip − φ of a beam above a stop.
    """
    own = None if scene.massless else scene.beam
    stop = scene.stop is not None
    there = {
        "": True,
        "beam": scene.upper is not None,
        "spring": scene.lower is not None,
        "pair": scene.coupled,
        "stop": stop and not scene.elastic_stop,
        "gap": scene.upper is not None and (scene.lower is not None or stop),
        "own beam": own is not None,
        "section": own is not None and own.section_height > 0.0,
        "own spring": scene.spring is not None,
    }
    before, after = (
        {name: column.unit for name, column in table.items() if there[column.part]} for table in (COLUMNS, BODY_COLUMNS)
    )
    return before | {f"load_{i}": load.unit for i, load in enumerate(scene.loads)} | after


def rounded(value: float, scale: float) -> str:
    """Return ``value`` in four digits; "0" if it is a rounded zero compared with ``scale``, the largest of its kind."""
    return "0" if abs(value) <= _NOISE * scale else f"{value:.4g}"


class Contact(NamedTuple):
    """A contact of tip and spring, or of a single body with the foundation; a row of ``contacts.csv``."""

    begin: float  #: [s]
    duration: float  #: [s]; of an impact that separates at once 0
    impulse: float  #: on the upper of both, upward: ∫ C dt and impacts [N·s]
    #: Largest force [N]: of the law, or of a rigid contact the mean over the window; ``None`` if that is not known.
    peak_force: float | None
    peak_time: float | None  #: when that is, or when the window begins [s]
    depth: float  #: largest penetration by the law; of a rigid one the distance that the ends go down together [m]
    loss: float  #: by the contact law, or in its impacts [J]
    v_tip_before: float  #: velocities of tip and lower end where they meet [m/s]; that of a wall, or of no body, is 0
    z_before: float
    v_tip_after: float | None  #: and where they part; ``None`` if the run ends in the contact
    z_after: float | None

    @property
    def closing(self) -> float:
        """Speed at which the ends meet [m/s]."""
        return self.z_before - self.v_tip_before

    @property
    def opening(self) -> float | None:
        """Speed at which they part [m/s]; ``None`` if the run ends in the contact."""
        return None if self.v_tip_after is None or self.z_after is None else self.v_tip_after - self.z_after


#: Units of the columns of ``contacts.csv``.
CONTACT_UNITS = dict(zip(Contact._fields, ("s", "s", "N·s", "N", "s", "m", "J", *["m/s"] * 4), strict=True))


@dataclass(repr=False)
class Trajectory:
    """Columns as numpy arrays under the names of `COLUMNS`: ``trajectory["y"]`` or ``trajectory.y``.

    ``shape_table`` has the numbers of `SHAPE_COLUMNS`, shape (n, 64); it is ``None`` without a beam. ``at`` is
    `springbeam.results.dense.at`; `springbeam.api` attaches ``contacts``, ``plot`` and ``save``.
    """

    scene: Scene
    columns: dict[str, np.ndarray]
    events: list[Event] = field(default_factory=list)
    shape_table: np.ndarray | None = None
    summary: dict[str, Any] = field(default_factory=dict)
    #: Records between the rows, a step per row (`springbeam.results.records.STEP`); ``None`` without such data.
    steps: np.ndarray | None = None

    if TYPE_CHECKING:

        @property
        def contacts(self) -> list[Contact]: ...
        def at(self, times: Any) -> Trajectory: ...
        def plot(self, picture: str = "positions", ax: Axes | None = None) -> Figure: ...
        def save(self, directory: str | Path, *, replace: bool = False) -> Path: ...

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self.columns:
            raise KeyError(f"{name}: no column; {nearest(name, self.columns)}there are {', '.join(self.columns)}")
        return self.columns[name]

    def __getattr__(self, name: str) -> np.ndarray:
        if name == "columns" or name not in self.columns:  # the former while it is unpickled
            raise AttributeError(name)
        return self.columns[name]

    @property
    def do_steps(self) -> int:
        """doStep calls of both FMUs, those that were rolled back included."""
        return sum(int(self.summary.get(f"{body}_steps", 0)) for body in ("beam", "spring"))

    def __len__(self) -> int:
        return len(self.columns["time"])

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.columns]

    def __repr__(self) -> str:
        status = self.summary.get("status", "no summary")
        span = f"t = {self.time[0]:g} … {self.time[-1]:g} s, " if len(self) else ""
        return f"<Trajectory {self.scene.title!r}: {len(self)} rows, {span}{len(self.events)} events, {status}>"

    @property
    def units(self) -> dict[str, str]:
        """Units of the columns that have one."""
        return {name: unit for name, unit in columns_of(self.scene).items() if unit and name in self.columns}

    @property
    def shapes(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Times [s], shape (n,), and deflections along the beam then [m], (n, 21); ``None`` without a beam."""
        return None if self.shape_table is None else (self.shape_table[:, 0], self._along(0))

    @property
    def bending_moment(self) -> np.ndarray | None:
        """Bending moments [N·m] at the times and places of the shapes, positive where they bend the beam upwards."""
        return None if self.shape_table is None else self._along(1)

    @property
    def shear_force(self) -> np.ndarray | None:
        """Shear forces [N] at the times and places of the shapes, upward on the part before the place."""
        return None if self.shape_table is None else self._along(2)

    def _along(self, part: int) -> np.ndarray:
        return np.split(np.asarray(self.shape_table)[:, 1:], 3, axis=1)[part]

    def without_start(self) -> Trajectory:
        """Return the run without its first row if the initial slope or velocity of the beam contradicts the clamp.

        Clamp and inner forces at that instant grow with the number of elements; they are finite in the next row.
        """
        beam = self.scene.beam
        later = self.time > self.time[:1]
        leans = beam is not None and (beam.initial_deflection_slope, beam.initial_velocity_slope) != (0.0, 0.0)
        if not leans or not later.any():
            return self
        columns = {name: values[later] for name, values in self.columns.items()}
        table = self.shape_table
        return replace(self, columns=columns, shape_table=None if table is None else table[table[:, 0] > self.time[0]])

    def to_pandas(self) -> DataFrame:
        """Return the columns as a pandas DataFrame, with units; needs the extra ``data``.

        Times of rows at an event repeat, so ``time`` is a column and not the index.
        """
        table: DataFrame = _of_extra("pandas").DataFrame(self.columns)
        table.attrs["title"] = self.scene.title
        table.attrs["units"] = self.units
        return table

    def to_xarray(self) -> Dataset:
        """Return the columns over ``time`` and the shapes over ``shape_time`` and ``x`` [m] as an xarray Dataset.

        No time repeats: at an event the values are those after it, and ``y_before`` over ``event_time`` those before
        it, of each column. It has units, and needs the extra ``data``.
        """
        last = np.append(self.time[1:] > self.time[:-1], True)
        times = np.unique([event.time for event in self.events if self.time[0] < event.time <= self.time[-1]])
        before = self._before(times)
        variables: dict[str, Any] = {}
        for name, values in self.columns.items():
            attributes = {"units": self.units[name]} if name in self.units else {}
            variables[name] = ("time", values[last], attributes)
            variables[f"{name}_before"] = ("event_time", before[name], attributes)
        coordinates = {"time": variables.pop("time"), "event_time": ("event_time", times, {"units": "s"})}
        del variables["time_before"]
        if self.shapes is not None and self.scene.beam is not None:
            along = {"deflection": "m", "bending_moment": "N·m", "shear_force": "N"}
            for part, (name, unit) in enumerate(along.items()):
                variables[name] = (("shape_time", "x"), self._along(part), {"units": unit})
            coordinates["shape_time"] = ("shape_time", self.shapes[0], {"units": "s"})
            coordinates["x"] = ("x", SHAPE_POINTS * self.scene.beam.length, {"units": "m"})
        dataset: Dataset = _of_extra("xarray").Dataset(variables, coordinates, {"title": self.scene.title})
        return dataset

    def _before(self, times: np.ndarray) -> dict[str, np.ndarray]:
        """Return the columns right before events at ``times`` [s]."""
        if self.steps is None:  # the run has a row before each event
            rows = np.searchsorted(self.time, times)
            return {name: values[rows] for name, values in self.columns.items()}
        return self.at(np.nextafter(times, -np.inf)).columns


def _of_extra(package: str) -> Any:
    """Return a package of the extra ``data``. Raises ImportError, which names the remedy."""
    try:
        return import_module(package)
    except ImportError as error:
        raise ImportError(
            f"{package} cannot be imported ({error}); the extra 'data' brings it: pip install -e '.[data]' in the "
            "checkout of springbeam"
        ) from error
