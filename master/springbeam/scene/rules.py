"""Errors of scenes whose values are valid one by one: keys and values that contradict each other.

Each function yields the errors of one subject; ``[table.key]`` in a text stands for the key with its value
(`springbeam.scene.messages.filled`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from .energies import hilltop, largest_load, spring_energy, well_depth
from .laws import LAWS
from .loads import MOST_POINTS, Load
from .messages import at, either, filled
from .partners import MovingWallElement, RigidWallElement, SpringDamperElement
from .plausibility import warnings_of
from .scene import Scene
from .schemes import DEFAULT_STEP
from .statics import bending_stiffness, shear_stiffness, tip_compliance
from .tables import ALL_MODES_UP_TO, MOST_ELEMENTS, MOST_MODE_VALUES, MOST_MODES, Beam, Spring, Table

#: More are a mistyped macro step: two weeks at a microsecond a step.
MOST_MACRO_STEPS = 1e12


def impossible(scene: Scene) -> list[str]:
    """Return why ``scene`` cannot be run, as lines ``[table] key = value: reason and remedy``; empty if it can."""
    try:
        lines = [filled(scene, text) for subject in SUBJECTS for text in subject(scene)]
        for number, load in enumerate(scene.loads):
            lines += [filled(scene, text, number) for text in _load(scene, load)]
        if not lines and (scene.beam is None or _is_finite(scene.beam)):
            warnings_of(scene)  # what is certain to overflow once the scene runs overflows here
            return []
    except ArithmeticError:
        lines = []
    return lines or [f"too large or too small to compute with; check the units: {_most_extreme(scene)}"]


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


def _bodies(scene: Scene) -> Iterator[str]:
    upper = scene.upper
    lower = scene.lower
    wall_below = isinstance(lower, RigidWallElement)
    if upper is None and lower is None:
        yield "no body: a scene needs [beam], [spring] or both"
    if isinstance(upper, RigidWallElement) and (lower is None or wall_below):
        yield "[beam.element]: nothing moves in this scene; give it a body in [spring]"
    if wall_below and upper is None:
        yield "[spring.element]: nothing moves in this scene; give it a body in [beam]"
    if wall_below and upper is not None and scene.stop is not None:
        yield "[spring.element]: leave [stop] out"
    for name, body in scene.partners.items():
        if isinstance(body, MovingWallElement) and not any(load.on == "wall" for load in scene.loads):
            yield f'[{name}.element]: [[loads]] with on = "wall" give its motion; without, use "rigid_wall"'


def _start_at_rest(scene: Scene) -> Iterator[str]:
    if not scene.static:
        return
    if scene.beam is not None and scene.beam.approach == "undeformed":
        yield (
            '[time.initial_state]: bends the beam from the start; use approach = "elastic" with it, not [beam.approach]'
        )
    for table in ("beam", "spring"):
        body = scene.under(table)
        if not _rests(body):
            yield (
                f"[time.initial_state]: the body in [{table}] can't start at rest under loads, only our own beam and "
                "spring, a spring_damper with a stiffness and a rigid_wall can; leave initial_state out"
            )
        for key in (
            "initial_deflection_slope",
            "initial_velocity_slope",
            "initial_velocity",
            "displacement",
            "velocity",
        ):
            if body is not None and key in body.model_fields_set and getattr(body, key) != 0.0:
                yield f"[{table}.{key}]: [time.initial_state] is at rest where the loads hold it; leave {key} out"


def _rests(body: Table | None) -> bool:
    """Return whether the package can compute the equilibrium of a body under loads; true if there is none."""
    own = isinstance(body, Beam | Spring | RigidWallElement | None) and not isinstance(body, MovingWallElement)
    return own or (isinstance(body, SpringDamperElement) and body.stiffness > 0.0)


def _gap(scene: Scene) -> Iterator[str]:
    lower = scene.lower
    if scene.contact.gap == 0.0:
        return
    if lower is None or not lower.AT_GAP:
        yield (
            "[contact.gap]: is the height of the unbent beam above our own spring or an element in [spring]; this "
            "scene has neither; leave gap out"
        )
    else:
        for key in lower.AT_GAP:
            if key in lower.model_fields_set:
                yield f"[spring.{key}]: [contact.gap] gives it; leave one of the two out"


def _law(scene: Scene) -> Iterator[str]:
    for table in ("beam", "spring"):
        if scene.contact.lasting and scene.under(table) is None and not scene.elastic_stop:
            yield f"[contact.law]: joins a [beam] and a [spring]; this scene has no [{table}], which it needs"
    if scene.elastic_stop and scene.stop is not None and scene.stop.restitution != 1.0:
        yield (
            "[stop.restitution]: [contact.law] makes the stop elastic; leave restitution out, and give its loss by "
            "[contact] damping"
        )


def _scheme(scene: Scene) -> Iterator[str]:
    if scene.coupling.exchanges and not scene.contact.soft:
        soft = either(name for name, law in LAWS.items() if not law.rigid)
        yield f'[coupling.scheme]: needs [contact] law = {soft}; use scheme = "energy" with [contact.law]'
    averages = scene.beam is not None and scene.beam.integrator == "midpoint"
    if scene.accuracy is None and averages and scene.degree > 0:
        yield (
            '[coupling.degree]: [beam.integrator] uses only the mean of the contact force; use "modal", or degree = 0'
        )


def _beam_without_inertia(scene: Scene) -> Iterator[str]:
    beam = scene.beam
    contact = scene.contact
    if beam is None or not scene.massless:
        return
    if scene.lower is None:
        yield '[beam.fidelity]: a beam without inertia needs a [spring]; use fidelity = "dynamic"'
    if contact.soft:
        rigid = "tie" if contact.lasting else "unilateral"
        yield (
            "[beam.fidelity]: the tip between the beam and [contact.law] would have no inertia; use "
            f'law = "{rigid}" or fidelity = "dynamic"'
        )
    if contact.impacts:
        for key in ("fmu", "element"):
            if hasattr(scene.lower, key):
                yield (
                    f"[spring.{key}]: [contact.law] needs our own spring below [beam.fidelity]; "
                    'use law = "tie", or fidelity = "dynamic"'
                )
    if beam.approach != "elastic":
        return
    if beam.initial_velocity_slope != 0.0:
        yield (
            '[beam.initial_velocity_slope]: without inertia, and approach = "elastic", nothing carries a velocity; '
            'use 0.0, or fidelity = "dynamic"'
        )
    if beam.alpha_b == 0.0 and beam.initial_deflection_slope != 0.0:
        yield (
            "[beam.initial_deflection_slope]: without inertia and damping the beam starts in its static deflection; "
            'use 0.0, approach = "undeformed", or alpha_b > 0'
        )


def _mesh(scene: Scene) -> Iterator[str]:
    beam = scene.beam
    if beam is None:
        return
    degree = beam.element_degree
    mesh = f"n_elements = {beam.n_elements}" + (f" of element_degree = {degree}" if degree > 1 else "")
    most_elements = 2 * MOST_ELEMENTS // (degree * (degree + 1))
    most = min(MOST_MODES, beam.unknowns // 2, MOST_MODE_VALUES // beam.unknowns)
    if beam.n_elements > most_elements:
        yield f"[beam.n_elements]: with element_degree = {degree} it must be at most {most_elements}"
    if beam.n_modes > beam.unknowns:
        yield f"[beam.n_modes]: {mesh} has only {beam.unknowns} modes; use 0 for all of them"
    if beam.integrator == "modal" and beam.unknowns > ALL_MODES_UP_TO and not 1 <= beam.n_modes <= most:
        yield (
            f"[beam.n_modes]: of the {beam.unknowns} modes of {mesh} at most {most} are found, all only up to "
            f'{ALL_MODES_UP_TO}; use n_modes = {min(64, most)}, fewer elements, or integrator = "midpoint"'
        )


def _heights(scene: Scene) -> Iterator[str]:
    tip = scene.at_start("beam")
    top = scene.at_start("spring")
    if scene.stop is not None and top is not None and scene.stop.position > top.value:
        yield f"[stop.position]: the foundation must not lie above [{top.key}]"
    if tip is None:
        return
    tie = scene.contact.lasting and scene.contact.rigid
    if tie and top is not None and not math.isclose(tip.value, top.value, rel_tol=1e-12):
        yield (
            f"[{tip.key}]: the tip starts at {tip.value:.6g} m, but [contact.law] holds it at [{top.key}]; let "
            'them start at one height, or use "link"'
        )
    target = scene.tip_target
    clearance = scene.initial_clearance
    arrives = scene.contact_time
    if target is None or clearance is None:
        return
    if clearance < 0.0:
        yield f"[{tip.key}]: the tip starts {-clearance:.6g} m below [{target.key}]; it must start there or above"
    elif arrives is not None and arrives > scene.time.t_end:
        late = f"not before t = {arrives:.6g} s, after [time.t_end]"
        slower = f"the undeformed tip reaches [{target.key}] {late}"
        never = f"the undeformed tip never reaches [{target.key}]"
        yield (
            f"[beam.initial_velocity_slope]: {never if arrives == math.inf else slower}; use a (more) negative "
            'initial_velocity_slope, or approach = "elastic"'
        )
    if _waits(scene):
        for key in ("initial_velocity", "velocity"):
            if getattr(scene.lower, key, 0.0) != 0.0:
                yield (
                    f"[spring.{key}]: [beam.approach] holds everything until the tip arrives at t = {arrives:.6g} s; "
                    'start at rest, or use approach = "elastic"'
                )


def _waits(scene: Scene) -> bool:
    """Return whether an undeformed tip arrives after the start; until then nothing is integrated."""
    return 0.0 < (scene.contact_time or 0.0) < math.inf


def _softening_spring(scene: Scene) -> Iterator[str]:
    spring = scene.spring
    if spring is None:
        return
    stiffnesses = (spring.linear_stiffness, spring.cubic_stiffness)
    if min(stiffnesses) < 0.0 >= max(stiffnesses):
        yield (
            "[spring.linear_stiffness]: with [spring.cubic_stiffness] the spring pushes away from [spring.unloaded]; "
            "one of them must be greater than 0"
        )
    if not spring.softens:
        return
    rim = hilltop(spring)
    if abs(spring.equilibrium - spring.unloaded) >= rim:
        yield (
            "[spring.equilibrium]: the softening spring escapes from beyond "
            f"|y − unloaded| = √(linear_stiffness/|cubic_stiffness|) = {rim:.6g} m; it must start inside"
        )
    elif not (scene.static or scene.beam):
        yield from _well(scene, spring)


def _well(scene: Scene, spring: Spring) -> Iterator[str]:
    """Yield why our spring, without a beam of ours above it, does not stay in the potential well in which it starts."""
    depth = well_depth(scene)
    energy = spring_energy(spring)
    lossless = spring.damping == 0.0 and (scene.stop is None or scene.stop.restitution == 1.0)
    if depth == -math.inf:
        yield (
            "[spring.external_force]: the softening spring can hold less than "
            f"2/3 linear_stiffness √(linear_stiffness/3|cubic_stiffness|) = {largest_load(spring):.6g} N"
        )
    elif lossless and energy > depth:
        yield (
            f"[spring.cubic_stiffness]: the softening spring starts with {energy:.6g} J and escapes from a well "
            f"{depth:.6g} J deep; use a smaller initial_velocity or external_force, an equilibrium nearer to unloaded, "
            "or a larger linear_stiffness"
        )


def _steps(scene: Scene) -> Iterator[str]:
    H = scene.coupling.macro_step
    if H is None or scene.accuracy is not None:  # which picks scheme, degree and steps that go together
        return
    steps = scene.duration / H
    if scene.time.t_end < H:
        default = ", the default" if H == DEFAULT_STEP else ""
        yield (
            f"[coupling.macro_step]{default}: must be at most [time.t_end]; give a smaller one, or an accuracy, which "
            "picks one"
        )
    if steps > MOST_MACRO_STEPS:
        yield (
            f"[coupling.macro_step]: the run would take {steps:.1e} macro steps up to [time.t_end]; at most "
            f"{MOST_MACRO_STEPS:.0e} are allowed"
        )


def _points(scene: Scene) -> Iterator[str]:
    points = sorted({load.at for load in scene.loads if load.at is not None})
    if len(points) > MOST_POINTS:
        yield (
            f"[[loads]]: point forces at {len(points)} places, {', '.join(f'{x:g}' for x in points)}; the beam takes "
            f"them at {MOST_POINTS} at most. Put some at one place, or give them a shape"
        )


#: What is judged of a scene.
SUBJECTS = (
    *(_bodies, _start_at_rest, _gap, _law, _scheme, _beam_without_inertia, _mesh, _heights),
    *(_softening_spring, _steps, _points),
)


def _load(scene: Scene, load: Load) -> Iterator[str]:
    """Yield the errors of one ``load``; ``[load.key]`` in a text is a key of it."""
    table = "spring" if load.on == "spring" else "beam"
    body = scene.under(table)
    if load.on == "wall":
        yield from _wall(scene, load)
        return
    if load.on != "base" and body is None:
        yield f"[load.on]: acts on a [{table}], and this scene has none"
    if scene.massless and load.on != "spring":
        yield (
            '[load.on]: [beam.fidelity] takes no loads that vary; use fidelity = "dynamic", or distributed_load for a '
            "constant"
        )
    moves = load.peak > 0.0 and (load.on != "spring" or scene.lower is not None)
    arrives = scene.contact_time or 0.0
    if moves and _waits(scene) and load.begins < arrives:
        yield (
            f"[load.signal]: acts before the tip arrives at t = {arrives:.6g} s, and [beam.approach] holds everything "
            'until then; give a start from there on, or use approach = "elastic"'
        )
    if load.on == "beam" and "beam" in scene.partners:
        yield '[load.on]: acts along our own beam; on = "tip" acts on the end of another body in [beam]'
    for name, end in (("beam", "tip"), ("spring", "spring")):
        if load.on == "base" and name in scene.foreign:
            yield f'[load.on]: which masses are in the FMU of [{name}] is not known; give a force, on = "{end}"'
    if load.on in ("tip", "spring") and isinstance(body, RigidWallElement):
        yield f"[load.on]: [{table}.element] does not move under any load; leave the load out"


def _wall(scene: Scene, load: Load) -> Iterator[str]:
    """Yield why the motion of a wall by ``load`` is none: it jumps, or does so in its speed under a rigid law."""
    if not any(isinstance(body, MovingWallElement) for body in scene.partners.values()):
        yield '[load.on]: needs a body with element = "moving_wall", and this scene has none'
    end = scene.time.t_end
    before = [math.nextafter(kink, -math.inf) for kink in load.kinks if 0.0 < kink < end]
    after = [kink for kink in load.kinks if 0.0 < kink < end]
    heights = abs(load.value(after) - load.value(before))
    speeds = abs(load.change(after) - load.change(before))
    high = 1e-9 * load.peak
    for when, height, speed in zip(after, heights, speeds, strict=True):
        if height > high:
            yield f"[load.signal]: its height would jump by {height:.4g} m at {when:g} s; use another signal"
            return
        if speed * end > high and not scene.contact.soft:
            yield (
                f"[load.signal]: under [contact.law] the speed of the wall must not jump, as by {speed:.4g} m/s "
                f'at {when:g} s; use a harmonic, or a table with interpolation = "cubic" that begins and ends with the '
                "run, or a soft law"
            )
            return
