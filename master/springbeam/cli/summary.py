"""The results of a run in words, for a terminal."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Mapping
from itertools import islice
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..results.directory import RunDirectory
from ..results.reading import load_events, load_summary
from ..results.totals import LOSS_NAMES, TOTALS
from ..results.trajectory import Event, rounded
from ..scene import Scene

_FIRST_EVENTS, _LAST_EVENTS = 10, 3


def report(console: Console, directory: RunDirectory, scene: Scene) -> None:
    """Print what a run has come to: its events, totals, residuals and warnings."""
    summary = load_summary(directory.path)
    console.print(Text(scene.title or "(untitled scene)", style="bold"))
    events = load_events(directory.path)
    first = list(islice(events, _FIRST_EVENTS))
    kinds = Counter(event.kind for event in first)
    last: deque[Event] = deque(maxlen=_LAST_EVENTS)
    for event in events:
        kinds[event.kind] += 1
        last.append(event)
    if first:
        console.print(_event_table(first, list(last), kinds.total() - len(first) - len(last), scene))
        counts = ", ".join(f"{number} {kind}" for kind, number in kinds.most_common())
        console.print(f"events    {counts}")
        console.print("          (on the tip, of the stop: impulses, upward; lost: energy that the event takes)")
    for line in _totals_in_words(summary):
        console.print(Text(line))
    if "macro_steps" in summary and "wall_time" in summary:
        console.print(f"run       {summary['macro_steps']} macro steps in {summary['wall_time']:.3g} s")
    if "coupling" in summary:
        console.print(Text("coupling  {scheme} {degree}: {because}".format(**summary["coupling"])))
    if "max_energy_residual" in summary:
        interface = summary.get("max_interface_residual")
        beside = "" if interface is None else f", of the interface {float(interface):.1e}"
        console.print(f"energy    largest relative residual {float(summary['max_energy_residual']):.1e}{beside}")
    if "accuracy" in summary:
        found = summary["accuracy"]
        errors = ", ".join(f"{value:.1e} ({name})" for name, value in found["estimated_errors"].items())
        console.print(f"accuracy  {picked_in_words(found)}\n          errors at most {errors}")
        if "estimated_mesh_error" in found:
            mesh = f"{found['picked']['n_elements']} elements"
            console.print(f"mesh      {mesh}: error {found['estimated_mesh_error']:.1e} beside the continuous beam")
    for warning in summary.get("warnings", ()):
        console.print(Text(f"warning   {warning}"))
    console.print(Text(f"results   {directory.path}"), soft_wrap=True)


def picked_in_words(accuracy: Mapping[str, Any]) -> str:
    """Return what was asked for and what was picked, from ``accuracy`` of a summary."""
    found = accuracy["picked"]
    return f"{accuracy['asked']:g} asked: {found['scheme']} {found['degree']}, H = {found['macro_step']:.3g} s"


def _event_table(first: list[Event], last: list[Event], between: int, scene: Scene) -> Table:
    position, speed = ("u_tip", "v_tip") if scene.lower is None else ("y", "z")
    table = Table(box=None, pad_edge=False, collapse_padding=True, header_style="bold")
    table.add_column("event", no_wrap=True)
    units = {"time": "s", position: "m", speed: "m/s", "on the tip": "N·s", "of the stop": "N·s", "lost": "J"}
    for name, unit in units.items():
        table.add_column(Text(f"{name}\n[{unit}]"), justify="right", no_wrap=True)
    shown = [*first, *last]
    scales = {name: max(abs(getattr(event, name) or 0.0) for event in shown) for name in (position, speed)}
    for event in shown:
        if between and last and event is last[0]:
            table.add_row("⋮", Text(f"{between} more"))
        impulses = (event.impulse_contact, event.impulse_foundation)
        table.add_row(
            event.kind,
            f"{event.time:.8f}",
            *("" if getattr(event, name) is None else rounded(getattr(event, name), scales[name]) for name in scales),
            *(f"{value:.3g}" if value else "" for value in (*impulses, event.energy_loss)),
        )
    return table


def _totals_in_words(summary: Mapping[str, Any]) -> list[str]:
    """Return what the run amounts to (`springbeam.results.totals`), a line per subject."""
    lines = []
    if "contact_impulse" in summary:
        found = {name: f"{summary[name]:.4g} {unit}" for name, (_, unit) in TOTALS.items() if name in summary}
        over = f"largest mean over {found['contact_force_window']}; pictures show instants, see docs/contact.md"
        parts = [f"impulse {found['contact_impulse']}", f"peak force {found['contact_force_max']} ({over})"]
        lines.append(f"contact   {', '.join(parts)}")
        parts = []
        if summary.get("contact_duration_total"):
            parts.append(f"longest {found['contact_duration']}, in all {found['contact_duration_total']}")
        if "rebound_velocity" in summary:
            parts.append(f"the tip leaves at {found['rebound_velocity']}")
        if parts:
            lines.append(f"          {'; '.join(parts)}")
    if "deepest_tip" in summary:
        lines.append(f"tip       deepest at {summary['deepest_tip']:.4g} m, t = {summary['deepest_tip_time']:.4g} s")
    if "stop_strokes" in summary:
        strokes = "1 stroke" if summary["stop_strokes"] == 1 else f"{summary['stop_strokes']} strokes"
        lines.append(f"stop      {strokes}, impulse {summary['foundation_impulse']:.4g} N·s")
    lost = [f"{summary[name]:.4g} J by {words}" for name, words in LOSS_NAMES.items() if summary.get(name)]
    if lost:
        lines.append(f"lost      {', '.join(lost)}")
    return lines
