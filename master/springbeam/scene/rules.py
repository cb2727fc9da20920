"""Rules for several keys together: scenes that cannot be run although each value is allowed.

Most are a line of the table `_RULES`: when it is broken, and what is said then, where ``{table.key}`` stands for a key
with its value. Those that need numbers yield such lines; there ``at("table.key")`` writes a key with its value.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial

from .laws import laws_that
from .linearised import largest_load, spring_energy, well_depth
from .loads import MOST_POINTS
from .messages import at, filled
from .partners import ForeignFmu, PointMass, RigidWall
from .scene import Scene
from .statics import bending_stiffness, shear_stiffness, tip_compliance
from .suspicions import suspicions
from .tables import DEFAULT_STEP, ORDINARY_SCHEMES, TOLERANCE_KEYS, Beam, Contact, Spring

#: More are a mistyped macro step: two weeks at a microsecond a step.
MOST_MACRO_STEPS = 1e12

#: Returns ``[table] key = value`` for ``"table.key"``.
At = Callable[[str], str]


def impossible(scene: Scene) -> list[str]:
    """Return why ``scene`` cannot be run, as lines ``[table] key = value: reason and remedy``; empty if it can."""
    try:
        found = [filled(scene, text) for broken, text in _RULES if broken(scene)]
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
    elif k2 < 0.0:
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


def _one_way(scene: Scene) -> bool:
    """Return whether one of our own bodies drives the other."""
    return scene.coupling.feedback != "two_way" and scene.beam is not None and scene.spring is not None


def _wall_below(scene: Scene) -> bool:
    return isinstance(scene.lower, RigidWall)


def _averages(scene: Scene) -> bool:
    """Return whether our beam's integrator sees only the mean of a force over a step that the scene asks for."""
    return scene.accuracy is None and scene.beam is not None and scene.beam.integrator == "generalized_alpha"


def _let_go(scene: Scene) -> bool:
    """Return whether our beam has no inertia and is let go at the start."""
    return scene.beam is not None and scene.massless and scene.beam.approach == "elastic"


