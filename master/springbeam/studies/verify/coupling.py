"""Both FMUs coupled: growth under ordinary exchanges, the gain of exchanging displacements, energy kept by `energy`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing
from itertools import product
from math import nan, pi, sqrt

import numpy as np
from scipy.integrate import quad
from scipy.special import j0

from ...bodies.fmu import Reals
from ...bodies.fmu_bodies import FmuBeam, FmuSpring
from ...bodies.protocol import NO_FORCE
from ...run.runner import simulate
from ...scene import Beam, Coupling, Scene, Spring, Time
from .check import EPS, UNIT_FORCE, Check, section
from .spring import IDA, ida_error


@section("Coupling: two masses, held exchange, ρ ≈ 1 + cπ²H²")
def two_masses() -> Iterator[Check]:
    """m = 1, 1; k = 4π², 16π² (between them), 4π²: spectral radius ρ ≈ 1 + cπ²H² of held exchanges, exact subsystems.

    Eigenfrequencies 2π and 6π. A held input arrives H/2 late on average (one step late: 3H/2; computed with the new
    value: H/2 early); a delay τ of a stiffness k is a damping −kτ, and the mode (1, −1) grows by what it then gains.
    """
    k_own, k_between = 4.0 * pi**2, 16.0 * pi**2
    sizes = (1e-3, 5e-4)
    by_force = Spring.with_ones(linear_stiffness=k_own)
    by_displacement = Spring.with_ones(linear_stiffness=k_own + k_between)
    with closing(FmuSpring(by_force, 0.0)) as f, closing(FmuSpring(by_displacement, 0.0)) as d:
        load = Reals(d.fmu, "external_force")

        def linked(y: float, z: float, stretch: float, size: float) -> tuple[float, float]:
            f.restart(0.0, y, z)
            f.advance(0.0, size, (-k_between * stretch, 0.0, 0.0))
            return f.motion()[:2]

        def beside(y: float, z: float, other: float, size: float) -> tuple[float, float]:
            d.restart(0.0, y, z)
            load.set([k_between * other])
            d.advance(0.0, size, NO_FORCE)
            return d.motion()[:2]

        # From displacement and velocity of both, and the first one's displacement a step ago, to the same at the end.
        names = ("force–displ. Jacobi", "… one step late", "… Gauss–Seidel", "displ.–displ. Jacobi", "… Gauss–Seidel")
        steps: tuple[Callable[..., tuple[float, ...]], ...] = (
            lambda H, y1, z1, y2, z2, _: (*linked(y1, z1, y2 - y1, H), *beside(y2, z2, y1, H), y1),
            lambda H, y1, z1, y2, z2, ago: (*linked(y1, z1, y2 - ago, H), *beside(y2, z2, y1, H), y1),
            lambda H, y1, z1, y2, z2, _: (*(first := linked(y1, z1, y2 - y1, H)), *beside(y2, z2, first[0], H), y1),
            lambda H, y1, z1, y2, z2, _: (*beside(y1, z1, y2, H), *beside(y2, z2, y1, H), y1),
            lambda H, y1, z1, y2, z2, _: (*(first := beside(y1, z1, y2, H)), *beside(y2, z2, first[0], H), y1),
        )
        w = 6.0 * pi
        truncation = k_between / pi**2 * (w * sizes[0]) ** 4
        solver = ida_error(w * sizes[1]) / (pi * sizes[1]) ** 2 * 4.0 / 3.0
        reason = "H = 1e-3 and 5e-4 s extrapolated to 0: k/π²·(6πH)⁴ left; and IDA's ωH·ε^(5/6) over π²H²"
        for name, step, exact in zip(names, steps, (6.0, 10.0, 2.0, 4.0, 0.0), strict=True):
            c = []
            for size in sizes:
                columns = np.array([step(size, *unit) for unit in np.eye(5)])
                radius = float(np.abs(np.linalg.eigvals(columns.T)).max())
                c.append((radius - 1.0) / (pi * size) ** 2)
            yield Check(f"{name}: c", exact, (4.0 * c[1] - c[0]) / 3.0, truncation + solver, reason)


@section("Coupling: gain of the tie by displacement exchange")
def added_mass() -> Iterator[Check]:
    """Fixed-point gain of the tie by displacement exchange: beam ∂u/∂C over spring −∂y/∂C, C held over a step H.

    Beam as a bar (θ kept at rest by a huge ρI), no echo before 2L/c: u = C H/Z, Z = √(KAG·ρA), on a spring that
    answers as a free mass: gain 2m/(ZH). A half-infinite P1 mesh has the tip compliance 1/(s Z √(1 + (s h/c)²/12)) in
    the Laplace domain, so with ω_c = √12 c/h

        u(H) = C/Z ∫₀ᴴ (H − σ) ω_c J₀(ω_c σ) dσ:    H/Z for ω_c H ≫ 1,    √3 H²/(ρA h) for ω_c H ≪ 1.
    """
    n, m, inertia = 100, 1.0, 1e8
    cutoff = sqrt(12.0) * n
    beam, spring = (
        Beam.with_ones(n_elements=n, second_moment_of_area=inertia),
        Spring.with_ones(mass=m, linear_stiffness=0.0),
    )

    def gain(size: float) -> float:
        with closing(FmuBeam(beam, 0.0, 0.0)) as upper, closing(FmuSpring(spring, 0.0)) as lower:
            upper.advance(0.0, size, UNIT_FORCE)
            lower.advance(0.0, size, UNIT_FORCE)
            return -upper.motion().displacement / lower.motion().displacement

    def mesh_gain(size: float) -> float:
        value, _ = quad(lambda s: (size - s) * cutoff * j0(cutoff * s), 0.0, size, limit=1000, epsabs=1e-13)
        return float(2.0 * m / size**2 * value)

    ripples = "ripples of the P1 mesh around the bar: √(2/π)(ω_c H)^(−3/2), next order 2/(ω_c H)"
    for size in (0.1, 0.5):
        x, exact = cutoff * size, 2.0 * m / size
        bound = exact * sqrt(2.0 / pi) * x**-1.5 * (1.0 + 2.0 / x)
        yield Check(f"2m/(ZH), H = {size:g} s", exact, gain(size), bound, ripples)
    limit = 2.0 * sqrt(3.0) * m * n
    size = 1e-6
    bound = limit * ((cutoff * size) ** 2 / 24.0 + (2 * n) ** 2 * EPS)
    reason = "J₀'s next term, (ω_c H)²/24; rounding ε N², N = 2n"
    yield Check("H → 0: 2√3 m/(ρA h)", limit, gain(size), bound, reason)
    for size in (0.01, 0.1):
        exact = mesh_gain(size)
        bound = exact * (size**2 / inertia + (2 * n) ** 2 * EPS)
        reason = "θ moves all the same, KAG H²/ρI; rounding ε N², N = 2n"
        yield Check(f"P1 mesh, H = {size:g} s", exact, gain(size), bound, reason)


#: κ [N] and H [s].
_TIED = ((1.0, 0.01), (1e4, 1e-3), (1e4, 0.1))


@section("Coupling: energy scheme, tied, undamped", *((*pair, degree) for pair, degree in product(_TIED, (0, 1, 2))))
def energy_scheme(kappa: float, size: float, degree: int) -> Iterator[Check]:
    """Beam and nonlinear spring, tied and undamped: the `energy` scheme keeps the energy, whatever H.

    A constant load pulls the spring down from rest, so that the pair swings below Ψ and stays tied.
    """
    steps, n = 100, 50
    reason = "relative drift in 100 steps: coupling.tolerance of each step's work, at most twice the energy; and " + IDA
    spring = Spring.with_ones(linear_stiffness=3.0, cubic_stiffness=100.0, external_force=-0.1 * kappa)
    scene = Scene(
        time=Time(t_end=steps * size),
        beam=Beam.with_ones(young_modulus=kappa, shear_modulus=kappa, n_elements=n),
        spring=spring,
        coupling=Coupling(scheme="energy", degree=degree, macro_step=size),
    )
    run = simulate(scene)
    stiffness = spring.linear_stiffness + 3.0 * spring.cubic_stiffness * float(np.abs(run["y"]).max()) ** 2
    solver = ida_error(sqrt(stiffness / spring.mass) * steps * size)
    tied = bool(np.all(run["phase"] == "tied"))
    drift = float(run.summary["max_energy_residual"]) if tied else nan
    name = f"degree {degree}, ω_max H = {sqrt(12.0 * kappa) * n * size:.0f}"
    yield Check(name, 0.0, drift, 2.0 * steps * scene.coupling.tolerance + solver, reason)
