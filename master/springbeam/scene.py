"""Scene files: what is simulated and how, validated before anything is built or loaded.

A scene is a TOML file with the tables ``[time]``, ``[beam]``, ``[spring]``, ``[stop]``, ``[contact]`` and
``[coupling]``; a missing ``[beam]``, ``[spring]`` or ``[stop]`` is a scene without it. Field names are those of
the FMU parameters; units are SI.
"""

from __future__ import annotations

import datetime
import difflib
import json
import math
import re
import sys
from collections.abc import Iterable, Iterator, Mapping
from importlib import resources
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic.fields import FieldInfo

from .statics import bending_stiffness, shear_stiffness, tip_compliance, tip_inertia, tip_load_deflection

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

#: Up to this many unknowns all modes may be kept; the full eigenproblem grows with the cube.
ALL_MODES_UP_TO = 1000
#: Most modes of a mesh with more.
MOST_MODES = 1000
#: Most modes times unknowns: 40 bytes each while the modes are found, so 1 GB.
MOST_MODE_VALUES = 25_000_000
#: Most elements times their degree.
MOST_ELEMENTS = 1_000_000
#: Two weeks at a microsecond a step: a mistyped macro step, not a run.
MOST_MACRO_STEPS = 1e12
#: For those who meet TOML here first.
_TOML_IS = "a line is a [table] or key = value, with numbers like 0.5 or 1e-3 and texts in quotes"
#: Bytes of a scene file.
LONGEST_FILE = 1_000_000

Positive = Annotated[float, Field(gt=0.0)]
NonNegative = Annotated[float, Field(ge=0.0)]


class SceneError(ValueError):
    """A scene that cannot be run; the message names the file, the table, the key and what would be allowed."""


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)


class Time(_Table):
    t_end: Positive  #: end of the run [s]; it starts at 0


