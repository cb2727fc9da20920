"""Both FMUs coupled: ordinary exchanges, energy kept by `energy`, a bar on a stop, loads that vary; SI units."""

from __future__ import annotations

from itertools import product
from math import nan, pi, sqrt

import numpy as np
from scipy.linalg import expm
from scipy.special import ai_zeros, itairy, spherical_jn

from springbeam.run.runner import run_in_memory
from springbeam.scene import Beam, Scene, Spring, Time, load_scene, with_changes
from springbeam.scene.schemes import EnergyCoupling

from .alone import (
    EPS,
    IDA,
    Check,
    clamped_free_frequencies,
    free_end,
    ida_error,
    scene_of,
    section,
    transfer_rate,
)

#: κ [N] and H [s].
_TIED = ((1.0, 0.01), (1e4, 1e-3), (1e4, 0.1))


@section(
    *((*pair, degree, "modal", 0.0) for pair, degree in product(_TIED, (0, 1, 2))),
    *((1e4, 0.02, 0, *body) for body in (("modal", 1e-4), ("midpoint", 0.0), ("midpoint", 1e-4))),
)
def energy_scheme(kappa, size, degree, integrator, alpha):
    """Beam and nonlinear spring, tied: the `energy` scheme keeps the energy but what damping takes, whatever H.

    A constant load pulls the spring down from rest, so that the pair swings below Ψ and stays tied.
    """
    steps = 100
    n = 50
    reason = "relative drift in 100 steps: coupling.tolerance of each step's work, at most twice the energy; and " + IDA
    spring = Spring.with_ones(linear_stiffness=3.0, cubic_stiffness=100.0, external_force=-0.1 * kappa)
    stiff = Beam.with_ones(young_modulus=kappa, shear_modulus=kappa, n_elements=n)
    scene = Scene(
        time=Time(t_end=steps * size),
        beam=stiff.model_copy(update={"integrator": integrator, "alpha_b": alpha}),
        spring=spring,
        coupling=EnergyCoupling(scheme="energy", degree=degree, macro_step=size),
    )
    run = run_in_memory(scene)
    stiffness = spring.linear_stiffness + 3.0 * spring.cubic_stiffness * float(np.abs(run["y"]).max()) ** 2
    bound = 2.0 * steps * scene.coupling.tolerance + ida_error(sqrt(stiffness / spring.mass) * steps * size)
    drift = float(run.summary["max_energy_residual"]) if np.all(run["phase"] == "tied") else nan
    yield Check("drift", 0.0, drift, bound, reason)


@section((100,))
def bar_impact(n):
    """Elastic bar on a rigid stop: u_tt = u_xx, u(0) = 0, u⁰ = x/2, u_t⁰ = 0, tip stopped at 0 (scene `bar-impact`).

    d'Alembert: period 3; approach 0–1 with tip speed −1/2, contact 1–2 with force 1/2 and impulse 1/2, release 2–3;
    energy 1/8. (EI → ∞ keeps θ = 0, so that the Timoshenko beam is this bar.)

    P1 elements disperse, ω ≈ k (1 + k²h²/24): after the time t a front is an integrated Airy function of the width
    (t h²/8)^⅓, which overshoots; and the tip, let go, moves in ripples of the relative size √(2/π)(ω_c t)^(−3/2),
    ω_c = √12/h, around the bar's. The tip's own mass is stopped at once, and its energy lost.
    """
    h = 1.0 / n
    scene = with_changes(load_scene("bar-impact"), beam={"n_elements": n}, coupling={"macro_step": 0.5 * h})
    run = run_in_memory(scene)
    begins = [event.time for event in run.events if event.kind == "seated"]
    ends = [event.time for event in run.events if event.kind == "separation"]
    begin, end = (begins[0], ends[-1]) if begins and ends else (nan, nan)
    tip = run["u_tip"]
    impulse = float(run.foundation_force[1:] @ np.diff(run.time)) + sum(
        event.impulse_foundation for event in run.events
    )

    x = sqrt(12.0) * n  # ω_c t at contact
    ripples = sqrt(2.0 / pi) * x**-1.5 * (1.0 + 2.0 / x)
    front = {t: (t * h * h / 8.0) ** (1.0 / 3.0) for t in (2.0, 3.0)}
    duration = front[2.0] + scene.coupling.H + ripples
    energy_of_tip = 0.5 * h / (2.0 * sqrt(3.0)) * (0.5 * _airy_overshoot()) ** 2

    returning = "P1 spreads the returning front to the Airy width (t h²/8)^⅓, t = 2, seen to H"
    rows = (
        ("contact begins [s]", 1.0, begin, ripples, "P1 ripples of the tip √(2/π)(ω_c t)^(−3/2), ω_c = √12/h"),
        ("contact ends [s]", 2.0, end, duration, returning),
        ("impulse [N·s]", 0.5, impulse, 0.5 * duration, "force 1/2 for the error of the duration"),
        ("u_tip(3) [m]", 0.5, float(tip[-1]), front[3.0], "velocity turns by 1 m/s over the Airy width at t = 3"),
        (
            "energy at t = 3 [J]",
            0.125,
            float(run["e_beam"][-1]),
            energy_of_tip,
            "kinetic energy of the mass h/2√3 that the tip stops with: speed 1/2 times Airy's overshoot 1.27",
        ),
    )
    yield from (Check(*row) for row in rows)


