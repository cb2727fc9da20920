"""``springbeam resume``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..results.directory import RunDirectory
from .common import JsonOption, NoPlotsOption, QuietOption, bad_input_reported, results_directory
from .run import carry_out
from .studies import Frame
from .studies import carry_out as carry_out_study


def resume(
    directory: Annotated[
        Path, typer.Argument(metavar="DIR", help="The directory of the run or the study.", show_default=False)
    ],
    no_plots: NoPlotsOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Go on with a run or a study that was killed or stopped.

    A run needs --checkpoint; its results are those of a run that was never stopped, to the last bit. A study (sweep,
    tradeoff, converge, stability, crosscheck) goes on with the cases that have no record yet.

    Example: springbeam resume results/soft
    """
    from ..run.runner import last_checkpoint
    from ..studies.study import study_in

    with bad_input_reported():
        study = study_in(directory)
        start = None if study is not None else last_checkpoint(results_directory(directory))
    if start is not None:
        carry_out(
            start.scene,
            RunDirectory(directory),
            seconds=start.seconds,
            start=start,
            no_plots=no_plots,
            quiet=quiet,
            as_json=as_json,
        )
    elif study is not None:
        carry_out_study(lambda: study, None, Frame(directory, False, no_plots, quiet, as_json))
