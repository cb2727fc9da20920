"""Errors of scenes whose values are valid one by one: keys and values that contradict each other.

Nearly all of the module is one table of such rules.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from .laws import LAWS
from .linearised import hilltop, largest_load, spring_energy, well_depth
from .loads import MOST_POINTS, Load
from .messages import Rule, at, either, texts_of, texts_of_loads
from .partners import RigidWallElement, SpringDamperElement
from .scene import Scene
from .schemes import DEFAULT_STEP
from .statics import bending_stiffness, shear_stiffness, tip_compliance
from .suspicions import suspicions
from .tables import (
    ALL_MODES_UP_TO,
    MOST_ELEMENTS,
    MOST_MODE_VALUES,
    MOST_MODES,
    Beam,
    Spring,
    Table,
)

#: More are a mistyped macro step: two weeks at a microsecond a step.
MOST_MACRO_STEPS = 1e12


def impossible(scene: Scene) -> list[str]:
    """Return why ``scene`` cannot be run, as lines ``[table] key = value: reason and remedy``; empty if it can."""
    try:
        found = [*texts_of(scene, FORBIDDEN), *texts_of_loads(scene, FORBIDDEN_LOADS)]
        if not found and (scene.beam is None or _is_finite(scene.beam)):
            suspicions(scene)  # what is certain to overflow once the scene runs overflows here
            return []
    except ArithmeticError:
        found = []
    return found or [f"too large or too small to compute with; check the units: {_most_extreme(scene)}"]


def _is_finite(beam: Beam) -> bool:
    """Return whether the coefficients EI, KAG, ρA, ρI, squares of wave speeds and 1/k are finite doubles above 0."""
    stiffness = (bending_stiffness(beam), shear_stiffness(beam))
    inertia = (beam.density * beam.area, beam.density * beam.second_moment_of_area)
    speeds = (k / m for k, m in zip(stiffness, reversed(inertia), strict=True))
    return all(0.0 < x < math.inf for x in (*stiffness, *inertia, *speeds, tip_compliance(beam)))


def _most_extreme(scene: Scene) -> str:
    """Return the value furthest from 1, with its place."""
    values = {place: x for place, x in scene.flat().items() if "." in place and isinstance(x, (int, float)) and x}
    return at(scene, max(values, key=lambda place: abs(math.log10(abs(values[place])))))


def _wall_below(scene: Scene) -> bool:
    return isinstance(scene.lower, RigidWallElement)


def _averages(scene: Scene) -> bool:
    """Return whether a degree above 0 is given, and our beam's integrator depends only on the mean force of a step."""
    return scene.accuracy is None and scene.beam is not None and scene.beam.integrator == "midpoint"


def _rests(body: Table | None) -> bool:
    """Return whether the package can compute the equilibrium of a body under loads; true if there is none."""
    own = isinstance(body, Beam | Spring | RigidWallElement | None)
    return own or (isinstance(body, SpringDamperElement) and body.stiffness > 0.0)


def _gives(body: Table | None, key: str) -> bool:
    """Return whether a body has a ``key`` of its own that is not 0."""
    return body is not None and key in body.model_fields_set and getattr(body, key) != 0.0


def _let_go(scene: Scene) -> bool:
    """Return whether our beam has no inertia and is released at the start."""
    return scene.beam is not None and scene.massless and scene.beam.approach == "elastic"


def _ends(scene: Scene) -> Mapping[str, Any]:
    """Return the positions of both ends at the start, and what the tip meets, for the texts of rules."""
    heights = {"tip": scene.at_start("beam"), "top": scene.at_start("spring"), "target": scene.tip_target}
    return {name: at(scene, height.key) for name, height in heights.items() if height is not None} | {
        "height": heights["tip"].value if heights["tip"] else None,
        "below": -(scene.initial_clearance or 0.0),
        "t_c": scene.contact_time,
    }


