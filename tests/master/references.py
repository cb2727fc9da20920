"""The event-driven reference, and its integration anew by scipy."""

import numpy as np
from scipy.integrate import solve_ivp

from springbeam.monolithic.event_driven import integrate
from springbeam.monolithic.exponential import ExponentialPropagator
from springbeam.scene import with_changes


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
    run = integrate(with_changes(scene, time={"t_end": t_end}), sample_times=np.linspace(0.0, t_end, 31))
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
