"""Both FMUs under an interface law: free masses that meet, masses on a link, masses tied for good.

Two free masses meet: with the reduced mass μ = 1/(1/m₁ + 1/m₂) the penetration follows μ p̈ = −C(p, ṗ), from p = 0 and
ṗ = v. Hunt & Crossley's C = λ p^q (1 + χ ṗ) separates, with w = ṗ along p::

    μ w dw/(1 + χ w) = −λ p^q dp,     G(w) = (χ w − ln(1 + χ w))/χ²,     G(w) = G(v) − λ p^{q+1}/(q + 1)μ

so that G = 0 at the largest penetration, and the ends part with −w, G(w) = G(v), w < 0 (χ → 0: G = w²/2, w = −v).

A unilateral spring and damper, C = (λ p + c ṗ)₊, is a damped oscillator until −μ p̈ = C = 0 (Schwager & Pöschel 2007)::

    ω² = λ/μ,     ζ = sin φ = c/2μω < 1,     p = v e^{−ζωt} sin(ω t cos φ)/(ω cos φ)
    C = 0 at ω t cos φ = π − 2φ,     ṗ = −e v there,     e = e^{−(π − 2φ) tan φ}
"""

from __future__ import annotations

from functools import partial
from itertools import product
from math import asin, cos, exp, nan, pi, sin, sqrt, tan

import numpy as np
from scipy.optimize import brentq
from scipy.special import beta, lambertw, spherical_jn

from springbeam.run.runner import run_in_memory
from springbeam.scene import Beam, scene_from_dict

from .alone import IDA, Check, ida_error, section

#: Stiffness [N, N·m²] that leaves the tip of a beam a free mass for a second, and rotary inertia that keeps θ at rest.
_LIMP = 1e-13
_RIGID = 1e14


def impact(mass, speed, stiffness, exponent, damping=0.0):
    """Return how long a reduced mass [kg] at ``speed`` [m/s] stays on λ_nc = ``stiffness`` [N/m^q], q = ``exponent``.

    And the speed at which the ends part [m/s], with damping χ [s/m]. Without it, the contact lasts
    T = 2 p_max/v · B(1/(q+1), ½)/(q+1) [s]; with damping no closed form is known, and T is that of the undamped one.
    """
    share = 1.0 / (exponent + 1.0)
    deepest = (0.5 * mass * speed**2 / (share * stiffness)) ** share
    duration = 2.0 * deepest / speed * float(beta(share, 0.5)) * share
    if damping == 0.0:
        return duration, speed
    # y = 1 + χ w < 1 with y − ln y = 1 + x, that is −y e^{−y} = −e^{−1−x}.
    x = damping * speed - np.log1p(damping * speed)
    return duration, float((1.0 + lambertw(-np.exp(-1.0 - x)).real) / damping)


def masses(beam, spring, contact, t_end, **coupling):
    """Return a scene of a ``beam`` of one linear element, whose tip has the mass ρAL/3, and a ``spring``."""
    return scene_from_dict(
        {
            "time": {"t_end": t_end},
            "beam": {**Beam.ones(), "n_elements": 1, **beam},
            "spring": spring,
            "contact": contact,
            "coupling": coupling,
        }
    )


def held(tip, top, **start):
    """Return a beam that can only shear, and a spring: unit masses held by ``tip`` and ``top`` [N/m]."""
    beam = {"density": 3.0, "second_moment_of_area": _RIGID, "shear_modulus": tip}
    return beam | start, {"mass": 1.0, "linear_stiffness": top}


# -- the checks -------------------------------------------------------------------------------------------------------

#: A tip of 0.5 kg, too limp to be held, that meets 2 kg at 1 m/s; their reduced mass [kg]; and λ_nc [N/m^q].
_TIP = {"density": 1.5, "young_modulus": _LIMP, "shear_modulus": _LIMP, "initial_velocity_slope": -1.0}
_MEETING = (_TIP, {"mass": 2.0, "linear_stiffness": 0.0})
_REDUCED = 0.4
_STIFFNESS = 1e4
_HALVED = "how much the value changes when H is halved: at order 2 a triple of the error left, more at a higher one"
_PROJECTED = (
    "a force without its Legendre terms above the degree d shifts the phase ωT by (2n+1) j_n(ωH/2)² of it, n = d + 1; "
    "next order (ωH)²"
)


