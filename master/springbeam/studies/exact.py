"""Exact solutions of a spring, and of two bodies under an interface law, for `verify` and the tests of the references.

Two free masses meet: with the reduced mass μ = 1/(1/m₁ + 1/m₂) the penetration follows μ p̈ = −C(p, ṗ), from p = 0 and
ṗ = v. Hunt & Crossley's C = λ p^q (1 + χ ṗ) separates, with w = ṗ along p::

    μ w dw/(1 + χ w) = −λ p^q dp,     G(w) = (χ w − ln(1 + χ w))/χ²,     G(w) = G(v) − λ p^{q+1}/(q + 1)μ

so that G = 0 at the largest penetration, and the ends part with −w, G(w) = G(v), w < 0 (χ → 0: G = w²/2, w = −v).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import block_diag, expm
from scipy.special import beta, ellipk, lambertw

from ..scene import Beam, Scene, scene_from_dict

#: Stiffness [N, N·m²] that leaves the tip of a beam a free mass for a second, and rotary inertia that keeps θ at rest.
_LIMP, _RIGID = 1e-13, 1e14


def duffing_period(k1: float, k2: float, amplitude: float) -> float:
    """Return the period [s] of the undamped ÿ + k1 y + k2 y³ = 0 of a unit mass, from rest at ``amplitude`` [m].

    Hardening: y = A cn(ωt|μ), ω² = k1 + k2A², μ = k2A²/2ω². Softening: y = A sn(ωt + K|μ), ω² = k1 + k2A²/2,
    μ = −k2A²/2ω². Period 4K(μ)/ω.
    """
    omega2 = k1 + k2 * amplitude**2 * (1.0 if k2 > 0.0 else 0.5)
    return float(4.0 * ellipk(abs(k2) * amplitude**2 / (2.0 * omega2)) / np.sqrt(omega2))


class Impact(NamedTuple):
    """Two free masses on normal compliance."""

    penetration: float  #: largest p [m]
    duration: float | None  #: of the contact [s]; ``None`` with damping, where no closed form is known
    rebound: float  #: speed at which they part [m/s]
    dissipated: float  #: [J]


def impact(mass: float, speed: float, stiffness: float, exponent: float, damping: float = 0.0) -> Impact:
    """Return how a reduced mass [kg] at ``speed`` [m/s] meets λ_nc = ``stiffness`` [N/m^q], q = ``exponent``, χ [s/m].

    T = 2 p_max/v · B(1/(q+1), ½)/(q+1) without damping.
    """
    q = exponent
    if damping == 0.0:
        largest = ((q + 1.0) * mass * speed**2 / (2.0 * stiffness)) ** (1.0 / (q + 1.0))
        return Impact(largest, float(2.0 * largest / speed * beta(1.0 / (q + 1.0), 0.5) / (q + 1.0)), speed, 0.0)
    G = damping * speed - np.log1p(damping * speed)
    largest = ((q + 1.0) * mass * G / (stiffness * damping**2)) ** (1.0 / (q + 1.0))
    # x = 1 + χ w < 1 with x − ln x = 1 + G, that is −x e^{−x} = −e^{−1−G}.
    rebound = float((1.0 + lambertw(-np.exp(-1.0 - G)).real) / damping)
    return Impact(float(largest), None, rebound, 0.5 * mass * (speed**2 - rebound**2))


def free_masses(
    tip_mass: float, mass: float, speed: float, t_end: float, contact: dict[str, Any], **coupling: Any
) -> Scene:
    """Return a scene in which a tip of ``tip_mass`` [kg] meets a free ``mass`` [kg] at t = 0 with ``speed`` [m/s].

    The beam is one linear element, whose tip has ρAL/3, too limp to hold it.
    """
    beam = {**Beam.ones(), "density": 3.0 * tip_mass, "young_modulus": _LIMP, "shear_modulus": _LIMP, "n_elements": 1}
    return scene_from_dict(
        {
            "time": {"t_end": t_end},
            "beam": {**beam, "initial_velocity_slope": -speed},
            "spring": {"mass": mass, "linear_stiffness": 0.0},
            "contact": contact,
            "coupling": coupling,
        }
    )


def linked_masses(stiffness: float, damping: float, t_end: float, **coupling: Any) -> Scene:
    """Return a scene of two unit masses, each held by 4π² N/m, on a link [N/m, N·s/m]; the tip starts at 1 m."""
    link, own = {"law": "link", "stiffness": stiffness, "damping": damping}, 4.0 * np.pi**2
    return _held_masses(own, own, link, t_end, {"initial_deflection_slope": 1.0}, coupling)


def tied_masses(tip: float, top: float, t_end: float, **coupling: Any) -> Scene:
    """Return a scene of two unit masses, held by ``tip`` and ``top`` [N/m] and tied; the tip starts with −1 m/s."""
    return _held_masses(tip, top, {"law": "tie"}, t_end, {"initial_velocity_slope": -1.0}, coupling)


def _held_masses(
    tip: float, top: float, contact: dict[str, Any], t_end: float, start: dict[str, float], coupling: dict[str, Any]
) -> Scene:
    """A scene of unit masses held by ``tip`` and ``top`` [N/m].

    The beam is one linear element that can shear only: a huge rotary inertia keeps θ = 0.
    """
    beam = {**Beam.ones(), "density": 3.0, "second_moment_of_area": _RIGID, "shear_modulus": tip, "n_elements": 1}
    return scene_from_dict(
        {
            "time": {"t_end": t_end},
            "beam": {**beam, **start},
            "spring": {"mass": 1.0, "linear_stiffness": top},
            "contact": contact,
            "coupling": coupling,
        }
    )


def linked(scene: Scene, M: np.ndarray, K: np.ndarray, q: np.ndarray, v: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return (u, y) [m] at ``times`` [s], shape (len(times), 2), of a beam on a linear spring and a link.

    ``M``, ``K`` are the matrices of the beam, whose last unknown is the tip; ``q``, ``v`` its state at the start.
    Exact: M q̈ + (α_b K + c gᵀg) q̇ + (K + λ gᵀg) q = F with the spring's unknown added, p = g q.
    """
    assert scene.beam is not None
    assert scene.spring is not None
    spring, law, n = scene.spring, scene.contact, len(M) + 1
    joint = np.pad([[1.0, -1.0], [-1.0, 1.0]], (n - 2, 0))  # gᵀg
    mass = block_diag(M, spring.mass)
    damping = block_diag(scene.beam.alpha_b * K, spring.damping) + law.damping * joint
    stiffness = block_diag(K, spring.linear_stiffness) + law.stiffness * joint
    load = np.append(np.zeros(n - 1), spring.external_force)[:, None]
    rates = np.linalg.solve(mass, np.hstack([-stiffness, -damping, load]))
    A = np.vstack([np.eye(n, 2 * n + 1, n), rates, np.zeros(2 * n + 1)])  # of displacements, velocities and 1
    start = np.concatenate([q, [spring.equilibrium], v, [spring.initial_velocity, 1.0]])
    return np.array([(expm(A * t) @ start)[[n - 2, n - 1]] for t in times])
