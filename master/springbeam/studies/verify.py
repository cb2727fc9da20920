"""Exact solutions, asked of the FMUs themselves: ``springbeam verify``.

Every function of `SECTIONS` computes one exact solution from its formula, has ``beam.fmu`` and ``spring.fmu`` (alone,
or in a scene) compute the same, and returns the comparison as a list of `Check`. A bound follows from what the method
leaves out, the discretisation's leading error, the solver's tolerance or rounding, and says which; none is fitted.

The beam of the exact solutions has ρA = ρI = L = 1, EI = KAG = κ, unless a function says otherwise; SI units.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from math import isnan, log, nan, pi, sqrt
from time import perf_counter
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text
from scipy.integrate import quad
from scipy.linalg import expm
from scipy.optimize import brentq
from scipy.special import ai_zeros, ellipk, itairy, j0

from ..bodies.fmu import FmuError, Reals
from ..bodies.fmu_bodies import FmuBeam, FmuSpring
from ..bodies.protocol import NO_FORCE, StepRefused
from ..run.outcome import RunStopped
from ..run.runner import simulate
from ..scene import Beam, Coupling, Scene, Spring, Time, load_scene, with_changes

_EPS = float(np.finfo(float).eps)
_UNIT_FORCE = (1.0, 0.0, 0.0)


@dataclass(frozen=True)
class Check:
    """One number that is known exactly, and what the FMUs make of it.

    Parameters
    ----------
    quantity
        What is compared, with its unit.
    exact, computed
        The two values; ``computed`` is ``None`` where the FMUs gave none.
    bound
        Of \\|computed − exact\\|; ``None`` if the number is reported, not judged.
    reason
        Where the bound comes from, or why there is none.
    """

    quantity: str
    exact: float | None
    computed: float | None
    bound: float | None
    reason: str

    @property
    def error(self) -> float | None:
        """computed − exact."""
        return None if self.exact is None or self.computed is None else self.computed - self.exact

    @property
    def passed(self) -> bool | None:
        """Whether the error is within the bound; ``None`` if the check is not judged. NaN does not pass."""
        if self.bound is None:
            return None
        return self.error is not None and abs(self.error) <= self.bound


# -- beam -----------------------------------------------------------------------------------------------------------


def static_deflection() -> list[Check]:
    """Tip deflection under a tip force of 1 N, of the mesh of n elements (h = L/n) and of the beam it stands for.

    Full integration: (1/3EI + 1/KAG)/(1 + KAG h²/12EI), which locks; reduced: (1 − h²/4)/3EI + 1/KAG; the beam:
    1/3EI + 1/KAG. Kelvin–Voigt damping brings the FMU to rest: its slowest rate is at least 1/2 s⁻¹ here.
    """
    n, h, checks = 10, 0.1, []
    for ratio_name, kag in (("1", 1.0), ("1e6", 1e6)):
        true = 1.0 / 3.0 + 1.0 / kag
        full, reduced = true / (1.0 + kag * h * h / 12.0), (1.0 - h * h / 4.0) / 3.0 + 1.0 / kag
        variants: tuple[tuple[str, float, dict[str, Any]], ...] = (
            ("full, all modes", full, {}),
            ("full, 1 mode", full, {"n_modes": 1}),
            ("full, ρ∞ = 0", full, {"integrator": "generalized_alpha", "rho_inf": 0.0}),
            ("reduced, all modes", reduced, {"reduced_integration": True}),
            ("reduced, 1 mode", reduced, {"reduced_integration": True, "n_modes": 1}),
        )
        for name, exact, options in variants:
            beam = Beam(shear_modulus=kag, n_elements=n, alpha_b=1.0, **options)
            with closing(FmuBeam(beam, 0.0, 0.0)) as body:
                # 200 s: what is left has decayed below e⁻¹⁰⁰, and generalized-α damps every step.
                for step in range(200):
                    body.advance(float(step), 1.0, _UNIT_FORCE)
                ratio = body.motion().displacement / true
            checks.append(
                Check(
                    f"KAG/EI {ratio_name}: {name}",
                    exact / true,
                    ratio,
                    (2 * n) ** 2 * _EPS * exact / true,
                    "tip deflection over that of the beam, 1/3EI + 1/KAG (n = 10). Rounding: ε N² in an eigenproblem "
                    "or factorisation of N = 2n unknowns",
                )
            )
    return checks


def _transfer_rate(w: float) -> np.ndarray:
    """A of (θ, M, u, Q)' = A (θ, M, u, Q) at the frequency ``w`` [rad/s]; EI = KAG = ρA = ρI = 1; shape (4, 4).

    θ' = M/EI,  M' = −Q − ρI ω² θ,  u' = Q/KAG + θ,  Q' = −ρA ω² u.
    """
    return np.array([[0, 1, 0, 0], [-w * w, 0, 0, -1], [1, 0, 0, 1], [0, 0, -w * w, 0]], dtype=float)


def _free_end(w: float) -> np.ndarray:
    """What (M, Q) at the clamp make (M, Q) at the tip, shape (2, 2): singular at a clamped–free frequency."""
    return np.asarray(expm(_transfer_rate(w)))[np.ix_([1, 3], [1, 3])]


@lru_cache(maxsize=1)
def clamped_free_frequencies() -> tuple[float, ...]:
    """The lowest six [rad/s] of EI = KAG = ρA = ρI = L = 1: zeros of det X, X of `_free_end`."""

    def determinant(w: float) -> float:
        return float(np.linalg.det(_free_end(w)))

    grid = np.arange(0.05, 9.0, 0.05)
    values = [determinant(w) for w in grid]
    roots = [
        float(brentq(determinant, a, b, xtol=1e-15))
        for (a, b), (p, q) in zip(pairwise(grid), pairwise(values), strict=True)
        if p * q < 0.0
    ]
    return tuple(roots[:6])


def _mesh_error(w: float) -> float:
    """Leading error (ω_h − ω)/h² of P1 elements for the clamped–free frequency ω = ``w``.

    ω_h² − ω² is the energy of what P1 cannot follow of the mode: h²/12 ∫ EI θ''² + KAG u''² over ∫ ρI θ² + ρA u².
    """
    start = np.zeros(4)
    start[[1, 3]] = np.linalg.svd(_free_end(w))[2][-1]
    nodes, weights = np.polynomial.legendre.leggauss(24)
    curvature = mass = 0.0
    for x, weight in zip((nodes + 1.0) / 2.0, weights, strict=True):
        theta, moment, u, shear = expm(_transfer_rate(w) * x) @ start
        curvature += weight * ((-shear - w * w * theta) ** 2 + (moment - w * w * u) ** 2)
        mass += weight * (theta**2 + u**2)
    return float(curvature / mass / 12.0 / (2.0 * w))


def _wave_number(w: float) -> float:
    """The larger k [1/m] of the unit beam at ω: (k² − ω²)² = ω²."""
    return sqrt(w * w + w)


def _measured_frequencies(beam: Beam, size: float, samples: int) -> np.ndarray:
    """Frequencies [rad/s] in the tip's velocity after an impulse, sampled 2 ``samples`` times at ``size`` [s].

    The samples Σ aᵢ cos(ωᵢ k H) = Σ aᵢ T_k(xᵢ), aᵢ > 0, are the Chebyshev moments of a measure with its masses at
    xᵢ = cos ωᵢH; with 2 T_j T_k = T_{j+k} + T_{|j−k|} they fill the Gram matrix of T_0, T_1, … and that of
    multiplication by x, whose eigenvalues relative to it are the xᵢ.
    """
    with closing(FmuBeam(beam, 0.0, 0.0)) as body:
        body.apply_impulse(1.0)
        velocity = [body.motion().velocity]
        for step in range(2 * samples):
            body.advance(step * size, size, NO_FORCE)
            velocity.append(body.motion().velocity)
    c = np.array(velocity)
    j, k = np.indices((samples, samples))
    gram = (c[j + k] + c[abs(j - k)]) / 2.0
    times_x = (c[j + 1 + k] + c[abs(j + 1 - k)] + c[abs(j - 1 + k)] + c[abs(j - 1 - k)]) / 4.0
    masses, vectors = np.linalg.eigh(gram)
    kept = masses > 1e-11 * masses[-1]
    basis = vectors[:, kept] / np.sqrt(masses[kept])
    x = np.linalg.eigvalsh(basis.T @ times_x @ basis)
    return np.asarray(np.arccos(np.clip(x, -1.0, 1.0)) / size)


def _nearest(values: np.ndarray, to: float) -> float:
    return float(values[np.argmin(np.abs(values - to))])


def frequencies() -> list[Check]:
    """Clamped–free frequencies, κ = 1, from the motion of the tip; √κ times these for any κ."""
    n, checks = 160, []
    measured = _measured_frequencies(Beam(n_elements=n, n_modes=6), 0.1, 300)
    for i, w in enumerate(clamped_free_frequencies(), 1):
        bound = _mesh_error(w) / n**2 * (1.0 + (_wave_number(w) / n) ** 2)
        reason = "P1, n = 160: leading error h²/24ω · ∫(EI θ''² + KAG u''²) of the mode, next order (kh)² of it"
        checks.append(Check(f"ω{i} [rad/s]", w, _nearest(measured, w), bound, reason))
    kappa, n = 3.6e10, 40
    soft = _measured_frequencies(Beam(n_elements=n, n_modes=2), 0.1, 150)
    stiff = Beam(n_elements=n, n_modes=2, young_modulus=kappa, shear_modulus=kappa)
    scaled = _measured_frequencies(stiff, 0.1 / sqrt(kappa), 150) / sqrt(kappa)
    first = _nearest(soft, clamped_free_frequencies()[0])
    reason = "against κ = 1 on the same mesh, n = 40. Rounding: ε N², N = 2n unknowns"
    bound = (2 * n) ** 2 * _EPS * first
    checks.append(Check("ω1/√κ at κ = 3.6e10 [rad/s]", first, _nearest(scaled, first), bound, reason))
    return checks


def mesh_convergence() -> list[Check]:
    """The first frequency's error is second order in h, with the coefficient of `_mesh_error`."""
    w = clamped_free_frequencies()[0]
    errors = {}
    for n in (40, 80):
        measured = _measured_frequencies(Beam(n_elements=n, n_modes=2), 0.1, 150)
        errors[n] = _nearest(measured, w) / w - 1.0
    next_order = (_wave_number(w) / 80) ** 2
    leading = _mesh_error(w) / 80**2 / w
    reason = "next order of the P1 dispersion, (kh)² of the leading error"
    return [
        Check("relative error of ω1, n = 80", leading, errors[80], leading * next_order, reason),
        # log2 of (1 + 4d)/(1 + d), |d| ≤ (kh)²
        Check(
            "order from n = 40 to 80", 2.0, float(np.log2(errors[40] / errors[80])), 3.0 * next_order / log(2), reason
        ),
    ]