def _phase(degree, angle):
    """Return the relative phase error of an oscillator whose force is of ``degree`` over a step of ``angle`` = ωH."""
    n = degree + 1
    return float((2 * n + 1) * spherical_jn(n, 0.5 * angle) ** 2 * (1.0 + angle**2))


def _halving(quantities, scene, size, solver):
    """Yield checks of what a run at H = ``size``/2 gives, bounded by its change from H = ``size``."""
    coarse = run_in_memory(scene(macro_step=size))
    fine = run_in_memory(scene(macro_step=0.5 * size))
    for name, value, of in quantities:
        bound = abs(of(fine) - of(coarse)) + solver * abs(value)
        yield Check(name, value, of(fine), bound, f"{_HALVED}; and {IDA}")


def _parting(run):
    """Return the speed [m/s] at which tip and spring part, from the last row."""
    return float(run["v_tip"][-1] - run["z"][-1])


def _duration(run):
    """Return how long the first contact lasts [s]; NaN if it does not end."""
    return next((event.time for event in run.events if event.kind == "separation"), nan)


@section((1.0,), (1.5,), (3.0,))
def compliant_impact(q):
    """Free masses, 0.5 and 2 kg at 1 m/s, on λ_nc p₊^q: how long, and how fast they part; λ_nc = 1e4 N/m^q.

    q = 1 is half a period of √(λ_nc/μ); other q by the beta function. No energy is lost.
    """
    whole, _ = impact(_REDUCED, 1.0, _STIFFNESS, q)
    steps = 40
    solver = ida_error(pi)
    law = {"law": "compliance", "stiffness": _STIFFNESS, "exponent": q}
    scene = partial(masses, *_MEETING, law, 1.5 * whole, degree=2)
    if q == 1.0:
        for degree in (0, 1, 2):
            bound = whole * (_phase(degree, pi / steps) + solver)
            lasts = _duration(run_in_memory(scene(macro_step=whole / steps, degree=degree)))
            yield Check(f"degree {degree}: lasts [s]", whole, lasts, bound, f"{_PROJECTED}; and {IDA}")
    else:
        quantity = ("lasts [s]", whole, _duration)
        yield from _halving((quantity,), scene, 2.0 * whole / steps, solver)
    run = run_in_memory(scene(macro_step=whole / 10.0))
    tolerance = 15.0 * run.scene.coupling.tolerance
    reason = f"H a tenth of the contact: no energy lost but coupling.tolerance of each of 15 steps; and {IDA}"
    yield Check("part at [m/s]", 1.0, _parting(run), tolerance + solver, reason)


@section((1.0,), (1.5,), (3.0,))
def hunt_crossley(q):
    """C = λ_nc p₊^q (1 + χ ṗ), χ = 0.5 s/m: the masses part at w with χ w − ln(1 + χ w) as before, and w < 0."""
    duration, rebound = impact(_REDUCED, 1.0, _STIFFNESS, q, 0.5)
    law = {"law": "compliance", "stiffness": _STIFFNESS, "exponent": q, "damping": 0.5}
    scene = partial(masses, *_MEETING, law, 2.0 * duration, degree=2)
    quantities = (
        ("part at [m/s]", rebound, _parting),
        (
            "dissipated [J]",
            0.5 * _REDUCED * (1.0 - rebound**2),
            lambda run: float(run["e_dissipated"][-1]),
        ),
    )
    yield from _halving(quantities, scene, duration / 20.0, ida_error(pi))


@section(*product((0, 1, 2), (0.1, 0.5)))
def kelvin_voigt(degree, ratio):
    """C = (λ p + c ṗ)₊ at a damping ratio ζ, λ = 1e4 N/m: C ends at p > 0, which opens at e v; a step ends there."""
    omega = sqrt(_STIFFNESS / _REDUCED)
    phi = asin(ratio)
    pulls = (pi - 2.0 * phi) / (omega * cos(phi))
    rebound = exp(-(pi - 2.0 * phi) * tan(phi))
    opens = pulls + sin(2.0 * phi) / (omega * cos(phi))
    law = {"law": "kelvin_voigt", "stiffness": _STIFFNESS, "damping": 2.0 * ratio * _REDUCED * omega}
    scene = partial(masses, *_MEETING, law, 1.5 * opens, degree=degree)
    quantities = (
        ("part at [m/s]", rebound, _parting),
        ("lasts [s]", opens, _duration),
        (
            "dissipated [J]",
            0.5 * _REDUCED * (1.0 - rebound**2),
            lambda run: float(run["e_dissipated"][-1]),
        ),
    )
    yield from _halving(quantities, scene, pulls / 20.0, ida_error(pi))


