"""Both FMUs' events: an elastic bar on a rigid stop."""

from __future__ import annotations

from collections.abc import Iterator
from math import nan, pi, sqrt

import numpy as np
from scipy.special import ai_zeros, itairy

from ...run.runner import simulate
from ...scene import load_scene, with_changes
from .check import Check, section


@section("Impact: elastic bar on a rigid stop", (100,), (200,))
def bar_impact(n: int) -> Iterator[Check]:
    """Elastic bar on a rigid stop: u_tt = u_xx, u(0) = 0, u⁰ = x/2, u_t⁰ = 0, tip stopped at 0 (scene `bar-impact`).

    d'Alembert: period 3; approach 0–1 with tip speed −1/2, contact 1–2 with force 1/2 and impulse 1/2, release 2–3;
    energy 1/8. (EI → ∞ keeps θ = 0, so that the Timoshenko beam is this bar.)

    P1 elements disperse, ω ≈ k (1 + k²h²/24): after the time t a front is an integrated Airy function of the width
    (t h²/8)^⅓, which overshoots; and the tip, let go, moves in ripples of the relative size √(2/π)(ω_c t)^(−3/2),
    ω_c = √12/h (see `added_mass`). The tip's own mass is stopped at once, and its energy lost.
    """
    h = 1.0 / n
    scene = with_changes(load_scene("bar-impact"), beam={"n_elements": n}, coupling={"macro_step": 0.5 * h})
    run = simulate(scene)
    begins = [event.time for event in run.events if event.kind == "seated"]
    ends = [event.time for event in run.events if event.kind == "separation"]
    begin, end = (begins[0], ends[-1]) if begins and ends else (nan, nan)
    time, force, tip = run["time"], run["foundation_force"], run["u_tip"]
    impulse = float(force[1:] @ np.diff(time)) + sum(event.impulse_foundation for event in run.events)
    held = (time > begin) & (time < end) & (run["phase"] == "seated")

    x = sqrt(12.0) * n  # ω_c t at contact
    ripples = sqrt(2.0 / pi) * x**-1.5 * (1.0 + 2.0 / x)
    front = {t: (t * h * h / 8.0) ** (1.0 / 3.0) for t in (2.0, 3.0)}
    duration = front[2.0] + scene.coupling.H + ripples
    energy_of_tip = 0.5 * h / (2.0 * sqrt(3.0)) * (0.5 * _airy_overshoot()) ** 2

    returning = "P1 spreads the returning front to the Airy width (t h²/8)^⅓, t = 2, seen to H"
    rows = (
        ("contact begins [s]", 1.0, begin, ripples, "P1 ripples of the tip √(2/π)(ω_c t)^(−3/2), ω_c = √12/h"),
        ("contact ends [s]", 2.0, end, duration, returning),
        ("contact lasts [s]", 1.0, end - begin, duration + ripples, returning),
        ("impulse [N·s]", 0.5, impulse, 0.5 * duration, "force 1/2 for the error of the duration"),
        (
            "u_tip in contact [m]",
            0.0,
            float(np.abs(tip[held]).max()) if held.any() else nan,
            scene.coupling.tolerance,
            "coupling.tolerance of the motion in a step, which is < 1 m",
        ),
        ("u_tip(3) [m]", 0.5, float(tip[-1]), front[3.0], "velocity turns by 1 m/s over the Airy width at t = 3"),
        (
            "energy at t = 3 [J]",
            0.125,
            float(run["e_beam"][-1]),
            energy_of_tip,
            "kinetic energy of the mass h/2√3 that the tip stops with: speed 1/2 times Airy's overshoot 1.27",
        ),
    )
    for row in rows:
        yield Check(f"n = {n}: {row[0]}", *row[1:])


def _airy_overshoot() -> float:
    """Return the largest value of a dispersed unit step, ∫ Ai from Ai's first zero to ∞: 1.274."""
    return float(1.0 / 3.0 + itairy(-ai_zeros(1)[0][0])[2])
