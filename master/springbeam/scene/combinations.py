"""Keys that do not go together, as a table."""

from __future__ import annotations

from collections.abc import Callable

from .laws import laws_that
from .partners import RigidWall
from .scene import Scene
from .tables import ORDINARY_SCHEMES, Beam, Contact, Spring


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


#: When a scene breaks a rule, and what is said then: ``{table.key}`` stands for a key with its value.
FORBIDDEN: tuple[tuple[Callable[[Scene], bool], str], ...] = (
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
    # A start at rest
    (
        lambda s: s.static and s.beam is not None and s.beam.approach == "undeformed",
        '{time.initial_state}: bends the beam from the start; use approach = "elastic" with it, not {beam.approach}',
    ),
    (
        lambda s: s.static and s.contact.algorithm,
        "{time.initial_state}: {contact.law} starts as the paper says; leave initial_state out",
    ),
    *(
        (
            lambda s, table=table: s.static and not isinstance(s.under(table), Beam | Spring | RigidWall | None),
            f"{{time.initial_state}}: where the body in [{table}] rests is known of our own beam and spring and of a "
            "rigid_wall only; leave initial_state out",
        )
        for table in ("beam", "spring")
    ),
    *(
        (
            lambda s, table=table, key=key: s.static and getattr(s.under(table), key, 0.0) != 0.0,
            f"{{{table}.{key}}}: {{time.initial_state}} is at rest where the loads hold it; leave {key} out",
        )
        for table, key in (
            ("beam", "initial_deflection_slope"),
            ("beam", "initial_velocity_slope"),
            ("spring", "initial_velocity"),
        )
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
