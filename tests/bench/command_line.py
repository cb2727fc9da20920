"""Commands as a user waits for them: whole processes, in multiples of one that draws a small figure."""

import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

import numpy as np
from measure import Row, median_and_spread, shown

from springbeam import load_scene, simulate

#: What every program takes that computes and draws: the unit of the table.
BASE = """\
import matplotlib
import numpy
matplotlib.use("Agg")
from matplotlib import pyplot
figure, axes = pyplot.subplots(figsize=(4.0, 3.0))
axes.plot(numpy.arange(9.0))
figure.savefig("base.png")
"""
FIT = "fit soft laser.csv --vary spring.linear_stiffness=2.9 --vary spring.mass=1.05 --map velocity=v_tip -f -o fit"
#: Commands, and the largest multiple of the base that they should take.
COMMANDS = {
    "scenes": 0.3,
    "run soft --no-plots -f": 0.9,
    "run soft -f": 2.0,
    "predict soft": 1.0,
    "report results/soft -f": 0.9,
    "crosscheck soft --set time.t_end=0.2 -f": 3.0,
    "run bumper.toml --no-plots -f": 0.9,
    "run bumper.toml -f": 2.0,
    "predict bumper.toml": 1.0,
    "report results/bumper -f": 0.9,
    "crosscheck bumper.toml --set time.t_end=0.1 -f": 3.0,
    FIT: 20.0,
}

#: What takes longer is timed twice [s].
LONG = 15.0


class Taken(NamedTuple):
    """Times of a process [s]."""

    processor: float  #: with those of its own processes
    wall: float


def python(folder, *arguments):
    """Return what Python takes for ``arguments`` in ``folder``: with its bytecode kept, and threads as users have."""
    left_out = ("PYTHONDONTWRITEBYTECODE", "OPENBLAS_NUM_THREADS")
    environment = {name: value for name, value in os.environ.items() if name not in left_out}
    environment |= {"PYTHONPYCACHEPREFIX": str(folder / "bytecode"), "XDG_CACHE_HOME": str(folder / "cache")}
    before = os.times()
    began = perf_counter()
    subprocess.run([sys.executable, *arguments], cwd=folder, env=environment, check=True, capture_output=True)
    wall = perf_counter() - began
    after = os.times()
    user = after.children_user - before.children_user
    return Taken(user + after.children_system - before.children_system, wall)


def laser(folder):
    """Write the velocity of the tip of `soft`, by a clock that is 10 ms late and with noise of 2 %."""
    times = np.linspace(0.0, 0.3, 3001)
    velocity = simulate(load_scene("soft", ["time.t_end=0.3"])).at(times)["v_tip"]
    noise = np.random.default_rng(1).normal(0.0, 0.02 * np.std(velocity), len(times))
    rows = np.column_stack([times + 0.01, velocity + noise])
    np.savetxt(folder / "laser.csv", rows, delimiter=",", header="time [s],velocity [m/s]", comments="")


def commands(effort):
    """Time each command and, before it, the base."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        laser(folder)
        python(folder, "-m", "springbeam", "new", "bumper")
        for line, goal in list(COMMANDS.items())[: 3 if effort.quick else None]:
            words = ("-m", "springbeam", *line.split())
            first = python(folder, *words)  # keeps its bytecode
            rounds = min(effort.rounds, 5 if first.wall < LONG else 2)
            pairs = [(python(folder, "-c", BASE), python(folder, *words)) for _ in range(rounds)]
            ratios = [ours.processor / base.processor for base, ours in pairs]
            taken, waited = (statistics.median(times) for times in zip(*(ours for _, ours in pairs), strict=True))
            yield Row(
                f"`{line}`",
                f"≤ {goal:g}",
                f"{median_and_spread(ratios)}; {shown(taken)}",
                statistics.median(ratios) <= goal,
                f"the user waits {shown(waited)}",
            )
