"""Statics of the clamped Timoshenko beam, exact, and its lowest frequency: no mesh, closed under quadrature.

With t = L − x the distance from the tip, a tip force of 1 N has the shear force 1 and the moment t; the loads of a
scene, p(t) = f_b + c (1 − t/h)₊ [N/m] (c the ``tip_load_coefficient``, h the last element's length), have

    Q(t) = ∫₀ᵗ p,     M(t) = ∫₀ᵗ Q.

Deflections are virtual work, u(x_j) = ∫ M m_j/EI + Q q_j/KAG dt, with m_j = (t − t_j)₊ and q_j = 1 for t > t_j.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache, partial

import numpy as np

from .tables import Beam, Spring

#: Positions at which the beam's shape is sampled, as fractions of its length.
SHAPE_POINTS = np.linspace(0.0, 1.0, 21)

#: Gauss–Legendre on [0, 1], exact to degree 7: M² has degree 6.
_NODES = (np.polynomial.legendre.leggauss(4)[0] + 1) / 2
_WEIGHTS = np.polynomial.legendre.leggauss(4)[1] / 2
_RITZ_DEGREE = 6


def bending_stiffness(beam: Beam) -> float:
    """Return EI [N·m²]."""
    return beam.young_modulus * beam.second_moment_of_area


def shear_stiffness(beam: Beam) -> float:
    """Return KAG [N]."""
    return beam.shear_coefficient * beam.area * beam.shear_modulus


def tip_compliance(beam: Beam) -> float:
    """Return the tip deflection under a tip force, L³/3EI + L/KAG [m/N]."""
    return beam.length**3 / (3.0 * bending_stiffness(beam)) + beam.length / shear_stiffness(beam)


def tip_force_shape(beam: Beam, fractions: np.ndarray) -> np.ndarray:
    """Return the deflection [m/N] at x = ``fractions``·L under a tip force, x/KAG + x²(3L − x)/6EI."""
    x = fractions * beam.length
    return x / shear_stiffness(beam) + x**2 * (3.0 * beam.length - x) / (6.0 * bending_stiffness(beam))


def tip_inertia(beam: Beam) -> float:
    """Return the tip mass [kg] of a beam that moves in the shape of a tip force (Rayleigh): 33/140 ρAL if slender."""
    x = beam.length * _NODES
    turn = (beam.length * x - x**2 / 2.0) / bending_stiffness(beam)
    shape = tip_force_shape(beam, _NODES)
    inertia = beam.second_moment_of_area / beam.area
    density = beam.density * beam.area * (shape**2 + inertia * turn**2)
    return beam.length * float(_WEIGHTS @ density) / tip_compliance(beam) ** 2


def initial_kinetic_energy(beam: Beam) -> float:
    """Return the kinetic energy [J] of u̇ = s₁ x, in which the beam starts."""
    return beam.density * beam.area * beam.length**3 * beam.initial_velocity_slope**2 / 6.0


@lru_cache(maxsize=64)
def lowest_frequency(beam: Beam) -> float:
    """Return the lowest frequency, clamped and free [rad/s], by Ritz's method.

    θ and the shear strain u' − θ are polynomials: with them the stiffness has no differences of large numbers, however
    slender the beam; and 1/ω² is the largest eigenvalue of the inertia against it.
    """
    nodes, weights = np.polynomial.legendre.leggauss(_RITZ_DEGREE + 2)  # exact for their products
    x = 0.5 * (nodes[:, None] + 1.0)
    L = beam.length
    n = np.arange(1, _RITZ_DEGREE + 1)
    zero = np.zeros((len(x), _RITZ_DEGREE))
    # The strains are scaled so that their energy is that of the rotations.
    small = np.sqrt(bending_stiffness(beam) / shear_stiffness(beam)) / L
    u = np.hstack([L * x ** (n + 1) / (n + 1), small * L * x**n])
    theta = np.hstack([x**n, zero])
    curvature = np.hstack([n * x ** (n - 1) / L, zero])
    strain = np.hstack([zero, small * n * x ** (n - 1)])
    area = beam.density * beam.area
    inertia = beam.density * beam.second_moment_of_area
    rows = ((area, u), (inertia, theta)), ((bending_stiffness(beam), curvature), (shear_stiffness(beam), strain))
    mass, stiffness = (sum(c * (B.T * weights) @ B for c, B in energy) for energy in rows)
    # By numpy: scipy takes longer to load than everything else that reads a scene.
    to_unit_stiffness = np.linalg.inv(np.linalg.cholesky(stiffness))
    largest = np.linalg.eigvalsh(to_unit_stiffness @ mass @ to_unit_stiffness.T)[-1]
    return float(1.0 / np.sqrt(largest))


def load_shape(beam: Beam, fractions: np.ndarray) -> np.ndarray:
    """Return the deflection [m] at x = ``fractions``·L under the loads."""

    def under(end: float) -> float:
        return _work(beam, end, lambda t: (np.ones_like(t), t - end))  # the forces of 1 N at the distance ``end``

    return np.array([under(end) for end in (beam.length * (1.0 - fractions)).tolist()])


def tip_load_deflection(beam: Beam) -> float:
    """Return the tip deflection under the loads [m]."""
    return float(load_shape(beam, np.ones(1))[0])


def load_energy(beam: Beam) -> float:
    """Return the work of the loads on their own deflection, ∫ M²/EI + Q²/KAG [J], twice the energy they store."""
    return _work(beam, 0.0, partial(load_forces, beam))


def load_forces(beam: Beam, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (Q, M) of the loads at the distances ``t`` from the tip [N, N·m]."""
    f = beam.distributed_load
    c = beam.tip_load_coefficient
    h = beam.length / beam.n_elements
    s = np.minimum(t, h)
    force = c * (s - s**2 / (2.0 * h))
    return f * t + force, f * t**2 / 2.0 + c * (s**2 / 2.0 - s**3 / (6.0 * h)) + c * h / 2.0 * (t - s)


