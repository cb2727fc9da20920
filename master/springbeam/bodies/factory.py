"""Make the bodies that a scene contains; start here."""

from __future__ import annotations

import hashlib
from pathlib import Path

from ..scene import Scene
from .archive import fmu_directory
from .fmu import FmuError
from .fmu_bodies import FmuBeam, FmuSpring
from .quasi_static import QuasiStaticBeam


def load_bodies(scene: Scene, start_time: float) -> tuple[FmuBeam | QuasiStaticBeam | None, FmuSpring | None]:
    """The bodies that ``scene`` contains, at ``start_time`` [s], where the beam is as the approach leaves it.

    They are FMUs, but for a beam without inertia.
    """
    beam: FmuBeam | QuasiStaticBeam | None = None
    if scene.beam is not None:
        rate = scene.beam.initial_velocity_slope
        if "beam" not in scene.fmus:
            assert scene.initial_tip is not None
            tip, velocity = scene.initial_tip + start_time * rate * scene.beam.length, rate * scene.beam.length
            beam = QuasiStaticBeam(scene.beam, scene.coupling.degree, tip, velocity)
            if scene.beam.approach == "elastic" or scene.contact.law == "compliance":
                beam.release()
        else:
            slope = scene.beam.initial_deflection_slope + start_time * rate
            beam = FmuBeam(scene.beam, start_time, slope, scene.loads)
    try:
        return beam, None if scene.spring is None else FmuSpring(scene.spring, start_time)
    except BaseException:
        if beam is not None:
            beam.close()
        raise


def fingerprints(scene: Scene) -> dict[str, str]:
    """Return SHA-256 by name of the files that ``scene`` needs: FMUs and tables. Raises FmuError if one is missing."""
    files = {f"{name}.fmu": fmu_directory() / f"{name}.fmu" for name in scene.fmus}
    files |= {load.file: Path(load.file) for load in scene.loads if load.file is not None}
    found = {}
    for name, path in files.items():
        try:
            found[name] = hashlib.sha256(path.read_bytes()).hexdigest()
        except OSError as error:
            remedy = "; ./build.sh fmus builds it" if path.suffix == ".fmu" else ""
            raise FmuError(f"{path}: {error.strerror}{remedy}") from error
    return found
