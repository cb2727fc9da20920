"""``coupling.scheme = "auto"``: `hermite` where it is stable and the motion resolved, `energy` elsewhere.

The choice depends on the scene alone (``docs/coupling.md``, "The scheme that fits").
"""

from __future__ import annotations

from typing import NamedTuple

from .linearised import spring_frequency
from .messages import Rule, filled
from .reading import with_changes
from .resolution import STABLE, TURN, mesh_frequency, slowest_frequency
from .scene import Scene


class Choice(NamedTuple):
    """The scheme and degree that couple a scene, and the reason."""

    scheme: str
    degree: int
    because: str


def _integrals(scene: Scene) -> bool:
    """Return whether all foreign FMUs of the scene tell both integrals of their motion."""
    return all(body.integral and body.integral_2 for body in scene.foreign.values())


def _turns(scene: Scene) -> dict[str, float]:
    """Return what the fastest and the slowest oscillation turn in a macro step [rad]."""
    beam, H = scene.beam, scene.coupling.H
    assert beam is not None
    fastest = max(mesh_frequency(beam), 0.0 if scene.spring is None else spring_frequency(scene))
    return {"fastest": fastest * H, "slowest": slowest_frequency(beam) * H}


#: What decides, the first rule that holds: the reason, and the scheme and degree for it.
_DECIDED: tuple[tuple[Rule, str, int], ...] = (
    (Rule(lambda s: s.partners and _integrals(s), "a body that is not our own"), "energy", 2),
    (Rule(lambda s: s.partners, "a body that is not our own"), "energy", 0),
    (Rule(lambda s: s.contact.algorithm, "{contact.law}"), "energy", 0),
    (Rule(lambda s: s.beam is None, "one body"), "energy", 0),
    (Rule(lambda s: s.beam.integrator != "modal", "{beam.integrator}"), "energy", 0),
    (Rule(lambda s: s.massless, "{beam.fidelity}"), "energy", 2),
    (Rule(lambda s: not s.contact.rigid, "{contact.law}"), "energy", 2),
    (Rule(lambda s: s.contact.impact == "rest" and s.spring, "{contact.impact}"), "energy", 2),
    (Rule(lambda s: s.coupling.adaptive, "the steps follow from tolerances"), "hermite", 2),
    (
        Rule(
            lambda s: _turns(s)["fastest"] <= STABLE,
            f"the whole mesh's ω_max H = {{fastest:.3g}} <= {STABLE:g}",
            _turns,
        ),
        "hermite",
        2,
    ),
    (
        Rule(
            lambda s: _turns(s)["slowest"] <= TURN,
            f"the whole mesh's ω_max H = {{fastest:.3g}} > {STABLE:g}",
            _turns,
        ),
        "energy",
        2,
    ),
    (Rule(lambda s: True, f"ω₁H = {{slowest:.3g}} > {TURN:g}", _turns), "energy", 0),
)


def choice(scene: Scene) -> Choice:
    """Return the scheme and degree that fit ``scene``, whatever it asks for."""
    rule, scheme, degree = next(row for row in _DECIDED if row[0].when(scene))
    return Choice(scheme, degree, filled(scene, rule.text, **rule.numbers(scene)))


def with_scheme_chosen(scene: Scene) -> tuple[Scene, Choice | None]:
    """Return the scene with a scheme and a degree in place of ``"auto"``, and the choice; ``None`` if it has one."""
    if scene.coupling.scheme != "auto":
        return scene, None
    taken = choice(scene)
    return with_changes(scene, coupling={"scheme": taken.scheme, "degree": taken.degree}), taken