#: When a scene breaks a rule, and what is said then.
_RULES: tuple[tuple[Callable[[Scene], bool], str], ...] = (
    # Bodies
    (lambda s: s.upper is None and s.lower is None, "no body: a scene needs [beam], [spring] or both"),
    (
        lambda s: isinstance(s.upper, RigidWall) and (s.lower is None or _wall_below(s)),
        "{beam.element}: nothing moves in this scene; give it a body in [spring]",
    ),
    (
        lambda s: _wall_below(s) and s.upper is None,
        "{spring.element}: nothing moves in this scene; give it a body in [beam]",
    ),
    (lambda s: _wall_below(s) and s.upper is not None and s.stop is not None, "{spring.element}: leave [stop] out"),
    (
        lambda s: _wall_below(s) and s.contact.facts.strikes and s.contact.impact == "tip",
        "{contact.impact}: gives the lower body the velocity of the tip, and {spring.element} cannot move; "
        'use impact = "inelastic"',
    ),
    # Laws
    *(
        (
            lambda s, key=key: key in s.contact.facts.needs and key not in s.contact.model_fields_set,
            f"[contact] {key}: missing; {{contact.law}} needs it",
        )
        for key in Contact.model_fields
    ),
    (
        lambda s: s.contact.damping > 0.0 and "damping" not in s.contact.facts.takes,
        f"{{contact.damping}}: {{contact.law}} has none; use 0.0, {laws_that(lambda law: 'damping' in law.takes)}",
    ),
    *(
        (
            lambda s, table=table: s.contact.lasting and s.under(table) is None and not s.elastic_stop,
            f"{{contact.law}}: joins a [beam] and a [spring]; this scene has no [{table}]",
        )
        for table in ("beam", "spring")
    ),
    (
        lambda s: s.contact.lasting and s.contact.soft and s.contact.stiffness == s.contact.damping == 0.0,
        "{contact.stiffness}: {contact.law} needs a stiffness or a damping greater than 0",
    ),
    (
        lambda s: s.contact.lasting and s.contact.rigid and s.contact.impact != "inelastic",
        '{contact.impact}: {contact.law} gives both ends one velocity; use "inelastic"',
    ),
    *(
        (
            lambda s, table=table: s.contact.algorithm and s.under(table) is None,
            f"{{contact.law}}: Algorithm 1 needs a [{table}]",
        )
        for table in ("beam", "spring", "stop")
    ),
    (
        lambda s: s.contact.algorithm and s.beam is not None and s.beam.damped_numerically,
        "{beam.rho_inf}: {contact.law} is the midpoint rule, rho_inf = 1",
    ),
    (
        lambda s: s.contact.facts.opens and s.contact.stiffness == 0.0,
        "{contact.stiffness}: with {contact.law} nothing would hold the bodies apart; it must be greater than 0",
    ),
    (
        lambda s: s.elastic_stop and s.stop is not None and s.stop.restitution != 1.0,
        "{stop.restitution}: {contact.law} makes the stop elastic; leave restitution out, and give its loss by "
        "[contact] damping",
    ),
    # Schemes
    (
        lambda s: s.coupling.scheme == "hermite" and s.coupling.degree == 0,
        "{coupling.degree}: {coupling.scheme} needs degree 1 or 2",
    ),
    (
        lambda s: s.coupling.scheme == "auto" and s.coupling.degree > 0,
        "{coupling.degree}: {coupling.scheme} picks the degree; leave it out",
    ),
    (
        lambda s: s.coupling.scheme in ORDINARY_SCHEMES and s.coupling.degree > 1,
        "{coupling.degree}: {coupling.scheme} extrapolates with degree 0 or 1",
    ),
    (
        lambda s: s.coupling.scheme in ORDINARY_SCHEMES and not s.contact.soft,
        f"{{coupling.scheme}}: needs [contact] law = {laws_that(lambda law: law.soft)}; "
        'use scheme = "energy" or "hermite" with {contact.law}',
    ),
    (
        lambda s: s.coupling.scheme == "hermite" and s.contact.soft,
        '{coupling.scheme}: needs a rigid law; with {contact.law} use scheme = "energy", "gauss_seidel" or "jacobi"',
    ),
    (
        lambda s: s.coupling.scheme == "hermite" and s.contact.impact == "rest" and s.contact.facts.strikes and s.joins,
        "{coupling.scheme}: gives both ends one velocity, but {contact.impact} leaves two; "
        'use scheme = "energy" or impact = "inelastic"',
    ),
    (
        lambda s: _averages(s) and s.coupling.scheme == "hermite",
        '{coupling.scheme}: {beam.integrator} sees only the mean of the contact force; use "modal", or '
        'scheme = "energy"',
    ),
    (
        lambda s: _averages(s) and s.coupling.scheme != "hermite" and s.coupling.degree > 0,
        '{coupling.degree}: {beam.integrator} sees only the mean of the contact force; use "modal", or degree = 0',
    ),
    # A beam without inertia
    (
        lambda s: s.massless and s.lower is None,
        '{beam.fidelity}: a beam without inertia needs a [spring]; use fidelity = "dynamic"',
    ),
    (
        lambda s: s.massless and s.contact.soft and s.contact.lasting and s.coupling.feedback != "beam_drives",
        "{beam.fidelity}: the tip between the beam and {contact.law} would have no inertia; use "
        'law = "tie" or fidelity = "dynamic"',
    ),
    (
        lambda s: s.massless and s.contact.facts.opens and s.coupling.feedback != "beam_drives",
        "{beam.fidelity}: the tip between the beam and {contact.law} would have no inertia; use "
        'law = "transmission", fidelity = "dynamic", or neglect the force on the beam: [coupling] '
        'feedback = "beam_drives"',
    ),
    (
        lambda s: s.massless and s.contact.algorithm,
        '{beam.fidelity}: {contact.law} integrates the beam by (62); use fidelity = "dynamic"',
    ),
    (
        lambda s: s.massless and s.contact.facts.strikes and s.contact.impact == "tip",
        "{beam.fidelity}: {contact.impact} gives the spring the velocity of the tip, which without inertia has none "
        'of its own; use impact = "inelastic"',
    ),
    (
        lambda s: s.massless and s.coupling.scheme == "hermite",
        "{beam.fidelity}: {coupling.scheme} sets the velocity of the tip, which without inertia is the spring's; "
        'use scheme = "energy"',
    ),
    (
        lambda s: _let_go(s) and s.beam is not None and s.beam.initial_velocity_slope != 0.0,
        '{beam.initial_velocity_slope}: without inertia, and approach = "elastic", nothing carries a velocity; '
        'use 0.0, or fidelity = "dynamic"',
    ),
    (
        lambda s: (
            _let_go(s) and s.beam is not None and s.beam.alpha_b == 0.0 and s.beam.initial_deflection_slope != 0.0
        ),
        "{beam.initial_deflection_slope}: without inertia and damping the beam starts in its static deflection; "
        'use 0.0, approach = "undeformed", or alpha_b > 0',
    ),
    # One-way coupling
    (
        lambda s: s.coupling.feedback != "two_way" and not s.joins,
        '{coupling.feedback}: there is one body only; use "two_way"',
    ),
    (
        lambda s: _one_way(s) and (not s.contact.facts.opens or s.coupling.scheme not in ("energy", "auto")),
        f"{{coupling.feedback}}: needs [contact] law = {laws_that(lambda law: law.opens)} and [coupling] "
        'scheme = "energy"; use "two_way" otherwise',
    ),
    (
        lambda s: _one_way(s) and s.contact.damping > 0.0,
        '{coupling.feedback}: its error is unknown for a damped contact; use [contact] damping = 0.0 or "two_way"',
    ),
    (
        lambda s: (
            _one_way(s)
            and s.coupling.feedback == "spring_drives"
            and s.spring is not None
            and (s.spring.cubic_stiffness != 0.0 or s.spring.linear_stiffness <= 0.0)
        ),
        "{coupling.feedback}: its error is known only for a linear spring; linear_stiffness must be greater than 0 "
        'and cubic_stiffness 0.0, or use "two_way"',
    ),
)
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
