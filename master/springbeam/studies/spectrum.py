"""Spectra of a run as tables and a picture (``springbeam spectrum``)."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from ..pictures.diagrams import Diagram, draw_diagrams
from ..results.trajectory import Trajectory
from ..signals.spectra import spectra
from .tables import Findings

#: Power below this share of the highest line is not drawn.
_FLOOR = 1e-12


def spectrum(
    run: Trajectory,
    of: Sequence[str],
    low: float | None,
    high: float | None,
    quality: float,
    since: float | None,
    segments: int,
    title: str,
) -> Findings:
    """Return the spectra of a run; arguments are those of `springbeam.signals.spectra.spectra`."""
    found = spectra(run, of, low, high, quality, since, segments)
    columns = {f"shock-{end}": shock._asdict() for end, shock in found.shock.items()}
    for number, (what, power) in enumerate(found.power.items()):
        columns[f"power-{what if what.isidentifier() else number}"] = power._asdict()
    swept = {(what, chirp.load): chirp for what, several in found.responses.items() for chirp in several}
    for (what, load), chirp in swept.items():
        name = f"response-{what if what.isidentifier() else 'function'}-load-{load}"
        columns[name] = {"frequency": chirp.frequency, "amplitude": chirp.amplitude}
    if found.points is not None:
        times, points = found.points
        columns["poincare"] = {"time": times, "position": points[:, 0], "velocity": points[:, 1]}
    shocks = {f"shock at the {end}": np.transpose(s[:2]) for end, s in found.shock.items()}
    powers = {f"power of {what}": np.transpose(p[:2]) for what, p in found.power.items()}
    powers = {name: points[points[:, 1] > _FLOOR * points[:, 1].max()] for name, points in powers.items()}
    answers = {f"{what} to load {load}, {c.way}": np.transpose(c[1:]) for (what, load), c in swept.items()}
    once = {} if found.points is None else {"points": found.points[1]}
    diagrams = [
        Diagram("frequency [Hz]", "largest acceleration [m/s²]", shocks),
        Diagram("frequency [Hz]", "power density [unit²/Hz]", powers),
        Diagram("frequency of the chirp [Hz]", "half the range [unit]", answers, log=False),
        Diagram("position once a period of the drive [m]", "velocity [m/s]", once, log=False, dots=tuple(once)),
    ]
    drawn = [diagram for diagram in diagrams if diagram.curves]
    draw = partial(draw_diagrams, drawn, run.scene.title or title, (8.2, 2.6), wide=1)
    tables = {
        name: [dict(zip(of, row, strict=True)) for row in np.transpose(list(of.values())).tolist()]
        for name, of in columns.items()
    }
    settled = None if found.settled is None else {**found.settled._asdict(), "period": found.settled.period}
    document = {
        "shock": {end: shock._asdict() for end, shock in found.shock.items()},
        "jumps": found.jumps,
        "highest": {what: power.highest for what, power in found.power.items()},
        "settled": settled,
    }
    lines = [f"{what:<20} {words}" for what, words in found.in_words()]
    return Findings(document, lines, tables=tables, pictures={"spectrum": draw})
