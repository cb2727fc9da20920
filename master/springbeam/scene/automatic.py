"""``coupling.scheme = "auto"``: `hermite` where it is stable and the motion resolved, `energy` elsewhere.

The choice depends on the scene alone (``docs/coupling.md``, "The scheme that fits").
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from .linearised import spring_frequency
from .messages import filled
from .reading import with_changes
from .resolution import STABLE, TURN, mesh_frequency, slowest_frequency
from .scene import Scene


class Choice(NamedTuple):
    """The scheme and degree that couple a scene, and the reason."""

    scheme: str
    degree: int
    because: str


#: What decides before the frequencies do, the first that holds: whether it does, scheme and degree, and the reason.
_DECIDED: tuple[tuple[Callable[[Scene], bool], str, int, str], ...] = (
    (lambda s: s.contact.algorithm, "energy", 0, "{contact.law}"),
    (lambda s: s.beam is None, "energy", 0, "one body"),
    (lambda s: s.beam is not None and s.beam.integrator != "modal", "energy", 0, "{beam.integrator}"),
    (lambda s: s.massless, "energy", 2, "{beam.fidelity}"),
    (lambda s: not s.contact.rigid, "energy", 2, "{contact.law}"),
    (lambda s: s.contact.impact == "rest" and s.spring is not None, "energy", 2, "{contact.impact}"),
    (lambda s: s.coupling.adaptive, "hermite", 2, "the steps follow from tolerances"),
)


def choice(scene: Scene) -> Choice:
    """Return the scheme and degree that fit ``scene``, whatever it asks for."""
    if scene.partners:
        return Choice("energy", _highest_degree(scene), "a body that is not our own")
    for decides, scheme, degree, because in _DECIDED:
        if decides(scene):
            return Choice(scheme, degree, filled(scene, because))
    beam, H = scene.beam, scene.coupling.H
    assert beam is not None
    fastest = max(mesh_frequency(beam), 0.0 if scene.spring is None else spring_frequency(scene))
    bound = f"the whole mesh's ω_max H = {fastest * H:.3g}"
    if fastest * H <= STABLE:
        return Choice("hermite", 2, f"{bound} <= {STABLE:g}")
    turn = slowest_frequency(beam) * H
    return (
        Choice("energy", 2, f"{bound} > {STABLE:g}")
        if turn <= TURN
        else Choice("energy", 0, f"ω₁H = {turn:.3g} > {TURN:g}")
    )


def _highest_degree(scene: Scene) -> int:
    """Return the highest degree that the bodies' tables speak of: of a foreign FMU, by its integrals."""
    integrals = [(body.integral, body.integral_2) for body in scene.foreign.values()]
    return min((2 if all(names) else 0 for names in integrals), default=2)


def with_scheme_chosen(scene: Scene) -> tuple[Scene, Choice | None]:
    """Return the scene with a scheme and a degree in place of ``"auto"``, and the choice; ``None`` if it has one."""
    if scene.coupling.scheme != "auto":
        return scene, None
    taken = choice(scene)
    return with_changes(scene, coupling={"scheme": taken.scheme, "degree": taken.degree}), taken