def beam_energy() -> list[Check]:
    """E(t+H) − E(t) = C·(u_tip(t+H) − u_tip(t)) − dissipation for every step under a constant force.

    At rest again, all that was there and half the work of C are dissipated: 1/6 + C²·(tip compliance)/2 for u_t⁰ = x.
    """
    n, kappa, size, checks = 50, 1e4, 0.02, []
    reason = "largest in 200 steps over the largest energy, κ = 1e4, H = 0.02 s. Rounding: sums of 2n terms, 2nε"
    for integrator in ("modal", "generalized_alpha"):
        for alpha in (0.0, 1e-4):
            stiff = Beam(young_modulus=kappa, shear_modulus=kappa, n_elements=n, initial_velocity_slope=1.0)
            beam = stiff.model_copy(update={"integrator": integrator, "alpha_b": alpha})
            violation = scale = 0.0
            with closing(FmuBeam(beam, 0.0, 0.0)) as body:
                for step in range(200):
                    u, e = body.motion().displacement, body.energies()
                    body.advance(step * size, size, _UNIT_FORCE)
                    du, after = body.motion().displacement - u, body.energies()
                    scale = max(scale, e.kinetic + e.potential)
                    change = after.kinetic + after.potential - e.kinetic - e.potential
                    violation = max(violation, abs(change + after.dissipated - e.dissipated - du))
            name = "midpoint" if integrator == "generalized_alpha" else "modal"
            checks.append(Check(f"{name}, α_b = {alpha:g} s", 0.0, violation / scale, 2 * n * _EPS, reason))
    with closing(FmuBeam(Beam(n_elements=n, alpha_b=1.0, initial_velocity_slope=1.0), 0.0, 0.0)) as body:
        for step in range(200):
            body.advance(float(step), 1.0, _UNIT_FORCE)
        lost = body.energies().dissipated
    compliance = (4.0 / 3.0) / (1.0 + 1.0 / (12.0 * n * n))
    reason = "rounding: 2nε a step, 200 steps (κ = 1, α_b = 1 s, H = 1 s)"
    checks.append(Check("modal: all lost at rest [J]", 1.0 / 6.0 + compliance / 2.0, lost, 200 * 2 * n * _EPS, reason))
    return checks


