"""Rules for several keys together: scenes that cannot be run although each value is allowed."""

from __future__ import annotations

import math
from collections.abc import Iterator

from .loads import MOST_POINTS
from .partner_rules import partners_fit
from .scene import TABLES, Scene
from .statics import bending_stiffness, shear_stiffness, tip_compliance
from .suspicions import suspicions
from .tables import DEFAULT_STEP, ORDINARY_SCHEMES, TOLERANCE_KEYS, Beam
from .well import largest_load, spring_energy, well_depth

#: More are a mistyped macro step: two weeks at a microsecond a step.
MOST_MACRO_STEPS = 1e12


def _extreme(scene: Scene) -> str:
    """Return the value furthest from 1, with its place."""
    places = {
        f"[{table}] {key}": float(value)
        for table in TABLES
        for key, value in (scene.under(table) or ())
        if isinstance(value, (int, float)) and value != 0.0
    }
    place = max(places, key=lambda name: abs(math.log10(abs(places[name]))))
    return f"{place} = {places[place]!r}"


def impossible(scene: Scene) -> list[str]:
    """Return why ``scene`` cannot be run, as lines ``[table] key = value: reason and remedy``; empty if it can."""
    try:
        found = [message for check in _CHECKS for message in check(scene)]
        if not found:
            beam = scene.beam
            if beam is not None and not 0.0 < min(quantities := _beam_quantities(beam)) <= max(quantities) < math.inf:
                raise OverflowError
            suspicions(scene)  # what is certain to overflow once the scene runs overflows here
    except ArithmeticError:
        found = ["no double holds what follows from these values; check their units: " + _extreme(scene)]
    return found


def _beam_quantities(beam: Beam) -> tuple[float, ...]:
    """Return ρA, ρI, EI, KAG, the squares of their wave speeds, and 1/k of the tip: what the equations are made of."""
    stiffness = (bending_stiffness(beam), shear_stiffness(beam))
    inertia = (beam.density * beam.area, beam.density * beam.second_moment_of_area)
    speeds = tuple(k / m if m > 0.0 else math.inf for k, m in zip(stiffness, reversed(inertia), strict=True))
    return (*stiffness, *inertia, *speeds, tip_compliance(beam))


def _bodies(scene: Scene) -> Iterator[str]:
    if scene.upper is None and scene.lower is None:
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
        if free and abs(spring.external_force) >= (largest := largest_load(spring)):
            yield (
                f"[spring] external_force = {spring.external_force}: the softening spring can hold less than "
                f"2/3 linear_stiffness √(linear_stiffness/3|cubic_stiffness|) = {largest:.6g} N"
            )
            return
        # Nothing takes energy away or pushes back: what is above the rim of the well runs over it.
        lossless = (
            scene.beam is None and spring.damping == 0.0 and (scene.stop is None or scene.stop.restitution == 1.0)
        )
        energy, depth = spring_energy(spring), well_depth(scene)
        if lossless and energy > depth:
            yield (
                f"[spring] cubic_stiffness = {k2}: the softening spring starts with {energy:.6g} J and escapes from a "
                f"well {depth:.6g} J deep; use a smaller initial_velocity or external_force, an equilibrium nearer to "
                "0, or a larger linear_stiffness"
            )


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


def _ends_can_be_joined(scene: Scene) -> Iterator[str]:
    beam, contact, tip, top = scene.beam, scene.contact, scene.initial_tip, scene.initial_top
    name = f'[contact] law = "{contact.law}"'
    if contact.damping > 0.0 and contact.law not in ("compliance", "link"):
        yield f'[contact] damping = {contact.damping}: law = "{contact.law}" has none; use 0.0, "compliance" or "link"'
    if not contact.lasting:
        return
    for table in ("beam", "spring"):
        if scene.under(table) is None and not scene.elastic_stop:
            yield f"{name}: joins a [beam] and a [spring]; this scene has no [{table}]"
    if contact.law == "link" and contact.stiffness == contact.damping == 0.0:
        yield f"[contact] stiffness = 0.0: {name} needs a stiffness or a damping greater than 0"
    if contact.law == "tie" and contact.impact != "inelastic":
        yield f'[contact] impact = "{contact.impact}": law = "tie" gives both ends one velocity; use "inelastic"'
    if contact.law == "tie" and tip is not None and top is not None and not math.isclose(tip, top, rel_tol=1e-12):
        key = f"initial_deflection_slope = {beam.initial_deflection_slope}" if beam else "displacement"
        other = "equilibrium" if scene.spring else "displacement"
        yield (
            f"[beam] {key}: the tip starts at {tip:.6g} m, "
            f'but law = "tie" holds it at [spring] {other} = {top}; let them start at one height, or use "link"'
        )


