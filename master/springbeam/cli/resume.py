"""``springbeam resume``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from ..results.directory import RunDirectory
from .common import JsonOption, NoPlotsOption, QuietOption, bad_input_reported, results_directory
from .run import carry_out


def resume(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="The directory of the run.", show_default=False)],
    no_plots: NoPlotsOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Go on with a run that was killed or stopped, from its last checkpoint.

    Needs a run begun with --checkpoint; the results are those of a run that was never stopped, to the last bit.

    Example: springbeam resume results/soft
    """
    from ..run.runner import last_checkpoint

    with bad_input_reported():
        start = last_checkpoint(results_directory(directory))
    results = RunDirectory(directory)
    carry_out(start.scene, results, seconds=start.seconds, start=start, no_plots=no_plots, quiet=quiet, as_json=as_json)
