"""Convergence of a run's results with finer meshes and more modes.

Macro step, scheme and accuracy concern the solution of the equations of one mesh. This study changes the mesh, and
shows how fast each quantity converges (Richardson 1911, Roache 1994).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import groupby
from time import perf_counter
from typing import Any, NamedTuple

from rich.text import Text
from scipy.optimize import brentq

from ..pictures.diagrams import Diagram, draw_diagrams
from ..scene import Scene, SceneError
from .design import with_keys
from .metrics import heading, metrics_of
from .study import measured, troubles
from .tables import Done, Findings, Row, difference, table, unseen

#: Default quantities, those that a scene has.
QUANTITIES = (
    *("u_tip_end", "u_tip_min", "y_end", "y_min", "contact_force_max", "contact_impulse", "contact_duration"),
    *("rebound_velocity", "first_impact", "first_stop_impact", "first_release", "first_separation"),
)
#: Factor from one level to the next.
_RATIO = 2
#: Limits of the order: slower convergence has no reliable limit; a higher order is not used.
_LEAST_ORDER = 0.5
_MOST_ORDER = 20.0
#: Largest ratio of two orders that agree.
_STEADY = 1.25
#: Changes below this part of the value are rounding.
_ROUNDING = 1e-12


class Extrapolated(NamedTuple):
    """Convergence of a quantity; ``None`` if its values do not show it."""

    change: float | None = None  #: from the last level but one to the last
    order: float | None = None  #: observed, in the size of the mesh
    limit: float | None = None  #: extrapolated to an infinitely fine mesh; of all modes the last value
    error: float | None = None  #: of the last level, from the limit


def extrapolated(values: Sequence[float | None], sizes: Sequence[int], *, complete: bool = False) -> Extrapolated:
    """Return the observed order and the limit of the last four of ``values``, at meshes of ascending ``sizes``.

    With errors e·n⁻ᵖ at the sizes n the order p follows from two changes. Four values have two orders; they have a
    limit only if these agree (`_STEADY`), so that they are known to be in the asymptotic range. If the last mesh is
    ``complete``, as with all modes, its value is the limit.
    """
    if len(values) < 2 or None in values[-4:]:
        return Extrapolated()
    known = [float(value) for value in values if value is not None]
    change = known[-1] - known[-2]
    if complete or abs(change) <= _ROUNDING * abs(known[-1]):
        return Extrapolated(change, None, known[-1], 0.0)
    orders = [_order(known[k - 3 : k], sizes[k - 3 : k]) for k in (len(known) - 1, len(known)) if k >= 3]
    if len(orders) < 2 or None in orders or max(filter(None, orders)) > _STEADY * min(filter(None, orders)):
        return Extrapolated(change)
    order = float(orders[-1] or 0.0)
    rest = change / math.expm1(math.log(sizes[-1] / sizes[-2]) * order)
    return Extrapolated(change, order, known[-1] + rest, abs(rest))


def _order(values: Sequence[float], sizes: Sequence[int]) -> float | None:
    """Return the order of three values; ``None`` if they approach nothing, or more slowly than is reliable."""
    before = values[1] - values[0]
    change = values[2] - values[1]
    a, b = (math.log(n / sizes[1]) for n in (sizes[0], sizes[2]))  # a < 0 < b

    def excess(p: float) -> float:
        return math.expm1(-a * p) / -math.expm1(-b * p) - before / change

    if before * change <= 0.0 or excess(_LEAST_ORDER) > 0.0:
        return None
    return float(brentq(excess, _LEAST_ORDER, _MOST_ORDER)) if excess(_MOST_ORDER) > 0.0 else _MOST_ORDER


def converge(scene: Scene, *, levels: int = 4, metric: Sequence[str] = (), done: Done = unseen) -> Findings:
    """Run ``scene`` on finer and finer meshes, and with more and more modes of its own mesh, and judge the convergence.

    Parameters
    ----------
    scene
        What is run.
    levels
        Meshes of each sequence, as of `meshes`.
    metric
        The quantities; those of `QUANTITIES` that the scene has if there are none.
    done
        Called after the run of each of `meshes`.

    Raises
    ------
    SceneError
        If the scene has no beam with a mesh, or a quantity is unknown.
    """
    metrics = metrics_of(metric or QUANTITIES)
    rows = dict[str, Row]()
    for name, mesh in meshes(scene, levels).items():
        began = perf_counter()
        record = measured(partial(with_keys, scene, mesh), metrics, judge=not rows)
        rows[name] = {**mesh, **record, "cost_wall_time": perf_counter() - began}
        done()
    findings = judged(scene, list(rows.values()), metric)
    return replace(findings, shown=[*findings.shown, *troubles(rows)])


def meshes(scene: Scene, levels: int) -> dict[str, Row]:
    """Return the meshes by what is refined, coarse to fine; ``unknowns`` are the modes that take part.

    Elements are n, 2n, 4n, …; modes go down by halves from those that the scene keeps. Raises SceneError if there is no
    mesh.
    """
    beam = scene.beam
    if beam is None or scene.massless:
        raise SceneError("[beam]: the scene has no mesh to refine")
    more = [_RATIO**k for k in range(levels)]
    refinements = [("elements", beam.n_elements * k, beam.n_modes) for k in more]
    if beam.integrator == "modal" and beam.modes_kept >= more[-1]:
        fewer = [beam.modes_kept // k for k in more[:0:-1]]
        refinements += [("modes", beam.n_elements, n_modes) for n_modes in (*fewer, beam.n_modes)]
    cases = {}
    for refined, elements, modes in refinements:
        keys = {"beam.n_elements": elements, "beam.n_modes": modes}
        mesh = with_keys(scene, keys).beam
        assert mesh is not None
        label = f"{refined}: {', '.join(f'{key} = {value}' for key, value in keys.items())}"
        cases[label] = {"refined": refined, "unknowns": mesh.modes_kept, **keys}
    return cases


def judged(scene: Scene, rows: Sequence[Row], metric: Sequence[str] = ()) -> Findings:
    """Judge the convergence of the quantities: the given ones, or those that the scene has.

    In the table errors are from the limits of a sequence. All modes of a mesh are its solution: no mode lies beyond
    the last.
    """
    beam = scene.beam
    document = dict[str, Any]()
    table_rows = list[Row]()
    diagrams = list[Diagram]()
    shown: list[Any] = [Text(scene.title or "(untitled scene)", style="bold")]
    given = rows[0]
    names = [name for name in metrics_of(metric or QUANTITIES) if metric or given[name] is not None]
    for refined, several in groupby(rows, lambda row: row["refined"]):
        mine = list(several)
        sizes = [row["beam.n_elements" if refined == "elements" else "unknowns"] for row in mine]
        complete = refined == "modes" and beam is not None and beam.modes_kept == beam.unknowns
        settled = {name: extrapolated([row[name] for row in mine], sizes, complete=complete) for name in names}
        document[refined] = {"levels": mine, "settled": {name: s._asdict() for name, s in settled.items()}}
        columns = ("", "as given:.6g", "extrapolated:.6g", "error:.1e", "order:.1f")
        cells = [(heading(name), given[name], s.limit, _error(given[name], s), s.order) for name, s in settled.items()]
        shown.append(table(columns, cells, f"more {refined}"))
        meshes = (f"{row['beam.n_elements']} el. {row['unknowns']} modes {row['cost_wall_time']:.2g} s" for row in mine)
        shown.append(f"runs      {', '.join(meshes)}")
        curves = {heading(name): list[tuple[float, float]]() for name in names}
        labels = "unknowns of the beam", "distance from the limit, relative"
        diagrams.append(Diagram(*labels, curves, f"more {refined}"))
        for row in mine:
            errors = {name: difference(row[name], s.limit) for name, s in settled.items()}
            table_rows.append(row | {f"error_{name}": error for name, error in errors.items()})
            for name, error in errors.items():
                share = abs((error or 0.0) / (settled[name].limit or 1.0))
                if share > _ROUNDING:
                    curves[heading(name)].append((row["unknowns"], share))
    shown.append("error: of the run as given; in brackets the last change, where the values show no limit")
    draw = partial(draw_diagrams, diagrams, f"{scene.title}: convergence with the mesh")
    return Findings(document, shown, tables={"converge": table_rows}, pictures={"converge": draw})


def _error(given: float | None, found: Extrapolated) -> float | str | None:
    """Return the error of the mesh as given, or the last change in brackets."""
    if found.limit is None and found.change is not None:
        return f"({found.change:.1e})"
    return difference(given, found.limit)
