"""What a check is, and each FMU alone: statics and frequencies of the beam; a Duffing spring.

The beam has ρA = ρI = L = 1, EI = KAG = κ, unless a function says otherwise; SI units.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise, product
from math import cos, pi, sqrt
from typing import Any

import numpy as np
from scipy.linalg import expm, hankel, svd
from scipy.optimize import brentq
from scipy.special import ellipk

from springbeam.bodies.fmu_bodies import FmuBeam
from springbeam.bodies.protocol import NO_FORCE, StepRefused
from springbeam.run.outcome import RunStopped
from springbeam.run.runner import run_in_memory
from springbeam.scene import Beam, Spring, scene_from_dict
from springbeam.studies.tables import difference

EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Check:
    """One number that is known exactly, and its value by the FMUs.

    Parameters
    ----------
    quantity
        What is compared, with its unit.
    exact, computed
        The two values; ``computed`` is ``None`` where the FMUs gave none.
    bound
        Largest \\|computed − exact\\| that passes.
    reason
        Where the bound comes from.
    """

    quantity: str
    exact: float | None
    computed: float | None
    bound: float
    reason: str

    @property
    def error(self):
        """computed − exact."""
        return difference(self.computed, self.exact)

    @property
    def passed(self):
        """Whether the error is within the bound; NaN is not."""
        return self.error is not None and abs(self.error) <= self.bound


@dataclass(frozen=True)
class Section:
    """An exact solution, and the cases in which the FMUs compute it, each by itself."""

    title: str
    solution: Callable[..., Iterator[Check]]
    cases: tuple[tuple[Any, ...], ...]  #: what the solution is called with

    def __call__(self):
        """Yield the checks of all cases; a case that cannot be computed is a failed check."""
        for case in self.cases:
            try:
                yield from self.solution(*case)
            except (StepRefused, RunStopped) as error:
                given = f"{', '.join(map(str, case))}: " * bool(case)
                yield Check("not computed", None, None, 0.0, f"{given}{error}")


def section(title, *cases):
    """Return what makes a `Section` of an exact solution; without ``cases`` it is called once."""
    return lambda solution: Section(title, solution, cases or ((),))


# -- each FMU alone --------------------------------------------------------------------------------------------------

#: Half the rows in which frequencies are looked for, and what of them is rounding.
_SAMPLES, _ROUNDING = 300, 1e-11
_VARIANTS = {
    "full, all modes": {},
    "full, 1 mode": {"n_modes": 1},
    "reduced, all modes": {"reduced_integration": True},
    "reduced, 1 mode": {"reduced_integration": True, "n_modes": 1},
}


@section("Beam: static deflection of the tip, locking", *product((1.0, 1e6), _VARIANTS))
def static_deflection(kag, variant):
    """Tip deflection under a tip load of 1 N, of the mesh of n elements (h = L/n) and of the beam it stands for.

    Full integration: (1/3EI + 1/KAG)/(1 + KAG h²/12EI), which locks; reduced: (1 − h²/4)/3EI + 1/KAG; the beam:
    1/3EI + 1/KAG. Kelvin–Voigt damping brings the FMU to rest: its slowest rate is at least 1/2 s⁻¹ here, so that
    after 200 s what is left has decayed below e⁻¹⁰⁰.
    """
    n, h = 10, 0.1
    true = 1.0 / 3.0 + 1.0 / kag
    beam = Beam.with_ones(shear_modulus=kag, n_elements=n, alpha_b=1.0, **_VARIANTS[variant])
    if beam.reduced_integration:
        share = ((1.0 - h * h / 4.0) / 3.0 + 1.0 / kag) / true
    else:
        share = 1.0 / (1.0 + kag * h * h / 12.0)
    reason = (
        "tip deflection over that of the beam, 1/3EI + 1/KAG (n = 10). Rounding: ε N² in an eigenproblem or "
        "factorisation of N = 2n unknowns"
    )
    name, pull = f"KAG/EI {kag:g}: {variant}", {"on": "tip", "amplitude": 1.0}
    deflection = float(run_in_memory(scene_of(200.0, 1.0, [pull], beam=beam)).u_tip[-1])
    yield Check(name, share, deflection / true, (2 * n) ** 2 * EPS * share, reason)


def _bar(unknowns, mass_matrix, dispersed):
    """Return a case of `frequencies`: a bar of c = 1 (θ kept at rest by a huge ρI) on linear elements.

    ``dispersed`` is the ω h of a wave that turns by kh over h; k = (j − ½)π.
    """
    n, mesh = unknowns // 2, {"n_elements": unknowns // 2, "mass_matrix": mass_matrix}
    exact = {j: n * dispersed((j - 0.5) * pi / n) for j in (1, 3, 6)}
    return f"bar, {mass_matrix} mass", {**mesh, "second_moment_of_area": 1e14, "young_modulus": 1e3}, 0.1, exact


def _stiff(kappa):
    """Return a case of `frequencies`: EI = KAG = κ on 8 elements of degree 8, exact to rounding."""
    exact = {i: sqrt(kappa) * w for i, w in enumerate(clamped_free_frequencies()[:6], 1)}
    mesh = {"n_elements": 8, "element_degree": 8, "young_modulus": kappa, "shear_modulus": kappa}
    return f"κ = {kappa:g}", mesh, 0.1 / sqrt(kappa), exact


@lru_cache(maxsize=1)
def clamped_free_frequencies():
    """Return those up to 30 rad/s of EI = KAG = ρA = ρI = L = 1: zeros of det X, X of `free_end`."""

    def determinant(w):
        return float(np.linalg.det(free_end(expm(transfer_rate(w)))))

    grid = np.arange(0.05, 30.0, 0.05)
    values = [determinant(w) for w in grid]
    return tuple(
        float(brentq(determinant, a, b, xtol=1e-15))
        for (a, b), (p, q) in zip(pairwise(grid), pairwise(values), strict=True)
        if p * q < 0.0
    )


def free_end(across):
    """Return the part of a transfer matrix from (M, Q) at the clamp to (M, Q) at the tip, (2, 2).

    It is singular at a natural frequency.
    """
    return across[np.ix_([1, 3], [1, 3])]


def transfer_rate(w, softer=1.0):
    """Return A of (θ, M, u, Q)' = A (θ, M, u, Q) at the frequency ``w`` [rad/s]; shape (4, 4).

    θ' = M/EI,  M' = −Q − ρI ω² θ,  u' = Q/KAG + θ,  Q' = −ρA ω² u; EI = KAG = 1/``softer``, ρA = ρI = 1.
    """
    return np.array([[0, softer, 0, 0], [-w * w, 0, 0, -1], [1, 0, 0, softer], [0, 0, -w * w, 0]])


def _measured_frequencies(beam, size):
    """Return the frequencies [rad/s] in the tip's velocity after an impulse, from rows at steps of ``size`` [s].

    By ESPRIT (Roy & Kailath 1989): shifted by a row, the space that the rows span turns by the angles ωH.
    """
    with closing(FmuBeam(beam, 0.0, 0.0)) as body:
        body.apply_impulse(1.0)
        velocity = [body.motion().velocity]
        for step in range(2 * _SAMPLES):
            body.advance(step * size, size, NO_FORCE)
            velocity.append(body.motion().velocity)
    vectors, shares, _ = svd(hankel(velocity[:_SAMPLES], velocity[_SAMPLES - 1 :]))
    space = vectors[:, shares > _ROUNDING * shares[0]]
    turns = np.linalg.eigvals(np.linalg.lstsq(space[:-1], space[1:], rcond=None)[0])
    return np.asarray(np.abs(np.angle(turns)) / size)


@section(
    "Beam: clamped–free frequencies, from the motion of the tip",
    *(_stiff(kappa) for kappa in (1.0, 3.6e10)),
    _bar(100, "consistent", lambda kh: sqrt(6.0 * (1.0 - cos(kh)) / (2.0 + cos(kh)))),
    _bar(100, "averaged", lambda kh: sqrt(12.0 * (1.0 - cos(kh)) / (5.0 + cos(kh)))),
)
def frequencies(name, beam, size, exact):
    """Clamped–free frequencies of the beam, and of a bar, whose waves the mesh disperses.

    Consistent mass: ω h/c = √(6(1 − cos kh)/(2 + cos kh)), too fast by (kh)²/24 of it; averaged mass:
    √(12(1 − cos kh)/(5 + cos kh)), too slow by (kh)⁴/480.
    """
    mesh = Beam.with_ones(n_modes=6, **beam)
    measured = _measured_frequencies(mesh, size)
    for i, w in exact.items():
        nearest = float(measured[np.argmin(np.abs(measured - w))])
        yield Check(f"{name}: ω{i} [rad/s]", w, nearest, mesh.unknowns**2 * EPS * w, "rounding: ε N², N unknowns")


IDA = "IDA: BDF of order ≤ 5 takes some ε^(−1/6) internal steps a radian, each of error ε: ωT·ε^(5/6)"

_SPRINGS = ((3.0, -0.2, 0.5), (3.0, -0.2, 1.0), (150.0, 67.0, 0.5), (150.0, 67.0, 1.0))


def duffing_period(k1, k2, amplitude):
    """Return the period [s] of the undamped ÿ + k1 y + k2 y³ = 0 of a unit mass, from rest at ``amplitude`` [m].

    Hardening: y = A cn(ωt|μ), ω² = k1 + k2A², μ = k2A²/2ω². Softening: y = A sn(ωt + K|μ), ω² = k1 + k2A²/2,
    μ = −k2A²/2ω². Period 4K(μ)/ω.
    """
    omega2 = k1 + k2 * amplitude**2 * (1.0 if k2 > 0.0 else 0.5)
    return float(4.0 * ellipk(abs(k2) * amplitude**2 / (2.0 * omega2)) / np.sqrt(omega2))


@section("Spring: Duffing (k1, k2, A), from rest", *_SPRINGS)
def duffing(k1, k2, amplitude):
    """Undamped Duffing spring, m = 1, from rest at A: where it is, at rest again, after `duffing_period`.

    A period that is off by δT leaves it with ẏ = (k1 A + k2 A³) δT.
    """
    period = duffing_period(k1, k2, amplitude)
    spring = Spring.with_ones(linear_stiffness=k1, cubic_stiffness=k2, equilibrium=amplitude)
    name, relative = f"({k1:g}, {k2:g}, {amplitude:g})", ida_error(2.0 * pi)
    run = run_in_memory(scene_of(period, period / 20.0, spring=spring))
    yield Check(f"{name}: y(T) [m]", amplitude, float(run.y[-1]), relative * amplitude, IDA)
    yield Check(f"{name}: ẏ(T) [m/s]", 0.0, float(run.z[-1]), relative * amplitude * 2.0 * pi / period, IDA)


def ida_error(radians):
    """Return the relative error that IDA's tolerance ε, the default of scenes, leaves over an angle ωT: `IDA`."""
    return float(radians * Spring.with_ones().relative_tolerance ** (5.0 / 6.0))


def scene_of(t_end, macro_step, loads=(), **bodies):
    """Return a scene of ``bodies`` under ``loads`` in steps of ``macro_step`` [s], of degree 2 if it may."""
    tables = {name: body.model_dump(exclude_none=True) for name, body in bodies.items()}
    degree = 2 if all(table.get("integrator") != "midpoint" for table in tables.values()) else 0
    coupling = {"macro_step": macro_step, "degree": degree}
    return scene_from_dict({**tables, "time": {"t_end": t_end}, "coupling": coupling, "loads": list(loads)})
