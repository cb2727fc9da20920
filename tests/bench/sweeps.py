"""Sweeps beside a pool of as many processes that are handed the same runs: cores × the speed of single runs."""

import multiprocessing
import os
import statistics
import tempfile
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from time import perf_counter

from measure import compare, ratio_row, shown, timed

from springbeam import load_scene, with_changes
from springbeam.studies.study import Records
from springbeam.studies.sweep import Sweep

#: End of the runs [s] and how many.
SIZES = ((0.6, 12), (0.02, 120))


def plan(t_end, runs):
    scene = with_changes(load_scene("soft"), time={"t_end": t_end})
    return Sweep(scene=scene, vary=(f"spring.mass=0.5:2:{runs}",))


def recorded(todo, pool):
    with tempfile.TemporaryDirectory() as folder, Records(todo, Path(folder)) as records:
        return timed(lambda: todo.computed(records, cluster=pool), perf_counter)


def in_a_pool(todo, pool):
    return timed(lambda: list(pool.map(todo.record, todo.cases().values())), perf_counter)


def warm(workers):
    """Return a pool of one thread a process."""
    os.environ.update(dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"))
    return ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"))


def throughput(effort):
    """Time sweeps whose workers are warm."""
    for workers in (1,) if effort.quick else (1, 2):
        with warm(workers) as pool:
            for t_end, runs in SIZES[-1:] if effort.quick else SIZES:
                todo = plan(t_end, 4 if effort.quick else runs)
                sides = (partial(side, todo, pool) for side in (recorded, in_a_pool))
                times = compare(*sides, min(effort.rounds, 5))
                each = statistics.median(times.rival) * workers / len(todo.cases())
                yield ratio_row(
                    f"a sweep on {workers} worker{'s' * (workers > 1)}, runs of {shown(each)}",
                    times,
                    1.18,  # 85 % of the throughput
                    "a plain pool of as many processes",
                )
