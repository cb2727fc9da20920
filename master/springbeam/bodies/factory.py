"""Make the bodies that a scene contains; start here."""

from __future__ import annotations

import hashlib
from contextlib import ExitStack
from pathlib import Path

from ..scene import Beam, Scene, Spring
from ..scene.partners import ForeignFmu, Partner
from .archive import fmu_directory, own_fmu
from .elements import ELEMENTS
from .fmu_bodies import FmuBeam, FmuSpring
from .foreign import Findings
from .isolated import IsolatedBody, examined
from .protocol import Body, FmuError
from .quasi_static import QuasiStaticBeam


def load_bodies(scene: Scene, start_time: float) -> tuple[Body | None, Body | None]:
    """Return the upper and the lower body of ``scene`` at ``start_time`` [s], our beam as the approach leaves it.

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
            body = None if spec is None else _body(scene, spec, start_time, found.get(table))
            if body is not None:
                made.callback(body.close)
            bodies.append(body)
        upper, lower = bodies
        made.pop_all()
    return upper, lower


def _body(scene: Scene, spec: Beam | Spring | Partner, start_time: float, found: Findings | None) -> Body:
    if isinstance(spec, ForeignFmu):
        assert found is not None
        return IsolatedBody(spec, spec is scene.upper, start_time, found)
    if isinstance(spec, Spring):
        return FmuSpring.of(spec, start_time)
    if not isinstance(spec, Beam):
        return ELEMENTS[spec.element](**spec.model_dump(exclude={"element"}))
    if scene.contact.algorithm:  # (62): the midpoint rule on the whole mesh
        spec = spec.model_copy(update={"integrator": "generalized_alpha", "rho_inf": 1.0, "n_modes": 0})
    rate = spec.initial_velocity_slope
    if spec.fidelity == "dynamic":
        return FmuBeam.of(spec, start_time, spec.initial_deflection_slope + start_time * rate, scene.loads)
    assert scene.tip_at_start is not None
    tip, velocity = scene.tip_at_start.value + start_time * rate * spec.length, rate * spec.length
    beam = QuasiStaticBeam(spec, scene.coupling.degree, tip, velocity)
    if spec.approach == "elastic" or scene.contact.soft:
        beam.release()
    return beam


def findings(scene: Scene) -> dict[str, Findings]:
    """Examine the foreign FMUs of ``scene`` (`springbeam.bodies.probe`), by table. Raises FmuError."""
    H = scene.coupling.macro_step or 1e-3 * scene.time.t_end
    return {table: examined(spec, table == "beam", 0.0, H) for table, spec in scene.foreign.items()}


def fingerprints(scene: Scene) -> dict[str, str]:
    """Return SHA-256 by name of the files that ``scene`` needs: FMUs and tables. Raises FmuError if one is missing."""
    files = {path.name: path for path in map(own_fmu, scene.fmus)}
    files |= {spec.fmu: Path(spec.fmu) for spec in scene.foreign.values()}
    files |= {load.file: Path(load.file) for load in scene.loads if load.file is not None}
    found = {}
    for name, path in files.items():
        try:
            found[name] = hashlib.sha256(path.read_bytes()).hexdigest()
        except OSError as error:
            remedy = "; ./build.sh fmus builds it" if path.parent == fmu_directory() else ""
            raise FmuError(f"{path}: {error.strerror}{remedy}") from error
    return found
