"""What a check is, and each FMU alone: statics and frequencies of the beam; a Duffing spring.

The beam has ρA = ρI = L = 1, EI = KAG = κ, unless a function says otherwise; SI units.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import lru_cache
from itertools import pairwise, product
from math import nan, pi
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq
from scipy.special import ellipk

from springbeam.bodies.protocol import StepRefused
from springbeam.run.outcome import RunStopped
from springbeam.run.runner import run_in_memory
from springbeam.scene import Beam, Spring, scene_from_dict

EPS = float(np.finfo(float).eps)


class Check(NamedTuple):
    """One number that is known exactly, and its value by the FMUs."""

    quantity: str  #: what is compared, with its unit
    exact: float
    computed: float
    bound: float  #: largest |computed − exact| that passes
    reason: str  #: where the bound comes from

    @property
    def passed(self):
        """Whether the error is within the bound; NaN is not."""
        return abs(self.computed - self.exact) <= self.bound


class Section(NamedTuple):
    """An exact solution, and the cases in which the FMUs compute it, each by itself."""

    solution: Callable[..., Iterator[Check]]
    cases: tuple[tuple[Any, ...], ...]  #: what the solution is called with

    def __call__(self):
        """Yield the checks of all cases; a case that cannot be computed is a failed check."""
        for case in self.cases:
            try:
                yield from self.solution(*case)
            except (StepRefused, RunStopped) as error:
                yield Check("not computed", nan, nan, 0.0, str(error))


def section(*cases):
    """Return what makes a `Section` of an exact solution; without ``cases`` it is called once."""
    return lambda solution: Section(solution, cases or ((),))


# -- each FMU alone --------------------------------------------------------------------------------------------------

_VARIANTS = {
    "full, all modes": {},
    "full, 1 mode": {"n_modes": 1},
    "reduced, all modes": {"reduced_integration": True},
    "reduced, 1 mode": {"reduced_integration": True, "n_modes": 1},
}


@section(*product((1.0, 1e6), _VARIANTS))
def static_deflection(kag, variant):
    """Tip deflection under a tip load of 1 N, of the mesh of n elements (h = L/n) and of the beam it stands for.

    Full integration: (1/3EI + 1/KAG)/(1 + KAG h²/12EI), which locks; reduced: (1 − h²/4)/3EI + 1/KAG; the beam:
    1/3EI + 1/KAG. Kelvin–Voigt damping brings the FMU to rest: its slowest rate is at least 1/2 s⁻¹ here, so that
    after 200 s what is left has decayed below e⁻¹⁰⁰.
    """
    n = 10
    h = 0.1
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
    pull = {"on": "tip", "amplitude": 1.0}
    deflection = float(run_in_memory(scene_of(200.0, 1.0, [pull], beam=beam)).u_tip[-1])
    yield Check("deflection", share, deflection / true, (2 * n) ** 2 * EPS * share, reason)


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


IDA = "IDA: BDF of order ≤ 5 takes some ε^(−1/6) internal steps a radian, each of error ε: ωT·ε^(5/6)"

_SPRINGS = ((3.0, -0.2, 0.5), (3.0, -0.2, 1.0), (150.0, 67.0, 0.5), (150.0, 67.0, 1.0))


def duffing_period(k1, k2, amplitude):
    """Return the period [s] of the undamped ÿ + k1 y + k2 y³ = 0 of a unit mass, from rest at ``amplitude`` [m].

    Hardening: y = A cn(ωt|μ), ω² = k1 + k2A², μ = k2A²/2ω². Softening: y = A sn(ωt + K|μ), ω² = k1 + k2A²/2,
    μ = −k2A²/2ω². Period 4K(μ)/ω.
    """
    omega2 = k1 + k2 * amplitude**2 * (1.0 if k2 > 0.0 else 0.5)
    return float(4.0 * ellipk(abs(k2) * amplitude**2 / (2.0 * omega2)) / np.sqrt(omega2))


@section(*_SPRINGS)
def duffing(k1, k2, amplitude):
    """Undamped Duffing spring, m = 1, from rest at A: where it is, at rest again, after `duffing_period`.

    A period that is off by δT leaves it with ẏ = (k1 A + k2 A³) δT.
    """
    period = duffing_period(k1, k2, amplitude)
    spring = Spring.with_ones(linear_stiffness=k1, cubic_stiffness=k2, equilibrium=amplitude)
    relative = ida_error(2.0 * pi)
    run = run_in_memory(scene_of(period, period / 20.0, spring=spring))
    yield Check("y(T) [m]", amplitude, float(run.y[-1]), relative * amplitude, IDA)
    yield Check("ẏ(T) [m/s]", 0.0, float(run.z[-1]), relative * amplitude * 2.0 * pi / period, IDA)


def ida_error(radians):
    """Return the relative error that IDA's tolerance ε, the default of scenes, leaves over an angle ωT: `IDA`."""
    return float(radians * Spring.with_ones().relative_tolerance ** (5.0 / 6.0))


def scene_of(t_end, macro_step, loads=(), **bodies):
    """Return a scene of ``bodies`` under ``loads`` in steps of ``macro_step`` [s], of degree 2 if it may."""
    tables = {name: body.model_dump(exclude_none=True) for name, body in bodies.items()}
    degree = 2 if all(table.get("integrator") != "midpoint" for table in tables.values()) else 0
    coupling = {"macro_step": macro_step, "degree": degree}
    return scene_from_dict({**tables, "time": {"t_end": t_end}, "coupling": coupling, "loads": list(loads)})
