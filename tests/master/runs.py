"""Made-up runs: whatever a scene can have, without computing anything."""

from __future__ import annotations

import numpy as np

from springbeam.results.trajectory import EVENT_KINDS, Event, Trajectory, columns_of
from springbeam.scene import load_scene
from springbeam.scene.statics import SHAPE_POINTS

PAIR = load_scene("soft")


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
    shapes = None if scene.beam is None else (t, np.outer(np.sin(9.0 * t), SHAPE_POINTS**2))
    ordered = {name: made[name] for name in columns_of(scene)}
    return Trajectory(scene, ordered, list(events), shapes, {})


EVERY_EVENT = [Event(0.05 * (i + 1), kind, 0, 0, 0, 0, 0.1, 0.2, 0.3) for i, kind in enumerate(EVENT_KINDS)]