# -- spring ---------------------------------------------------------------------------------------------------------

_IDA = "IDA: BDF of order ≤ 5 takes some ε^(−1/6) internal steps a radian, each of error ε: ωT·ε^(5/6)"


def _read(body: FmuBeam | FmuSpring, name: str) -> float:
    return Reals(body.fmu, name).get()[0]


def _ida_error(body: FmuSpring, radians: float) -> float:
    """Relative error that IDA's tolerance ε leaves over an angle ωT: `_IDA`."""
    return float(radians * _read(body, "relative_tolerance") ** (5.0 / 6.0))


def _falling_zeros(body: FmuSpring, size: float, count: int) -> list[float]:
    """The first times [s] at which y falls through 0, found by repeating the step with other sizes."""
    time, zeros = 0.0, list[float]()
    while len(zeros) < count:
        body.mark()
        before, start = body.motion().displacement, time

        def displacement(tau: float, before: float = before, start: float = start) -> float:
            if tau == 0.0:
                return before
            body.rewind()
            body.advance(start, tau, NO_FORCE)
            return float(body.motion().displacement)

        after = displacement(size)
        if before > 0.0 >= after:
            zeros.append(time + float(brentq(displacement, 0.0, size, xtol=1e-16)))
            displacement(size)
        time += size
    return zeros


