"""The runs of a fit: what is left of measured curves in each, and what the user is shown of all of them.

Curves of different units are weighed by their spread, and then by what is left of each. The clock of the measurement
may be off by a shift, which is eliminated inside each residual (`least`) unless it is given.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping
from functools import cached_property, partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from pydantic import PrivateAttr
from rich.text import Text

from ...pictures.diagrams import draw_diagrams
from ...results.trajectory import Trajectory
from ...run.accuracy import prepared
from ...run.outcome import RunStopped
from ...run.simulate import simulate_to
from ...scene import ArgumentError, Scene, SceneError, with_changes
from ...scene.files import write_tables
from ...scene.tables import TOLERANCE_KEYS
from ...signals.measured import (
    Aligned,
    Measured,
    at_shift,
    measured_as,
    period,
    rms,
    settled,
    shifts,
)
from ..beside import overlaid
from ..design import with_keys
from ..study import Make, Study
from ..tables import Findings, Row, table
from .least import SHIFT
from .multistart import STARTS, MultiStart, expected, name_of
from .ranges import Ranges
from .verdict import undetermined

_DISAGREES = 1
_STOPPED = 3
#: Share of the run by which the clock may move from where a search begins before points leave the run.
_MARGIN = 0.02
#: Share of the run by which it goes on beyond the last point, for a derivative there.
_BEYOND = 1e-5
#: Makes a tolerance or an accuracy tighter, as half the macro step does.
_TIGHTER = 0.1
#: Rows of runs that are kept for other shifts of the clock.
_KEPT = 100_000


class Fit(Study):
    """What is sought by which measurement."""

    kind: ClassVar[str] = "fit"
    announced: ClassVar[str] = "about {} runs"

    scene: Scene
    file: Path  #: the measured columns, time first
    vary: tuple[str, ...]  #: ``KEY=GUESS`` or ``KEY=LOW:HIGH`` each
    names: tuple[str, ...] = ()  #: ``NAME=COLUMN`` each: which column of a run a measured one is
    scale: tuple[str, ...] = ()  #: ``NAME=NUMBER [UNIT]`` each: by what a measured column is multiplied
    read: tuple[str, ...] = ()  #: ``KEY=VALUE`` each: how the file is read
    shift: float | None = None  #: by which the clock of the measurement is moved [s]; found if it is left out
    repeat: Path | None = None  #: a second measurement of the same, which shows the noise

    _kept: dict[str, Trajectory] = PrivateAttr(default_factory=dict)  #: runs by their scenes, the last used one last

    @cached_property
    def data(self) -> Measured:
        """What is measured. Raises SceneError if the file cannot be used."""
        return measured_as(self.file, self.scene, self.names, self.scale, self.read)

    @cached_property
    def repeated(self) -> Measured | None:
        """The second measurement."""
        if self.repeat is None:
            return None
        return measured_as(self.repeat, self.scene, self.names, self.scale, self.read)

    @cached_property
    def ranges(self) -> Ranges:
        """Where keys are sought. Raises SceneError if they cannot be fitted."""
        return Ranges.parse(self.vary)

    def cases(self) -> dict[str, Row]:
        """Return the runs with which the search begins. Raises SceneError if nothing can be found."""
        cases = [self.ranges.values(start) for start in self.ranges.starts(STARTS[0])]
        with_keys(self.scene, cases[0])
        data = self.data
        free = self.shift is None
        # Where the run may begin in the time of the measurement, and how many points it then covers at most.
        begins = data.time if self.shift is None else np.array([(self.scene.contact_time or 0.0) - self.shift])
        ends = np.searchsorted(data.time, begins + self.scene.duration, side="right")
        inside = int(np.max(ends - np.searchsorted(data.time, begins)))
        if inside <= len(self.ranges.ends) + free:
            raise ArgumentError(
                f"{self.file}: fewer of its points lie in the run than are needed to find "
                f"{', '.join(self.ranges.ends)}{' and the shift of its clock' * free}; make time.t_end longer, give "
                "more points, or another --shift"
            )
        _ = self.repeated
        return {name_of(case): case for case in cases}

    def expected(self, done: int = 0) -> int:
        """Return the number of runs, as far as ``done`` of them show it."""
        return expected(len(self.ranges.ends), done)

    def settings(self) -> dict[str, Any]:
        """Return the identity of a fit; measurements count by their content."""
        several = [data for data in (self.data, self.repeated) if data is not None]
        held = [hashlib.sha256(part.tobytes()) for data in several for part in (data.time, *data.values.values())]
        return super().settings() | {"measured": [part.hexdigest() for part in held]}

    def record(self, case: Row) -> Row:
        """Run one case; return what is left of the curves at the shift that fits best, or why it cannot be run.

        Beside the keys, a case says

        * ``clock``: the lowest shift of the clock [s], that from which the best one is sought, and the highest;
          ``points`` are those that count, from a number up to another. Without a clock it is sought anywhere, if it is
          not given;
        * ``near``: without a clock, a shift [s] near which the best one is sought;
        * ``step``: the macro step [s] that was picked for the accuracy of the scene, so that it is not picked again;
        * ``finer``: the run has shorter steps;
        * ``repeat``: it is compared with the repeated measurement.
        """
        keys = {name: case[name] for name in self.ranges.ends}
        data = self.repeated if case.get("repeat") else self.data
        assert data is not None
        anywhere = (-math.inf, 0.0, math.inf) if self.shift is None else (self.shift, self.shift, self.shift)
        lowest, near, highest = case.get("clock", anywhere)
        try:
            run = self._run(case, float(data.time[-1]) + highest)
        except (RunStopped, SceneError) as refused:
            return {**keys, "error": str(refused)}
        begins: Row = {}
        if "clock" in case:
            here = at_shift(run, data, near)
            aligned = settled(run, data, here, slice(*case["points"]), (lowest, highest))
        else:
            aligned, begins = self._begun(run, data, case)
        left = {f"left_{name}": rms(off) for name, off in aligned.off.items()}
        step = None if self.scene.accuracy is None else run.scene.coupling.H
        curves = {"off": aligned.off, "slope": aligned.slope}
        return {**keys, SHIFT: aligned.shift, **left, "error": "", "step": step, **curves, **begins}

    def _begun(self, run: Trajectory, data: Measured, case: Row) -> tuple[Aligned, Row]:
        """Return both at the best shift of the clock, and what a search from there takes.

        These are the ``points`` that take part, from a number up to another, the ``room`` of the clock: between which
        shifts [s] the run covers them; and ``ranked``: other shifts [s] and mean squares (`shifts`).
        """
        free = self.shift is None
        ranked = shifts(run, data) if self.shift is None else [(self.shift, 0.0)]
        here = at_shift(run, data, case.get("near", ranked[0][0]))
        covered = np.flatnonzero(data.covered(run, here.shift, _MARGIN * free))
        first, last = (int(covered[0]), int(covered[-1]) + 1) if len(covered) else (0, 0)
        room = (here.shift, here.shift)
        if free and last > first:
            room = (float(run.time[0] - data.time[first]), float(run.time[-1] - data.time[last - 1]))
        quarter = 0.25 * period(here.slope, data)
        limits = (max(room[0], here.shift - quarter), min(room[1], here.shift + quarter))
        aligned = settled(run, data, here, slice(first, last), limits)
        return aligned, {"points": (first, last), "room": room, "ranked": ranked}

    def _run(self, case: Row, last: float) -> Trajectory:
        """Return the run of a case, at least up to the time ``last`` [s] if that is in it.

        Raises RunStopped, and SceneError if it cannot be run.
        """
        scene = with_keys(self.scene, {name: case[name] for name in self.ranges.ends})
        if case.get("finer"):
            scene = _finer(scene)
        elif case.get("step"):
            scene = prepared(scene, case["step"])
        until = min(last + _BEYOND * scene.duration, scene.time.t_end)
        name = scene.model_dump_json()
        run = self._kept.pop(name, None)
        if run is None or run.time[-1] < until:
            run = simulate_to(scene, until)
        self._kept[name] = run
        while len(self._kept) > 1 and sum(map(len, self._kept.values())) > _KEPT:
            self._kept.pop(next(iter(self._kept)))
        return run

    def made(self, make: Make, known: Mapping[str, Row]) -> dict[str, Row]:
        """Search; return all runs."""
        self._search(lambda case: make({name_of(case): case})[name_of(case)]).found()
        return dict(known)

    def findings(self, records: Mapping[str, Row]) -> Findings:
        """Return the values found with their intervals, and why the data does not determine them (exit code 1)."""
        found = self._search(lambda case: records[name_of(case)]).found()
        kept = ("step", "off", "slope", "points", "room", "ranked")
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
        values = {row["key"]: row["value"] for row in found.keys if row["key"] != SHIFT}
        fitted = with_keys(self.scene, values)
        what = f"fitted to {self.file}" + "; the data do not determine it" * bool(why)
        texts = {"fitted.toml": write_tables(fitted.model_dump(exclude_none=True), what)}
        pictures = {self.kind: partial(self._drawn, fitted, found.shift)}
        return Findings(
            document, shown, code=_DISAGREES * bool(why), tables={self.kind: runs}, texts=texts, pictures=pictures
        )

    def _drawn(self, fitted: Scene, shift: float) -> Any:
        """Return a figure of the curves, measured and of the fitted scene, each above what is left of it."""
        run = self._run({name: fitted.flat()[name] for name in self.ranges.ends}, float(self.data.time[-1]) + shift)
        diagrams = overlaid(run, self.data, shift, "fitted", left=True)
        return draw_diagrams(diagrams, self.scene.title, (8.2, 2.2), wide=1)

    def _search(self, make: Callable[[Row], Row]) -> MultiStart:
        return MultiStart(self.ranges, self.data, self.repeated, self.shift is None, self.scene.duration, make)


def _finer(scene: Scene) -> Scene:
    """Return a scene with half the macro step, or a tighter accuracy or tolerances."""
    if scene.accuracy is not None:
        return with_changes(scene, accuracy=_TIGHTER * scene.accuracy)
    coupling = scene.coupling
    if not coupling.adaptive:
        return with_changes(scene, coupling={"macro_step": 0.5 * coupling.H})
    tolerances = ((name, getattr(coupling, name)) for name in TOLERANCE_KEYS)
    return with_changes(scene, coupling={name: _TIGHTER * given for name, given in tolerances if given is not None})
