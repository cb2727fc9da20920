"""A run as one HTML page without a network, a server or other files.

``charts`` makes the charts, ``page.html``, ``page.js`` and ``page.css`` the page around them.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from math import copysign
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import tomli_w

from ...results.contacts import contacts_of
from ...results.judged import judged_in_words
from ...results.totals import in_words
from ...results.trajectory import CONTACT_UNITS, Trajectory, cascades, rounded
from ...scene import Scene
from ...scene.partners import kind_of
from ...scene.statics import bending_stiffness, shear_stiffness
from ..drawing import (
    EVENT_LOOKS,
    FORCES,
    GLOSSARY,
    POSITIONS,
    event_marks,
    mark,
    present,
    readable_unit,
    shaded_phases,
    time_unit,
)
from ..frames import COIL_HEIGHTS, Frames, Sketch, frames_of, sketches
from .charts import Chart, backdrop, charts, moving_chart

_HERE = Path(__file__).parent
#: Rows of the table of events.
_EVENTS_SHOWN = 200
_EVENT_UNITS = {"y": "m", "z": "m/s", "u_tip": "m", "v_tip": "m/s"}
_FORCES_READ = ("contact_force", "foundation_force")
#: Numbers of a summary in words, and how they are written.
_NUMBERS = {
    "macro_steps": ("macro steps", "{:.0f}"),
    "iterations": ("iterations for the contact force", "{:.0f}"),
    "wall_time": ("wall time", "{:.3g} s"),
    "max_energy_residual": ("largest energy residual, relative", "{:.2g}"),
}


def page(trajectory: Trajectory) -> str:
    """Return the report of a run as HTML; the same run always gives the same text.

    Parameters
    ----------
    trajectory
        Any run, also one that stopped early or has no rows; missing parts are left out.
    """
    time = trajectory.columns["time"]
    over_time = charts(trajectory)
    frames = frames_of(trajectory)
    shown = [] if frames is None else sketches(trajectory, frames)
    moving = [] if frames is None else [moving_chart(sketch, frames) for sketch in shown]
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_HERE), autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    scene = trajectory.scene
    events = trajectory.events[:_EVENTS_SHOWN]
    values = {name: unit for name, unit in _EVENT_UNITS.items() if name in trajectory.columns}
    return environment.get_template("page.html").render(
        title=scene.title or "(untitled scene)",
        version=trajectory.summary.get("version", ""),
        warnings=_warnings(trajectory),
        mark=mark(trajectory),
        moving=moving,
        frames=0 if frames is None else len(frames.time),
        charts=over_time,
        phases=[look for look, _ in shaded_phases(trajectory)],
        event_key=event_marks(trajectory),
        numbers=list(_numbers(trajectory)),
        described=list(described(scene)),
        results=list(in_words(trajectory.summary)),
        judged=judged_in_words(trajectory.summary, trajectory.scene.duration),
        events=list(cascades(events)),
        contact_units=CONTACT_UNITS,
        contacts=contacts_of(trajectory),
        contacts_shown=_EVENTS_SHOWN,
        event_values=values,
        event_scales={name: max((abs(getattr(e, name) or 0.0) for e in events), default=0.0) for name in values},
        rounded=rounded,
        event_words={kind: look.words for kind, look in EVENT_LOOKS.items()},
        more_events=max(0, len(trajectory.events) - _EVENTS_SHOWN),
        rows=len(time),
        points=max((chart.points for chart in over_time), default=0),
        toml=tomli_w.dumps(scene.model_dump(exclude_none=True)),
        data=_as_script(_data(trajectory, [*moving, *over_time], shown, frames) if over_time else None),
        glossary=list(_glossary(trajectory)),
        plotly=(_HERE / "plotly-basic.min.js").read_text(encoding="utf-8"),
        script=(_HERE / "page.js").read_text(encoding="utf-8"),
        style=(_HERE / "page.css").read_text(encoding="utf-8"),
    )


def _warnings(trajectory: Trajectory) -> list[str]:
    """Return warnings for the reader, the most severe first."""
    summary = trajectory.summary
    warnings = []
    status = summary.get("status", "done")
    if status == "running":
        warnings.append("The run is not finished: it was still running when this page was made, or it was killed.")
    elif status != "done":
        when = f" at t = {summary['time']:.9g} s" if isinstance(summary.get("time"), float) else ""
        warnings.append(f"The run was {status}{when}: {summary.get('cause', 'cause unknown')}")
    warnings += [str(warning) for warning in summary.get("warnings", ())]
    return warnings


def _glossary(trajectory: Trajectory) -> Iterator[tuple[str, str]]:
    """Yield the words of phases and events that the page shows, and what they mean."""
    events = {event.kind for event in trajectory.events}
    for name, meaning in GLOSSARY.items():
        if name in events or name in trajectory["phase"] or name in ("foundation", "window"):
            yield name.replace("_", " "), meaning


def _numbers(trajectory: Trajectory) -> Iterator[tuple[str, str]]:
    """Return words and values for the table of numbers."""
    summary = trajectory.summary
    for key, (words, form) in _NUMBERS.items():
        if key in summary:
            yield words, form.format(float(summary[key]))
    for body in ("beam", "spring"):
        if f"{body}_steps" in summary:
            taken_back = summary[f"{body}_rollbacks"]
            yield f"steps of the {body} FMU", f"{summary[f'{body}_steps']}, {taken_back} of them repeated"


def _data(trajectory: Trajectory, drawn: list[Chart], moving: list[Sketch], frames: Frames | None) -> dict[str, Any]:
    unit = time_unit(trajectory)
    data: dict[str, Any] = {
        "unit": {"factor": unit.factor, "name": unit.name},
        "backdrop": backdrop(trajectory),
        "charts": {chart.name: {"data": chart.traces, "layout": chart.layout} for chart in drawn},
        "overTime": [chart.name for chart in drawn[len(moving) :]],
    }
    if frames is not None:
        data["motion"] = {
            "time": frames.time,
            "phase": trajectory["phase"][frames.row],
            "readings": list(_readings(trajectory, frames)),
            "deflection": frames.deflection,
            "y": frames.y,
            "foot": frames.foot,
            "coil": COIL_HEIGHTS,
            "parts": {sketch.name: {"factor": sketch.unit.factor, "traces": sketch.moving} for sketch in moving},
        }
    return data


def _readings(trajectory: Trajectory, frames: Frames) -> Iterator[dict[str, Any]]:
    for looks, unit in ((POSITIONS, "m"), ({name: FORCES[name] for name in _FORCES_READ}, "N")):
        names = present(trajectory, looks)
        readable = readable_unit([trajectory[name] for name in names], unit)
        for name in names:
            values = trajectory[name][frames.row]
            yield {"words": looks[name].words, "values": values, "factor": readable.factor, "unit": readable.name}


def _short(values: np.ndarray) -> Any:
    """Return numbers for the JSON of a page, with nine digits, more than a screen shows."""
    return [_short(row) for row in values] if values.ndim > 1 else [
        float(f"{value:.9g}") if isinstance(value, float) else value for value in values.tolist()
    ]  # fmt: skip


def _as_script(data: dict[str, Any] | None) -> str:
    """Return JSON that can stand inside a script element."""
    text = json.dumps(data, default=_short, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c")


def described(scene: Scene) -> Iterator[tuple[str, str]]:
    """Return a description of each part of the scene, in the order of the drawing from above."""
    beam = scene.beam
    spring = scene.spring
    stop = scene.stop
    contact = scene.contact
    if beam is not None:
        mesh = "no inertia" if beam.fidelity == "quasi_static" else f"{beam.n_elements} elements"
        if beam.fidelity == "dynamic" and beam.n_modes:
            mesh += f", {beam.n_modes} modes"
        mass = beam.density * beam.area * beam.length
        stiffness = f"EI = {bending_stiffness(beam):.4g} N·m², KAG = {shear_stiffness(beam):.4g} N"
        yield "beam", f"length {beam.length:.4g} m, mass {mass:.4g} kg, stiffness {stiffness}; {mesh}"
    if spring is not None:
        cubic = f", cubic stiffness {spring.cubic_stiffness:.4g} N/m³" if spring.cubic_stiffness else ""
        stiffness = f"stiffness {spring.linear_stiffness:.4g} N/m{cubic}"
        unloaded = f", without force at {spring.unloaded:.4g} m" if spring.unloaded else ""
        start = f"its top starts at Ψ = {spring.equilibrium:.4g} m"
        yield "spring", f"mass {spring.mass:.4g} kg, {stiffness}{unloaded}, {start}"
    for table, partner in scene.partners.items():
        yield table, f"another body in its place: {kind_of(partner).replace('_', ' ')}"
    if scene.coupled:
        values = contact.own_keys if contact.soft else {}
        numbers = [f"{key} {value:.4g}" for key, value in values.items() if key != "damping" or value > 0.0]
        yield "contact", f"{contact.law}: {', '.join([contact.words, *numbers])}"
    if stop is not None:
        rebound = "elastic" if scene.elastic_stop else f"restitution {stop.restitution:.4g}"
        yield "foundation", f"at φ = {stop.position:.4g} m, {rebound}"
    for i, load in enumerate(scene.loads):
        what = (
            f"{load.signal.replace('_', '-')} on the {load.on}, {copysign(load.peak, load.amplitude):.4g} {load.unit}"
        )
        given = load.model_dump(exclude_none=True)
        units = (("frequency", ", {:.4g} Hz"), ("frequency_end", " to {:.4g} Hz"), ("duration", ", in {:.4g} s"))
        yield f"load_{i}", what + "".join(words.format(given[key]) for key, words in units if key in given)
    H = scene.coupling.macro_step
    length = "macro steps that follow from tolerances" if H is None else f"macro step {H:.4g} s"
    yield "steps", f"{scene.coupling.scheme} of degree {scene.degree}, {length}, to {scene.time.t_end:.4g} s"
