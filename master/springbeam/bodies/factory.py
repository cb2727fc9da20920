"""Make the bodies that a scene contains; start here."""

from __future__ import annotations

from contextlib import ExitStack
from math import inf
from typing import TYPE_CHECKING

from ..scene import Beam, Scene, SceneError, Spring
from ..scene.linearised import hilltop
from ..scene.partners import ForeignFmu, MovingWallElement, Partner, RigidWallElement, SpringDamperElement
from ..scene.statics import resting_height, tip_compliance, tip_load_deflection
from .elements import ELEMENTS, MovingWall
from .fmu_bodies import FmuBeam, FmuSpring
from .protocol import Body, FmuError
from .quasi_static import QuasiStaticBeam

if TYPE_CHECKING:
    from .foreign import Findings


def load_bodies(
    scene: Scene, start_time: float, degree: int, contact_force: float = 0.0
) -> tuple[Body | None, Body | None]:
    """Return the upper and the lower body of ``scene`` at ``start_time`` [s], our beam as the approach leaves it.

    The force between them is a polynomial of ``degree`` over a step. Where the scene starts at rest, it does so under
    the force ``contact_force`` between the ends [N].

    Raises
    ------
    FmuError
        If an FMU cannot be found or loaded, or a foreign one contradicts its declarations or the scene.
    """
    found = findings(scene)
    faults = [fault for finding in found.values() for fault in finding.faults]
    if faults:
        raise FmuError("\n".join(faults))
    bodies: list[Body | None] = []
    with ExitStack() as made:
        for table, spec in (("beam", scene.upper), ("spring", scene.lower)):
            body = None if spec is None else _body(scene, spec, start_time, found.get(table), degree, contact_force)
            if body is not None:
                made.callback(body.close)
            bodies.append(body)
        upper, lower = bodies
        made.pop_all()
    return upper, lower


def _body(
    scene: Scene,
    spec: Beam | Spring | Partner,
    start_time: float,
    found: Findings | None,
    degree: int,
    contact_force: float,
) -> Body:
    if isinstance(spec, ForeignFmu):
        from .foreign import ForeignBody

        return ForeignBody(spec, spec is scene.upper, (start_time, scene.time.t_end), found)
    if isinstance(spec, Spring):
        return FmuSpring(spec, start_time, top_at_rest(scene, contact_force) if scene.static else None)
    if isinstance(spec, Beam):
        if scene.massless:
            return _massless_beam(scene, spec, start_time, degree, contact_force)
        return _beam(scene, spec, start_time, contact_force)
    if isinstance(spec, MovingWallElement):
        return MovingWall(spec.position, [load for load in scene.loads if load.on == "wall"], start_time)
    keys = {name: getattr(spec, name) for name in type(spec).model_fields if name != "element"}
    if scene.static and isinstance(spec, SpringDamperElement):
        upper = spec is scene.upper
        keys["displacement"] = (
            _element_at_rest(scene, spec, contact_force) if upper else top_at_rest(scene, contact_force)
        )
    return ELEMENTS[spec.element](**keys)


def _beam(scene: Scene, spec: Beam, start_time: float, contact_force: float) -> Body:
    slope = spec.initial_deflection_slope + start_time * spec.initial_velocity_slope
    held = (0.0, scene.loads, contact_force) if scene.static else (slope, scene.loads)
    return FmuBeam(spec, start_time, *held)


def _massless_beam(scene: Scene, spec: Beam, start_time: float, degree: int, contact_force: float) -> Body:
    if (start := scene.at_start("beam")) is None:  # at rest under the loads and the contact force
        tip = tip_load_deflection(spec) + contact_force * tip_compliance(spec)
        return QuasiStaticBeam(spec, degree, tip, 0.0)
    rate = spec.initial_velocity_slope
    velocity = rate * spec.length
    tip = start.value + start_time * velocity
    beam = QuasiStaticBeam(spec, degree, tip, velocity)
    if spec.approach == "elastic":
        beam.release()
    return beam


def top_at_rest(scene: Scene, contact_force: float) -> float:
    """Return the equilibrium [m] of the lower end under ``contact_force`` [N]: of a spring, a wall or a stop.

    A spring that would rest below the stop rests on it. Raises SceneError if the spring has no equilibrium.
    """
    floor = -inf if scene.stop is None else scene.stop.position
    if isinstance(scene.lower, SpringDamperElement):
        return max(_element_at_rest(scene, scene.lower, -contact_force), floor)
    if (spring := scene.spring) is None:
        return scene.lower.position if isinstance(scene.lower, RigidWallElement) else floor
    load = _load_at_start(scene, "spring", spring.mass) - contact_force
    force = spring.external_force + load
    height = resting_height(spring, force)
    if scene.stop is not None and (height is None or height < floor) and spring.force(floor) > load:
        if spring.softens and abs(floor - spring.unloaded) > hilltop(spring):
            raise SceneError(
                f'[time] initial_state = "static": under {force:.6g} N the softening spring would rest on [stop] '
                f"position = {floor:g}, beyond |y - unloaded| = √(linear_stiffness/|cubic_stiffness|) = "
                f"{hilltop(spring):.6g} m, where it cannot start; use a smaller load, or leave initial_state out"
            )
        return floor
    if height is None:
        raise SceneError(
            f'[time] initial_state = "static": no equilibrium of the spring under {force:.6g} N; use a stiffer one, '
            "or a smaller load"
        )
    return height


def _element_at_rest(scene: Scene, body: SpringDamperElement, force: float) -> float:
    """Return the equilibrium [m] of a mass on a linear spring under its loads and an upward ``force`` [N]."""
    force += body.external_force + _load_at_start(scene, "tip" if body is scene.upper else "spring", body.mass)
    return body.rest + force / body.stiffness


def _load_at_start(scene: Scene, end: str, mass: float) -> float:
    """Return the upward force [N] of the loads at t = 0 on an ``end`` with a mass."""
    shares = {end: 1.0, "base": -mass}
    return sum(shares.get(load.on, 0.0) * float(load.value(0.0)) for load in scene.loads)


def findings(scene: Scene) -> dict[str, Findings]:
    """Check the foreign FMUs of ``scene`` (`springbeam.bodies.probe`), by table. Raises FmuError."""
    if not scene.foreign:
        return {}
    from .probe import examined  # which starts processes

    H = scene.coupling.macro_step or 1e-3 * scene.time.t_end
    times = 0.0, scene.time.t_end
    return {table: examined(spec, table == "beam", times, H) for table, spec in scene.foreign.items()}
