"""One engine for experiments: a study is a table of cases, each a run of a scene with other values of some keys.

* The columns of a case are its **axes**: keys of a scene, as ``spring.mass``, with their values, or labels. Its record
  adds columns: how the run ended, **metrics** of it, ``error_…`` against a **reference**, ``cost_…``.
* A `Study` holds its settings as plain values. They alone decide its cases, so the same command can continue an
  interrupted study.
* A case is computed independently, in any order, in this process or by workers. Each record is in ``study.jsonl`` of
  the results as soon as its case is finished. The first line there identifies the study, the version and the FMUs.
  Nothing is written before the FMUs are found, and nothing stays if no case was finished.
* A case whose record is there is not computed again. A study with all records is shown at once.
* `Findings` are made from the records alone: table (``KIND.parquet``, ``KIND.csv``), pictures and messages.

`record_all` (`studies/engine.py`) computes, `Records` is the file, `cli/studies.py` has the commands.
"""

from __future__ import annotations

import hashlib
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from pathlib import Path
from typing import Any, ClassVar

from pydantic import BaseModel, ConfigDict
from pydantic_core import from_json, to_json

from ..bodies.archive import fmu_directory, own_fmu
from ..bodies.protocol import FmuError
from ..results.directory import ResultsExist, ResultsUnreadable, RunDirectory, lock
from ..run.outcome import RunStopped
from ..run.simulate import checked, simulate
from ..scene import Scene, SceneError, load_scene
from ..scene.loads import TableLoad
from ..version import __version__
from .engine import Measure, Report, lost, record_all
from .metrics import Metric, costs
from .tables import Findings, Row

#: Returns the records of cases, computed where they are not known.
Make = Callable[[Mapping[str, Row]], dict[str, Row]]

FILE = "study.jsonl"
#: Format of the files of studies.
_KINDS = ("sweep", "tradeoff", "fit")


class Study(BaseModel, ABC):
    """Settings of a study. A subclass adds its settings, its cases, and the findings from their records."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: ClassVar[str]  #: names the command, and the files of the results begin with it
    #: Whether workers compute the cases; else they follow one another here, where they are timed or too few.
    parallel: ClassVar[bool] = False
    announced: ClassVar[str] = "{} runs"  #: what there is to compute, with the number of cases

    scene: Scene | None = None
    quick: bool = False  #: a smaller table of cases
    remarks: tuple[str, ...] = ()  #: printed before the findings

    @abstractmethod
    def cases(self) -> Mapping[str, Row]:
        """Return the axes of each case, by its name. Raises SceneError if there is nothing to compute."""

    def expected(self, done: int = 0) -> int:
        """Return the number of records when all is done, as far as ``done`` of them show it; raises as `cases`."""
        return len(self.cases())

    @abstractmethod
    def record(self, case: Row) -> Row:
        """Measure one case. Raises FmuError if an FMU cannot be loaded."""

    def computed(
        self,
        records: Records | None = None,
        workers: int = 0,
        cluster: Executor | None = None,
        report: Report = lambda record: None,
    ) -> dict[str, Row]:
        """Compute the cases that ``records`` lacks, keep them there, and return all; others as of `record_all`."""
        known = {} if records is None else records.by_name
        keep = known.__setitem__ if records is None else records.add
        measure = self.measure(known)

        def make(cases: Mapping[str, Row]) -> dict[str, Row]:
            return record_all(cases, measure, known, keep, workers, cluster, report, self.lost)

        return self.made(make, known)

    def made(self, make: Make, known: Mapping[str, Row]) -> dict[str, Row]:
        """Return all records: those that are ``known``, and others, which ``make`` computes and adds to these."""
        return make(self.cases())

    def measure(self, known: Mapping[str, Row]) -> Measure:
        """Return what measures a case; ``known`` are the records there are when it is called."""
        return self.record

    def lost(self, cause: str) -> Row:
        """Return the record of a case whose worker process has died."""
        return lost(cause)

    def rows(self, records: Mapping[str, Row]) -> list[Row]:
        """Return a row per case, in their order: its axes and its record."""
        cases = self.cases()
        return [{"index": k, **cases[name], **record} for k, (name, record) in enumerate(records.items())]

    @abstractmethod
    def findings(self, records: Mapping[str, Row]) -> Findings:
        """Judge the records, which come in the order of the cases. The table is named as the study's `kind`."""

    def settings(self) -> dict[str, Any]:
        """Return the identity of the study, with the files that it needs. Raises FmuError if one is missing."""
        return {
            "study": self.kind,
            "springbeam": __version__,
            "files": _fingerprints(self.scene or load_scene("soft")),
            "settings": self.model_dump(mode="json", exclude_none=True),
        }


