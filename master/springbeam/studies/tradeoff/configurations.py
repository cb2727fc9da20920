"""The configurations that `springbeam.studies.tradeoff` runs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from ...scene import Scene, SceneError, with_changes
from ...scene.resolution import slowest_frequency
from ...scene.tables import ALL_MODES_UP_TO
from ..schemes import RIGID, SOFT

#: Macro steps are the scene's times powers of 2 between these, where a run has this many of them.
_COARSEST, _FINEST = 6, -2
_FEWEST_STEPS, _MOST_STEPS = 4, 20_000
_ADAPTIVE_TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
#: Steps that follow from tolerances resolve the motion: with more turns of the slowest mode [rad] that takes too many.
_MOST_TURNS = 2000.0
#: Tolerance of IDA, where it is not the scene's own; that of the tie is a hundredth.
_IDA_TOLERANCE = 1e-4
_MODES = (2, 4, 8, 16, 32, 64, 128)
_MESHES = (0.25, 0.5, 1.0, 2.0)
_DEGREES = (1, 4, 8)
_HIGHEST_DEGREE = 8
#: Relative tolerances of scipy's solvers; they are stable from loose ones on, at the step their stability asks.
SCIPY_TOLERANCES = {
    "DOP853": (1e-1, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10),
    "LSODA": (1e-3, 1e-5, 1e-7, 1e-9),
    "Radau": (1e-2, 1e-4, 1e-6, 1e-8),
}
ALGORITHM_1 = "Algorithm 1"


@dataclass(frozen=True)
class Configuration:
    """One point of the sweep."""

    family: str  #: points of a family are joined by a line
    setting: str  #: what varies in it
    scene: Scene  #: as run
    method: str = "co-simulation"  #: or one of `SCIPY_TOLERANCES`, or `ALGORITHM_1`
    rtol: float = 0.0  #: of scipy's methods
    refined: bool = False  #: judged by the reference on a finer mesh: the model is what varies

    @property
    def name(self) -> str:
        return f"{self.family}, {self.setting}"


def configurations(scene: Scene) -> list[Configuration]:
    """Return the configurations for a scene, without those that the scene cannot have."""
    return [*_macro_steps(scene), *_adaptive(scene), *_models(scene), *_rivals(scene)]


def _changed(scene: Scene, **tables: Any) -> Iterator[Scene]:
    try:
        yield with_changes(scene, **tables)
    except SceneError:
        return


def _sizes(scene: Scene) -> list[float]:
    span = scene.duration
    sizes = [scene.coupling.H * 2.0**k for k in range(_COARSEST, _FINEST - 1, -1)]
    return [H for H in sizes if _FEWEST_STEPS <= span / H <= _MOST_STEPS]


def _macro_steps(scene: Scene) -> Iterator[Configuration]:
    """Yield all schemes, the best ones with a looser tolerance of IDA, and `auto`."""
    families: list[tuple[str, str, int, dict[str, Any]]] = [
        (f"{scheme} {degree}", scheme, degree, {}) for scheme, degree in (RIGID if scene.contact.rigid else SOFT)
    ]
    if scene.spring is not None:
        looser = {"relative_tolerance": _IDA_TOLERANCE, "absolute_tolerance": 1e-2 * _IDA_TOLERANCE}
        families += [
            (f"{scheme} {degree}, IDA {_IDA_TOLERANCE:.0e}", scheme, degree, {"spring": looser})
            for scheme, degree in _best_schemes(scene)
        ]
    for family, scheme, degree, more in [*families, ("auto", "auto", 0, {})]:
        for H in _sizes(scene):
            coupling = {"scheme": scheme, "degree": degree, "macro_step": H}
            if more:
                coupling["tolerance"] = 1e-2 * _IDA_TOLERANCE
            for changed in _changed(scene, coupling=coupling, **more):
                yield Configuration(family, f"H = {H:.3g}", changed)


def _best_schemes(scene: Scene) -> list[tuple[str, int]]:
    return [("energy", 2), ("hermite", 2)] if scene.contact.rigid else [("energy", 2)]


def _adaptive(scene: Scene) -> Iterator[Configuration]:
    beam, span = scene.beam, scene.duration
    if beam is not None and beam.fidelity == "dynamic" and slowest_frequency(beam) * span > _MOST_TURNS:
        return
    for scheme, degree in _best_schemes(scene):
        for tolerance in _ADAPTIVE_TOLERANCES:
            coupling = {"scheme": scheme, "degree": degree, "relative_tolerance": tolerance}
            for changed in _changed(scene, coupling=coupling):
                yield Configuration(f"{scheme} {degree} adaptive", f"{tolerance:.0e}", changed)


def finer(scene: Scene) -> Scene | None:
    """Return the scene with elements of higher degree, which stand for the continuum; ``None`` if that is too large."""
    beam = scene.beam
    if beam is None or beam.integrator != "modal":
        return None
    degree = min(_HIGHEST_DEGREE, ALL_MODES_UP_TO // (2 * beam.n_elements))
    if degree < 2 * beam.element_degree:
        return None
    return with_changes(scene, beam={"element_degree": degree, "n_modes": 0, "reduced_integration": False})


def _models(scene: Scene) -> Iterator[Configuration]:
    beam, fine = scene.beam, finer(scene)
    if beam is None or fine is None or fine.beam is None:
        return
    limit = fine.beam.n_elements * fine.beam.element_degree
    for modes in _MODES:
        if modes < beam.unknowns:
            for changed in _changed(scene, beam={"n_modes": modes}):
                yield Configuration("modes", f"{modes}", changed, refined=True)
    for degree in _DEGREES:
        for factor in _MESHES:
            n = round(factor * beam.n_elements / degree)
            if n >= 1 and 2 * n * degree <= limit:
                mesh = {"n_elements": n, "element_degree": degree, "n_modes": 0}
                if degree > 2:
                    mesh["reduced_integration"] = False
                for changed in _changed(scene, beam=mesh):
                    yield Configuration(f"elements of degree {degree}", f"{n}", changed, refined=True)


def _rivals(scene: Scene) -> Iterator[Configuration]:
    for method, tolerances in SCIPY_TOLERANCES.items():
        if scene.massless and method != "DOP853":  # the reference knows no other one there
            continue
        for rtol in tolerances:
            yield Configuration(method, f"rtol {rtol:.0e}", scene, method, rtol)
    joined_for_good = scene.contact.lasting  # Algorithm 1 lets go
    if scene.beam is not None and scene.spring is not None and scene.stop is not None and not joined_for_good:
        for H in _sizes(scene):
            paper = {"contact": {"law": "paper"}, "coupling": {"scheme": "energy", "degree": 0, "macro_step": H}}
            for changed in _changed(scene, beam={"n_modes": 0}, **paper):
                yield Configuration(ALGORITHM_1, f"H = {H:.3g}", changed, ALGORITHM_1)
