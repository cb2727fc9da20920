"""Rules for several keys together: scenes that cannot be run although each value is allowed.

Most are lines of the table `combinations.FORBIDDEN`. Those that need numbers are functions here, which yield the lines
to show; ``at("table.key")`` writes a key with its value.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial

from .combinations import FORBIDDEN
from .linearised import largest_load, spring_energy, well_depth
from .loads import MOST_POINTS
from .messages import at, filled
from .partners import ForeignFmu, PointMass, RigidWall
from .scene import Scene
from .statics import bending_stiffness, shear_stiffness, tip_compliance
from .suspicions import suspicions
from .tables import DEFAULT_STEP, ORDINARY_SCHEMES, TOLERANCE_KEYS, Beam, Spring

#: More are a mistyped macro step: two weeks at a microsecond a step.
MOST_MACRO_STEPS = 1e12

#: Returns ``[table] key = value`` for ``"table.key"``.
At = Callable[[str], str]


def impossible(scene: Scene) -> list[str]:
    """Return why ``scene`` cannot be run, as lines ``[table] key = value: reason and remedy``; empty if it can."""
    try:
        found = [filled(scene, text) for broken, text in FORBIDDEN if broken(scene)]
        found += [line for check in _CHECKS for line in check(scene, partial(at, scene))]
        if not found:
            beam = scene.beam
            if beam is not None and not 0.0 < min(quantities := _beam_quantities(beam)) <= max(quantities) < math.inf:
                raise OverflowError
            suspicions(scene)  # what is certain to overflow once the scene runs overflows here
    except ArithmeticError:
        found = ["no double holds what follows from these values; check their units: " + _extreme(scene)]
    return found


def _extreme(scene: Scene) -> str:
    """Return the value furthest from 1, with its place."""
    sizes = {
        place: abs(math.log10(abs(value)))
        for place, value in scene.flat().items()
        if "." in place and isinstance(value, (int, float)) and value != 0.0
    }
    return at(scene, max(sizes, key=lambda place: sizes[place]))


def _beam_quantities(beam: Beam) -> tuple[float, ...]:
    """Return ρA, ρI, EI, KAG, the squares of their wave speeds, and 1/k of the tip: what the equations are made of."""
    stiffness = (bending_stiffness(beam), shear_stiffness(beam))
    inertia = (beam.density * beam.area, beam.density * beam.second_moment_of_area)
    speeds = tuple(k / m if m > 0.0 else math.inf for k, m in zip(stiffness, reversed(inertia), strict=True))
    return (*stiffness, *inertia, *speeds, tip_compliance(beam))


def _partners_fit(scene: Scene, at: At) -> Iterator[str]:
    """Yield what only our own bodies can do."""
    contact = scene.contact
    for table, body in scene.partners.items():
        foreign = isinstance(body, ForeignFmu)
        name = at(f"{table}.fmu" if foreign else f"{table}.element")
        if contact.algorithm:
            yield f"{name}: {at('contact.law')} is Algorithm 1, which needs our own bodies; take another law"
        if scene.coupling.feedback != "two_way":
            yield f'{name}: {at("coupling.feedback")} bounds what it neglects for our own bodies only; use "two_way"'
        if scene.massless and contact.facts.strikes:
            yield (
                f"{name}: {at('contact.law')} needs our own spring below {at('beam.fidelity')}; "
                'use law = "tie", or fidelity = "dynamic"'
            )
        end = "spring" if table == "spring" else "tip"
        for number, load in enumerate(scene.loads):
            on = at(f"loads.{number}.on")
            if load.on == "beam" and table == "beam":
                yield f'{on}: acts along our own beam; on = "tip" acts on the end of another body in [beam]'
            elif load.on == "base" and foreign:
                yield f'{on}: which masses are in the FMU of [{table}] is not known; give a force, on = "{end}"'
            elif load.on == end and isinstance(body, RigidWall):
                yield f"{on}: {name} moves under no load; take the load out"


def _spring_holds(scene: Scene, at: At) -> Iterator[str]:
    if (spring := scene.spring) is None:
        return
    k1, k2 = spring.linear_stiffness, spring.cubic_stiffness
    if (k2 < 0.0 and k1 <= 0.0) or (k1 < 0.0 and k2 <= 0.0):
        yield (
            f"{at('spring.linear_stiffness')}: with cubic_stiffness = {k2} the spring pushes away from y = 0 "
            "everywhere; one of them must be greater than 0"
        )
    elif k2 < 0.0 and abs(spring.equilibrium) >= (hilltop := math.sqrt(k1 / -k2)):
        yield (
            f"{at('spring.equilibrium')}: the softening spring escapes from beyond "
            f"|y| = √(linear_stiffness/|cubic_stiffness|) = {hilltop:.6g} m; it must start inside"
        )
    elif k2 < 0.0 and not scene.static:
        free = scene.beam is None and (spring.external_force > 0.0 or scene.stop is None)
        if free and abs(spring.external_force) >= (largest := largest_load(spring)):
            yield (
                f"{at('spring.external_force')}: the softening spring can hold less than "
                f"2/3 linear_stiffness √(linear_stiffness/3|cubic_stiffness|) = {largest:.6g} N"
            )
            return
        # Nothing takes energy away or pushes back: what is above the rim of the well runs over it.
        elastic = scene.stop is None or scene.stop.restitution == 1.0
        energy, depth = spring_energy(spring), well_depth(scene)
        if scene.beam is None and spring.damping == 0.0 and elastic and energy > depth:
            yield (
                f"{at('spring.cubic_stiffness')}: the softening spring starts with {energy:.6g} J and escapes from a "
                f"well {depth:.6g} J deep; use a smaller initial_velocity or external_force, an equilibrium nearer to "
                "0, or a larger linear_stiffness"
            )


def _tip_arrives(scene: Scene, at: At) -> Iterator[str]:
    tip, target, clearance, t_c = scene.tip_at_start, scene.tip_target, scene.initial_clearance, scene.contact_time
    if tip is None or target is None or clearance is None:
        return
    if clearance < 0.0:
        yield f"{at(tip.key)}: the tip starts {-clearance:.6g} m below {at(target.key)}; it must start there or above"
    elif t_c is not None and t_c > scene.time.t_end:
        when = f"not before t = {t_c:.6g} s, after {at('time.t_end')}" if math.isfinite(t_c) else "never"
        yield (
            f"{at('beam.initial_velocity_slope')}: the undeformed tip reaches {at(target.key)} {when}; "
            'use a (more) negative initial_velocity_slope, or approach = "elastic"'
        )


def _nothing_moves_before(scene: Scene, at: At) -> Iterator[str]:
    """Yield what would move while an undeformed tip approaches, for nothing is integrated until it arrives."""
    t_c, lower = scene.contact_time, scene.lower
    if t_c is None or not 0.0 < t_c < math.inf:
        return
    approach, remedy = at("beam.approach"), 'or use approach = "elastic"'
    for key in ("initial_velocity", "velocity"):
        if isinstance(lower, Spring | PointMass) and getattr(lower, key, 0.0) != 0.0:
            yield (
                f"{at(f'spring.{key}')}: {approach} holds everything until the tip arrives at t = {t_c:.6g} s; start "
                f"at rest, {remedy}"
            )
    for number, load in enumerate(scene.loads):
        acts = load.on != "spring" or lower is not None
        if acts and load.peak > 0.0 and load.begins < t_c:
            yield (
                f"{at(f'loads.{number}.signal')}: acts before the tip arrives at t = {t_c:.6g} s, and {approach} holds "
                f"everything until then; give a start from there on, {remedy}"
            )


def _heights_fit(scene: Scene, at: At) -> Iterator[str]:
    contact, tip, top, stop = scene.contact, scene.tip_at_start, scene.top_at_start, scene.stop
    if stop is not None and top is not None and stop.position >= top.value:
        yield f"{at('stop.position')}: the foundation must lie below {at(top.key)}"
    if not (contact.lasting and contact.rigid) or tip is None or top is None:
        return
    if not math.isclose(tip.value, top.value, rel_tol=1e-12):
        yield (
            f'{at(tip.key)}: the tip starts at {tip.value:.6g} m, but law = "{contact.law}" holds it at {at(top.key)}; '
            'let them start at one height, or use "link"'
        )


def _feedback_negligible(scene: Scene, at: At) -> Iterator[str]:
    contact, coupling = scene.contact, scene.coupling
    # A contact of depth p has V = 2 λ p, whatever p.
    share = 4.0 * contact.stiffness / (scene.driver_stiffness or math.inf)
    if contact.exponent == 1.0 and "exponent" in contact.facts.takes and share > coupling.feedback_tolerance:
        yield (
            f"{at('coupling.feedback')}: neglects up to 4·stiffness/(stiffness of the driving end) = {share:.2g} of "
            f"the penetration; allowed is feedback_tolerance = {coupling.feedback_tolerance:g}. "
            'Use "two_way", or allow more'
        )


def _coupling_resolves(scene: Scene, at: At) -> Iterator[str]:
    coupling, H, t_end = scene.coupling, scene.coupling.macro_step, scene.time.t_end
    if scene.accuracy is not None:
        return  # it picks scheme, degree and steps that go together
    if H is None:
        tolerance = next(at(f"coupling.{key}") for key in TOLERANCE_KEYS if getattr(coupling, key) is not None)
        if scene.contact.algorithm:
            yield f"{tolerance}: {at('contact.law')} is Algorithm 1, which has one macro_step"
        if coupling.scheme in ORDINARY_SCHEMES:
            yield f'{tolerance}: scheme = "{coupling.scheme}" never repeats a step; give macro_step instead'
    elif t_end < H:
        default = ", the default" if H == DEFAULT_STEP else ""
        yield (
            f"{at('coupling.macro_step')}{default}: must be at most {at('time.t_end')}; give a smaller one, or an "
            "accuracy, which picks one"
        )
    elif t_end / H > MOST_MACRO_STEPS:
        yield (
            f"{at('coupling.macro_step')}: {at('time.t_end')} would take {t_end / H:.1e} macro steps; at most "
            f"{MOST_MACRO_STEPS:.0e} are allowed"
        )


def _loads_act(scene: Scene, at: At) -> Iterator[str]:
    points = {load.at for load in scene.loads if load.at is not None}
    if len(points) > MOST_POINTS:
        yield (
            f"[[loads]]: point forces at {len(points)} places, {', '.join(f'{x:g}' for x in sorted(points))}; the "
            f"beam takes them at {MOST_POINTS} at most. Put some at one place, or give them a shape"
        )
    for number, load in enumerate(scene.loads):
        on = at(f"loads.{number}.on")
        for table, acts in (("beam", load.on in ("beam", "tip")), ("spring", load.on == "spring")):
            if acts and scene.under(table) is None:
                yield f"{on}: acts on a [{table}], and this scene has none"
        if scene.massless and load.on != "spring":
            yield (
                f'{on}: {at("beam.fidelity")} takes no loads that vary; use fidelity = "dynamic", or distributed_load '
                "for a constant"
            )
        if scene.contact.algorithm:
            yield f"{on}: {at('contact.law')} is Algorithm 1, which knows constant loads only; take another law"


_CHECKS = (
    _heights_fit,
    _partners_fit,
    _spring_holds,
    _tip_arrives,
    _nothing_moves_before,
    _feedback_negligible,
    _coupling_resolves,
    _loads_act,
)