def duffing() -> list[Check]:
    """Undamped Duffing spring, m = 1, from rest at A.

    Hardening: y = A cn(ωt|μ), ω² = k1 + k2A², μ = k2A²/2ω². Softening: y = A sn(ωt + K|μ), ω² = k1 + k2A²/2,
    μ = −k2A²/2ω². Period 4K(μ)/ω.
    """
    checks = []
    for k1, k2, amplitude in ((3.0, -0.2, 0.5), (3.0, -0.2, 1.0), (150.0, 67.0, 0.5), (150.0, 67.0, 1.0)):
        w2 = k1 + k2 * amplitude**2 * (1.0 if k2 > 0.0 else 0.5)
        period = 4.0 * float(ellipk(abs(k2) * amplitude**2 / (2.0 * w2))) / sqrt(w2)
        spring = Spring(linear_stiffness=k1, cubic_stiffness=k2, equilibrium=amplitude)
        name = f"({k1:g}, {k2:g}, {amplitude:g})"
        with closing(FmuSpring(spring, 0.0)) as body:
            relative = _ida_error(body, 2.0 * pi)
            first, second = _falling_zeros(body, period / 18.5, 2)
        with closing(FmuSpring(spring, 0.0)) as body:
            for step in range(20):
                body.advance(step * period / 20.0, period / 20.0, NO_FORCE)
            back = body.motion()
        checks += [
            Check(f"{name}: period [s]", period, second - first, relative * period, _IDA),
            Check(f"{name}: y(T) [m]", amplitude, back.displacement, relative * amplitude, _IDA),
            Check(f"{name}: ẏ(T) [m/s]", 0.0, back.velocity, relative * amplitude * 2.0 * pi / period, _IDA),
        ]
    return checks


def _threshold(runs: Callable[[float], bool], low: float, high: float, width: float) -> float:
    """Where ``runs`` ends, to ``width`` relative, by bisection; NaN unless low runs and high does not."""
    if not runs(low) or runs(high):
        return nan
    while high - low > width * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if runs(middle) else (low, middle)
    return 0.5 * (low + high)


