"""Sweeps on Dask beside a pool of as many processes that are handed the same runs: cores × the speed of single runs."""

from __future__ import annotations

import multiprocessing
import os
import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

from measure import timed

from springbeam import load_scene, with_changes
from springbeam.studies import sweep
from springbeam.studies.sweep.design import design, parse_axis

#: End of the runs [s] and how many.
SIZES = ((0.6, 12), (0.02, 120))


def plan(t_end: float, runs: int) -> sweep.Sweep:
    scene = with_changes(load_scene("soft"), time={"t_end": t_end})
    axes = (parse_axis(f"spring.mass=0.5:2:{runs}"),)
    return sweep.Sweep(scene, axes, design(axes, 0, 0, "random"), tuple(sweep.METRICS))


def on_dask(todo: sweep.Sweep, client: Any) -> float:
    with tempfile.TemporaryDirectory() as folder:
        return timed(lambda: sweep.run(todo, Path(folder), client), perf_counter)


def in_a_pool(todo: sweep.Sweep, pool: ProcessPoolExecutor) -> float:
    run = partial(sweep.row, todo.scene, todo.axes, metrics=todo.metrics)
    return timed(lambda: list(pool.map(run, todo.values)), perf_counter)


@contextmanager
def both(workers: int) -> Iterator[tuple[Any, ProcessPoolExecutor]]:
    """The cluster and the pool, both of one thread a process, as Dask has it."""
    os.environ.update(dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"))
    context = multiprocessing.get_context("spawn")
    with sweep.cluster(None, workers) as client, ProcessPoolExecutor(workers, context) as pool:
        yield client, pool
