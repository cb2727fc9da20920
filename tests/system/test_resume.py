"""A run goes on from a checkpoint to the same bits, whenever it was stopped and whatever it was doing."""

import numpy as np
import pytest

from springbeam import Simulation, load_scene, with_changes

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


def shapes_of(run):
    return np.empty(0) if run.shape_table is None else run.shape_table


@pytest.mark.parametrize("name", SCENES)
def test_a_run_goes_on_from_any_step_to_the_same_bits(name):
    """Everything that is remembered comes back, counts of steps and rollbacks among it."""
    scene, saved = SCENES[name], []
    with Simulation(scene) as whole:
        while not whole.done:
            whole.step()
            saved.append(whole._master.run_state())
    run, records, last = whole.run, whole.recorder.steps(), len(saved) - 1
    assert last > 100
    # After steps that ended on an event, and in between.
    at_events = np.searchsorted(run.time, [event.time for event in run.events])
    assert len(at_events) > 0
    chosen = {int(k) for k in at_events[:: max(1, len(at_events) // 2)]} | {0, last // 2}
    for k in sorted(k for k in chosen if k < last):
        with Simulation(scene) as rest:
            rest._master.go_on(saved[k])
            steps, shapes = records[: k + 2], shapes_of(run)  # the row at the start, and one per step
            events = run.events[: int(steps["events"][-1])]
            rest.recorder.keep(steps, events, shapes[shapes[:, 0] <= steps["time"][-1]] if len(shapes) else shapes)
            rest.finish()
        assert rest._master.run_state() == saved[-1]
        assert rest.recorder.steps().tobytes() == records.tobytes()
        assert rest.run.events == run.events
        assert shapes_of(rest.run).tobytes() == shapes_of(run).tobytes()
        clocks = {"setup_time", "wall_time"}
        assert [(key, rest.run.summary[key]) for key in run.summary.keys() - clocks] == [
            (key, run.summary[key]) for key in run.summary.keys() - clocks
        ]