def escape() -> list[Check]:
    """A softening spring escapes past the hilltop √(k1/|k2|) of its potential; from y = 0 with z > k1/√(2 m |k2|).

    Inside the FMU must run, outside it must refuse. Bisection finds where one turns into the other.
    """
    k1, k2 = 3.0, -0.2
    hilltop, speed = sqrt(k1 / -k2), k1 / sqrt(-2.0 * k2)
    seconds, width = 20, 1e-11
    with closing(FmuSpring(Spring(linear_stiffness=k1, cubic_stiffness=k2), 0.0)) as body:
        relative = _ida_error(body, sqrt(k1) * seconds)

    def runs(position: float, velocity: float) -> bool:
        start = {"equilibrium": position, "initial_velocity": velocity}
        spring = Spring(linear_stiffness=k1, cubic_stiffness=k2, **start)
        try:
            with closing(FmuSpring(spring, 0.0)) as body:
                for second in range(seconds):
                    body.advance(float(second), 1.0, NO_FORCE)
                    if abs(body.motion().displacement) > hilltop * (1.0 + relative):
                        return True  # a number from beyond the hilltop: not refused
        except (StepRefused, FmuError):
            return False
        return True

    return [
        Check(
            "start at rest, largest |y| [m]",
            hilltop,
            _threshold(lambda y: runs(y, 0.0), 0.9 * hilltop, 1.1 * hilltop, width),
            width * hilltop,
            "width of the bisection; the start is compared with the formula",
        ),
        Check(
            "escape from y = 0, ẏ [m/s]",
            speed,
            _threshold(lambda z: runs(0.0, z), 0.9 * speed, 1.1 * speed, width),
            relative * speed,
            _IDA + ", T = 20 s",
        ),
    ]


# -- impact ---------------------------------------------------------------------------------------------------------


def bar_impact() -> list[Check]:
    """Elastic bar on a rigid stop: u_tt = u_xx, u(0) = 0, u⁰ = x/2, u_t⁰ = 0, tip stopped at 0 (scene `bar-impact`).

    d'Alembert: period 3; approach 0–1 with tip speed −1/2, contact 1–2 with force 1/2 and impulse 1/2, release 2–3;
    energy 1/8. (EI → ∞ keeps θ = 0, so that the Timoshenko beam is this bar.)

    P1 elements disperse, ω ≈ k (1 + k²h²/24): after the time t a front is an integrated Airy function of the width
    (t h²/8)^⅓, which overshoots; and the tip, let go, moves in ripples of the relative size √(2/π)(ω_c t)^(−3/2),
    ω_c = √12/h (see `added_mass`). The tip's own mass is stopped at once, and its energy lost.
    """
    checks = [check for n in (100, 200) for check in _bar_on_mesh(n)]
    checks += [_force_between_the_fronts(mass_matrix) for mass_matrix in ("consistent", "averaged")]
    reason = (
        "Doyen, Ern & Piperno 2011 (L = 10, E = 900, ρ = 1): not representable. 2L/c is the way to the free far end "
        "and back; the beam FMU is clamped there, and u(0) = 0 reflects the wave with the other sign"
    )
    checks.append(Check("bouncing bar: contact lasts [s]", 2.0 * 10.0 / sqrt(900.0), None, None, reason))
    return checks


def _force_between_the_fronts(mass_matrix: str, n: int = 50) -> Check:
    """Compare the force from 1.2 to 1.8 s with the exact 1/2. Averaged, ω ≈ k (1 − k⁴h⁴/480): it rings much less."""
    scene = with_changes(
        load_scene("bar-impact"),
        time={"t_end": 1.8},
        beam={"n_elements": n, "mass_matrix": mass_matrix},
        coupling={"macro_step": 0.25 / n, "degree": 2},
    )
    run = simulate(scene)
    force = run["foundation_force"][run["time"] > 1.2]
    ringing = float(np.sqrt(np.mean((force / 0.5 - 1.0) ** 2)))
    name = f"{mass_matrix} mass, n = {n}: ringing"
    if mass_matrix == "averaged":
        return Check(name, 0.0, ringing, 0.01, "of the force between the fronts, L2 over 1/2: 1 % from 50 elements on")
    return Check(name, 0.0, ringing, None, "not judged: short waves are too fast")


