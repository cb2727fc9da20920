"""Both FMUs' events: an elastic bar on a rigid stop."""

from __future__ import annotations

from collections.abc import Iterator
from math import nan, pi, sqrt
from typing import Any

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
    middle = force[(time > 1.25) & (time < 1.75)]

    x = sqrt(12.0) * n  # ω_c t at contact
    ripples = sqrt(2.0 / pi) * x**-1.5 * (1.0 + 2.0 / x)
    front = {t: (t * h * h / 8.0) ** (1.0 / 3.0) for t in (2.0, 3.0)}
    duration = front[2.0] + scene.coupling.H + ripples
    energy_of_tip = 0.5 * h / (2.0 * sqrt(3.0)) * (0.5 * _airy_overshoot()) ** 2

    returning = "P1 spreads the returning front to the Airy width (t h²/8)^⅓, t = 2, seen to H"
    not_judged = "from 1.25 to 1.75 s, not judged: the force of plain enforcement need not converge at any one time"
    rows: tuple[tuple[str, float, float, float | None, str], ...] = (
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
        ("force, mean [N]", 0.5, float(middle.mean()), None, not_judged),
        ("force, least [N]", 0.5, float(middle.min()), None, not_judged),
        ("force, most [N]", 0.5, float(middle.max()), None, not_judged),
    )
    for row in rows:
        yield Check(f"n = {n}: {row[0]}", *row[1:])


_N = 50
_BEAMS: dict[str, dict[str, Any]] = {
    f"consistent mass, n = {_N}": {"n_elements": _N, "mass_matrix": "consistent"},
    f"averaged mass, n = {_N}": {"n_elements": _N, "mass_matrix": "averaged"},
    f"{2 * _N} exact modes": {"mesh": "none", "n_modes": 2 * _N},
}


@section("Impact: ringing of the force on the bar's stop", *_BEAMS.items())
def ringing(name: str, beam: dict[str, Any]) -> Iterator[Check]:
    """The force of `bar_impact` from 1.2 to 1.8 s, between the fronts, is 1/2.

    Averaged, ω ≈ k (1 − k⁴h⁴/480), and exact frequencies ring much less.
    """
    coupling = {"macro_step": 0.25 / _N, "degree": 2}
    run = simulate(with_changes(load_scene("bar-impact"), time={"t_end": 1.8}, beam=beam, coupling=coupling))
    force = run["foundation_force"][run["time"] > 1.2]
    found = float(np.sqrt(np.mean((force / 0.5 - 1.0) ** 2)))
    if beam.get("mass_matrix") == "consistent":
        yield Check(name, 0.0, found, None, "not judged: short waves are too fast")
    else:
        yield Check(name, 0.0, found, 0.01, "L2 over 1/2: 1 % from 50 elements or 100 modes on")


@section("Impact: bouncing bar of Doyen, Ern & Piperno 2011 (L = 10, E = 900, ρ = 1)")
def bouncing_bar() -> Iterator[Check]:
    """The contact lasts 2L/c."""
    reason = (
        "not representable. 2L/c is the way to the free far end and back; the beam FMU is clamped there, and u(0) = 0 "
        "reflects the wave with the other sign"
    )
    yield Check("contact lasts [s]", 2.0 * 10.0 / sqrt(900.0), None, None, reason)


def _airy_overshoot() -> float:
    """Return the largest value of a dispersed unit step, ∫ Ai from Ai's first zero to ∞: 1.274."""
    return float(1.0 / 3.0 + itairy(-ai_zeros(1)[0][0])[2])