def _law_applies(scene: Scene) -> Iterator[str]:
    beam, contact, coupling = scene.beam, scene.contact, scene.coupling
    if contact.law == "paper":
        for table in ("beam", "spring", "stop"):
            if scene.under(table) is None:
                yield f'[contact] law = "paper": Algorithm 1 needs a [{table}]'
        if beam is not None and beam.mesh == "none":
            yield '[beam] mesh = "none": [contact] law = "paper" integrates the beam by (62), which needs a mesh'
        if beam is not None and beam.integrator == "generalized_alpha" and beam.rho_inf != 1.0:
            yield f'[beam] rho_inf = {beam.rho_inf}: [contact] law = "paper" is the midpoint rule, rho_inf = 1'
    if contact.law == "compliance" and contact.stiffness == 0.0:
        yield (
            '[contact] stiffness = 0.0: with law = "compliance" nothing would hold the bodies apart; it must be '
            "greater than 0"
        )
    if scene.elastic_stop and scene.stop is not None and scene.stop.restitution != 1.0:
        yield (
            f'[stop] restitution = {scene.stop.restitution}: [contact] law = "{contact.law}" makes the stop elastic; '
            "leave restitution out, and give its loss by [contact] damping"
        )
    if coupling.scheme in ORDINARY_SCHEMES and contact.law not in ("compliance", "link"):
        yield (
            f'[coupling] scheme = "{coupling.scheme}": needs [contact] law = "compliance" or "link"; '
            f'use scheme = "energy" or "hermite" with law = "{contact.law}"'
        )
    if coupling.scheme == "hermite" and contact.law in ("compliance", "link"):
        yield (
            f'[coupling] scheme = "hermite": needs a rigid law; with [contact] law = "{contact.law}" use '
            'scheme = "energy", "gauss_seidel" or "jacobi"'
        )
    if coupling.scheme == "hermite" and contact.impact == "rest" and contact.rigid and scene.joins:
        yield (
            '[coupling] scheme = "hermite": gives both ends one velocity, but [contact] impact = "rest" leaves two; '
            'use scheme = "energy" or impact = "inelastic"'
        )


def _feedback_negligible(scene: Scene) -> Iterator[str]:
    beam, spring, contact, coupling = scene.beam, scene.spring, scene.contact, scene.coupling
    if coupling.feedback == "two_way":
        return
    name = f'[coupling] feedback = "{coupling.feedback}"'
    if not scene.joins:
        yield f'{name}: there is one body only; use "two_way"'
    if beam is None or spring is None:
        return
    if contact.law != "compliance" or coupling.scheme not in ("energy", "auto"):
        yield f'{name}: needs [contact] law = "compliance" and [coupling] scheme = "energy"; use "two_way" otherwise'
    if contact.damping > 0.0:
        yield f'{name}: its error is unknown for a damped contact; use [contact] damping = 0.0 or "two_way"'
    if coupling.feedback == "spring_drives" and (spring.cubic_stiffness != 0.0 or spring.linear_stiffness <= 0.0):
        yield (
            f"{name}: its error is known only for a linear spring; linear_stiffness must be greater than 0 "
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
    if scene.lower is None:
        yield f'{name}: a beam without inertia needs a [spring]; use fidelity = "dynamic"'
    if contact.law == "compliance" and scene.coupling.feedback != "beam_drives":
        yield (
            f'{name}: the tip between the beam and [contact] law = "compliance" would have no '
            'inertia; use law = "transmission", fidelity = "dynamic", or neglect the force on the beam: '
            '[coupling] feedback = "beam_drives"'
        )
    if contact.law == "link":
        yield (
            f'{name}: the tip between the beam and [contact] law = "link" would have no inertia; '
            'use law = "tie" or fidelity = "dynamic"'
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
    if scene.accuracy is not None:
        return  # it picks scheme, degree and steps that go together
    if coupling.macro_step is None:
        key = next(key for key in TOLERANCE_KEYS if getattr(coupling, key) is not None)
        if scene.contact.law == "paper":
            yield f'[coupling] {key}: [contact] law = "paper" is Algorithm 1, which has one macro_step'
        if coupling.scheme in ORDINARY_SCHEMES:
            yield f'[coupling] {key}: scheme = "{coupling.scheme}" never repeats a step; give macro_step instead'
    elif coupling.macro_step > t_end:
        default = ", the default" if coupling.macro_step == DEFAULT_STEP else ""
        yield (
            f"[coupling] macro_step = {coupling.macro_step}{default}: must be at most [time] t_end = {t_end}; give a "
            "smaller one, or an accuracy, which picks one"
        )
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


def _loads_act(scene: Scene) -> Iterator[str]:
    beam, points = scene.beam, {load.at for load in scene.loads if load.at is not None}
    if len(points) > MOST_POINTS:
        yield (
            f"[[loads]]: point forces at {len(points)} places, {', '.join(f'{at:g}' for at in sorted(points))}; the "
            f"beam takes them at {MOST_POINTS} at most. Put some at one place, or give them a shape"
        )
    for number, load in enumerate(scene.loads):
        name = f"[loads.{number}]"
        on = f'{name} on = "{load.on}"'
        for table, acts in (("beam", load.on in ("beam", "tip")), ("spring", load.on == "spring")):
            if acts and scene.under(table) is None:
                yield f"{on}: acts on a [{table}], and this scene has none"
        if beam is not None and beam.fidelity == "quasi_static" and load.on != "spring":
            yield (
                f'{on}: [beam] fidelity = "quasi_static" takes no loads that vary; use fidelity = "dynamic", or '
                "distributed_load for a constant"
            )
        if scene.contact.law == "paper":
            yield f'{name}: [contact] law = "paper" is Algorithm 1, which knows constant loads only; take another law'
        if (fault := load.fault()) is not None:
            yield f'{name} file = "{load.file}": {fault}'


#: Checks of what cannot be run although each value is allowed; each yields ``[table] key = value: reason and remedy``.
_CHECKS = (
    _bodies,
    partners_fit,
    _spring_holds,
    _tip_arrives,
    _ends_can_be_joined,
    _law_applies,
    _inertia_needed,
    _feedback_negligible,
    _coupling_resolves,
    _loads_act,
)