def _bar_on_mesh(n: int) -> list[Check]:
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
    return [Check(f"n = {n}: {row[0]}", *row[1:]) for row in rows]


def _airy_overshoot() -> float:
    """Largest value of a dispersed unit step, ∫ Ai from Ai's first zero to ∞: 1.274."""
    return float(1.0 / 3.0 + itairy(-ai_zeros(1)[0][0])[2])


# -- coupling -------------------------------------------------------------------------------------------------------


def two_masses() -> list[Check]:
    """m = 1, 1; k = 4π², 16π² (between them), 4π²: spectral radius ρ ≈ 1 + cπ²H² of held exchanges, exact subsystems.

    Eigenfrequencies 2π and 6π. A held input arrives H/2 late on average (one step late: 3H/2; computed with the new
    value: H/2 early); a delay τ of a stiffness k is a damping −kτ, and the mode (1, −1) grows by what it then gains.
    """
    k_own, k_between = 4.0 * pi**2, 16.0 * pi**2
    sizes = (1e-3, 5e-4)
    by_force = Spring(linear_stiffness=k_own)
    by_displacement = Spring(linear_stiffness=k_own + k_between)
    with closing(FmuSpring(by_force, 0.0)) as f, closing(FmuSpring(by_displacement, 0.0)) as d:
        load = Reals(d.fmu, "external_force")

        def under_force(y: float, z: float, force: float, size: float) -> tuple[float, float]:
            f.restart(0.0, y, z)
            f.advance(0.0, size, (-force, 0.0, 0.0))
            return f.motion()[:2]

        def beside(y: float, z: float, other: float, size: float) -> tuple[float, float]:
            d.restart(0.0, y, z)
            load.set([k_between * other])
            d.advance(0.0, size, NO_FORCE)
            return d.motion()[:2]

        def fd_jacobi(s: np.ndarray, size: float) -> tuple[float, ...]:
            y1, z1, y2, z2 = s
            return *under_force(y1, z1, k_between * (y2 - y1), size), *beside(y2, z2, y1, size)

        def fd_late(s: np.ndarray, size: float) -> tuple[float, ...]:
            y1, z1, y2, z2, held = s
            return *under_force(y1, z1, k_between * (y2 - held), size), *beside(y2, z2, y1, size), y1

        def fd_gauss_seidel(s: np.ndarray, size: float) -> tuple[float, ...]:
            y1, z1, y2, z2 = s
            first = under_force(y1, z1, k_between * (y2 - y1), size)
            return *first, *beside(y2, z2, first[0], size)

        def dd_jacobi(s: np.ndarray, size: float) -> tuple[float, ...]:
            y1, z1, y2, z2 = s
            return *beside(y1, z1, y2, size), *beside(y2, z2, y1, size)

        def dd_gauss_seidel(s: np.ndarray, size: float) -> tuple[float, ...]:
            y1, z1, y2, z2 = s
            first = beside(y1, z1, y2, size)
            return *first, *beside(y2, z2, first[0], size)

        exchanges: tuple[tuple[str, Callable[[np.ndarray, float], tuple[float, ...]], int, float], ...] = (
            ("force–displ. Jacobi", fd_jacobi, 4, 6.0),
            ("… one step late", fd_late, 5, 10.0),
            ("… Gauss–Seidel", fd_gauss_seidel, 4, 2.0),
            ("displ.–displ. Jacobi", dd_jacobi, 4, 4.0),
            ("… Gauss–Seidel", dd_gauss_seidel, 4, 0.0),
        )
        w = 6.0 * pi
        truncation = k_between / pi**2 * (w * sizes[0]) ** 4
        solver = _ida_error(f, w * sizes[1]) / (pi * sizes[1]) ** 2 * 4.0 / 3.0
        checks = []
        for name, step, states, exact in exchanges:
            c = []
            for size in sizes:
                columns = np.array([step(unit, size) for unit in np.eye(states)])
                radius = float(np.abs(np.linalg.eigvals(columns.T)).max())
                c.append((radius - 1.0) / (pi * size) ** 2)
            checks.append(
                Check(
                    f"{name}: c",
                    exact,
                    (4.0 * c[1] - c[0]) / 3.0,
                    truncation + solver,
                    "H = 1e-3 and 5e-4 s extrapolated to 0: k/π²·(6πH)⁴ left; and IDA's ωH·ε^(5/6) over π²H²",
                )
            )
    return checks


