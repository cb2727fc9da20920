"""``springbeam paper``: Algorithm 1 of Ahn & Tate on the cases of their figures."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

import typer

from ..studies.tables import Findings
from .common import (
    STOPPED,
    ForceOption,
    JsonOption,
    NoPlotsOption,
    QuietOption,
    SettingsOption,
    fail,
    progress,
    run_directory,
)
from .run import carry_out

#: (A) to (E) of the paper's figures.
_PICTURES = ("shapes_after_contact", "shapes_later", "positions", "velocities_and_forces", "gap_and_energy")


def paper(
    figure: Annotated[
        Literal["2", "3", "4", "5"], typer.Argument(metavar="FIGURE", help="Number of the figure: 2, 3, 4 or 5.")
    ],
    monolithic: Annotated[
        bool, typer.Option("--monolithic", help="Solve each step as one system, not through the FMUs.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", metavar="DIR", help="Directory for results. Default: results/paper-figN, or …-2, …"
        ),
    ] = None,
    settings: SettingsOption = None,
    no_plots: NoPlotsOption = False,
    force: ForceOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> Findings:
    """Run Algorithm 1 of Ahn & Tate on the case of a figure; write the files of springbeam run.

    Example: springbeam paper 2 --monolithic
    """
    from ..paper import co_simulation
    from ..paper import monolithic as as_one_system
    from ..paper.algorithm import AlgorithmFailure
    from ..paper.problem import TABLE_2
    from ..results.recording import FileRecorder
    from ..scene import load_scene

    scene = load_scene(f"paper-fig{figure}", settings or ())
    failed = ""
    try:
        with progress("Algorithm 1", scene.time.t_end, silent=quiet or as_json) as show:
            run = (as_one_system if monolithic else co_simulation).algorithm_1(scene, progress=show)
    except AlgorithmFailure as failure:
        failed = f"the run stopped early: {failure}"
        if failure.trajectory is None:
            fail(STOPPED, failed)
        run = failure.trajectory
        run.summary |= {"status": "stopped", "cause": str(failure)}
    directory = run_directory(Path("results") / f"paper-fig{figure}", out, force=force)
    recorder = FileRecorder(scene, directory)
    findings = carry_out(recorder, made=run, pictures=_PICTURES, no_plots=no_plots, silent=quiet or as_json)
    solves = run.summary["iterations_per_solve"]
    printed = TABLE_2[int(figure)][0]
    line = f"Table 2   {solves:.3f} iterations per solve of (53), printed {printed:.3f}"
    findings = replace(findings, shown=[*findings.shown, line])
    if failed:
        return replace(findings, code=STOPPED, error=f"{failed}; the results so far are in {directory.path}")
    return findings
