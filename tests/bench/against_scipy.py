"""What an accuracy costs, beside what a good user of scipy would write (`rivals`).

Both give y at the same 401 times, and are judged at all of them: ours between its macro points too. Set-up is not
counted, on either side: FMUs that are loaded, modes that are known.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from measure import compare, ratio_row, timed
from rivals import Rival

from springbeam import Scene, load_scene, simulate, with_changes
from springbeam.monolithic import event_driven

#: Ours: macro steps, and tolerances of the coupling and of IDA; the force is quadratic.
STEPS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192)
TOLERANCES = ((1e-4, 1e-3), (1e-5, 1e-3), (1e-6, 1e-4), (1e-8, 1e-8))
RIVALS = {"DOP853": (1e-1, 1e-2, 1e-3, 1e-4, 1e-5), "LSODA": (1e-2, 1e-3, 1e-5), "Radau": (1e-2, 1e-3)}
#: A method so many times dearer than the cheapest is not tried on the finer mesh.
_HOPELESS = 10.0
#: Just before the first impact on the foundation of `soft` [s]. Until then y moves 15 mm.
UNTIL = 0.0712
TIMES = np.linspace(0.0, UNTIL, 401)


@dataclass(frozen=True)
class Candidate:
    """A run of ours, and its largest error of y [m]."""

    scene: Scene
    seconds: float
    error: float

    @property
    def setting(self):
        coupling = self.scene.coupling
        spring = self.scene.spring
        assert spring is not None
        return (
            f"{coupling.scheme} {coupling.degree}, {round(UNTIL / coupling.H)} steps, tolerances "
            f"{coupling.tolerance:.0e} and {spring.relative_tolerance:.0e}"
        )


def accuracy(effort):
    methods = list(RIVALS)[:1] if effort.quick else list(RIVALS)
    for n in (10,) if effort.quick else (50, 200):
        soft = with_changes(load_scene("soft"), beam={"n_elements": n}, time={"t_end": UNTIL})
        exact = event_driven.integrate(soft, sample_times=TIMES).y
        scale = float(np.abs(exact).max())
        families = [
            [_candidate(soft, exact, steps, *tolerances) for steps in (STEPS[-2:] if effort.quick else STEPS)]
            for tolerances in (TOLERANCES[2:3] if effort.quick else TOLERANCES)
        ]
        rival = Rival(soft)
        theirs = []
        for method in methods:
            for rtol in RIVALS[method]:
                error = float(np.abs(_solved(rival, method, rtol, scale).columns["y"] - exact).max())
                theirs.append((_seconds(rival, method, rtol, scale), error, method, rtol))
        for target, meaning in ((1e-6, "1e-6 m"), (1e-6 * scale, "1e-6 of its motion")):
            chosen = _cheapest(families, target)
            best, _, method, rtol = min(t for t in theirs if t[1] <= target)
            times = compare(partial(_ours, chosen.scene), partial(_seconds, rival, method, rtol, scale), effort.rounds)
            yield ratio_row(
                f"`soft`, {n} elements, y within {meaning} at 401 times: {chosen.setting}, error {chosen.error:.1e} m",
                times,
                10.0,
                f"the cheapest of scipy's: {method}, rtol {rtol:.0e}",
                faster=True,
            )
            whole = compare(partial(_whole, chosen.scene), partial(_whole_of_scipy, soft, method, rtol, scale),
                            effort.rounds)  # fmt: skip
            besides = "of scipy's, with assembly and modes"
            yield ratio_row("the same, whole calls", whole, 1.0, besides, faster=True)
            if effort.quick:
                return
        methods = list(dict.fromkeys(m for seconds, _, m, _ in theirs if seconds <= _HOPELESS * best))


def _candidate(soft, exact, steps, tolerance, ida):
    scene = with_changes(
        soft,
        coupling={"degree": 2, "macro_step": UNTIL / steps, "tolerance": tolerance},
        spring={"relative_tolerance": ida, "absolute_tolerance": 1e-2 * ida},
    )
    error = float(np.abs(simulate(scene).at(TIMES).y - exact).max())
    return Candidate(scene, min(_ours(scene) for _ in range(3)), error)


def _cheapest(families, target):
    """Return the cheapest that is within the target together with all finer ones of its family: not by luck."""
    kept = []
    for family in families:
        fine = [candidate.error <= target for candidate in family]
        kept += [candidate for i, candidate in enumerate(family) if all(fine[i:])]
    return min(kept, key=lambda candidate: candidate.seconds)


def _ours(scene):
    run = simulate(scene)
    return float(run.summary["wall_time"]) + timed(lambda: run.at(TIMES))


def _whole(scene):
    return timed(lambda: simulate(scene).at(TIMES))


def _solved(rival, method, rtol, scale):
    return rival.solve(method, rtol, 1e-3 * rtol * scale, TIMES)


def _seconds(rival, method, rtol, scale):
    return _solved(rival, method, rtol, scale).seconds


def _whole_of_scipy(soft, method, rtol, scale):
    return timed(lambda: _solved(Rival(soft), method, rtol, scale))