class Records:
    """``study.jsonl`` of a directory: the study in the first line, then a record a line, as they come.

    Within the context the file is open for new records. Results that are replaced stay until there is one.

    Raises
    ------
    ResultsExist
        If the directory holds something else.
    ResultsInUse
        On entry, if another process writes to it.
    FmuError
        If an FMU that the study needs is missing.
    """

    def __init__(self, study: Study, directory: Path, *, replace: bool = False) -> None:
        self._settings = study.settings()
        self.path = directory / FILE
        self._directory = RunDirectory(directory)
        settings, self.by_name, self._whole = ({}, {}, 0) if replace else _read(self.path)
        if settings not in ({}, self._settings):
            raise ResultsExist(f"{directory}: holds another study, or one of another springbeam or FMU ({FILE})")
        if not (settings or replace) and directory.is_dir() and any(file != self.path for file in directory.iterdir()):
            raise ResultsExist(f"{directory}: is not empty and holds no study")

    def __enter__(self) -> Records:
        self.path.parent.mkdir(parents=True, exist_ok=True)
        self._file = self.path.open("ab", buffering=0)
        lock(self._file, self.path)
        self._begun = False
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()
        if self.path.stat().st_size == 0:
            self.path.unlink()
            self._directory.discard()

    def add(self, name: str, record: Row) -> None:
        """Append a record; the first one removes what it replaces. Raises OSError if the disk is full."""
        if not self._begun:
            self._begun = True
            self._file.truncate(self._whole)  # without a line that was cut short
            if not self._whole:
                for stale in self.path.parent.iterdir():
                    if re.split(r"[.-]", stale.name)[0] in _KINDS:
                        stale.unlink()
                self._write(self._settings)
        self._write({"case": name, "record": record})
        self.by_name[name] = record

    def _write(self, line: dict[str, Any]) -> None:
        left = to_json(line) + b"\n"
        while left:
            left = left[self._file.write(left) :]


def _read(path: Path) -> tuple[dict[str, Any], dict[str, Row], int]:
    """Return the study, its records and the bytes of the complete lines; nothing where there is no file."""
    lines = path.read_bytes().splitlines(keepends=True) if path.exists() else []
    if lines and not lines[-1].endswith(b"\n"):
        lines.pop()
    try:
        settings, *entries = map(from_json, lines or [b"{}"])
        return settings, {entry["case"]: entry["record"] for entry in entries}, sum(map(len, lines))
    except (ValueError, KeyError, TypeError) as error:
        raise ResultsUnreadable(f"{path}: not a file of records: {error}") from error


def measured(at: Callable[[], Scene], metrics: Mapping[str, Metric], *, judge: bool = True) -> Row:
    """Run the scene that ``at`` returns; return how the run ended, its metrics and its cost.

    With ``judge`` the run is checked, and ``error_NAME`` bounds the error of the metric NAME, in its unit.
    ``status`` is ``done``, ``stopped`` (early) or ``refused`` (bad input), ``error`` has the cause. Raises FmuError if
    an FMU cannot be loaded.
    """
    row: Row = {"status": "done", "error": "", "warnings": "", **dict.fromkeys(metrics)}
    try:
        judged = checked(at()) if judge else None
        run = simulate(at(), check=False) if judged is None else judged.judged_run()
        numbers = {name: metric(run) for name, metric in metrics.items()}
        if judged is not None and judged.companion is not None:
            for name in (name for name, metric in metrics.items() if not metric.several and numbers[name] is not None):
                if metrics[name](judged.companion) is not None:
                    numbers[f"error_{name}"] = float(judged.error_of(metrics[name]))
        lacking = dict.fromkeys(metric.lacking(run) for metric in metrics.values())
    except SceneError as refused:
        row |= {"status": "refused", "error": str(refused)}
    except RunStopped as stopped:
        row |= {"status": "stopped", "error": str(stopped)}
    else:
        row["warnings"] = "\n".join([*run.summary["warnings"], *filter(None, lacking)])
        row |= numbers | costs(run)
    return row


def troubles(records: Mapping[str, Row]) -> list[str]:
    """Return in how many cases there were errors, and warnings, with the first of each."""
    lines = []
    for kind in ("error", "warnings"):
        troubled = [(name, record[kind]) for name, record in records.items() if record.get(kind)]
        if troubled:
            name, text = troubled[0]
            lines.append(f"{kind:<10}in {len(troubled)} cases, first in {name}: {text.splitlines()[0]}")
    return lines


def _fingerprints(scene: Scene) -> dict[str, str]:
    """Return SHA-256 by name of the files that ``scene`` needs: FMUs and tables. Raises FmuError if one is missing."""
    files = {path.name: path for path in map(own_fmu, scene.fmus)}
    files |= {spec.fmu: Path(spec.fmu) for spec in scene.foreign.values()}
    files |= {load.file: Path(load.file) for load in scene.loads if isinstance(load, TableLoad)}
    digests = {}
    for name, path in files.items():
        try:
            digests[name] = hashlib.sha256(path.read_bytes()).hexdigest()
        except OSError as error:
            remedy = "; ./build.sh fmus builds it" if path.parent == fmu_directory() else ""
            raise FmuError(f"{path}: {error.strerror}{remedy}") from error
    return digests