def _airy_overshoot():
    """Return the largest value of a dispersed unit step, ∫ Ai from Ai's first zero to ∞: 1.274."""
    return float(1.0 / 3.0 + itairy(-ai_zeros(1)[0][0])[2])


_N = 2 * 2 * 8  #: unknowns of the beam


def _beam(**changes):
    return Beam.with_ones(n_elements=2, element_degree=8, approach="elastic", **changes)


@section((0.8,), (1.0,), (2.5,))
def resonance(factor):
    """Amplitude and phase of the tip under a tip force of 1 N at ``factor`` ω₁, after the transient.

    Exact, of the beam itself: a transfer matrix with EI and KAG times 1 + iωα_b.
    """
    alpha = 0.4
    per_period = 64
    first = clamped_free_frequencies()[0]
    w = factor * first
    H = 2.0 * pi / w / per_period
    # The slowest transient, e^{−α_b ω₁² t/2}, is below rounding of the amplitude.
    periods = int(40.0 / (0.5 * alpha * first**2) * w / (2.0 * pi)) + 1
    drive = {"on": "tip", "signal": "harmonic", "frequency": w / (2.0 * pi)}
    run = run_in_memory(scene_of(periods * per_period * H, H, [drive], beam=_beam(alpha_b=alpha)))
    last = slice(-per_period, None)
    found = 2j * np.mean(run.u_tip[last] * np.exp(-1j * w * run.time[last]))
    exact = _tip_receptance(w, alpha)
    left_out = 14.0 * float(spherical_jn(3, 0.5 * w * H)) * 4.0 / 3.0
    reason = "what a polynomial of degree 2 leaves of the sine, 7 j₃(ωH/2) each way, on the static compliance 4/3"
    yield Check("amplitude [m]", abs(exact), abs(found), left_out, reason)
    angles = float(np.angle(exact)), float(np.angle(found))
    yield Check("phase [rad]", *angles, left_out / abs(exact), reason)


def _tip_receptance(w, alpha):
    """Return u(L)/C [m/N] at ``w`` [rad/s]: M = 0 and Q = C at the tip."""
    across = expm(transfer_rate(w, 1.0 / (1.0 + 1j * w * alpha)))
    start = np.linalg.solve(free_end(across), [0.0, 1.0])
    return complex(across[2, [1, 3]] @ start)


_RAMPS = (
    *(
        (
            {"on": "beam", "shape": [0.0] * i + [1.0]},
            (3.0 / (i + 3) - 1.0 / (i + 4)) / 6.0 + 1.0 / (i + 2),
        )
        for i in range(4)
    ),
    *(({"on": "beam", "at": a}, a * a * (3.0 - a) / 6.0 + a) for a in (0.3, 0.75)),
    ({"on": "tip"}, 4.0 / 3.0),
    ({"on": "base"}, -(1.0 / 8.0 + 1.0 / 2.0)),
)


@section(*_RAMPS)
def slow_ramp(load, exact):
    """Static deflection of the tip after a load has risen to 1 and its vibration has died out, EI = KAG = L = 1.

    ∫ f (ξ²(3 − ξ)/6EI + ξ/KAG) dx, exact on any mesh that holds the static shape of a tip force.
    """
    ramp = {**load, "signal": "ramp", "duration": 3.0}
    run = run_in_memory(scene_of(200.0, 1.0, [ramp], beam=_beam(alpha_b=1.0)))
    yield Check("u_tip [m]", exact, float(run.u_tip[-1]), _N**2 * EPS, "rounding: ε N², N unknowns of the beam")
