"""The results of a run in words, for a terminal."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterator, Mapping
from itertools import islice
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from ..results.directory import RunDirectory
from ..results.reading import load_events, load_summary
from ..results.totals import in_words
from ..results.trajectory import Event, rounded
from ..scene import Scene

_FIRST_EVENTS, _LAST_EVENTS = 10, 3


def report(console: Console, directory: RunDirectory, scene: Scene) -> None:
    """Print what a run has come to: its events, totals, residuals and warnings."""
    summary, events = load_summary(directory.path), load_events(directory.path)
    console.print(Text(scene.title or "(untitled scene)", style="bold"))
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
    results = Table.grid(padding=(0, 2))
    for words, value in in_words(summary):
        results.add_row(Text(words), Text(value))
    console.print(results)
    for line in _lines(summary):
        console.print(Text(line))
    console.print(Text(f"results   {directory.path}"), soft_wrap=True)


def _lines(summary: Mapping[str, Any]) -> Iterator[str]:
    """Yield how the run was made and how far it can be trusted."""
    if "macro_steps" in summary and "wall_time" in summary:
        yield f"run       {summary['macro_steps']} macro steps in {summary['wall_time']:.3g} s"
    if "coupling" in summary:
        yield "coupling  {scheme} {degree}: {because}".format(**summary["coupling"])
    if "max_energy_residual" in summary:
        interface = summary.get("max_interface_residual")
        beside = "" if interface is None else f", of the interface {float(interface):.1e}"
        yield f"energy    largest relative residual {float(summary['max_energy_residual']):.1e}{beside}"
    if (found := summary.get("accuracy")) is not None:
        errors = ", ".join(f"{value:.1e} ({name})" for name, value in found["estimated_errors"].items())
        yield f"accuracy  {picked_in_words(found)}\n          errors at most {errors}"
        if "estimated_mesh_error" in found:
            mesh = f"{found['picked']['n_elements']} elements"
            yield f"mesh      {mesh}: error {found['estimated_mesh_error']:.1e} beside the continuous beam"
    yield from (f"warning   {warning}" for warning in summary.get("warnings", ()))


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
