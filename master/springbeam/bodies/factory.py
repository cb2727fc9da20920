"""Make the bodies that a scene contains; start here."""

from __future__ import annotations

import hashlib
from contextlib import ExitStack
from math import isclose
from pathlib import Path

from ..scene import Beam, Scene, SceneError, Spring
from ..scene.partners import ForeignFmu, Partner
from ..scene.tables import ORDINARY_SCHEMES
from .abilities import refusals
from .archive import fmu_directory
from .elements import ELEMENTS
from .fmu_bodies import FmuBeam, FmuSpring
from .foreign import Findings
from .isolated import IsolatedBody, examined
from .protocol import Body, FmuError
from .quasi_static import QuasiStaticBeam

#: Velocities closer than this share are one where an end takes no impulse: told, and measured from displacements.
_SAME_SPEED, _SAME_SPEED_MEASURED = 1e-13, 1e-6


def load_bodies(scene: Scene, start_time: float) -> tuple[Body | None, Body | None]:
    """Return the upper and the lower body of ``scene`` at ``start_time`` [s], our beam as the approach leaves it.

    Raises
    ------
    FmuError
        If an FMU cannot be found or loaded, or a foreign one does not do what it or the scene says.
    SceneError
        If the scene asks for what a foreign FMU cannot do.
    """
    found = findings(scene)
    faults = [fault for finding in found.values() for fault in finding.faults]
    if faults:
        raise FmuError("\n".join(faults))
    if lines := refusals(scene, {table: finding.abilities for table, finding in found.items()}):
        raise SceneError("\n".join(lines))
    bodies: list[Body | None] = []
    with ExitStack() as made:
        for table, spec in (("beam", scene.upper), ("spring", scene.lower)):
            body = None if spec is None else _body(scene, spec, start_time, found.get(table))
            if body is not None:
                made.callback(body.close)
            bodies.append(body)
        upper, lower = bodies
        if found and upper is not None and lower is not None:
            _refuse_start(scene, upper, lower)
        made.pop_all()
    return upper, lower


def _body(scene: Scene, spec: Beam | Spring | Partner, start_time: float, found: Findings | None) -> Body:
    if isinstance(spec, ForeignFmu):
        assert found is not None
        coupling = scene.coupling
        by_substeps = coupling.degree > found.abilities.integrals and coupling.scheme not in ORDINARY_SCHEMES
        return IsolatedBody(spec, spec is scene.upper, start_time, found, by_substeps)
    if isinstance(spec, Spring):
        return FmuSpring(spec, start_time)
    if not isinstance(spec, Beam):
        return ELEMENTS[spec.element](**spec.model_dump(exclude={"element"}))
    rate = spec.initial_velocity_slope
    if spec.fidelity == "dynamic":
        return FmuBeam(spec, start_time, spec.initial_deflection_slope + start_time * rate, scene.loads)
    assert scene.tip_at_start is not None
    tip, velocity = scene.tip_at_start.value + start_time * rate * spec.length, rate * spec.length
    beam = QuasiStaticBeam(spec, scene.coupling.degree, tip, velocity)
    if spec.approach == "elastic" or scene.contact.law == "compliance":
        beam.release()
    return beam


def findings(scene: Scene) -> dict[str, Findings]:
    """Examine the foreign FMUs of ``scene`` (`springbeam.bodies.probe`), by table. Raises FmuError."""
    H = scene.coupling.macro_step or 1e-3 * scene.time.t_end
    return {table: examined(spec, table == "beam", 0.0, H) for table, spec in scene.foreign.items()}


def _refuse_start(scene: Scene, upper: Body, lower: Body) -> None:
    """Raise SceneError if the ends cannot start where only the FMUs know that they do."""
    u, y = upper.motion().displacement, lower.motion().displacement
    apart = not isclose(u, y, rel_tol=1e-12)
    starts = f"the upper end starts at {u:.9g} m and the lower one at {y:.9g} m"
    if scene.contact.law == "tie" and apart:
        raise SceneError(f'[contact] law = "tie": {starts}; let them start at one height, or use "link"')
    if scene.contact.law == "tie":
        _refuse_speeds(upper, lower)
    if scene.contact.lasting or not apart:
        return
    if u < y:
        raise SceneError(f"[beam]: {starts}; it must start there or above")
    if scene.beam is not None and scene.beam.approach == "undeformed":
        raise SceneError(
            f'[beam] approach = "undeformed": {starts}, and where the FMU below is when they meet is not known '
            'beforehand; use approach = "elastic", or let them start at one height'
        )


def _refuse_speeds(upper: Body, lower: Body) -> None:
    """Raise SceneError if ends that are to be tied start with two velocities, and one takes no impulse."""
    v, z = upper.motion().velocity, lower.motion().velocity
    for table, body, other in (("beam", upper, lower), ("spring", lower, upper)):
        if not isinstance(body, IsolatedBody) or body.abilities.impulse:
            continue
        same = _SAME_SPEED if body.abilities.velocity else _SAME_SPEED_MEASURED
        if abs(v - z) > same * max(abs(v), abs(z)):
            raise SceneError(
                f'[contact] law = "tie": the ends start with {v:.6g} and {z:.6g} m/s and are joined by an impulse, '
                f"which the FMU in [{table}] has no input for; name its impulse, let both start with one velocity, or "
                'use "link"'
            )
        body.start_as_fast_as(other.motion().velocity)


def fingerprints(scene: Scene) -> dict[str, str]:
    """Return SHA-256 by name of the files that ``scene`` needs: FMUs and tables. Raises FmuError if one is missing."""
    files = {f"{name}.fmu": fmu_directory() / f"{name}.fmu" for name in scene.fmus}
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
