"""Make the bodies that a scene contains; start here."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from ..scene import Beam, Scene, Spring
from ..scene.partners import ForeignFmu, MovingWallElement, PointMassElement, RigidWallElement, SpringDamperElement
from ..scene.statics import tip_compliance, tip_load_deflection
from .elements import ELEMENTS, MovingWall
from .equilibrium import contact_at_rest, element_at_rest, lower_at_rest
from .own import FmuBeam, FmuSpring
from .protocol import Body, FmuError
from .quasi_static import QuasiStaticBeam

if TYPE_CHECKING:
    from .foreign import Findings


class Bodies(NamedTuple):
    """The bodies of a scene, and the contact force [N] under which they start at rest."""

    upper: Body | None
    lower: Body | None
    contact_force: float = 0.0


def load_bodies(scene: Scene, start_time: float, degree: int) -> Bodies:
    """Make the bodies of ``scene`` at ``start_time`` [s], our beam as the approach leaves it.

    The force between them is a polynomial of ``degree`` over a step.

    Raises
    ------
    FmuError
        If an FMU cannot be found or loaded, or a foreign one contradicts its declarations or the scene.
    SceneError
        If the scene starts at rest and its spring has no equilibrium.
    """
    checked = findings(scene)
    faults = [fault for finding in checked.values() for fault in finding.faults]
    if faults:
        raise FmuError("\n".join(faults))

    make = partial(_body, scene, start_time, degree, checked)
    contact_force = 0.0
    rest = None
    with ExitStack() as failing:
        upper = make("beam", contact_force)
        if scene.static and upper is not None:
            contact_force = contact_at_rest(scene, upper.motion().displacement)
            if contact_force != 0.0:
                upper.close()
                upper = make("beam", contact_force)
        if upper is not None:
            failing.callback(upper.close)
        if scene.static:
            rest = lower_at_rest(scene, contact_force, None if upper is None else upper.motion().displacement)
        lower = make("spring", contact_force, rest)
        failing.pop_all()
    return Bodies(upper, lower, contact_force)


def _body(
    scene: Scene,
    start_time: float,
    degree: int,
    checked: Mapping[str, Findings],
    table: str,
    contact_force: float,
    rest: float | None = None,
) -> Body | None:
    """Make the body of a ``table``; a lower one starts at ``rest`` [m] if that is given."""
    spec = scene.under(table)
    if spec is None:
        return None
    if isinstance(spec, ForeignFmu):
        from .foreign import ForeignBody

        return ForeignBody(spec, table == "beam", (start_time, scene.time.t_end), checked[table])
    if isinstance(spec, Spring):
        return FmuSpring(spec, start_time, rest)
    if isinstance(spec, Beam):
        if scene.massless:
            return _massless_beam(scene, spec, start_time, degree, contact_force)
        return _beam(scene, spec, start_time, contact_force)
    if isinstance(spec, MovingWallElement):
        return MovingWall(spec.position, [load for load in scene.loads if load.on == "wall"], start_time)
    assert isinstance(spec, PointMassElement | RigidWallElement)
    keys = {name: getattr(spec, name) for name in type(spec).model_fields if name != "element"}
    if scene.static and isinstance(spec, SpringDamperElement):
        keys["displacement"] = element_at_rest(scene, spec, contact_force) if rest is None else rest
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


def findings(scene: Scene) -> dict[str, Findings]:
    """Check the foreign FMUs of ``scene`` (`springbeam.bodies.probe`), by table. Raises FmuError."""
    if not scene.foreign:
        return {}
    from .probe import examined  # which starts processes

    H = scene.coupling.macro_step or 1e-3 * scene.time.t_end
    times = 0.0, scene.time.t_end
    return {table: examined(spec, table == "beam", times, H) for table, spec in scene.foreign.items()}