class Beam(_Table):
    """Kelvin–Voigt Timoshenko beam, clamped at x = 0 (Ahn & Tate, (1)–(5))."""

    density: Positive = 1.0  #: ρ [kg/m³]
    area: Positive = 1.0  #: A [m²]
    second_moment_of_area: Positive = 1.0  #: I [m⁴]
    young_modulus: Positive = 1.0  #: E [Pa]
    shear_modulus: Positive = 1.0  #: G [Pa]
    shear_coefficient: Positive = 1.0  #: K [–]
    length: Positive = 1.0  #: L [m]
    alpha_b: NonNegative = 0.0  #: Kelvin–Voigt retardation time [s]
    n_elements: Annotated[int, Field(ge=1, le=MOST_ELEMENTS)] = 50
    element_degree: Annotated[int, Field(ge=1, le=12)] = 1  #: of u and θ in an element; 1 is the paper's
    n_modes: Annotated[int, Field(ge=0)] = 0  #: lowest modes kept; 0 = all
    reduced_integration: bool = False
    integrator: Literal["modal", "generalized_alpha"] = "modal"
    rho_inf: Annotated[float, Field(ge=0.0, le=1.0)] = 1.0  #: generalized-α only; 1 = midpoint rule (62)
    distributed_load: float = 0.0  #: f_b, uniform [N/m]
    tip_load_coefficient: float = 0.0  #: last hat-function coefficient of f_b [N/m]
    initial_deflection_slope: float = 0.0  #: u⁰ = s x
    initial_velocity_slope: float = 0.0  #: u_t⁰ = s x [1/s]
    approach: Literal["undeformed", "elastic"] = "undeformed"
    #: "quasi_static": without inertia, a tip compliance; mesh, modes, integrator and density then play no part.
    fidelity: Literal["dynamic", "quasi_static"] = "dynamic"

    @property
    def damped_numerically(self) -> bool:
        """Whether the integrator takes energy that nothing books."""
        return self.fidelity == "dynamic" and self.integrator == "generalized_alpha" and self.rho_inf < 1.0

    @model_validator(mode="after")
    def _modes_exist(self) -> Beam:
        unknowns, degree = 2 * self.n_elements * self.element_degree, self.element_degree
        mesh = f"n_elements = {self.n_elements}" + (f" of element_degree = {degree}" if degree > 1 else "")
        if self.n_elements * degree > MOST_ELEMENTS:
            raise ValueError(
                f"n_elements = {self.n_elements}: times element_degree = {degree} it must be at most {MOST_ELEMENTS}"
            )
        if self.n_modes > unknowns:
            raise ValueError(f"n_modes = {self.n_modes}: {mesh} has only {unknowns} modes; use 0 for all of them")
        if self.integrator == "modal" and self.n_modes == 0 and unknowns > ALL_MODES_UP_TO:
            raise ValueError(
                f"n_modes = 0: {mesh} has {unknowns} modes, too many to keep them all (allowed up to "
                f'{ALL_MODES_UP_TO}); use n_modes = 64, or integrator = "generalized_alpha"'
            )
        if self.integrator == "modal" and unknowns > ALL_MODES_UP_TO:
            most = min(MOST_MODES, unknowns // 2)
            if self.n_modes > most:
                raise ValueError(
                    f"n_modes = {self.n_modes}: at most {most} of the {unknowns} modes of {mesh} are found"
                )
            if self.n_modes * unknowns > MOST_MODE_VALUES:
                raise ValueError(
                    f"n_modes = {self.n_modes}: with {mesh} they take {40 * self.n_modes * unknowns / 1e9:.3g} GB; "
                    f"use n_modes = {MOST_MODE_VALUES // unknowns} or less, or fewer n_elements"
                )
        return self


class Spring(_Table):
    """Duffing spring m ÿ + α_s ẏ + k1 y + k2 y³ = −C + N + f_s (Ahn & Tate, (6))."""

    mass: Positive = 1.0  #: m [kg]
    damping: NonNegative = 0.0  #: α_s [N·s/m]
    linear_stiffness: float = 1.0  #: k1 [N/m]
    cubic_stiffness: float = 0.0  #: k2 [N/m³]
    equilibrium: float = 0.0  #: Ψ [m]: where the top starts
    external_force: float = 0.0  #: f_s [N]
    initial_velocity: float = 0.0  #: z at the start [m/s]
    relative_tolerance: Annotated[float, Field(gt=0.0, le=1e-2)] = 1e-12  #: of IDA
    absolute_tolerance: Annotated[float, Field(gt=0.0, le=1e-2)] = 1e-14  #: of IDA


class Stop(_Table):
    """Rigid foundation: 0 ≤ N ⊥ y − φ ≥ 0 (Ahn & Tate, (8))."""

    position: float  #: φ [m]
    restitution: Annotated[float, Field(ge=0.0, le=1.0)] = 1.0  #: e


class Contact(_Table):
    law: Literal["transmission", "compliance", "paper"] = "transmission"
    impact: Literal["inelastic", "rest", "tip"] = "inelastic"
    stiffness: NonNegative = 1.0e4  #: λ_nc [N/m^p]
    exponent: Annotated[float, Field(ge=1.0, le=100.0)] = 3.0  #: p


#: How long macro steps are: one key, or the others.
_STEP, _TOLERANCES = "macro_step", ("relative_tolerance", "absolute_tolerance")
#: Schemes that exchange once per macro step, as ordinary masters do.
ORDINARY_SCHEMES = ("gauss_seidel", "jacobi")
#: Schemes that iterate over an exchange of the tip's displacement against the spring's force.
DISPLACEMENT_DRIVEN = ("fixed_point", "aitken")


class Coupling(_Table):
    #: "auto" picks scheme and degree: `springbeam.automatic`.
    scheme: Literal["energy", "hermite", "auto", "gauss_seidel", "jacobi", "fixed_point", "aitken"] = "energy"
    degree: Annotated[int, Field(ge=0, le=2)] = 0  #: of the contact force over a step
    macro_step: Annotated[float | None, Field(gt=0.0)] = None  #: H [s]; 0.004 where no tolerance is given
    #: Instead of ``macro_step``: of a step's error, relative to the motion so far, and absolute [m].
    relative_tolerance: Annotated[float | None, Field(gt=0.0, le=0.1)] = None
    absolute_tolerance: Annotated[float | None, Field(gt=0.0)] = None
    tolerance: Annotated[float, Field(gt=0.0, le=1e-3)] = 1.0e-12
    #: One-way: the driving body does not feel the contact force (law "compliance").
    feedback: Literal["two_way", "beam_drives", "spring_drives"] = "two_way"
    #: Motion of the driving end that one-way coupling may neglect, over the largest penetration.
    feedback_tolerance: Annotated[float, Field(gt=0.0, le=0.1)] = 1.0e-6

    @model_validator(mode="before")
    @classmethod
    def _default_step(cls, data: Any) -> Any:
        if isinstance(data, dict) and all(data.get(key) is None for key in (_STEP, *_TOLERANCES)):
            return {**data, _STEP: 0.004}
        return data

    @model_validator(mode="after")
    def _step_or_tolerance(self) -> Coupling:
        if self.macro_step is not None and self.adaptive:
            raise ValueError(
                f"macro_step = {self.macro_step}: with relative_tolerance or absolute_tolerance the master chooses its "
                "steps; give either macro_step or tolerances"
            )
        return self

    @property
    def adaptive(self) -> bool:
        """Whether the steps follow from tolerances."""
        return self.relative_tolerance is not None or self.absolute_tolerance is not None

    @property
    def H(self) -> float:
        """The macro step [s]. Raises SceneError if tolerances are given instead."""
        if self.macro_step is None:
            raise SceneError("[coupling] macro_step: needed here; this scene gives tolerances instead")
        return self.macro_step

    @model_validator(mode="after")
    def _degree_of_scheme(self) -> Coupling:
        if self.scheme == "hermite" and self.degree == 0:
            raise ValueError('degree = 0: scheme = "hermite" needs degree 1 or 2')
        if self.scheme == "auto" and self.degree > 0:
            raise ValueError(f'degree = {self.degree}: scheme = "auto" picks the degree; leave it out')
        if self.scheme in DISPLACEMENT_DRIVEN and self.degree > 0:
            raise ValueError(
                f'degree = {self.degree}: scheme = "{self.scheme}" exchanges one force a step, degree 0; leave it out'
            )
        if self.scheme in ORDINARY_SCHEMES and self.degree > 1:
            raise ValueError(f'degree = {self.degree}: scheme = "{self.scheme}" extrapolates with degree 0 or 1')
        return self


class Scene(_Table):
    """A validated scene. ``beam``, ``spring`` and ``stop`` are ``None`` where the scene does not have them."""

    title: str = ""
    #: Picks scheme, macro step and tolerances instead of those given: `springbeam.accuracy`.
    accuracy: Annotated[float | None, Field(gt=0.0, lt=1.0)] = None
    time: Time
    beam: Beam | None = None
    spring: Spring | None = None
    stop: Stop | None = None
    contact: Contact = Contact()
    coupling: Coupling = Coupling()

    @model_validator(mode="after")
    def _possible(self) -> Scene:
        try:
            impossible = [message for check in _CHECKS for message in check(self)] or _uncomputable(self)
        except ArithmeticError:
            impossible = ["no double holds what follows from these values; check their units: " + _extreme(self)]
        if impossible:
            raise ValueError("\n".join(impossible))
        return self

    @property
    def fmus(self) -> tuple[str, ...]:
        """Names of the FMUs that the scene is made of; a beam without inertia is none."""
        beam = self.beam is not None and self.beam.fidelity == "dynamic"
        return ("beam",) * beam + ("spring",) * (self.spring is not None)

    @property
    def driver_stiffness(self) -> float | None:
        """Static force per displacement [N/m] of the end that drives a one-way coupling; ``None`` without one."""
        if self.coupling.feedback == "beam_drives" and self.beam is not None:
            return 1.0 / tip_compliance(self.beam)
        if self.coupling.feedback == "spring_drives" and self.spring is not None:
            return self.spring.linear_stiffness
        return None

    @property
    def tip_target(self) -> tuple[str, float] | None:
        """What the beam's tip meets first, as ``("[table] key", height [m])``: the spring, else the stop."""
        if self.beam is None:
            return None
        if self.spring is not None:
            return "[spring] equilibrium", self.spring.equilibrium
        return None if self.stop is None else ("[stop] position", self.stop.position)

    @property
    def initial_tip(self) -> float | None:
        """u_tip at the start [m]: s₀ L, or the static deflection of a beam let go without inertia and damping."""
        if (beam := self.beam) is None:
            return None
        if beam.fidelity == "quasi_static" and beam.approach == "elastic" and beam.alpha_b == 0.0:
            return tip_load_deflection(beam)
        return beam.initial_deflection_slope * beam.length

    @property
    def initial_clearance(self) -> float | None:
        """Height [m] of the tip above `tip_target` at the start, 0 where only rounding separates them."""
        tip = self.initial_tip
        if tip is None or self.tip_target is None:
            return None
        target = self.tip_target[1]
        return 0.0 if math.isclose(tip, target, rel_tol=1e-12) else tip - target

    @property
    def contact_time(self) -> float | None:
        """First contact t_c [s] of an undeformed approach; ``None`` where there is none to compute beforehand."""
        clearance = self.initial_clearance
        if self.beam is None or clearance is None or self.beam.approach == "elastic":
            return None
        velocity = self.beam.initial_velocity_slope * self.beam.length
        if clearance == 0.0 and velocity <= 0.0:
            return 0.0
        return -clearance / velocity if clearance > 0.0 > velocity else math.inf


def _extreme(scene: Scene) -> str:
    """The value furthest from 1, by its place."""
    places = {
        f"[{table}] {key}": float(value)
        for table in ("time", "beam", "spring", "stop", "contact", "coupling")
        for key, value in (getattr(scene, table) or ())
        if isinstance(value, (int, float)) and value != 0.0
    }
    place = max(places, key=lambda name: abs(math.log10(abs(places[name]))))
    return f"{place} = {places[place]!r}"


def _uncomputable(scene: Scene) -> list[str]:
    """What is certain to overflow once the scene runs."""
    suspicions(scene)
    beam = scene.beam
    if beam is not None and not 0.0 < min(quantities := _beam_quantities(beam)) <= max(quantities) < math.inf:
        raise OverflowError
    return []


def _beam_quantities(beam: Beam) -> tuple[float, ...]:
    """What the equations are made of: ρA, ρI, EI, KAG, their wave speeds squared, and 1/k of the tip."""
    stiffness = (bending_stiffness(beam), shear_stiffness(beam))
    inertia = (beam.density * beam.area, beam.density * beam.second_moment_of_area)
    speeds = tuple(k / m if m > 0.0 else math.inf for k, m in zip(stiffness, reversed(inertia), strict=True))
    return (*stiffness, *inertia, *speeds, tip_compliance(beam))


def _bodies(scene: Scene) -> Iterator[str]:
    if scene.beam is None and scene.spring is None:
        yield "no body: a scene needs [beam], [spring] or both"
    if scene.spring is not None and scene.stop is not None and scene.stop.position >= scene.spring.equilibrium:
        yield (
            f"[stop] position = {scene.stop.position}: the foundation must lie below "
            f"[spring] equilibrium = {scene.spring.equilibrium}"
        )


def _spring_holds(scene: Scene) -> Iterator[str]:
    if (spring := scene.spring) is None:
        return
    k1, k2 = spring.linear_stiffness, spring.cubic_stiffness
    if (k2 < 0.0 and k1 <= 0.0) or (k1 < 0.0 and k2 <= 0.0):
        yield (
            f"[spring] linear_stiffness = {k1}: with cubic_stiffness = {k2} the spring pushes away from y = 0 "
            "everywhere; one of them must be greater than 0"
        )
    elif k2 < 0.0 and abs(spring.equilibrium) >= (hilltop := math.sqrt(k1 / -k2)):
        yield (
            f"[spring] equilibrium = {spring.equilibrium}: the softening spring escapes from beyond "
            f"|y| = √(linear_stiffness/|cubic_stiffness|) = {hilltop:.6g} m; it must start inside"
        )
    elif k2 < 0.0:
        free = scene.beam is None and (spring.external_force > 0.0 or scene.stop is None)
        if free and abs(spring.external_force) >= (largest := _largest_load(spring)):
            yield (
                f"[spring] external_force = {spring.external_force}: the softening spring can hold less than "
                f"2/3 linear_stiffness √(linear_stiffness/3|cubic_stiffness|) = {largest:.6g} N"
            )
            return
        # Nothing takes energy away or pushes back: what is above the rim of the well runs over it.
        lossless = (
            scene.beam is None and spring.damping == 0.0 and (scene.stop is None or scene.stop.restitution == 1.0)
        )
        energy, depth = _spring_energy(spring), _well_depth(scene)
        if lossless and energy > depth:
            yield (
                f"[spring] cubic_stiffness = {k2}: the softening spring starts with {energy:.6g} J and escapes from a "
                f"well {depth:.6g} J deep; use a smaller initial_velocity or external_force, an equilibrium nearer to "
                "0, or a larger linear_stiffness"
            )


def _potential(spring: Spring, y: float) -> float:
    """Of the spring and its load [J]."""
    k1, k2 = spring.linear_stiffness, spring.cubic_stiffness
    return y * (y * (0.5 * k1 + 0.25 * k2 * y * y) - spring.external_force)


def _spring_energy(spring: Spring) -> float:
    """At the start, with the load's potential [J]."""
    return 0.5 * spring.mass * spring.initial_velocity**2 + _potential(spring, spring.equilibrium)


def _largest_load(spring: Spring) -> float:
    """Of which a softening spring has an equilibrium, 2/3 k1 √(k1/3|k2|) [N]."""
    return 2.0 / 3.0 * spring.linear_stiffness * math.sqrt(spring.linear_stiffness / (-3.0 * spring.cubic_stiffness))


def _well_depth(scene: Scene) -> float:
    """Potential [J] at the lower rim of a softening spring's well, of those that the foundation does not bar.

    −∞ where the load leaves no well. The rims are the outer roots of k1 y + k2 y³ = f_s: y = 2a cos θ with
    a² = k1/3|k2| and cos 3θ = −f_s/(2|k2|a³) (Viète).
    """
    spring = scene.spring
    assert spring is not None
    a = math.sqrt(spring.linear_stiffness / (-3.0 * spring.cubic_stiffness))
    if not abs(spring.external_force) < _largest_load(spring):
        return -math.inf
    theta = math.acos(-spring.external_force / _largest_load(spring)) / 3.0
    low, high = 2.0 * a * math.cos(theta + 2.0 / 3.0 * math.pi), 2.0 * a * math.cos(theta)
    barred = scene.stop is not None and scene.stop.position > low
    return min(_potential(spring, y) for y in ((high,) if barred else (low, high)))


def _tip_arrives(scene: Scene) -> Iterator[str]:
    beam, target, clearance = scene.beam, scene.tip_target, scene.initial_clearance
    if beam is None or target is None or clearance is None:
        return
    name, height = target
    if clearance < 0.0:
        yield (
            f"[beam] initial_deflection_slope = {beam.initial_deflection_slope}: the tip starts {-clearance:.6g} m "
            f"below {name} = {height}; it must start there or above"
        )
    elif (t_c := scene.contact_time) is not None and t_c > scene.time.t_end:
        when = f"not before t = {t_c:.6g} s, after [time] t_end = {scene.time.t_end}" if math.isfinite(t_c) else "never"
        yield (
            f"[beam] initial_velocity_slope = {beam.initial_velocity_slope}: the undeformed tip reaches "
            f'{name} = {height} {when}; use a (more) negative initial_velocity_slope, or approach = "elastic"'
        )


def _law_applies(scene: Scene) -> Iterator[str]:
    beam, contact, coupling = scene.beam, scene.contact, scene.coupling
    if contact.law == "paper":
        for table in ("beam", "spring", "stop"):
            if getattr(scene, table) is None:
                yield f'[contact] law = "paper": Algorithm 1 needs a [{table}]'
        if beam is not None and beam.integrator == "generalized_alpha" and beam.rho_inf != 1.0:
            yield f'[beam] rho_inf = {beam.rho_inf}: [contact] law = "paper" is the midpoint rule, rho_inf = 1'
    if contact.law == "compliance":
        if contact.stiffness == 0.0:
            yield (
                '[contact] stiffness = 0.0: with law = "compliance" nothing would hold the bodies apart; it must be '
                "greater than 0"
            )
        if coupling.scheme not in ORDINARY_SCHEMES and (
            coupling.scheme in ("hermite", *DISPLACEMENT_DRIVEN) or coupling.degree != 0
        ):
            yield (
                f'[coupling] scheme = "{coupling.scheme}", degree = {coupling.degree}: [contact] law = "compliance" '
                'needs scheme = "energy" and degree = 0 (its discrete gradient), "gauss_seidel" or "jacobi"'
            )
    elif coupling.scheme in ORDINARY_SCHEMES:
        yield (
            f'[coupling] scheme = "{coupling.scheme}": exchanges the force of [contact] law = "compliance"; '
            f'law = "{contact.law}" needs "energy" or "hermite"'
        )
    elif coupling.scheme in DISPLACEMENT_DRIVEN and (beam is None or scene.spring is None):
        yield (
            f'[coupling] scheme = "{coupling.scheme}": moves the spring to where the tip went; needs a [beam] and a '
            "[spring]"
        )


def _feedback_negligible(scene: Scene) -> Iterator[str]:
    beam, spring, contact, coupling = scene.beam, scene.spring, scene.contact, scene.coupling
    if coupling.feedback == "two_way":
        return
    name = f'[coupling] feedback = "{coupling.feedback}"'
    if beam is None or spring is None:
        yield f'{name}: there is one body only; use "two_way"'
        return
    if contact.law != "compliance" or coupling.scheme not in ("energy", "auto"):
        yield (
            f'{name}: needs [contact] law = "compliance" and [coupling] scheme = "energy"; a tie is felt by both ends. '
            'Use "two_way"'
        )
    if coupling.feedback == "spring_drives" and (spring.cubic_stiffness != 0.0 or spring.linear_stiffness <= 0.0):
        yield (
            f"{name}: what it neglects is bounded for a linear spring only; linear_stiffness must be greater than 0 "
            'and cubic_stiffness 0.0, or use "two_way"'
        )
        return
    # A contact of depth p has V = 2 λ p, whatever p.
    share = 4.0 * contact.stiffness / (scene.driver_stiffness or math.inf)
    if contact.exponent == 1.0 and share > coupling.feedback_tolerance:
        yield (
            f"{name}: neglects up to 4·stiffness/(stiffness of the driving end) = {share:.2g} of the penetration; "
            f'allowed is feedback_tolerance = {coupling.feedback_tolerance:g}. Use "two_way", or allow more'
        )


def _inertia_needed(scene: Scene) -> Iterator[str]:
    beam, contact, scheme = scene.beam, scene.contact, scene.coupling.scheme
    if beam is None or beam.fidelity == "dynamic":
        return
    name = '[beam] fidelity = "quasi_static"'
    if scene.spring is None:
        yield f'{name}: a beam without inertia moves with a [spring] or not at all; use fidelity = "dynamic"'
    if contact.law == "compliance" and scene.coupling.feedback != "beam_drives":
        yield (
            f'{name}: is in series with the compliance of [contact] law = "compliance", and what lies between them has '
            'no inertia; use law = "transmission", fidelity = "dynamic", or neglect the force on the beam: '
            '[coupling] feedback = "beam_drives"'
        )
    if contact.law == "paper":
        yield f'{name}: [contact] law = "paper" integrates the beam by (62); use fidelity = "dynamic"'
    if contact.law == "transmission" and contact.impact == "tip":
        yield (
            f'{name}: [contact] impact = "tip" gives the spring the velocity of the tip, which without inertia has '
            'none of its own; use impact = "inelastic"'
        )
    if scheme == "hermite":
        yield (
            f'{name}: [coupling] scheme = "hermite" sets the velocity of the tip, which without inertia is the '
            'spring\'s; use scheme = "energy"'
        )
    if beam.approach == "elastic":
        if beam.initial_velocity_slope != 0.0:
            yield (
                f"[beam] initial_velocity_slope = {beam.initial_velocity_slope}: without inertia, and approach = "
                '"elastic", nothing carries a velocity; use 0.0, or fidelity = "dynamic"'
            )
        if beam.alpha_b == 0.0 and beam.initial_deflection_slope != 0.0:
            yield (
                f"[beam] initial_deflection_slope = {beam.initial_deflection_slope}: without inertia and damping the "
                'beam starts in its static deflection; use 0.0, approach = "undeformed", or alpha_b > 0'
            )


def _coupling_resolves(scene: Scene) -> Iterator[str]:
    beam, coupling, t_end = scene.beam, scene.coupling, scene.time.t_end
    if coupling.macro_step is None:
        key = next(key for key in _TOLERANCES if getattr(coupling, key) is not None)
        if scene.contact.law == "paper":
            yield f'[coupling] {key}: [contact] law = "paper" is Algorithm 1, which has one macro_step'
        if coupling.scheme in ORDINARY_SCHEMES:
            yield f'[coupling] {key}: scheme = "{coupling.scheme}" never repeats a step; give macro_step instead'
    elif coupling.macro_step > t_end:
        yield f"[coupling] macro_step = {coupling.macro_step}: must be at most [time] t_end = {t_end}"
    elif t_end / coupling.macro_step > MOST_MACRO_STEPS:
        yield (
            f"[coupling] macro_step = {coupling.macro_step}: [time] t_end = {t_end} would take "
            f"{t_end / coupling.macro_step:.1e} macro steps; at most {MOST_MACRO_STEPS:.0e} are allowed"
        )
    if beam is not None and beam.integrator == "generalized_alpha":
        remedy = '[beam] integrator = "generalized_alpha" sees only the mean of the contact force; use "modal"'
        if coupling.scheme == "hermite":
            yield f'[coupling] scheme = "hermite": {remedy}, or scheme = "energy"'
        elif coupling.degree > 0:
            yield f"[coupling] degree = {coupling.degree}: {remedy}, or degree = 0"


#: What cannot be run although each value is allowed; each yields ``[table] key = value: reason and remedy``.
_CHECKS = (
    _bodies,
    _spring_holds,
    _tip_arrives,
    _law_applies,
    _inertia_needed,
    _feedback_negligible,
    _coupling_resolves,
)

_TABLES: dict[str, type[_Table]] = {
    "time": Time,
    "beam": Beam,
    "spring": Spring,
    "stop": Stop,
    "contact": Contact,
    "coupling": Coupling,
}


def locking(beam: Beam) -> float:
    """Static tip stiffness of the mesh over that of the beam, with full integration (model.md, "Locking")."""
    if beam.fidelity == "quasi_static" or beam.reduced_integration or beam.element_degree > 2:
        return 1.0
    bending, shear, h = bending_stiffness(beam), shear_stiffness(beam), beam.length / beam.n_elements
    if beam.element_degree == 1:
        return 1.0 + shear * h**2 / (12.0 * bending)
    compliance = tip_compliance(beam)
    missing = beam.length * h**2 / (12.0 * bending) / (1.0 + 60.0 * bending / (shear * h**2))
    return compliance / (compliance - missing)


def _beam_energy(scene: Scene) -> float:
    """Kinetic, and of the shear of a straight slope, as the beam arrives [J]; without the work of its loads."""
    if (beam := scene.beam) is None or beam.fidelity == "quasi_static":
        return 0.0
    target, slope = scene.tip_target, beam.initial_deflection_slope
    if beam.approach == "undeformed" and target is not None:
        slope = target[1] / beam.length
    kinetic = beam.density * beam.area * beam.length**3 * beam.initial_velocity_slope**2 / 6.0
    return kinetic + 0.5 * shear_stiffness(beam) * beam.length * slope**2


def suspicions(scene: Scene) -> list[str]:
    """What can be run but may not be meant; for a run's warnings."""
    found = []
    beam, spring = scene.beam, scene.spring
    if spring is not None and spring.cubic_stiffness < 0.0:
        energy, depth = _spring_energy(spring) + _beam_energy(scene), _well_depth(scene)
        if energy > depth:
            deep = f"well is {depth:.3g} J deep" if depth > -math.inf else "well is gone under external_force"
            found.append(
                f"[spring] cubic_stiffness = {spring.cubic_stiffness}: the motion starts with {energy:.3g} J, the "
                f"softening spring's {deep}; the run stops should it escape"
            )
    if beam is not None and (factor := locking(beam)) > 1.05:
        found.append(
            f"[beam] n_elements = {beam.n_elements}: full integration locks, the beam is {factor:.3g} times too "
            "stiff; use reduced_integration = true, element_degree = 3, or more elements"
        )
    if beam is not None and beam.fidelity == "quasi_static" and scene.spring is not None:
        share = tip_inertia(beam) / scene.spring.mass
        if share > 0.05 and scene.contact.law == "transmission":
            found.append(
                f'[beam] fidelity = "quasi_static": leaves out an inertia that at the tip is {share:.2g} of the '
                f"spring's mass; the joined motion is about {math.sqrt(1.0 + share) - 1.0:.0%} too fast"
            )
        if beam.approach == "undeformed" and beam.initial_velocity_slope != 0.0:
            energy = beam.density * beam.area * beam.length**3 * beam.initial_velocity_slope**2 / 6.0
            found.append(
                f'[beam] fidelity = "quasi_static": the beam arrives without its kinetic energy, {energy:.3g} J; its '
                "blow, and the vibration it leaves, are not in the result"
            )
    return found


def shipped_scenes() -> dict[str, Path]:
    """Names and files of the scenes that come with the package."""
    folder = Path(str(resources.files("springbeam") / "scenes"))
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def load_scene(path_or_name: str | Path, overrides: Iterable[str] = ()) -> Scene:
    """Read and validate a scene.

    Parameters
    ----------
    path_or_name
        A TOML file, or the name of a shipped scene.
    overrides
        ``"table.key=value"`` strings, the value in TOML syntax (a bare word is taken as a string).

    Raises
    ------
    SceneError
        If the file cannot be read or the scene cannot be run.
    """
    path = _scene_file(path_or_name)
    if (size := path.stat().st_size) > LONGEST_FILE:
        raise SceneError(f"{path}: {size} bytes, more than a scene has; at most {LONGEST_FILE} are read")
    try:
        text = path.read_text(encoding="utf-8-sig")
        data = tomllib.loads(text)
    except OSError as error:
        raise SceneError(f"{path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise SceneError(f"{path}: not TOML, which is text in UTF-8: {error.reason} at byte {error.start}") from error
    except tomllib.TOMLDecodeError as error:
        raise SceneError(f"{path}: not TOML: {error}{_line_of(error, text)}; {_TOML_IS}") from error
    except ValueError as error:  # Python's own limit on the digits of an integer
        raise SceneError(f"{path}: a number in it has more digits than can be read") from error
    except RecursionError as error:
        raise SceneError(f"{path}: nested too deeply; a scene has tables with plain values in them") from error
    changes = {_override(data, override): override for override in overrides}
    try:
        return scene_from_dict(data, source=str(path))
    except SceneError as error:
        raise SceneError(_blamed(str(error), str(path), changes)) from None


def _line_of(error: Exception, text: str) -> str:
    """The line that a TOML error is about, for its message."""
    found = re.search(r"at line (\d+)", str(error))
    lines = text.splitlines()
    return f": {_one_line(lines[int(found[1]) - 1].strip())}" if found and int(found[1]) <= len(lines) else ""


def _blamed(message: str, path: str, changes: Mapping[tuple[str, str], str]) -> str:
    """The message with ``--set`` named instead of the file where it is about a value given there."""
    lines = []
    for line in message.splitlines():
        said = line.removeprefix(f"{path}: ")
        found = re.match(r"\[(\w+)\](?: (\w+))?", said)
        given = [
            text for (table, key), text in changes.items() if found and found[1] == table and found[2] in (key, None)
        ]
        source = f"--set {given[-1]}" if given else f"{path} with --set" if changes else path
        lines.append(f"{source}: {said}")
    return "\n".join(lines)


def scene_from_dict(data: dict[str, Any], source: str = "scene") -> Scene:
    """Validate a scene given as nested dictionaries; ``source`` names it in errors."""
    try:
        return Scene.model_validate(data)
    except ValidationError as error:
        lines = [line for e in error.errors() for line in _explain(e)]
        raise SceneError("\n".join(f"{source}: {line}" for line in lines)) from None


def with_changes(scene: Scene, **tables: Mapping[str, Any] | None) -> Scene:
    """A validated copy with keys changed: ``with_changes(scene, coupling={"macro_step": 1e-3})``.

    ``None`` takes a table out: ``with_changes(scene, stop=None)``.
    """
    data = scene.model_dump(exclude_none=True)
    for table, changes in tables.items():
        if changes is None:
            data[table] = None
            continue
        content = data.setdefault(table, {})
        for key, value in changes.items():
            _change(content, key, value)
    return scene_from_dict({table: content for table, content in data.items() if content is not None})


def scene_keys() -> list[str]:
    """All keys as ``table.key``."""
    return [f"{table}.{key}" for table, model in _TABLES.items() for key in model.model_fields]


def key_kind(table: str, key: str) -> type:
    """What ``[table] key`` takes, of int, float, bool and str. Raises SceneError if there is no such key."""
    if table not in _TABLES:
        raise SceneError(_explain_top("extra_forbidden", {}, table))
    if key not in _TABLES[table].model_fields:
        raise SceneError(f"[{table}] {key}: unknown key; {_nearest_key(table, key)}")
    kinds = {get_origin(part) or part for part in _alternatives(_TABLES[table].model_fields[key].annotation)}
    return next((kind for kind in (int, bool, float) if kind in kinds), str)


def _alternatives(annotation: Any) -> tuple[Any, ...]:
    return get_args(annotation) if get_origin(annotation) in (Union, UnionType) else (annotation,)


def _scene_file(path_or_name: str | Path) -> Path:
    shipped = shipped_scenes()
    if str(path_or_name) in shipped:
        return shipped[str(path_or_name)]
    path = Path(path_or_name)
    try:
        if path.is_file():
            return path
        what = "is a directory" if path.is_dir() else "not a file" if path.exists() else "no such file"
    except OSError as error:  # a name too long
        raise SceneError(f"{_one_line(str(path))}: {error.strerror}") from error
    if path.suffix != ".toml":
        what += ", and not a shipped scene"
    raise SceneError(f"{path_or_name}: {what}; {_nearest(path.stem, shipped)}shipped scenes: {', '.join(shipped)}")


def _override(data: dict[str, Any], override: str) -> tuple[str, str]:
    """Returns the table and the key that it has set."""
    target, separator, text = override.partition("=")
    table, dot, key = (part.strip() for part in target.partition("."))
    if not (separator and dot and table and key):
        raise SceneError(f"--set {override}: must be TABLE.KEY=VALUE, as in coupling.macro_step=1e-3")
    content = data.setdefault(table, {})
    if not isinstance(content, dict):
        raise SceneError(f"--set {override}: {table} is not a table; tables: {', '.join(_TABLES)}")
    _change(content, key, parse_value(text.strip()))
    return table, key


def _change(content: dict[str, Any], key: str, value: Any) -> None:
    """Set a key of a table; a macro step takes the place of tolerances, and the other way round."""
    for other in _TOLERANCES if key == _STEP else (_STEP,) if key in _TOLERANCES else ():
        content.pop(other, None)
    content[key] = value


def parse_value(text: str) -> Any:
    """A value in TOML syntax; what is none is a bare word, taken as a string."""
    try:
        parsed = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        parsed = {}
    if parsed.keys() == {"value"}:
        return parsed["value"]
    try:
        return float(text)  # ".5" and "1." are not TOML
    except ValueError:
        return text


def _explain(error: Any) -> list[str]:
    """Lines ``[table] key = value: what is wrong and what would be allowed`` for one of pydantic's errors."""
    kind, value, loc = error["type"], error["input"], [str(part) for part in error["loc"]]
    if kind == "value_error":
        prefix = f"[{loc[0]}] " if loc else ""
        return [prefix + line for line in error["msg"].removeprefix("Value error, ").splitlines()]
    if len(loc) == 1:
        return [_explain_top(kind, value, loc[0])]
    table, key = loc[0], ".".join(map(_bare, loc[1:]))
    if kind == "extra_forbidden":
        return [f"[{table}] {key}: unknown key; {_nearest_key(table, key)}"]
    if kind == "missing":
        return [f"[{table}] {key}: missing; must be {_allowed(_TABLES[table].model_fields[key])}"]
    return [f"[{table}] {key} = {_toml(value)}: must be {_allowed(_TABLES[table].model_fields[key])}"]


def _explain_top(kind: str, value: Any, name: str) -> str:
    if kind == "missing":
        return f"[{name}]: missing table; it must have {', '.join(_TABLES[name].model_fields)}"
    if kind == "extra_forbidden" and isinstance(value, dict):
        return f"[{_bare(name)}]: unknown table; {_nearest(name, _TABLES)}allowed: {', '.join(_TABLES)}"
    if kind == "extra_forbidden":
        return f"{_bare(name)} = {_toml(value)}: unknown key outside a table; {_nearest_key('', name)}"
    allowed = _allowed(Scene.model_fields[name]) if name not in _TABLES else f"a table, written as [{name}]"
    return f"{name} = {_toml(value)}: must be {allowed}"


def _nearest(name: str, candidates: Iterable[str]) -> str:
    close = difflib.get_close_matches(name, candidates, n=1)
    return f"did you mean {close[0]}? " if close else ""


def _nearest_key(table: str, key: str) -> str:
    here = list(_TABLES[table].model_fields) if table else ["title", *(f"[{name}]" for name in _TABLES)]
    elsewhere = [name for name, model in _TABLES.items() if key in model.model_fields]
    hint = f"it belongs to [{elsewhere[0]}]; " if elsewhere else _nearest(key, here)
    return f"{hint}allowed: {', '.join(here)}"


def _allowed(field: FieldInfo) -> str:
    """What a key may be, in words, from its declaration."""
    if get_origin(field.annotation) is Literal:
        return " or ".join(_toml(choice) for choice in get_args(field.annotation))
    nouns: dict[Any, str] = {bool: "true or false", str: "a text in quotes", int: "a whole number"}
    noun = nouns.get(field.annotation, "a finite number")
    bounds = {
        name: value
        for m in field.metadata
        for name in ("gt", "ge", "le", "lt")
        if (value := getattr(m, name, None)) is not None
    }
    words = {"gt": "greater than", "ge": "at least", "le": "at most", "lt": "less than"}
    return " ".join([noun, " and ".join(f"{words[name]} {value:.15g}" for name, value in bounds.items())]).strip()


def _toml(value: Any) -> str:
    """A value as it may stand in a file, in one line of at most 60 characters."""
    if isinstance(value, dict):
        return "{…}"
    if isinstance(value, (bool, str)):
        return _one_line(json.dumps(value, ensure_ascii=False))
    if isinstance(value, (datetime.date, datetime.time)):
        return value.isoformat()
    if isinstance(value, list):
        shown = [_toml(item) if not isinstance(item, list) else "[…]" for item in value[:8]]
        return _one_line(f"[{', '.join(shown)}{', …' if len(value) > 8 else ''}]")
    if isinstance(value, int) and value.bit_length() > 1000:  # more digits than Python may convert
        return _one_line(hex(value)[:50] + "…")
    return _one_line(repr(value))


def _bare(key: str) -> str:
    """A key as it may stand in a file."""
    return _one_line(key if re.fullmatch("[A-Za-z0-9_.-]+", key) else json.dumps(key, ensure_ascii=False))


def _one_line(text: str, longest: int = 60) -> str:
    text = "".join(c if c.isprintable() else "�" for c in text)
    return text if len(text) <= longest else text[: longest - 1] + "…"
