"""Sweeps beside a pool of as many processes that are handed the same runs: cores × the speed of single runs."""

from __future__ import annotations

import multiprocessing
import os
import tempfile
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from time import perf_counter

from measure import timed

from springbeam import load_scene, with_changes
from springbeam.studies import sweep
from springbeam.studies.study import Records, record_all

#: End of the runs [s] and how many.
SIZES = ((0.6, 12), (0.02, 120))


def plan(t_end: float, runs: int) -> sweep.Sweep:
    scene = with_changes(load_scene("soft"), time={"t_end": t_end})
    return sweep.Sweep(scene=scene, vary=(f"spring.mass=0.5:2:{runs}",))


def recorded(todo: sweep.Sweep, pool: ProcessPoolExecutor) -> float:
    with tempfile.TemporaryDirectory() as folder, Records(todo, Path(folder)) as records:
        return timed(lambda: record_all(todo, records, cluster=pool), perf_counter)


def in_a_pool(todo: sweep.Sweep, pool: ProcessPoolExecutor) -> float:
    return timed(lambda: list(pool.map(todo.record, todo.cases().values())), perf_counter)


def warm(workers: int) -> ProcessPoolExecutor:
    """Return a pool of one thread a process."""
    os.environ.update(dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"))
    return ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"))
