"""Scenes that the references are tested with, and an integration of theirs by scipy."""

import numpy as np
from scenes import scene_from_dict
from scipy.integrate import solve_ivp

from springbeam.monolithic.event_driven import integrate
from springbeam.monolithic.exponential import ExponentialPropagator


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
    times, time, speed = [], np.arccos(-0.8) / 10.0, 0.6
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
        s, phase = propagator.form.system, propagator.form.phase

        def slope(_, X, s=s, phase=phase):
            m = s.motion(phase, X)
            return np.concatenate([X[s.V], m.a, [s.dissipation_rate(phase, X), s.load_power(X), 1.0]])

        options = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-18}
        begin, end = segment.states[0], segment.states[-1]
        found = s.synchronise(phase, solve_ivp(slope, (0.0, segment.nodes[-1]), begin, **options).y[:, -1].copy())
        energy = sum(np.abs(part) for part in s.energies(np.stack([begin, end]), phase).values()).max()
        for parts in (s.A, s.V):
            error, size = np.abs(found - end)[parts], np.abs([begin, end])[:, parts]
            assert np.max(error) <= 1e-11 * np.max(size), (phase, parts)
        for part in (s.D, s.W):
            assert abs(found[part] - end[part]) <= 1e-11 * energy, (phase, part)
    return run
