"""Scenes that the references are tested with, an integration of theirs by scipy; references that are kept on disk."""

import hashlib
import os
import pickle
import platform
import shutil
from functools import cache
from pathlib import Path

import numpy as np
import scipy
from scenes import scene_from_dict
from scipy.integrate import solve_ivp

import springbeam
from springbeam.monolithic.event_driven import Equations, integrate
from springbeam.monolithic.exponential import ExponentialPropagator

#: Where references are kept between runs of the tests.
KEPT = Path(__file__).parents[2] / "build" / "cache" / "references"


@cache
def folder_of_references():
    """Return the folder of references by this code and these libraries; those by others are removed."""
    made_by = hashlib.sha256(f"{np.__version__} {scipy.__version__} {platform.version()}".encode())
    made_by.update(os.environ.get("OPENBLAS_CORETYPE", "").encode())
    for part in ("monolithic", "motion", "results", "scene"):
        for path in sorted((Path(springbeam.__file__).parent / part).rglob("*.py")):
            made_by.update(path.read_bytes())
    folder = KEPT / made_by.hexdigest()[:16]
    for other in KEPT.glob("*"):
        if other != folder:
            shutil.rmtree(other, ignore_errors=True)
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def reference(scene, **options):
    """Return the event-driven reference of a scene or its equations: that of an earlier run if the code is the same."""
    of = scene.scene if isinstance(scene, Equations) else scene
    if any(load.signal == "table" for load in of.loads):  # the file may have changed
        return integrate(scene, **options)
    asked = pickle.dumps((of.model_dump_json(), {name: np.asarray(given) for name, given in options.items()}))
    file = folder_of_references() / hashlib.sha256(asked).hexdigest()
    if file.exists():
        return pickle.loads(file.read_bytes())
    found = integrate(scene, **options)
    part = file.with_name(f"{file.name}.{os.getpid()}")
    part.write_bytes(pickle.dumps(found))
    part.replace(file)
    return found


def dips(restitution, turn):
    """Return a spring of ω = 10 rad/s that swings 0.1 m about 0, by steps of ``turn`` [rad], and when it strikes [s].

    The foundation is at −0.08 m: above it for (π − acos(0.08/A))·2/ω after each impact, A² = 0.08² + (e z/ω)². The dips
    become as shallow as 1e-5 m.
    """
    tables = {
        "time": {"t_end": 5.0},
        "spring": {"mass": 1.0, "linear_stiffness": 100.0, "equilibrium": 0.1},
        "stop": {"position": -0.08, "restitution": restitution},
        "coupling": {"macro_step": turn / 10.0},
    }
    times = []
    time = np.arccos(-0.8) / 10.0
    speed = 0.6
    while time < 5.0:
        times.append(float(time))
        speed *= restitution
        time += 0.2 * (np.pi - np.arccos(0.08 / np.hypot(0.08, speed / 10.0)))
    return scene_from_dict(tables), times


def integrated_anew(scene, patch, t_end):
    """Return the reference's run of ``scene`` after scipy has integrated the first and longest step of each phase.

    Both have the equations of motion, `HybridSystem.motion`, and no numerical method in common.
    """
    kept = {}
    step = ExponentialPropagator._step

    def noted(self, *arguments):
        segment = step(self, *arguments)
        phase = self.form.phase
        first, last = kept.get(phase, ((self, segment), (self, segment)))
        kept[phase] = first, max(last, (self, segment), key=lambda step: step[1].nodes[-1])
        return segment

    patch.setattr(ExponentialPropagator, "_step", noted)
    run = integrate(scene, sample_times=np.linspace(0.0, t_end, 31), t_end=t_end)
    for propagator, segment in (one for some in kept.values() for one in some):
        s = propagator.form.system
        phase = propagator.form.phase

        def slope(_, X, s=s, phase=phase):
            m = s.motion(phase, X)
            return np.concatenate([X[s.V], m.a, [s.dissipation_rate(phase, X), s.load_power(X), 1.0]])

        options = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-18}
        begin = segment.states[0]
        end = segment.states[-1]
        found = s.synchronise(phase, solve_ivp(slope, (0.0, segment.nodes[-1]), begin, **options).y[:, -1].copy())
        energy = sum(np.abs(part) for part in s.energies(np.stack([begin, end]), phase).values()).max()
        for parts in (s.A, s.V):
            error = np.abs(found - end)[parts]
            size = np.abs([begin, end])[:, parts]
            assert np.max(error) <= 1e-11 * np.max(size), (phase, parts)
        for part in (s.D, s.W):
            assert abs(found[part] - end[part]) <= 1e-11 * energy, (phase, part)
    return run
