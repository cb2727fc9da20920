"""``coupling.scheme = "auto"``: `hermite` where it is stable and the motion resolved, `energy` elsewhere.

The choice depends on the scene alone (``docs/coupling.md``, "The scheme that fits").
"""

from __future__ import annotations

from typing import NamedTuple

from .linearised import spring_frequency
from .reading import with_changes
from .resolution import STABLE, TURN, mesh_frequency, slowest_frequency
from .scene import Scene


class Choice(NamedTuple):
    """The scheme and degree that couple a scene, and the reason."""

    scheme: str
    degree: int
    because: str


def choice(scene: Scene) -> Choice:
    """Return the scheme and degree that fit ``scene``, whatever it asks for."""
    beam, coupling = scene.beam, scene.coupling
    if scene.contact.algorithm:
        return Choice("energy", 0, f'contact.law = "{scene.contact.law}"')
    if scene.partners:
        return Choice("energy", _highest_degree(scene), "a body that is not our own")
    if beam is None:
        return Choice("energy", 0, "one body")
    if beam.integrator != "modal":
        return Choice("energy", 0, f'beam.integrator = "{beam.integrator}"')
    if beam.fidelity == "quasi_static":
        return Choice("energy", 2, 'beam.fidelity = "quasi_static"')
    if not scene.contact.rigid:
        return Choice("energy", 2, f'contact.law = "{scene.contact.law}"')
    if scene.contact.impact == "rest" and scene.spring is not None:
        return Choice("energy", 2, 'contact.impact = "rest"')
    if coupling.macro_step is None:
        return Choice("hermite", 2, "the steps follow from tolerances")
    H = coupling.macro_step
    fastest = max(mesh_frequency(beam), 0.0 if scene.spring is None else spring_frequency(scene))
    bound = f"the whole mesh's ω_max H = {fastest * H:.3g}"
    if fastest * H <= STABLE:
        return Choice("hermite", 2, f"{bound} <= {STABLE:g}")
    slowest = slowest_frequency(beam)
    if slowest * H <= TURN:
        return Choice("energy", 2, f"{bound} > {STABLE:g}")
    return Choice("energy", 0, f"ω₁H = {slowest * H:.3g} > {TURN:g}")


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