@section()
def unilateral():
    """Unit masses held by 12π² and 4π² N/m, the lower one lifted by f = 1 N, meet at −1 m/s and y = Ψ = 0.

    One oscillator of ω² = 8π² from ẏ = −½ m/s about y∞ = f/16π², until C = 4π² y + f/2 = 0 at y = −2 y∞ < Ψ; then two.
    """
    omega = sqrt(8.0) * pi
    middle = 1.0 / (16.0 * pi**2)

    def height(t):
        return middle * (1.0 - cos(omega * t)) - 0.5 / omega * sin(omega * t)

    part = brentq(lambda t: height(t) + 2.0 * middle, 0.0, 0.5 * pi / omega, xtol=1e-15)
    speed = middle * omega * sin(omega * part) - 0.5 * cos(omega * part)
    own = 2.0 * pi
    tau = 0.05 - part
    rest = 1.0 / own**2
    beam, spring = held(12.0 * pi**2, own**2, initial_velocity_slope=-1.0)
    scene = partial(masses, beam, spring | {"external_force": 1.0}, {"law": "unilateral"}, 0.05, degree=2)
    top = rest - (rest + 2.0 * middle) * cos(own * tau) + speed / own * sin(own * tau)
    fast = sqrt(3.0) * own
    tip = -2.0 * middle * cos(fast * tau) + speed / fast * sin(fast * tau)
    quantities = (
        ("part at [s]", part, _duration),
        ("y(0.05) [m]", top, lambda run: float(run["y"][-1])),
        ("u(0.05) [m]", tip, lambda run: float(run["u_tip"][-1])),
    )
    yield from _halving(quantities, scene, 0.01, ida_error(omega))


@section(*product((0, 1, 2), (0.025, 0.0125)))
def link(degree, size):
    """Unit masses held by 4π² each, on a link of 16π² N/m: u, y = (cos 2πt ± cos 6πt)/2.

    The link has 8/9 of the stiffness of the fast mode and none of the slow one's.
    """
    own = 4.0 * pi**2
    law = {"law": "link", "stiffness": 4.0 * own}
    bodies = held(own, own, initial_deflection_slope=1.0)
    run = run_in_memory(masses(*bodies, law, 1.0, macro_step=size, degree=degree))
    slow, fast = (0.5 * np.cos(w * run.time) for w in (2.0 * pi, 6.0 * pi))
    error = float(np.abs([run.u_tip - slow - fast, run.y - slow + fast]).max())
    bound = 0.5 * 6.0 * pi * 8.0 / 9.0 * _phase(degree, 6.0 * pi * size) + ida_error(6.0 * pi)
    reason = f"largest error over 1 s. {_PROJECTED}; and {IDA}"
    yield Check("error [m]", 0.0, error, bound, reason)


@section()
def tie():
    """Unit masses held by 4π² and 12π² N/m, tied for good: one oscillator of ω² = 8π² from ẏ = −½ m/s, ¼ J lost.

    The tie pulls as much as it presses: C = (k₁ − k₂) y/2.
    """
    omega = sqrt(8.0) * pi
    tied = held(4.0 * pi**2, 12.0 * pi**2, initial_velocity_slope=-1.0)
    scene = partial(masses, *tied, {"law": "tie"}, 1.0, degree=2)
    quantities = (
        ("y(1) [m]", -0.5 / omega * sin(omega), lambda run: float(run["y"][-1])),
        ("lost in the impact [J]", 0.25, lambda run: float(run["e_impact_loss"][-1])),
        ("C(1) [N]", 2.0 * pi**2 / omega * sin(omega), lambda run: float(run["contact_force"][-1])),
    )
    yield from _halving(quantities, scene, 0.01, ida_error(omega))
