"""Studies for Python programs: ``springbeam.sweep`` and the others, as the commands of these names.

Each returns `Findings`: ``table`` (a DataFrame where pandas is installed), ``plot()``, ``document`` (what ``--json``
prints), ``ok``; printed, they are what the command prints. ``scene`` is what `springbeam.simulate` takes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import nullcontext
from itertools import count
from pathlib import Path
from typing import Any

from .scene import Scene, as_scene
from .studies import converge as converging
from .studies import crosscheck as comparing
from .studies.design import Sampling
from .studies.fit.study import Fit
from .studies.study import Records, Study, troubles
from .studies.sweep import Sweep
from .studies.tables import Done, Findings, Row

#: A scene, its tables or keys, a file, or the name of a shipped scene.
AnyScene = Scene | Mapping[str, Any] | str | Path
#: Values of keys: a list, or a range as ``springbeam sweep --vary`` takes it, "LOW:HIGH:COUNT:log".
Vary = Mapping[str, Iterable[Any] | str | float]
#: Called with how many cases, or parts, are done.
Progress = Callable[[int], object]


def sweep(
    scene: AnyScene,
    vary: Vary,
    metrics: Sequence[str] = (),
    *,
    samples: int = 0,
    sampling: Sampling = "latin_hypercube",
    seed: int = 0,
    workers: int = 0,
    directory: str | Path | None = None,
    progress: Progress | None = None,
) -> Findings:
    """Run a scene with many values of its keys: ``sweep("soft", {"spring.mass": [1.0, 2.0]}, ["contact_force_max"])``.

    Parameters
    ----------
    vary
        Values of each key; with ``samples`` ranges "LOW:HIGH", of which so many samples are taken.
    metrics
        Names of metrics (``springbeam keys --metrics``), or "NAME=MODULE:FUNCTION".
    workers
        Processes; 0: this one.
    directory
        Where the rows are kept: the same call continues a study that was interrupted.

    Raises
    ------
    SceneError
        If a key, a value or a metric is none.
    """
    own = Sweep(
        scene=as_scene(scene), vary=_texts(vary), samples=samples, sampling=sampling, seed=seed, metric=tuple(metrics)
    )
    return _carried_out(own, workers, directory, progress)


def fit(
    scene: AnyScene,
    measured: str | Path,
    vary: Vary,
    *,
    names: Mapping[str, str] | None = None,
    scale: Mapping[str, str] | None = None,
    read: Mapping[str, Any] | None = None,
    shift: float | None = None,
    repeat: str | Path | None = None,
    directory: str | Path | None = None,
    progress: Progress | None = None,
) -> Findings:
    """Fit keys of a scene to measured columns of a file: ``fit("soft", "y.csv", {"spring.damping": "0.01:1"})``.

    Parameters
    ----------
    vary
        A guess, or a range "LOW:HIGH", of each key.
    names, scale, read
        Columns of a run by those of the file, factors with units, and how the file is read: the options ``--map``,
        ``--scale`` and ``--read`` of the command.
    shift
        By which the clock of the measurement is moved [s]; found if it is left out.
    repeat
        A second measurement of the same, which shows the noise.
    directory
        As of `sweep`.

    Raises
    ------
    SceneError
        If a key or the file cannot be used.
    """
    own = Fit(
        scene=as_scene(scene),
        file=Path(measured),
        vary=_texts(vary),
        names=_texts(names),
        scale=_texts(scale),
        read=_texts(read),
        shift=shift,
        repeat=None if repeat is None else Path(repeat),
    )
    return _carried_out(own, 0, directory, progress)


def converge(
    scene: AnyScene, metrics: Sequence[str] = (), *, levels: int = 4, progress: Progress | None = None
) -> Findings:
    """Show how results converge with ``levels`` meshes and with more modes. Raises SceneError without a mesh."""
    return converging.converge(as_scene(scene), levels=levels, metric=metrics, done=_counting(progress))


def crosscheck(scene: AnyScene, *, quick: bool = False, progress: Progress | None = None) -> Findings:
    """Compare a scene with the monolithic reference of its law; ``ok`` says whether they agree.

    Raises SceneError if no reference knows its bodies or its law.
    """
    return comparing.crosscheck(as_scene(scene), quick=quick, done=_counting(progress))


def _texts(given: Mapping[str, Any] | None) -> tuple[str, ...]:
    """Return values by name as an option of a command takes them."""
    listed = {
        name: values if isinstance(values, str) or not isinstance(values, Iterable) else ",".join(map(str, values))
        for name, values in (given or {}).items()
    }
    return tuple(f"{name}={values}" for name, values in listed.items())


def _counting(progress: Progress | None) -> Done:
    number = count(1)

    def done() -> None:
        if progress is not None:
            progress(next(number))

    return done


def _carried_out(study: Study, workers: int, directory: str | Path | None, progress: Progress | None) -> Findings:
    done = _counting(progress)

    def report(record: Row) -> None:
        done()

    with nullcontext() if directory is None else Records(study, Path(directory)) as records:
        computed = study.computed(records, workers, report=report)
    findings = study.findings(computed)
    return findings.with_lines(study.remarks, troubles(computed))