def _alone_in_a_well(scene: Scene) -> bool:
    """Return whether our spring softens, starts inside its potential well, and has no beam of ours above it."""
    spring = scene.spring
    return (
        spring is not None
        and spring.softens
        and abs(spring.equilibrium - spring.unloaded) < hilltop(spring)
        and not (scene.static or scene.beam)
    )


def _waits(scene: Scene) -> bool:
    """Return whether an undeformed tip arrives after the start; until then nothing is integrated."""
    return 0.0 < (scene.contact_time or 0.0) < math.inf


def _given_step(scene: Scene) -> bool:
    """Return whether the macro step is given, not found by an accuracy or by tolerances."""
    return scene.accuracy is None and scene.coupling.macro_step is not None


def _points(scene: Scene) -> list[float]:
    """Return the positions of point forces, as fractions of the beam's length."""
    return sorted({load.at for load in scene.loads if load.at is not None})


def _most_elements(beam: Beam) -> int:
    """Return how many elements of its degree a beam may have."""
    return 2 * MOST_ELEMENTS // (beam.element_degree * (beam.element_degree + 1))


def _mesh(scene: Scene) -> Mapping[str, Any]:
    """Return sizes and limits of the mesh of our beam, for the texts of rules."""
    beam = scene.beam
    assert beam is not None
    degree = f" of element_degree = {beam.element_degree}" if beam.element_degree > 1 else ""
    most = min(MOST_MODES, beam.unknowns // 2, MOST_MODE_VALUES // beam.unknowns)
    return {
        "mesh": f"n_elements = {beam.n_elements}{degree}",
        "unknowns": beam.unknowns,
        "most": most,
        "fewer": min(64, most),
        "degree": beam.element_degree,
        "most_elements": _most_elements(beam),
    }


def _moves_without_inertia(scene: Scene) -> bool:
    """Return whether a beam without inertia is released with a velocity."""
    return _let_go(scene) and scene.beam is not None and scene.beam.initial_velocity_slope != 0.0


def _bent_without_damping(scene: Scene) -> bool:
    """Return whether a beam without inertia and damping is released bent."""
    beam = scene.beam
    return _let_go(scene) and beam is not None and beam.alpha_b == 0.0 and beam.initial_deflection_slope != 0.0


def _too_many_modes(scene: Scene) -> bool:
    """Return whether our beam keeps more modes than are found of its mesh."""
    beam = scene.beam
    if beam is None or beam.integrator != "modal" or beam.unknowns <= ALL_MODES_UP_TO:
        return False
    return not 1 <= beam.n_modes <= _mesh(scene)["most"]


def _starts_below_stop(scene: Scene) -> bool:
    """Return whether the lower end starts below the foundation."""
    top = scene.at_start("spring")
    return scene.stop is not None and top is not None and scene.stop.position > top.value


def _tied_apart(scene: Scene) -> bool:
    """Return whether a tie holds ends together that start at different heights."""
    tip = scene.at_start("beam")
    top = scene.at_start("spring")
    if not (scene.contact.lasting and scene.contact.rigid) or tip is None or top is None:
        return False
    return not math.isclose(tip.value, top.value, rel_tol=1e-12)


def _pushes_away(scene: Scene) -> bool:
    """Return whether our spring has no stiffness that holds it."""
    spring = scene.spring
    if spring is None:
        return False
    stiffnesses = (spring.linear_stiffness, spring.cubic_stiffness)
    return min(stiffnesses) < 0.0 >= max(stiffnesses)


def _escapes(scene: Scene) -> bool:
    """Return whether our spring alone starts with more energy than its well holds, and nothing takes it away."""
    spring = scene.spring
    if spring is None or not _alone_in_a_well(scene):
        return False
    lossless = spring.damping == 0.0 and (scene.stop is None or scene.stop.restitution == 1.0)
    return lossless and spring_energy(spring) > well_depth(scene) > -math.inf


def _acts_before_contact(scene: Scene, load: Load) -> bool:
    """Return whether a load moves what an undeformed approach holds."""
    moves = load.peak > 0.0 and (load.on != "spring" or scene.lower is not None)
    return moves and _waits(scene) and load.begins < (scene.contact_time or 0.0)


#: Rules for scenes.
FORBIDDEN: tuple[Rule, ...] = (
    # Bodies
    Rule(lambda s: s.upper is None and s.lower is None, "no body: a scene needs [beam], [spring] or both"),
    Rule(
        lambda s: isinstance(s.upper, RigidWallElement) and (s.lower is None or _wall_below(s)),
        "{beam.element}: nothing moves in this scene; give it a body in [spring]",
    ),
    Rule(
        lambda s: _wall_below(s) and s.upper is None,
        "{spring.element}: nothing moves in this scene; give it a body in [beam]",
    ),
    Rule(lambda s: _wall_below(s) and s.upper is not None and s.stop is not None, "{spring.element}: leave [stop] out"),
    # A start at rest
    Rule(
        lambda s: s.static and s.beam is not None and s.beam.approach == "undeformed",
        '{time.initial_state}: bends the beam from the start; use approach = "elastic" with it, not {beam.approach}',
    ),
    *(
        Rule(
            lambda s, table=table: s.static and not _rests(s.under(table)),
            f"{{time.initial_state}}: the body in [{table}] can't start at rest under loads, only our own beam and "
            "spring, a spring_damper with a stiffness and a rigid_wall can; leave initial_state out",
        )
        for table in ("beam", "spring")
    ),
    *(
        Rule(
            lambda s, table=table, key=key: s.static and _gives(s.under(table), key),
            f"{{{table}.{key}}}: {{time.initial_state}} is at rest where the loads hold it; leave {key} out",
        )
        for table, key in (
            ("beam", "initial_deflection_slope"),
            ("beam", "initial_velocity_slope"),
            ("spring", "initial_velocity"),
            *((table, key) for table in ("beam", "spring") for key in ("displacement", "velocity")),
        )
    ),
    # A gap
    Rule(
        lambda s: s.contact.gap != 0.0 and not (s.lower and s.lower.AT_GAP),
        "{contact.gap}: is the height of the unbent beam above our own spring or an element in [spring]; this scene "
        "has neither; leave gap out",
    ),
    *(
        Rule(
            lambda s, key=key: s.lower and s.contact.gap != 0.0 and key in {*s.lower.AT_GAP} & s.lower.model_fields_set,
            f"{{spring.{key}}}: {{contact.gap}} gives it; leave one of the two out",
        )
        for key in ("equilibrium", "unloaded", "displacement", "rest", "position")
    ),
    # Laws
    *(
        Rule(
            lambda s, table=table: s.contact.lasting and s.under(table) is None and not s.elastic_stop,
            f"{{contact.law}}: joins a [beam] and a [spring]; this scene has no [{table}]",
        )
        for table in ("beam", "spring")
    ),
    Rule(
        lambda s: s.elastic_stop and s.stop is not None and s.stop.restitution != 1.0,
        "{stop.restitution}: {contact.law} makes the stop elastic; leave restitution out, and give its loss by "
        "[contact] damping",
    ),
    # Schemes
    Rule(
        lambda s: s.coupling.exchanges and not s.contact.soft,
        '{coupling.scheme}: needs [contact] law = {soft}; use scheme = "energy" with {contact.law}',
        lambda s: {"soft": either(name for name, law in LAWS.items() if not law.rigid)},
    ),
    Rule(
        lambda s: _averages(s) and s.degree > 0,
        '{coupling.degree}: {beam.integrator} uses only the mean of the contact force; use "modal", or degree = 0',
    ),
    # A beam without inertia
    Rule(
        lambda s: s.massless and s.lower is None,
        '{beam.fidelity}: a beam without inertia needs a [spring]; use fidelity = "dynamic"',
    ),
    Rule(
        lambda s: s.massless and s.contact.soft and s.contact.lasting,
        "{beam.fidelity}: the tip between the beam and {contact.law} would have no inertia; use "
        'law = "tie" or fidelity = "dynamic"',
    ),
    Rule(
        lambda s: s.massless and s.contact.opens,
        "{beam.fidelity}: the tip between the beam and {contact.law} would have no inertia; use "
        'law = "transmission" or fidelity = "dynamic"',
    ),
    Rule(
        _moves_without_inertia,
        '{beam.initial_velocity_slope}: without inertia, and approach = "elastic", nothing carries a velocity; '
        'use 0.0, or fidelity = "dynamic"',
    ),
    Rule(
        _bent_without_damping,
        "{beam.initial_deflection_slope}: without inertia and damping the beam starts in its static deflection; "
        'use 0.0, approach = "undeformed", or alpha_b > 0',
    ),
    # The mesh
    Rule(
        lambda s: s.beam and s.beam.n_elements > _most_elements(s.beam),
        "{beam.n_elements}: with element_degree = {degree} it must be at most {most_elements}",
        _mesh,
    ),
    Rule(
        lambda s: s.beam and s.beam.n_modes > s.beam.unknowns,
        "{beam.n_modes}: {mesh} has only {unknowns} modes; use 0 for all of them",
        _mesh,
    ),
    Rule(
        _too_many_modes,
        "{beam.n_modes}: of the {unknowns} modes of {mesh} at most {most} are found, all only up to "
        f"{ALL_MODES_UP_TO}; use n_modes = {{fewer}}, fewer elements, or "
        'integrator = "midpoint"',
        _mesh,
    ),
    # Heights
    Rule(
        _starts_below_stop,
        "{stop.position}: the foundation must not lie above {top}",
        _ends,
    ),
    Rule(
        _tied_apart,
        "{tip}: the tip starts at {height:.6g} m, but {contact.law} holds it at {top}; let them start at one height, "
        'or use "link"',
        _ends,
    ),
    Rule(
        lambda s: (s.initial_clearance or 0.0) < 0.0,
        "{tip}: the tip starts {below:.6g} m below {target}; it must start there or above",
        _ends,
    ),
    Rule(
        lambda s: s.contact_time == math.inf and s.initial_clearance >= 0.0,
        "{beam.initial_velocity_slope}: the undeformed tip never reaches {target}; "
        'use a (more) negative initial_velocity_slope, or approach = "elastic"',
        _ends,
    ),
    Rule(
        lambda s: s.time.t_end < (s.contact_time or 0.0) < math.inf,
        "{beam.initial_velocity_slope}: the undeformed tip reaches {target} not before t = {t_c:.6g} s, after "
        '{time.t_end}; use a (more) negative initial_velocity_slope, or approach = "elastic"',
        _ends,
    ),
    *(
        Rule(
            lambda s, key=key: _waits(s) and getattr(s.lower, key, 0.0) != 0.0,
            f"{{spring.{key}}}: {{beam.approach}} holds everything until the tip arrives at t = {{t_c:.6g}} s; start "
            'at rest, or use approach = "elastic"',
            _ends,
        )
        for key in ("initial_velocity", "velocity")
    ),
    # A softening spring
    Rule(
        _pushes_away,
        "{spring.linear_stiffness}: with {spring.cubic_stiffness} the spring pushes away from {spring.unloaded}; one "
        "of them must be greater than 0",
    ),
    Rule(
        lambda s: s.spring and s.spring.softens and abs(s.spring.equilibrium - s.spring.unloaded) >= hilltop(s.spring),
        "{spring.equilibrium}: the softening spring escapes from beyond "
        "|y − unloaded| = √(linear_stiffness/|cubic_stiffness|) = {hilltop:.6g} m; it must start inside",
        lambda s: {"hilltop": hilltop(s.spring)},
    ),
    Rule(
        lambda s: _alone_in_a_well(s) and well_depth(s) == -math.inf,
        "{spring.external_force}: the softening spring can hold less than "
        "2/3 linear_stiffness √(linear_stiffness/3|cubic_stiffness|) = {largest:.6g} N",
        lambda s: {"largest": largest_load(s.spring)},
    ),
    Rule(
        _escapes,
        "{spring.cubic_stiffness}: the softening spring starts with {energy:.6g} J and escapes from a well {depth:.6g} "
        "J deep; use a smaller initial_velocity or external_force, an equilibrium nearer to unloaded, or a larger "
        "linear_stiffness",
        lambda s: {"energy": spring_energy(s.spring), "depth": well_depth(s)},
    ),
    # Bodies that are not our own
    *(
        Rule(
            lambda s, key=key: s.massless and s.contact.strikes and hasattr(s.lower, key),
            f"{{spring.{key}}}: {{contact.law}} needs our own spring below {{beam.fidelity}}; "
            'use law = "tie", or fidelity = "dynamic"',
        )
        for key in ("fmu", "element")
    ),
    # Steps; an accuracy picks scheme, degree and steps that go together
    Rule(
        lambda s: _given_step(s) and s.time.t_end < s.coupling.H,
        "{coupling.macro_step}{default}: must be at most {time.t_end}; give a smaller one, or an accuracy, which picks "
        "one",
        lambda s: {"default": ", the default" * (s.coupling.H == DEFAULT_STEP)},
    ),
    Rule(
        lambda s: _given_step(s) and s.time.t_end / s.coupling.H > MOST_MACRO_STEPS,
        "{coupling.macro_step}: {time.t_end} would take {steps:.1e} macro steps; at most "
        f"{MOST_MACRO_STEPS:.0e} are allowed",
        lambda s: {"steps": s.time.t_end / s.coupling.H},
    ),
    # Loads
    Rule(
        lambda s: len(_points(s)) > MOST_POINTS,
        "[[loads]]: point forces at {number} places, {places}; the beam takes them at "
        f"{MOST_POINTS} at most. Put some at one place, or give them a shape",
        lambda s: {"number": len(_points(s)), "places": ", ".join(f"{x:g}" for x in _points(s))},
    ),
)

#: Rules for loads.
FORBIDDEN_LOADS: tuple[Rule, ...] = (
    *(
        Rule(
            lambda s, load, table=table, on=on: load.on in on and s.under(table) is None,
            f"{{load.on}}: acts on a [{table}], and this scene has none",
        )
        for table, on in (("beam", ("beam", "tip")), ("spring", ("spring",)))
    ),
    Rule(
        lambda s, load: s.massless and load.on != "spring",
        '{load.on}: {beam.fidelity} takes no loads that vary; use fidelity = "dynamic", or distributed_load for a '
        "constant",
    ),
    Rule(
        _acts_before_contact,
        "{load.signal}: acts before the tip arrives at t = {t_c:.6g} s, and {beam.approach} holds everything until "
        'then; give a start from there on, or use approach = "elastic"',
        lambda s, load: {"t_c": s.contact_time},
    ),
    Rule(
        lambda s, load: load.on == "beam" and "beam" in s.partners,
        '{load.on}: acts along our own beam; on = "tip" acts on the end of another body in [beam]',
    ),
    *(
        Rule(
            lambda s, load, table=table: load.on == "base" and table in s.foreign,
            f'{{load.on}}: which masses are in the FMU of [{table}] is not known; give a force, on = "{end}"',
        )
        for table, end in (("beam", "tip"), ("spring", "spring"))
    ),
    *(
        Rule(
            lambda s, load, table=table, end=end: load.on == end and isinstance(s.under(table), RigidWallElement),
            f"{{load.on}}: {{{table}.element}} does not move under any load; leave the load out",
        )
        for table, end in (("beam", "tip"), ("spring", "spring"))
    ),
)