def added_mass() -> list[Check]:
    """Fixed-point gain of the tie by displacement exchange: beam ∂u/∂C over spring −∂y/∂C, C held over a step H.

    Beam as a bar (θ kept at rest by a huge ρI), no echo before 2L/c: u = C H/Z, Z = √(KAG·ρA), on a spring that
    answers as a free mass: gain 2m/(ZH). A half-infinite P1 mesh has the tip compliance 1/(s Z √(1 + (s h/c)²/12)) in
    the Laplace domain, so with ω_c = √12 c/h

        u(H) = C/Z ∫₀ᴴ (H − σ) ω_c J₀(ω_c σ) dσ:    H/Z for ω_c H ≫ 1,    √3 H²/(ρA h) for ω_c H ≪ 1.
    """
    n, m, inertia = 100, 1.0, 1e8
    cutoff = sqrt(12.0) * n
    beam, spring = Beam(n_elements=n, second_moment_of_area=inertia), Spring(mass=m, linear_stiffness=0.0)

    def gain(size: float) -> float:
        with closing(FmuBeam(beam, 0.0, 0.0)) as upper, closing(FmuSpring(spring, 0.0)) as lower:
            upper.advance(0.0, size, _UNIT_FORCE)
            lower.advance(0.0, size, _UNIT_FORCE)
            return -upper.motion().displacement / lower.motion().displacement

    def mesh_gain(size: float) -> float:
        value, _ = quad(lambda s: (size - s) * cutoff * j0(cutoff * s), 0.0, size, limit=1000, epsabs=1e-13)
        return float(2.0 * m / size**2 * value)

    checks = []
    ripples = "ripples of the P1 mesh around the bar: √(2/π)(ω_c H)^(−3/2), next order 2/(ω_c H)"
    for size in (0.1, 0.5):
        x, exact = cutoff * size, 2.0 * m / size
        bound = exact * sqrt(2.0 / pi) * x**-1.5 * (1.0 + 2.0 / x)
        checks.append(Check(f"2m/(ZH), H = {size:g} s", exact, gain(size), bound, ripples))
    limit = 2.0 * sqrt(3.0) * m * n
    size = 1e-6
    bound = limit * ((cutoff * size) ** 2 / 24.0 + (2 * n) ** 2 * _EPS)
    reason = "J₀'s next term, (ω_c H)²/24; rounding ε N², N = 2n"
    checks.append(Check("H → 0: 2√3 m/(ρA h)", limit, gain(size), bound, reason))
    for size in (0.01, 0.1):
        exact = mesh_gain(size)
        bound = exact * (size**2 / inertia + (2 * n) ** 2 * _EPS)
        reason = "θ moves all the same, KAG H²/ρI; rounding ε N², N = 2n"
        checks.append(Check(f"P1 mesh, H = {size:g} s", exact, gain(size), bound, reason))
    return checks


def energy_scheme() -> list[Check]:
    """Beam and nonlinear spring, tied and undamped: the `energy` scheme keeps the energy, whatever H.

    A constant load pulls the spring down from rest, so that the pair swings below Ψ and stays tied.
    """
    checks = []
    steps, n = 100, 50
    reason = (
        "relative drift in 100 steps: coupling.tolerance of each step's work, at most twice the energy; and " + _IDA
    )
    for kappa, size in ((1.0, 0.01), (1e4, 1e-3), (1e4, 0.1)):
        spring = Spring(linear_stiffness=3.0, cubic_stiffness=100.0, external_force=-0.1 * kappa)
        for degree in (0, 1, 2):
            scene = Scene(
                time=Time(t_end=steps * size),
                beam=Beam(young_modulus=kappa, shear_modulus=kappa, n_elements=n),
                spring=spring,
                coupling=Coupling(scheme="energy", degree=degree, macro_step=size),
            )
            name = f"degree {degree}, ω_max H = {sqrt(12.0 * kappa) * n * size:.0f}"
            bound = 2.0 * steps * scene.coupling.tolerance
            try:
                run = simulate(scene)
            except RunStopped as stopped:
                checks.append(Check(name, 0.0, nan, bound, f"{reason}; {stopped}"))
                continue
            stiffness = spring.linear_stiffness + 3.0 * spring.cubic_stiffness * float(np.abs(run["y"]).max()) ** 2
            with closing(FmuSpring(spring, 0.0)) as body:
                solver = _ida_error(body, sqrt(stiffness / spring.mass) * steps * size)
            tied = bool(np.all(run["phase"] == "tied"))
            drift = float(run.summary["max_energy_residual"]) if tied else nan
            checks.append(Check(name, 0.0, drift, bound + solver, reason))
    return checks


