"""What a run amounts to, on steps made by hand: each number against its integral in closed form."""

import numpy as np
import pytest
from bodies import pair_of

from springbeam.motion.events import Event
from springbeam.results.dense import inside
from springbeam.results.records import STEP
from springbeam.results.totals import totals
from springbeam.run.peaks import force_window
from springbeam.scene import load_scene, with_changes
from springbeam.scene.frequencies import slowest_frequency

SCENE = load_scene("soft")


def steps_with(force, ends, tip=lambda t: -t, rate=lambda t: -1.0, once=None):
    """Steps between ``ends``; ``force(t)`` is (C, Ċ, C̈) of the step that starts at t, the tip moves as told."""
    steps = np.zeros(len(ends), STEP)
    steps["time"] = ends
    steps["u_tip"] = [tip(t) for t in ends]
    steps["v_tip"] = [rate(t) for t in ends]
    for k, start in enumerate(ends[:-1], start=1):
        steps["size"][k] = ends[k] - start
        C, rate, bend = force(start)
        steps["contact_force_after"][k - 1] = steps["contact_force"][k] = C
        steps["contact_force_rate"][k] = rate
        steps["contact_force_rate_2"][k] = bend
        steps["contact_force_end"][k] = C + steps["size"][k] * (rate + 0.5 * steps["size"][k] * bend)
        if once is not None:
            steps["u_tip_integral"][k], steps["u_tip_integral_2"][k] = once(start, ends[k])
    for name in ("u_tip", "v_tip"):
        steps[f"{name}_after"] = steps[name]
    return steps


def found(steps, *events, window=0.1, scene=SCENE, apart=True):
    steps["phase"][-1] = 0.0 if apart else 1.0
    tip = inside(scene.contact.rigid, steps, "u_tip").extremes["u_tip"]
    return totals(scene, steps, events, window, tip)


def parabola(t):
    """12 t (1 − t), whose integral over the run is 2 N·s."""
    return 12.0 * t * (1.0 - t), 12.0 - 24.0 * t, -24.0


def test_the_window_is_a_fiftieth_of_the_slowest_period():
    def window_of(scene):
        with pair_of(scene) as pair:
            beam = scene.beam
            return force_window(pair, np.zeros(1, STEP), 0.0 if scene.massless else slowest_frequency(beam))

    slowest = slowest_frequency(SCENE.beam)
    assert window_of(SCENE) == pytest.approx(2.0 * np.pi / slowest / 50.0, rel=1e-12)
    assert window_of(with_changes(SCENE, contact={"force_window": 0.25})) == 0.25
    # 1/k of the beam is 3.3e-3 + 1e-2 m/N: with the spring's 3 N/m it holds 1 kg.
    massless = with_changes(SCENE, beam={"fidelity": "quasi_static"})
    stiffness = 3.0 + 1.0 / (1.0 / 300.0 + 1.0 / 100.0)
    assert window_of(massless) == pytest.approx(2.0 * np.pi / np.sqrt(stiffness) / 50.0, rel=1e-12)


WINDOWS = {
    # C = 1 − 4 s² before the peak, 1 − 16 s² after it, s from the peak: a window w begins 2w/3 before it.
    "of different curvature": (
        lambda t: (0.0, 4.0, -8.0) if t < 0.5 else (1.0, 0.0, -32.0),
        [0.0, 0.5, 1.0], None, 0.3, 1.0 - 16.0 * 0.3**2 / 27.0, 0.5 - 0.2,
    ),
    "where the run begins": (lambda t: (1.0 - t, -1.0, 0.0), np.linspace(0.0, 1.0, 8), None, 0.2, 0.9, 0.0),
    # Another window is the best of those that do not touch the impulse.
    "an impulse at its start": (
        parabola, [0.0, 1.0], (0.0, 1.0), 0.2, (1.0 + 6.0 * 0.2**2 - 4.0 * 0.2**3) / 0.2, 0.0
    ),
    # (0.9 − 0.19) + 0.19 < 0.9 in doubles.
    "an impulse beside rounding": (lambda t: (1.0, 0.0, 0.0), [0.0, 0.9], (0.9, 1.0), 0.19, 1.19 / 0.19, 0.71),
    # A window that began before the run, or ended after it, would have the mean 0.5.
    "a pull later": (lambda t: (1.0 if t < 0.5 else -0.5, 0.0, 0.0), [0.0, 0.5, 1.0], None, 1.0, 0.25, 0.0),
    "a pull before": (lambda t: (-0.5 if t < 0.5 else 1.0, 0.0, 0.0), [0.0, 0.5, 1.0], None, 1.0, 0.25, 0.0),
}  # fmt: skip


@pytest.mark.parametrize(("force", "ends", "impulse", "window", "mean", "begins"), WINDOWS.values(), ids=WINDOWS)
def test_the_window_of_the_largest_mean(force, ends, impulse, window, mean, begins):
    """Whatever the row of the start tells of the force that begins there is no force before the run."""
    steps = steps_with(force, ends)
    steps["contact_force"][0] = force(0.0)[0]
    events = [Event(impulse[0], "impact", impulse_contact=impulse[1])] if impulse else []
    numbers = found(steps, *events, window=window)
    assert numbers["contact_force_max"] == pytest.approx(mean, rel=1e-13)
    assert numbers["contact_force_max_time"] == pytest.approx(begins, rel=1e-13)
