"""An accuracy that includes the mesh: finer meshes, each solved to the accuracy, until the last two agree."""

from __future__ import annotations

import math

from ..results.trajectory import Trajectory
from ..scene import Scene, SceneError, with_changes
from ..scene.tables import ALL_MODES_UP_TO
from .accuracy import differences, pick

#: Factor from one mesh to the next.
_RATIO = 2
#: Shares of the accuracy that the mesh may use, and the coupling and the time integration.
_SHARE = 0.5
#: Contacts shorter than this share of the run are not compared.
_SHORT = 1e-3
#: Order in the size of the elements that is relied on at least, and at most.
_LOWEST, _HIGHEST = 1.0, 2.0


def pick_mesh(scene: Scene) -> Trajectory:
    """Return a run of ``scene`` that keeps its ``accuracy`` beside the continuous beam.

    The elements, and with them the modes kept, are doubled until two meshes agree. The finer one's error is their
    difference over 2ᵖ − 1, p being the order that three meshes show, between 1 and 2.

    Raises
    ------
    SceneError
        If the scene asks for no accuracy, has no mesh, or the accuracy cannot be reached; the message says how far it
        is.
    RunStopped
        If a run that does keep it stops early.
    """
    if scene.accuracy is None:
        raise SceneError("accuracy: missing; the mesh is chosen to reach it")
    if scene.beam is None or scene.massless:
        raise SceneError("[beam]: the scene has no mesh to choose")
    beam, asked = scene.beam, scene.accuracy
    coarse: Trajectory | None = None
    before = error = math.inf
    factor = 1
    while beam.unknowns * factor <= ALL_MODES_UP_TO:
        mesh = {"n_modes": factor * beam.n_modes, "n_elements": factor * beam.n_elements}
        fine = pick(with_changes(scene, accuracy=_SHARE * asked, beam=mesh))
        if coarse is not None:
            apart = differences(coarse, fine, _SHORT)
            difference = max(apart["motion"], apart["times"])
            order = math.log(before / difference, _RATIO) if 0.0 < difference < before < math.inf else _LOWEST
            error = difference / (_RATIO ** min(max(order, _LOWEST), _HIGHEST) - 1.0)
            if error <= _SHARE * asked:
                found = fine.summary["accuracy"]
                found |= {"asked": asked, "picked": {**found["picked"], **mesh}, "estimated_mesh_error": error}
                return fine
            before = difference
        coarse, factor = fine, _RATIO * factor
    reached = f"{factor // _RATIO * beam.n_elements} elements still leave some {error:.1e}"
    raise SceneError(
        f"accuracy = {asked:g} with the mesh: not reached, {reached}; ask for less, shorten [time] t_end, or take "
        "elements of a higher degree where the motion is smooth (springbeam converge shows what settles)"
    )