def _work(beam: Beam, start: float, virtual: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]) -> float:
    """Return ∫ M m/EI + Q q/KAG dt from ``start`` to the clamp; ``virtual`` gives q and m at the distances t."""
    h = beam.length / beam.n_elements
    total = 0.0
    for a, b in ((start, max(start, h)), (max(start, h), beam.length)):
        t = a + (b - a) * _NODES
        (Q, M) = load_forces(beam, t)
        q, m = virtual(t)
        density = M * m / bending_stiffness(beam) + Q * q / shear_stiffness(beam)
        total += (b - a) * float(_WEIGHTS @ density)
    return total


@lru_cache(maxsize=64)
def tip_reach(beam: Beam) -> float:
    """Estimate the largest deflection of the tip [m].

    It is the static one under the loads, or one that stores the kinetic energy of the start.
    """
    swing = math.sqrt(2.0 * initial_kinetic_energy(beam) * tip_compliance(beam))
    return max(swing, abs(tip_load_deflection(beam)))


def resting_height(spring: Spring, force: float) -> float | None:
    """Return the equilibrium [m] of the spring's top under an upward ``force`` [N], k1 x + k2 x³ = F.

    Of several it is the stable one nearest to Ψ, which is itself one where no force acts at any height; ``None`` if
    there is none.
    """
    roots = np.roots([spring.cubic_stiffness, 0.0, spring.linear_stiffness, -force])
    heights = spring.unloaded + roots.real[roots.imag == 0.0]
    # Where the stiffness vanishes too, that of higher order decides.
    stable = [y for y in heights.tolist() if (spring.stiffness(y), spring.cubic_stiffness) > (0.0, 0.0)]
    if force == spring.linear_stiffness == spring.cubic_stiffness == 0.0:
        return spring.equilibrium
    return min(stable, key=lambda y: abs(y - spring.equilibrium), default=None)


def mesh_compliance(beam: Beam) -> float:
    """Return the tip deflection under a tip force of the mesh, or of the beam without inertia, which has none [m/N]."""
    compliance = tip_compliance(beam)
    if beam.fidelity == "quasi_static" or beam.element_degree > 2:
        return compliance
    h = beam.length / beam.n_elements
    bending = bending_stiffness(beam)
    ratio = shear_stiffness(beam) * h**2 / bending
    missing = beam.length * h**2 / (12.0 * bending)
    if beam.element_degree == 2:
        return compliance if beam.reduced_integration else compliance - missing / (1.0 + 60.0 / ratio)
    return compliance - missing if beam.reduced_integration else compliance / (1.0 + ratio / 12.0)


def locking(beam: Beam) -> float:
    """Return the static tip stiffness of the mesh over that of the beam (model.md, "Locking")."""
    return tip_compliance(beam) / mesh_compliance(beam)
