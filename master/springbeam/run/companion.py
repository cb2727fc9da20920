"""Judge a run by a companion in steps 2.3 times as long: how far apart both are bounds the error of the finer one.

Where errors fall at least with the size of the steps, the difference of both runs is an upper bound of the error of the
finer run, of whatever is a function of a run, for any bodies, laws and loads. The sizes are incommensurate, as far as
the bodies allow: runs that share macro points may miss one event. What both runs cannot see is in ``docs/verdicts.md``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import inf
from time import perf_counter
from typing import Any

import numpy as np

from ..bodies.protocol import Abilities, Body, FmuError
from ..results.distance import Distance, distance
from ..results.inner import largest
from ..results.judged import in_words
from ..results.totals import BESIDE, LOSS_NAMES, TOTALS
from ..results.trajectory import BODY_COLUMNS, Trajectory
from ..scene import Scene, SceneError, with_changes
from .outcome import Progress, RunStopped
from .peaks import PEAK_DOUBTED
from .runner import abilities, run_in_memory
from .setup import set_up
from .summary import NOT_RESOLVED
from .validation import refusals

#: Length of the companion's steps over the run's.
LONGER = 2.3
#: Those of bodies whose steps have one size: whole numbers, of which the first is taken that ends where the run does.
_WHOLE = range(3, 11)
#: Tolerances of the companion of an adaptive run over the run's.
LOOSER = 100.0
#: A run of fewer steps has a companion in shorter ones.
_FEWEST = 8
#: Error of the coarser of both runs over their difference, at order 1.
_OF_COARSER = LONGER / (LONGER - 1.0)
#: A run is resolved if the companion differs from it by no more than this: `Distance`. Chosen on drawn scenes, and
#: tested on others (``docs/measured.md``).
LIMITS = Distance(motion=0.025, times=0.01, impulses=0.1, force=inf, velocities=0.17, energies=inf)
#: Error of the peak of a soft contact force, relative to it, from which on a run warns.
PEAK_FORCE = 0.1


@dataclass(frozen=True)
class Check:
    """A run beside its companion.

    ``errors`` are bounds of its relative errors by the names of `springbeam.results.distance.Distance`; ``why_not``
    says why there are none, or why the run is not resolved.
    """

    run: Trajectory
    companion: Trajectory | None
    errors: dict[str, float]
    ratio: float  #: of the companion's steps to those of the run
    seconds: float  #: that the companion has taken
    why_not: str = ""

    @property
    def judged(self) -> bool:
        """Whether there are errors."""
        return bool(self.errors)

    @property
    def resolved(self) -> bool | None:
        """Whether all errors are within `LIMITS` and the run shows none alone; ``None`` if it is not judged."""
        if self.run.summary.get("resolved") is False:
            return False
        if self.companion is None:
            return False if self.why_not.startswith(NOT_RESOLVED) else None
        return not self.why_not

    def error_of(self, quantity: Callable[[Trajectory], Any]) -> Any:
        """Return a bound of the error of any function of a run, a number or an array, in its unit.

        Raises ValueError if there is no companion.
        """
        if self.companion is None:
            raise ValueError(f"there is no companion run: {self.why_not}")
        return self._share * np.abs(np.subtract(quantity(self.run), quantity(self.companion)))

    @property
    def _share(self) -> float:
        return _OF_COARSER if self.ratio < 1.0 else 1.0

    def quantities(self) -> dict[str, float]:
        """Return bounds of the errors of the results of a run, in their units."""
        if self.companion is None:
            return {}
        ours, theirs = (results_of(run) for run in (self.run, self.companion))
        return {name: self._share * abs(ours[name] - theirs[name]) for name in ours if name in theirs}

    def as_summary(self) -> dict[str, Any]:
        """Return the entries of the summary of the run."""
        warnings = [*self.run.summary.get("warnings", ())]
        if self.resolved is False and self.why_not:
            warnings.append(self.why_not)
        if (peak := self.errors.get("force", 0.0)) > PEAK_FORCE:
            warnings.append(f"{PEAK_DOUBTED}may be wrong by up to {100.0 * peak:.2g} %; take shorter steps")
        if not self.judged:
            not_judged = {} if self.resolved is False else {"not_judged": self.why_not}
            return {"resolved": self.resolved, "warnings": warnings, **not_judged}
        assert self.companion is not None
        errors = {
            **self.errors,
            "quantities": self.quantities(),
            "beside": _beside(self.run.scene, self.ratio),
            "ratio": self.ratio,
            "do_steps": self.companion.do_steps,
            "wall_time": self.seconds,
        }
        return {"resolved": self.resolved, "warnings": warnings, "errors": errors}

    def judged_run(self) -> Trajectory:
        """Return the run with these entries in its summary."""
        return replace(self.run, summary={**self.run.summary, **self.as_summary()})


def check(
    run: Trajectory,
    progress: Progress | None = None,
    *,
    upper: Body | None = None,
    lower: Body | None = None,
) -> Check:
    """Judge a finished run: make its companion, and return bounds of the errors and what the companion has cost.

    Parameters
    ----------
    run
        A run that is done, made here or loaded. Its bits do not change.
    progress
        As of `springbeam.simulate`.
    upper, lower
        Bodies of the caller's at the start of the run, if it had such; they are at its end afterwards.

    Raises
    ------
    ValueError
        If the run is not done, or has no steps.
    """
    if run.steps is None or run.summary.get("status", "done") not in ("done", "running"):
        raise ValueError("a run that has not come to its end, or one by a reference, cannot be checked")
    ratio = LONGER
    began = perf_counter()
    try:
        scene, ratio = _companion_of(run.scene, abilities(run.scene, upper=upper, lower=lower))
        companion = run_in_memory(scene, progress, upper=upper, lower=lower)
    except RunStopped as stopped:
        why = f"{NOT_RESOLVED}: with {_beside(scene, ratio)} the run {stopped}"
        return Check(run, None, {}, ratio, perf_counter() - began, why)
    except (SceneError, FmuError) as refused:
        return Check(run, None, {}, ratio, perf_counter() - began, f"not judged: the companion is refused: {refused}")
    return compared(run, companion, ratio, perf_counter() - began)


def compared(run: Trajectory, companion: Trajectory, ratio: float, seconds: float) -> Check:
    """Return what the difference of two runs says of the first; parameters as of `Check`."""
    coarser, finer = (companion, run) if ratio >= 1.0 else (run, companion)
    share = 1.0 if ratio >= 1.0 else _OF_COARSER
    apart = distance(coarser, finer, _window(coarser))._asdict()
    errors = {name: share * part for name, part in apart.items() if part is not None}
    return Check(run, companion, errors, ratio, seconds, _why_not(run, errors, ratio))


def _companion_of(scene: Scene, able: Mapping[str, Abilities]) -> tuple[Scene, float]:
    """Return the scene of the companion of a run of ``scene``, and the ratio of its steps to those of the run."""
    coupling = scene.coupling
    if coupling.macro_step is None:
        keys = ("relative_tolerance", "absolute_tolerance")
        given = {name: getattr(coupling, name) for name in keys if getattr(coupling, name) is not None}
        looser = {name: LOOSER * value for name, value in given.items()}
        if "relative_tolerance" in looser:
            looser["relative_tolerance"] = min(0.1, looser["relative_tolerance"])
        return with_changes(scene, coupling=looser), LOOSER
    ratio = _ratio(scene, coupling.macro_step, able)
    return with_changes(scene, coupling={"macro_step": ratio * coupling.macro_step}), ratio


def _ratio(scene: Scene, H: float, able: Mapping[str, Abilities]) -> float:
    """Return the ratio of the companion's steps to those of a run in steps ``H`` [s] of bodies of these abilities.

    Where no longer steps are allowed, it is the shortest, by which the companion is refused with a remedy.
    """
    if all(body.any_size for body in able.values()):
        return LONGER if scene.duration > _FEWEST * H else 1.0 / LONGER
    setup = set_up(scene, *able.values())
    allowed = (ratio for ratio in _WHOLE if not refusals(replace(setup, macro_step=ratio * H), able))
    return float(next(allowed, _WHOLE[0]))


def _window(run: Trajectory) -> float:
    """Return how short contacts are that may be none: a macro step, or the longest of adaptive ones [s]."""
    assert run.steps is not None
    return float(run.scene.coupling.macro_step or run.steps["size"].max())


def results_of(run: Trajectory) -> dict[str, float]:
    """Return the numbers of a run that have errors: its totals, and the largest magnitudes of columns of bodies.

    When an extreme comes is left out, which jumps where two are alike.
    """
    names = [name for name in (*TOTALS, *LOSS_NAMES) if name not in BESIDE]
    results = {name: float(run.summary[name]) for name in names if run.summary.get(name) is not None}
    later = run.without_start()
    for name in (name for name in ("v_tip", "z") if name in later.columns):
        results[f"max_{name}"] = float(np.abs(later[name]).max(initial=0.0))
    for column in (column for column in BODY_COLUMNS if column in run.columns and len(later)):
        lowest, _, highest, _ = largest(run, column)
        results[f"max_{column}"] = max(highest, -lowest)
    return results


def _why_not(run: Trajectory, errors: Mapping[str, float], ratio: float) -> str:
    """Return in words why ``run`` is not resolved, and which steps would do; nothing if all is within `LIMITS`."""
    excess = {name: value / getattr(LIMITS, name) for name, value in errors.items()}
    broken = [name for name, times in excess.items() if times > 1.0]
    if not broken:
        return ""
    said = ", ".join(in_words({name: errors[name] for name in broken}, run.scene.duration))
    return f"{NOT_RESOLVED}: {_beside(run.scene, ratio)} differ by {said}; {_remedy(run, max(excess.values()))}"


def _remedy(run: Trajectory, excess: float) -> str:
    """Return which steps would do, for errors ``excess`` times as large as they may be.

    Those of order 2 or more would be that much smaller; differences without an order are named as such.
    """
    H = run.scene.coupling.macro_step
    if H is None:
        return "smaller tolerances resolve it"
    return f"try coupling.macro_step = {H / min(1.5 * excess**0.5, 10.0):.1e} s"


def _beside(scene: Scene, ratio: float) -> str:
    """Return what the companion has in words."""
    if scene.coupling.macro_step is None:
        return f"tolerances {LOOSER:g} times as large"
    return f"steps {max(ratio, 1.0 / ratio):g} times as {'long' if ratio > 1.0 else 'short'}"
