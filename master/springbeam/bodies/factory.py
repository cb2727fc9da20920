"""Make the bodies that a scene contains; start here."""

from __future__ import annotations

import hashlib
from contextlib import ExitStack
from math import inf
from pathlib import Path

from ..scene import Beam, Scene, SceneError, Spring
from ..scene.loads import TableLoad
from ..scene.partners import ForeignFmu, Partner, RigidWallElement
from ..scene.statics import resting_height, tip_compliance, tip_load_deflection
from .archive import fmu_directory, own_fmu
from .elements import ELEMENTS
from .fmu_bodies import FmuBeam, FmuSpring
from .foreign import Findings, ForeignBody
from .probe import examined
from .protocol import Body, FmuError
from .quasi_static import QuasiStaticBeam


def load_bodies(scene: Scene, start_time: float, degree: int, contact: float = 0.0) -> tuple[Body | None, Body | None]:
    """Return the upper and the lower body of ``scene`` at ``start_time`` [s], our beam as the approach leaves it.

    The force between them is a polynomial of ``degree`` over a step. Where the scene starts at rest, it does so under
    the force ``contact`` between the ends [N].

    Raises
    ------
    FmuError
        If an FMU cannot be found or loaded, or a foreign one does not do what it or the scene says.
    """
    found = findings(scene)
    faults = [fault for finding in found.values() for fault in finding.faults]
    if faults:
        raise FmuError("\n".join(faults))
    bodies: list[Body | None] = []
    with ExitStack() as made:
        for table, spec in (("beam", scene.upper), ("spring", scene.lower)):
            body = None if spec is None else _body(scene, spec, start_time, found.get(table), degree, contact)
            if body is not None:
                made.callback(body.close)
            bodies.append(body)
        upper, lower = bodies
        made.pop_all()
    return upper, lower


def _body(
    scene: Scene, spec: Beam | Spring | Partner, start_time: float, found: Findings | None, degree: int, contact: float
) -> Body:
    if isinstance(spec, ForeignFmu):
        return ForeignBody(spec, spec is scene.upper, (start_time, scene.time.t_end), found)
    if isinstance(spec, Spring):
        return FmuSpring(spec, start_time, top_at_rest(scene, contact) if scene.static else None)
    if isinstance(spec, Beam):
        if scene.massless:
            return _massless_beam(scene, spec, start_time, degree, contact)
        return _beam(scene, spec, start_time, contact)
    return ELEMENTS[spec.element](**spec.model_dump(exclude={"element"}))


def _beam(scene: Scene, spec: Beam, start_time: float, contact: float) -> Body:
    slope = spec.initial_deflection_slope + start_time * spec.initial_velocity_slope
    held = (0.0, scene.loads, contact) if scene.static else (slope, scene.loads)
    return FmuBeam(spec, start_time, *held)


def _massless_beam(scene: Scene, spec: Beam, start_time: float, degree: int, contact: float) -> Body:
    if (start := scene.at_start("beam")) is None:  # at rest under the loads and the contact force
        tip = tip_load_deflection(spec) + contact * tip_compliance(spec)
        return QuasiStaticBeam(spec, degree, tip, 0.0)
    rate = spec.initial_velocity_slope
    velocity = rate * spec.length
    tip = start.value + start_time * velocity
    beam = QuasiStaticBeam(spec, degree, tip, velocity)
    if spec.approach == "elastic":
        beam.release()
    return beam


def top_at_rest(scene: Scene, contact: float) -> float:
    """Return where what lies below the upper end rests under ``contact`` [N]: our spring, a wall or a stop [m].

    Raises SceneError where the spring rests nowhere.
    """
    if (spring := scene.spring) is None:
        level = scene.lower if isinstance(scene.lower, RigidWallElement) else scene.stop
        return -inf if level is None else level.position
    force = spring.external_force - contact
    for load in scene.loads:
        force += {"spring": 1.0, "base": -spring.mass}.get(load.on, 0.0) * float(load.value(0.0))
    height = resting_height(spring, force)
    if height is None:
        raise SceneError(
            f'[time] initial_state = "static": under {force:.6g} N the spring rests nowhere; use a stiffer one, or a '
            "smaller load"
        )
    return height


def findings(scene: Scene) -> dict[str, Findings]:
    """Examine the foreign FMUs of ``scene`` (`springbeam.bodies.probe`), by table. Raises FmuError."""
    H = scene.coupling.macro_step or 1e-3 * scene.time.t_end
    times = 0.0, scene.time.t_end
    return {table: examined(spec, table == "beam", times, H) for table, spec in scene.foreign.items()}


def fingerprints(scene: Scene) -> dict[str, str]:
    """Return SHA-256 by name of the files that ``scene`` needs: FMUs and tables. Raises FmuError if one is missing."""
    files = {path.name: path for path in map(own_fmu, scene.fmus)}
    files |= {spec.fmu: Path(spec.fmu) for spec in scene.foreign.values()}
    files |= {load.file: Path(load.file) for load in scene.loads if isinstance(load, TableLoad)}
    found = {}
    for name, path in files.items():
        try:
            found[name] = hashlib.sha256(path.read_bytes()).hexdigest()
        except OSError as error:
            remedy = "; ./build.sh fmus builds it" if path.parent == fmu_directory() else ""
            raise FmuError(f"{path}: {error.strerror}{remedy}") from error
    return found
