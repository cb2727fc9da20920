"""Made-up runs: whatever a scene can have, without computing anything."""

import numpy as np

from springbeam.motion.events import Event, EventKind
from springbeam.results.records import BEAM_REPORTS, SPRING_REPORTS, STEP, STEP_COLUMNS
from springbeam.results.trajectory import Trajectory, columns_of
from springbeam.scene import load_scene, with_changes
from springbeam.scene.statics import SHAPE_POINTS

PAIR = load_scene("soft")
#: Scenes that lack a body each, by what they have.
SCENES = {
    "all": PAIR,
    "no stop": with_changes(PAIR, stop=None),
    "no spring": with_changes(PAIR, spring=None),
    "beam": with_changes(PAIR, spring=None, stop=None),
    "no beam": with_changes(PAIR, beam=None),
    "spring": with_changes(PAIR, beam=None, stop=None),
}


def a_trajectory(scene=PAIR, n=400, events=(), **columns):
    t = np.linspace(0.0, scene.time.t_end, n)
    made = {
        name: 1e-2 * np.sin((i + 3.0) * t) ** 2 for i, name in enumerate(columns_of(scene)) if name.startswith("e_")
    }
    made |= {"e_load": np.zeros(n), "energy_residual": 1e-15 * np.sin(t)}
    made["e_total"] = sum(values for name, values in made.items() if name not in ("e_total", "energy_residual"))
    for i, name in enumerate(columns_of(scene)):
        made.setdefault(name, 1e-2 * np.sin((i + 3.0) * t))
    made |= {"time": t, "phase": np.where(np.sin(20.0 * t) > 0.0, "tied", "free")} | columns
    shapes = None if scene.beam is None else shape_table(t, np.outer(np.sin(9.0 * t), SHAPE_POINTS**2))
    ordered = {name: made[name] for name in columns_of(scene)}
    return Trajectory(scene, ordered, list(events), shapes)


def shape_table(t, deflection):
    """Deflections along the beam at the times ``t``, without moments and shear forces."""
    return np.column_stack([t, deflection, np.zeros((len(t), 42))])


def block(n=300, scene=PAIR, t_end=3.0, begin=0):
    """Records of ``n`` steps up to ``t_end``, in every phase, with an event every tenth step, and shapes.

    A run may have several, of which ``begin`` steps came before.
    """
    rng = np.random.default_rng(n + begin)
    steps = np.zeros(n, STEP)
    for name in STEP_COLUMNS:
        steps[name] = rng.normal(size=n)
    number = np.arange(begin, begin + n)
    steps["time"] = t_end * number / max(begin + n - 1, 1)
    steps["size"] = np.where(number % 7, t_end / n, 0.0)
    steps["phase"] = number % 6
    steps["events"] = (number + 9) // 10
    steps["energy_at_start"] = 0.25
    steps["reports"] = BEAM_REPORTS + SPRING_REPORTS
    steps["degree"] = 2.0
    steps["tip_share"] = 0.25
    steps["reduced_mass"] = 0.75
    happen = number[number % 10 == 1]
    events = [Event(float(steps["time"][i - begin]), "impact", 0.5, -1.0, None, 0.1 * i) for i in happen]
    shapes = np.column_stack([steps["time"], rng.normal(size=(n, 63))]) if scene.beam is not None else np.empty((0, 64))
    return steps, events, shapes


EVERY_EVENT = [Event(0.05 * (i + 1), kind, 0, 0, 0, 0, 0.1, 0.2, 0.3) for i, kind in enumerate(EventKind)]
