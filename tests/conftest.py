"""Fixtures for all tests."""

import os
import signal
import sys
from pathlib import Path

# Before numpy is imported, and for the processes that tests start. The matrices are small, and tests run on all cores:
# more threads of OpenBLAS only wait for each other, and spin meanwhile.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# What Python compiles is kept for the processes that tests start, even where the environment says to write no bytecode:
# without it, each of them spends most of its time on compiling what it imports.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
os.environ["PYTHONPYCACHEPREFIX"] = str(Path(__file__).resolve().parents[1] / "build" / "bytecode")
os.environ["XDG_CACHE_HOME"] = str(Path(__file__).resolve().parents[1] / "build" / "cache")

import hypothesis
import numpy as np
import pytest
from matplotlib.figure import Figure

import springbeam.api  # attaches what a trajectory can do
from springbeam.bodies import foreign, probe
from springbeam.bodies.fmu import release

ROOT = Path(__file__).resolve().parents[1]

# The folders of the helper modules: commands.py here, the others beside the tests that use them.
sys.path[:0] = [str(ROOT / "tests" / folder) for folder in (".", "campaign", "master", "system")]

# Every run of the tests draws the same examples, however busy the machine, whatever an earlier run has found.
hypothesis.settings.register_profile("springbeam", derandomize=True, database=None, deadline=None)
hypothesis.settings.load_profile("springbeam")

# FMUs of others answer however busy the machine is; the check before a run has a body of its own.
foreign.ForeignBody.PATIENCE = probe._TriedBody.PATIENCE = 1800.0

# A shell ignores it in what it runs in the background, and so would the programs that tests start and interrupt.
signal.signal(signal.SIGINT, signal.default_int_handler)
if hasattr(signal, "SIGHUP"):  # nohup does this to this one
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


@pytest.fixture(scope="session", autouse=True)
def fmu_folder():
    """The folder with the built FMUs."""
    folder = ROOT / "fmus"
    missing = [name for name in ("beam.fmu", "spring.fmu", "beam3.fmu", "spring3.fmu") if not (folder / name).is_file()]
    if missing:
        pytest.fail(f"{', '.join(missing)} not in {folder}: run ./build.sh fmus")
    return folder


@pytest.fixture
def here(tmp_path, monkeypatch):
    """An empty folder, in which the test runs."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def none_kept():
    """No body of an FMU is kept from an earlier test, nor for a later one."""
    release()
    yield
    release()


@pytest.fixture
def unpainted(monkeypatch):
    """Pictures are composed and their files made, but nothing is painted: that is most of the time a command takes.

    tests/master/test_plots.py and the tests of each study look at pictures.
    """
    paint = Figure.savefig

    def save(figure, file, **options):
        if isinstance(file, Path):
            file.touch()
        else:  # the frames of an animation
            paint(figure, file, **options)

    monkeypatch.setattr(Figure, "savefig", save)


#: `soft` with the compliance law: what the pair of FMUs runs where only ports are connected.
COMPLIANCE = springbeam.with_changes(
    springbeam.load_scene("soft"),
    time={"t_end": 0.4},
    contact={"law": "compliance", "stiffness": 1e6, "exponent": 1.5},
)


def y_by_the_master(**coupling):
    """y at 1, 2, … 400 ms of that scene."""
    run = springbeam.simulate(springbeam.with_changes(COMPLIANCE, coupling=coupling))
    return np.interp(np.arange(1, 401) * 1e-3, run.time, run.y)


@pytest.fixture(scope="session", name="reference")
def y_of_the_pair():
    """In steps so short that the event-driven solver, which takes twenty times as long, is 6e-9 m off."""
    return y_by_the_master(macro_step=2.5e-4, degree=2)


@pytest.fixture(scope="session")
def master_run():
    """Per macro step that tools take, under a force that is held over it as theirs is."""
    return {size: y_by_the_master(macro_step=size, degree=0) for size in (1e-3, 5e-4)}
