"""Both FMUs under loads that vary: resonance, a pulse, a slow ramp, a moving base; SI units.

The beam has ρA = ρI = EI = KAG = L = 1 in two elements of degree 8, whose error is rounding.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import cos, pi, sin, sqrt
from typing import Any

import numpy as np
from scipy.linalg import expm
from scipy.special import spherical_jn

from ...run.runner import simulate
from ...scene import Beam, Scene, Spring, scene_from_dict
from .beam import clamped_free_frequencies, free_end, transfer_rate
from .check import EPS, Check, section

_N = 2 * 2 * 8  #: unknowns of the beam


def _scene(t_end: float, macro_step: float, loads: list[dict[str, Any]], **bodies: Any) -> Scene:
    tables = {name: body.model_dump(exclude_none=True) for name, body in bodies.items()}
    coupling = {"macro_step": macro_step, "degree": 2}
    return scene_from_dict({**tables, "time": {"t_end": t_end}, "coupling": coupling, "loads": loads})


def _beam(**changes: Any) -> Any:
    return Beam.with_ones(n_elements=2, element_degree=8, approach="elastic", **changes)


@section("Loads: a damped beam driven at its tip, amplitude and phase", (0.8,), (1.0,), (2.5,))
def resonance(factor: float) -> Iterator[Check]:
    """Amplitude and phase of the tip under a tip force of 1 N at ``factor`` ω₁, after the transient.

    Exact, of the beam itself: a transfer matrix with EI and KAG times 1 + iωα_b.
    """
    alpha, per_period = 0.4, 64
    first = clamped_free_frequencies()[0]
    w = factor * first
    H = 2.0 * pi / w / per_period
    # The slowest transient, e^{−α_b ω₁² t/2}, is below rounding of the amplitude.
    periods = int(40.0 / (0.5 * alpha * first**2) * w / (2.0 * pi)) + 1
    drive = {"on": "tip", "signal": "harmonic", "frequency": w / (2.0 * pi)}
    run = simulate(_scene(periods * per_period * H, H, [drive], beam=_beam(alpha_b=alpha)))
    last = slice(-per_period, None)
    found = 2j * np.mean(run.u_tip[last] * np.exp(-1j * w * run.time[last]))
    exact = _tip_receptance(w, alpha)
    left_out = 14.0 * float(spherical_jn(3, 0.5 * w * H)) * 4.0 / 3.0
    reason = "what a polynomial of degree 2 leaves of the sine, 7 j₃(ωH/2) each way, on the static compliance 4/3"
    yield Check(f"{factor:g} ω₁: amplitude [m]", abs(exact), abs(found), left_out, reason)
    angles = float(np.angle(exact)), float(np.angle(found))
    yield Check(f"{factor:g} ω₁: phase [rad]", *angles, left_out / abs(exact), reason)


def _tip_receptance(w: float, alpha: float) -> complex:
    """Return u(L)/C [m/N] at ``w`` [rad/s]: M = 0 and Q = C at the tip."""
    across = expm(transfer_rate(w, 1.0 / (1.0 + 1j * w * alpha)))
    start = np.linalg.solve(free_end(across), [0.0, 1.0])
    return complex(across[2, [1, 3]] @ start)


@section("Loads: half-sine pulse on an oscillator")
def pulse() -> Iterator[Check]:
    """Undamped spring, m = 1, k = 4π², under a half-sine pulse of F = 3 N and T = 0.3 s that begins off the macro grid.

    y = F/k (sin Ωt − r sin ωt)/(1 − r²) with Ω = π/T and r = Ω/ω; then it swings freely.
    """
    stiffness, force, duration, start = 4.0 * pi**2, 3.0, 0.3, 0.0123
    w, rate = sqrt(stiffness), pi / duration
    r, scale = rate / w, force / stiffness
    y = -scale * r * sin(w * duration) / (1.0 - r * r)
    z = scale * rate * (-1.0 - cos(w * duration)) / (1.0 - r * r)
    shock = {"on": "spring", "signal": "half_sine", "amplitude": force, "start": start, "duration": duration}
    run = simulate(_scene(start + duration + 1.25, 0.01, [shock], spring=Spring.with_ones(linear_stiffness=stiffness)))
    at = int(np.argmin(np.abs(run.time - start - duration)))
    bound = 1e-9 * scale
    reason = "IDA's tolerance, 1e-12 a step; the pulse loses 7 j₃(ΩH/2)² < 1e-9 of itself"
    later = (y * cos(1.25 * w) + z / w * sin(1.25 * w), z * cos(1.25 * w) - y * w * sin(1.25 * w))
    worked = 0.5 * (z * z + stiffness * y * y)
    yield Check("y at its end [m]", y, float(run.y[at]), bound, reason)
    yield Check("ẏ at its end [m/s]", z, float(run.z[at]), bound * w, reason)
    yield Check("y 1.25 s later [m]", later[0], float(run.y[-1]), bound, reason)
    yield Check("work on the spring [J]", worked, -float(run.e_load[-1]), bound * force, reason)


_RAMPS: tuple[tuple[str, dict[str, Any], float], ...] = (
    *(
        (
            f"(x/L)^{i}",
            {"on": "beam", "shape": [0.0] * i + [1.0]},
            (3.0 / (i + 3) - 1.0 / (i + 4)) / 6.0 + 1.0 / (i + 2),
        )
        for i in range(4)
    ),
    *((f"point, {a:g} L", {"on": "beam", "at": a}, a * a * (3.0 - a) / 6.0 + a) for a in (0.3, 0.75)),
    ("tip", {"on": "tip"}, 4.0 / 3.0),
    ("base", {"on": "base"}, -(1.0 / 8.0 + 1.0 / 2.0)),
)


@section("Loads: static limit of a slow ramp, EI = KAG = L = 1", *_RAMPS)
def slow_ramp(name: str, load: dict[str, Any], exact: float) -> Iterator[Check]:
    """Static deflection of the tip after each kind of load on the beam has risen to 1 and its vibration has died out.

    ∫ f (ξ²(3 − ξ)/6EI + ξ/KAG) dx, exact on any mesh that holds the static shape of a tip force.
    """
    ramp = {**load, "signal": "ramp", "duration": 3.0}
    run = simulate(_scene(200.0, 1.0, [ramp], beam=_beam(alpha_b=1.0)))
    yield Check(
        f"{name}: u_tip [m]", exact, float(run.u_tip[-1]), _N**2 * EPS, "rounding: ε N², N unknowns of the beam"
    )


@section("Loads: a moving base and the equivalent loads")
def moving_base() -> Iterator[Check]:
    """A base that accelerates by a(t) is the load −ρA a(t) on the beam and −m a(t) on the spring, through an impact."""
    beam = Beam.with_ones(density=2.0, area=1.5, n_elements=6, young_modulus=100.0, initial_velocity_slope=-1.0)
    signal = {"signal": "harmonic", "frequency": 12.0, "amplitude": 5.0}
    spring = Spring.with_ones(mass=0.7, linear_stiffness=3.0)
    equivalent = [
        {**signal, "on": "beam", "amplitude": -5.0 * 2.0 * 1.5},
        {**signal, "on": "spring", "amplitude": -5.0 * 0.7},
    ]
    runs = [
        simulate(_scene(0.2, 1e-3, loads, beam=beam, spring=spring))
        for loads in ([{**signal, "on": "base"}], equivalent)
    ]
    reason = "rounding of the modes and IDA's tolerance, 200 steps"
    for column in ("u_tip", "y", "z"):
        by_base, by_loads = (float(run[column][-1]) for run in runs)
        yield Check(f"{column}(0.2 s)", by_loads, by_base, 200 * 1e-12, reason)
