"""``springbeam spectrum``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.text import Text

from ..results.reading import load_trajectory
from .common import (
    JsonOption,
    NoPlotsOption,
    QuietOption,
    RunArgument,
    bad_input_reported,
    results_directory,
    say,
)


def spectrum(
    run: RunArgument,
    of: Annotated[
        list[str] | None,
        typer.Option(
            "--of",
            metavar="FORMULA",
            help="Column or formula whose power is wanted, as a_tip or 'a_tip/g'; may be repeated.",
        ),
    ] = None,
    low: Annotated[float | None, typer.Option("--low", metavar="HZ", help="Lowest oscillator of the shock.")] = None,
    high: Annotated[float | None, typer.Option("--high", metavar="HZ", help="Highest oscillator of the shock.")] = None,
    quality: Annotated[float, typer.Option("--quality", metavar="Q", help="1/2ζ of the oscillators.")] = 10.0,
    since: Annotated[
        float | None,
        typer.Option(
            "--since", metavar="SECONDS", help="Begin of the power spectra. Default: where the motion settles."
        ),
    ] = None,
    segments: Annotated[
        int, typer.Option("--segments", metavar="N", min=1, help="Parts whose power spectra are averaged.")
    ] = 1,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", metavar="DIR", help="Where tables and picture go. Default: DIR-spectrum."),
    ] = None,
    no_plots: NoPlotsOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Spectra of a run: shock response, power, and the points and the period of a driven motion.

    Example: springbeam spectrum results/soft --of a_tip --quality 25
    """
    from ..signals.report import spectra
    from ..studies.tables import write_csv

    with bad_input_reported():
        trajectory = load_trajectory(results_directory(run))
        found = spectra(trajectory, of or (), low, high, quality, since, segments)
        directory = out or run.with_name(f"{run.resolve().name}-spectrum")
        directory.mkdir(parents=True, exist_ok=True)
        tables = {f"shock-{end}": shock._asdict() for end, shock in found.shock.items()}
        for number, (what, power) in enumerate(found.power.items()):
            tables[f"power-{what if what.isidentifier() else number}"] = power._asdict()
        swept = {(what, chirp.load): chirp for what, several in found.responses.items() for chirp in several}
        for (what, load), chirp in swept.items():
            name = f"response-{what if what.isidentifier() else 'formula'}-load-{load}"
            tables[name] = {"frequency": chirp.frequency, "amplitude": chirp.amplitude}
        if found.points is not None:
            times, points = found.points
            tables["poincare"] = {"time": times, "position": points[:, 0], "velocity": points[:, 1]}
        files = []
        for name, columns in tables.items():
            rows = [dict(zip(columns, row, strict=True)) for row in np.transpose(list(columns.values())).tolist()]
            files.append(write_csv(directory / f"{name}.csv", rows))
        if not no_plots:
            from ..pictures.spectra import draw

            files.append(directory / "spectrum.png")
            shocks = {f"shock at the {end}": (s.frequency, s.maximax) for end, s in found.shock.items()}
            powers = {f"power of {what}": (p.frequency[1:], p.density[1:]) for what, p in found.power.items()}
            answers = {
                f"{what} to load {load}, {c.way}": (c.frequency, c.amplitude) for (what, load), c in swept.items()
            }
            once = None if found.points is None else found.points[1]
            draw(shocks, powers, answers, once, trajectory.scene.title or str(run), files[-1])
    settled = None if found.settled is None else {**found.settled._asdict(), "period": found.settled.period}
    document = {
        "directory": directory,
        "files": files,
        "shock": {end: shock._asdict() for end, shock in found.shock.items()},
        "jumps": found.jumps,
        "highest": {what: power.highest for what, power in found.power.items()},
        "settled": settled,
    }
    lines = [Text(f"{what:<20} {words}") for what, words in found.in_words()]
    say(document, lines, [("results", file) for file in files], where=directory, quiet=quiet, as_json=as_json)