#: Title and exact solution, in the order of the table.
SECTIONS: tuple[tuple[str, Callable[[], list[Check]]], ...] = (
    ("Beam: static deflection of the tip, locking", static_deflection),
    ("Beam: clamped–free frequencies", frequencies),
    ("Beam: convergence of the mesh", mesh_convergence),
    ("Beam: energy of a step under a constant force", beam_energy),
    ("Spring: Duffing (k1, k2, A), from rest", duffing),
    ("Spring: escape of a softening spring", escape),
    ("Impact: elastic bar on a rigid stop", bar_impact),
    ("Coupling: two masses, held exchange, ρ ≈ 1 + cπ²H²", two_masses),
    ("Coupling: gain of the tie by displacement exchange", added_mass),
    ("Coupling: energy scheme, tied, undamped", energy_scheme),
)


def verify() -> Iterator[tuple[str, list[Check]]]:
    """Each section's title and checks, as they are computed. A section that cannot be computed is a failed check.

    Raises
    ------
    FmuError
        If an FMU cannot be found, loaded or initialised.
    """
    for title, section in SECTIONS:
        try:
            yield title, section()
        except (StepRefused, RunStopped) as error:
            yield title, [Check("not computed", None, None, 0.0, str(error))]


def report(console: Console) -> bool:
    """Print every section's table and a last line that counts; returns whether all judged checks passed."""
    began = perf_counter()
    verdicts: list[bool | None] = []
    for title, section in verify():
        console.print(Text(title, style="bold"))
        console.print(_table(section))
        console.print(_footnotes(section))
        console.print()
        verdicts += [check.passed for check in section]
    failed = verdicts.count(False)
    counts = f"{verdicts.count(True)} passed, {failed} failed, {verdicts.count(None)} reported without judgement"
    console.print(f"{counts}; {perf_counter() - began:.0f} s")
    return failed == 0


def _reasons(section: list[Check]) -> dict[str, str]:
    """Footnotes: reason → letter."""
    return {reason: chr(ord("a") + i) for i, reason in enumerate(dict.fromkeys(c.reason for c in section))}


def _footnotes(section: list[Check]) -> Table:
    notes = Table.grid(padding=(0, 1))
    for reason, mark in _reasons(section).items():
        notes.add_row(Text(mark), Text(reason))
    return notes


def _table(section: list[Check]) -> Table:
    notes = _reasons(section)
    table = Table(box=None, pad_edge=False, padding=(0, 1, 0, 0), header_style="bold")
    table.add_column("quantity", no_wrap=True, min_width=30)
    for heading, width in (("exact", 11), ("computed", 11), ("error", 8), ("bound", 7)):
        table.add_column(heading, justify="right", no_wrap=True, min_width=width)
    table.add_column("", no_wrap=True)
    for check in section:
        verdict = {True: Text("pass"), False: Text("FAIL", style="bold red"), None: Text("–")}[check.passed]
        table.add_row(
            Text(check.quantity),
            _number(check.exact, ".6g"),
            _number(check.computed, ".6g"),
            _number(check.error, ".1e"),
            _number(check.bound, ".1e"),
            verdict.append(f" {notes[check.reason]}"),
        )
    return table


def _number(value: float | None, form: str) -> str:
    if value is None:
        return "–"
    return "nan" if isnan(value) else f"{value:{form}}"
