"""What an accuracy costs, beside the cheapest method of scipy."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from measure import compare, timed
from rows import Effort, Row, ratio_row

from springbeam import load_scene, simulate, with_changes
from springbeam.monolithic import event_driven
from springbeam.scene import Scene

#: Ours: macro steps, and tolerances of the coupling and of IDA; the force is quadratic.
STEPS = (1, 2, 3, 4, 6, 8, 12, 16, 20, 24, 28, 32, 40)
TOLERANCES = ((1e-4, 1e-3), (1e-5, 1e-3), (1e-6, 1e-4), (1e-8, 1e-8))
RIVALS = {"DOP853": (1e-1, 1e-2, 1e-3, 1e-4), "LSODA": (1e-2, 1e-3), "Radau": (1e-2,)}
#: A method so many times dearer than the cheapest is not tried on the finer mesh.
_HOPELESS = 10.0
#: Just before the first impact on the foundation of `soft` [s]. Until then y moves 15 mm.
UNTIL = 0.0712


@dataclass(frozen=True)
class Candidate:
    """A run of ours; errors of y [m] at its macro points, and between them by `Trajectory.at`."""

    scene: Scene
    seconds: float
    at_points: float
    between: float

    @property
    def setting(self) -> str:
        coupling, spring = self.scene.coupling, self.scene.spring
        assert spring is not None
        return (
            f"{coupling.scheme} {coupling.degree}, {round(UNTIL / coupling.H)} steps, tolerances "
            f"{coupling.tolerance:.0e} and {spring.relative_tolerance:.0e}"
        )


def accuracy(effort: Effort) -> Iterator[Row]:
    methods = list(RIVALS)[:1] if effort.quick else list(RIVALS)
    for n in (10,) if effort.quick else (50, 200):
        soft = with_changes(load_scene("soft"), beam={"n_elements": n}, time={"t_end": UNTIL})
        grid = np.linspace(0.0, UNTIL, 401)
        exact = event_driven.simulate(soft, sample_times=grid)
        scale = float(np.abs(exact.y).max())
        families = [
            [_candidate(soft, scheme, steps, *tolerances) for steps in (STEPS[-2:] if effort.quick else STEPS)]
            for tolerances in (TOLERANCES[2:3] if effort.quick else TOLERANCES)
            for scheme in ("energy", "hermite")
        ]
        theirs: list[tuple[float, float, str, float]] = []
        for method in methods:
            for rtol in RIVALS[method]:
                error = float(np.abs(_scipy(soft, method, rtol, scale, grid).y - exact.y).max())
                theirs.append((_seconds(soft, method, rtol, scale), error, method, rtol))
        for target, error_of, meaning in (
            (1e-6, "at_points", "1e-6 m at macro points"),
            (1e-6, "between", "1e-6 m, also between macro points"),
            (1e-6 * scale, "at_points", "1e-6 of its motion at macro points"),
        ):
            chosen = _cheapest(families, error_of, target)
            best, _, method, rtol = min(t for t in theirs if t[1] <= target)
            times = compare(partial(_ours, chosen.scene), partial(_seconds, soft, method, rtol, scale), effort.rounds)
            yield ratio_row(
                f"`soft`, {n} elements, y within {meaning}: {chosen.setting}, error {getattr(chosen, error_of):.1e} m",
                times,
                10.0,
                f"the cheapest of scipy's: {method}, rtol {rtol:.0e}",
                faster=True,
            )
            call = partial(simulate, chosen.scene)
            theirs_call = partial(_scipy, soft, method, rtol, scale, np.array([UNTIL]))
            whole = compare(lambda f=call: timed(f), lambda f=theirs_call: timed(f), effort.rounds)  # type: ignore[misc]
            besides = "whole calls in a warm process: of scipy's, assembly and modes are a part"
            yield ratio_row("the same, whole calls", whole, 1.0, besides, faster=True)
            if effort.quick:
                return
        methods = list(dict.fromkeys(m for seconds, _, m, _ in theirs if seconds <= _HOPELESS * best))


def _candidate(soft: Scene, scheme: str, steps: int, tolerance: float, ida: float) -> Candidate:
    scene = with_changes(
        soft,
        coupling={"scheme": scheme, "degree": 2, "macro_step": UNTIL / steps, "tolerance": tolerance},
        spring={"relative_tolerance": ida, "absolute_tolerance": 1e-2 * ida},
    )
    run = simulate(scene)
    exact = event_driven.simulate(soft, sample_times=np.union1d(np.linspace(0.0, UNTIL, 401), run.time))
    at = np.searchsorted(exact.time, run.time)
    return Candidate(
        scene,
        min(_ours(scene) for _ in range(3)),
        float(np.abs(run.y - exact.y[at]).max()),
        float(np.abs(run.at(exact.time).y - exact.y).max()),
    )


def _cheapest(families: list[list[Candidate]], error_of: str, target: float) -> Candidate:
    """Return the cheapest that is within the target together with all finer ones of its family: not by luck."""
    kept = []
    for family in families:
        fine = [getattr(candidate, error_of) <= target for candidate in family]
        kept += [candidate for i, candidate in enumerate(family) if all(fine[i:])]
    return min(kept, key=lambda candidate: candidate.seconds)


def _ours(scene: Scene) -> float:
    return float(simulate(scene).summary["wall_time"])


def _seconds(scene: Scene, method: str, rtol: float, scale: float) -> float:
    """What scipy takes without rows; the matrices are made before the clock runs."""
    return float(_scipy(scene, method, rtol, scale, np.array([scene.time.t_end])).summary["wall_time"])


def _scipy(scene: Scene, method: str, rtol: float, scale: float, times: np.ndarray) -> Any:
    return event_driven.simulate(scene, method=method, rtol=rtol, atol=1e-3 * rtol * scale, nodes=2, sample_times=times)
