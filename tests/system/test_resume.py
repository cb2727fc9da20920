"""A run goes on from a checkpoint to the same bits, whenever it was stopped and whatever it was doing."""

import numpy as np
import pytest

from springbeam.bodies.factory import load_bodies
from springbeam.results.recording import MemoryRecorder
from springbeam.run.master import Master
from springbeam.scene import load_scene, with_changes

pytestmark = pytest.mark.usefixtures("fmu_folder")

SOFT = with_changes(load_scene("soft"), beam={"n_elements": 10}, coupling={"macro_step": 2e-3})
COMPLIANCE = {"law": "compliance", "exponent": 1.0}
SCENES = {
    "energy": SOFT,
    "energy 2, damped": with_changes(SOFT, beam={"alpha_b": 1e-3}, spring={"damping": 0.5}, coupling={"degree": 2}),
    "hermite 2": with_changes(SOFT, coupling={"scheme": "hermite", "degree": 2, "macro_step": 1e-3}),
    "adaptive": with_changes(SOFT, coupling={"relative_tolerance": 1e-4}),
    "generalized_alpha": with_changes(SOFT, beam={"integrator": "generalized_alpha", "rho_inf": 0.8}),
    "quasi-static": with_changes(
        SOFT, beam={"fidelity": "quasi_static", "alpha_b": 0.1, "distributed_load": -20.0}, coupling={"degree": 1}
    ),
    "compliance": with_changes(SOFT, contact={**COMPLIANCE, "exponent": 1.5}, coupling={"degree": 2}),
    # Some of its steps find their force at degree 0 only.
    "too stiff for its degree": with_changes(
        SOFT, contact={**COMPLIANCE, "stiffness": 1e18}, coupling={"degree": 2, "macro_step": 4e-3}, stop=None
    ),
    "one-way": with_changes(
        SOFT,
        beam={"young_modulus": 1e6, "shear_modulus": 1e6},
        contact={**COMPLIANCE, "stiffness": 100.0},
        coupling={"feedback": "beam_drives", "feedback_tolerance": 0.1},
    ),
    "gauss_seidel": with_changes(
        SOFT,
        contact={**COMPLIANCE, "stiffness": 100.0},
        coupling={"scheme": "gauss_seidel", "macro_step": 4e-4},
        time={"t_end": 0.4},
    ),
    # The load presses tip and spring onto the foundation until they stay there.
    "seated": with_changes(
        SOFT,
        beam={"distributed_load": -6.0, "alpha_b": 2e-2},
        spring={"damping": 2.0},
        stop={"restitution": 0.3},
        time={"t_end": 1.0},
    ),
    "loads": with_changes(
        SOFT,
        coupling={"degree": 1},
        spring={"external_force": -5.0, "damping": 2.0},
        stop={"restitution": 0.3},
        loads=[
            {"on": "base", "signal": "harmonic", "frequency": 12.0, "amplitude": 5.0},
            {"on": "beam", "at": 0.4, "signal": "half_sine", "start": 0.01, "duration": 0.3, "amplitude": -9.0},
        ],
    ),
    "beam on a stop": with_changes(SOFT, spring=None, stop={"restitution": 0.4}, beam={"alpha_b": 1e-3}),
    "spring on a stop": with_changes(
        SOFT, beam=None, stop={"restitution": 0.7}, spring={"initial_velocity": -1.0}, time={"t_end": 4.0}
    ),
    "elastic approach": with_changes(
        SOFT, beam={"approach": "elastic", "initial_deflection_slope": 0.05}, contact={"impact": "rest"}
    ),
    "retie": with_changes(load_scene("paper-fig4"), beam={"n_elements": 20, "n_modes": 0}, time={"t_end": 1.2}),
    "paper": with_changes(
        load_scene("paper-fig4"),
        beam={"n_elements": 20, "n_modes": 0},
        contact={"law": "paper"},
        time={"t_end": 1.2013},  # off the grid
    ),
}


class Run:
    """A run into memory, and what it remembered: after each step, or at the end only."""

    def __init__(self, scene, *, each_step=False):
        start_time = scene.contact_time or 0.0
        self.bodies = load_bodies(scene, start_time)
        self.recorder = MemoryRecorder(scene)
        self.saved = []
        self.simulation = Master(scene, start_time, *self.bodies, self.recorder)
        self._each_step = each_step

    def _save(self):
        self.saved.append(self.simulation.run_state())

    def finish(self):
        while not self.simulation.done:
            self.simulation.step()
            if self._each_step:
                self._save()
        self._save()
        self.recorder.finish(self.simulation.summary())
        self.trajectory = self.recorder.trajectory()
        self.close()
        return self

    def close(self):
        for body in self.bodies:
            if body is not None:
                body.close()


@pytest.mark.parametrize("name", SCENES)
def test_a_run_goes_on_from_any_step_to_the_same_bits(name):
    scene = SCENES[name]
    whole = Run(scene, each_step=True).finish()
    steps = len(whole.saved) - 1
    assert steps > 100
    # After steps that ended on an event, and in between.
    at_events = np.searchsorted(whole.trajectory.time, [event.time for event in whole.trajectory.events])
    assert len(at_events) > 0
    chosen = {int(k) for k in at_events[:: max(1, len(at_events) // 6)]} | set(range(0, steps, steps // 2))
    for k in sorted(k for k in chosen if k < steps):
        rest = Run(scene)
        rest.simulation.go_on(whole.saved[k])
        steps = whole.recorder.steps()[: k + 2]  # the row at the start, and one per step
        events = whole.trajectory.events[: int(steps["events"][-1])]
        shapes = whole.trajectory.shape_table()
        rest.recorder.keep(steps, events, shapes[shapes[:, 0] <= steps["time"][-1]] if len(shapes) else shapes)
        rest.simulation.catch_up()
        rest.finish()
        # Everything remembered, counts of steps and rollbacks among it.
        assert rest.saved[-1] == whole.saved[-1]
        assert rest.recorder.steps().tobytes() == whole.recorder.steps().tobytes()
        assert rest.trajectory.events == whole.trajectory.events
        if scene.beam is not None:
            assert all(map(np.array_equal, rest.trajectory.shapes, whole.trajectory.shapes))
        assert rest.trajectory.summary == whole.trajectory.summary


def test_the_scenes_pass_every_phase_and_event():
    trajectories = [Run(SCENES[name]).finish().trajectory for name in ("energy", "seated", "retie")]
    assert {phase for t in trajectories for phase in t.phase} == {"free", "tied", "touch", "seated"}
    kinds = {event.kind for t in trajectories for event in t.events}
    assert kinds >= {"impact", "stop_impact", "release", "retie", "separation", "seated"}
