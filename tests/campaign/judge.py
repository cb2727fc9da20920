"""One scene, run in each way, beside the event-driven reference."""

from dataclasses import dataclass, replace

import numpy as np
from draw import KINDS, drawn

from springbeam import RunStopped, SceneError, Trajectory, simulate, with_changes
from springbeam.monolithic import event_driven
from springbeam.results.distance import distance
from springbeam.scene.resolution import peak_force_doubt
from springbeam.scene.suspicions import suspicions

#: Ways to run a scene: an accuracy, or [coupling] at the scene's own macro step, or that over ``finer``.
WAYS = {
    "--accuracy 1e-3": {"accuracy": 1e-3},
    "--accuracy 1e-4": {"accuracy": 1e-4},
    "energy 0": {"scheme": "energy", "degree": 0},
    "energy 1": {"scheme": "energy", "degree": 1},
    "energy 2": {"scheme": "energy", "degree": 2},
    "energy 0, H/4": {"scheme": "energy", "degree": 0, "finer": 4.0},
    "energy 2, H/4": {"scheme": "energy", "degree": 2, "finer": 4.0},
}
#: What a run at a fixed step may be wrong by.
FIXED = 1e-2
#: Rows of a run that are judged, about, and times of a run with an accuracy; seconds that a reference may take.
ROWS, POINTS, TIME_LIMIT = 25, 200, 30.0
#: Relative changes of a stiffness that show the conditioning, and how many times larger the motion's may be.
PERTURBATIONS, WELL_CONDITIONED = (1e-5, 1e-3, -1e-3), 30.0
#: What became of a run that raised an error.
OUTCOMES = {SceneError: "refused", RunStopped: "stopped"}


@dataclass(frozen=True)
class Verdict:
    """What became of a run. Errors are over the largest change of the reference, times over the time that is run."""

    seed: int
    number: int
    way: str
    outcome: str  #: "done", "stopped", "refused", "no reference"
    condition: float = 0.0  #: change of the motion or of a time over that of a stiffness
    told: bool = False  #: not resolved, or a warning that the scene alone does not give
    motion: float = 0.0
    time: float = 0.0  #: of contact
    impulse: float = 0.0  #: of all impacts
    calls: int = 0  #: doStep calls of both FMUs, of all pilot runs
    why: str = ""

    @property
    def kind(self):
        return KINDS[self.number % len(KINDS)]

    @property
    def bound(self):
        return float(WAYS[self.way].get("accuracy", FIXED))

    @property
    def factor(self):
        """Error over what it may be."""
        off = max(self.motion, self.time, self.impulse) if "accuracy" in self.way else self.motion
        return off / self.bound

    @property
    def judged(self):
        return self.outcome == "done" and self.condition <= WELL_CONDITIONED

    @property
    def silent(self):
        return self.judged and self.factor > 1.0 and not self.told


def judge(seed, number, ways):
    """Run scene ``number`` of ``seed`` in each of ``ways``."""
    scene = drawn(seed, number)
    runs = {way: _run(scene, way) for way in ways}
    done = {way: run for way, run in runs.items() if isinstance(run, Trajectory)}
    found = [
        Verdict(seed, number, way, OUTCOMES[type(run)], told=True, why=str(run))
        for way, run in runs.items()
        if way not in done
    ]
    if not done:
        return found
    times = np.unique(np.concatenate([_times(way, run) for way, run in done.items()]))
    try:
        reference = event_driven.simulate(scene, sample_times=times, time_limit=TIME_LIMIT)
        condition = _condition(scene)
    except (event_driven.ReferenceFailure, RunStopped, ValueError) as failed:
        return [*found, *(Verdict(seed, number, way, "no reference", why=str(failed)) for way in done)]
    return [*found, *(_verdict(seed, number, way, run, reference, condition) for way, run in done.items())]


def _times(way, run):
    """Return when ``run`` is judged: with an accuracy between its rows too, since that is about the curve."""
    rows = run.time[:: len(run) // ROWS + 1]
    return np.append(rows, np.linspace(run.time[0], run.time[-1], POINTS)) if "accuracy" in WAYS[way] else rows


def _run(scene, way):
    settings = WAYS[way]
    try:
        if "accuracy" in settings:
            return simulate(scene.model_copy(update=settings))
        coupling = {"macro_step": scene.coupling.H, **settings}
        coupling["macro_step"] /= coupling.pop("finer", 1.0)
        return simulate(with_changes(scene, coupling=coupling))
    except (SceneError, RunStopped) as failed:
        return failed


def _verdict(seed, number, way, run, reference, condition):
    span = float(run.time[-1] - run.time[0])
    picked = run.summary.get("accuracy")
    promised = WAYS[way].get("accuracy")
    # With an accuracy at all times, and contacts are told apart as far as their times are promised.
    times, window = run.time, 2.0 * span / run.summary["macro_steps"]
    if promised is not None:
        times, window = _times(way, run), promised * span
    rows = np.isin(reference.time, times)
    exact = replace(reference, columns={name: values[rows] for name, values in reference.columns.items()})
    found = distance(run, exact, window)
    said = set(run.summary["warnings"]) - {*suspicions(run.scene), peak_force_doubt(run.scene)}
    return Verdict(
        seed, number, way, "done", condition, bool(said) or not run.summary["resolved"],
        found.motion, found.times, found.impulses,
        calls=run.do_steps + (picked["pilot_steps"] if picked else 0), why="; ".join(said),
    )  # fmt: skip


def _condition(scene):
    """Return how many times larger than that of a stiffness the change of the motion or of a time is.

    By runs with short steps, since it need not be exact.
    """
    body, key = ("beam", "young_modulus") if scene.spring is None else ("spring", "linear_stiffness")
    sharp = {"scheme": "energy", "degree": 2, "macro_step": scene.coupling.H / 4.0}
    stiffness, worst = getattr(getattr(scene, body), key), 0.0

    def run(share):
        return simulate(with_changes(scene, coupling=sharp, **{body: {key: stiffness * (1.0 + share)}}))

    exact = run(0.0)
    for share in PERTURBATIONS:
        found = distance(run(share), exact, 2.0 * scene.coupling.H)
        worst = max(worst, found.motion / abs(share), found.times / abs(share))
    return worst
