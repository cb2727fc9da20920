"""What a body can do, and what a scene may therefore ask of it: the one table of capabilities and what they allow."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from ..scene import Scene
from ..scene.messages import Rule, told
from ..scene.tables import ORDINARY_SCHEMES


@dataclass(frozen=True)
class Abilities:
    """What a body can do; the default is that of our own."""

    state: bool = True  #: its state can be saved and restored
    serialized: bool = True  #: … and written to a file
    any_size: bool = True  #: its steps may have any size
    velocity: bool = True  #: it tells its velocity
    integrals: int = 2  #: it tells ∫x (1) and ∫∫x (2) over a step
    slopes: int = 2  #: highest derivative of a force over a step that it follows
    impulse: bool = True  #: it takes impulses
    energies: bool = True  #: it tells its energies


#: What is said of a body that lacks a capability.
_LACKS = {
    "state": "its state cannot be saved (canGetAndSetFMUstate = false)",
    "any_size": "its steps have one size (canHandleVariableCommunicationStepSize = false)",
    "velocity": "it has no velocity",
    "integrals": "it has not integral and integral_2",
    "impulse": "it has no impulse, or of a body of your own no apply_impulse",
}
_TO_BE_STRUCK = ("state", "any_size", "velocity", "impulse")
_LEFT_OUT, _MULTIPLE = 'leave it out, or use scheme = "energy"', "use a multiple of {coupling.macro_step}"
#: A share of a step that is rounding.
_SAME = 1e-9


def _exchanges(scene: Scene) -> bool:
    return scene.coupling.scheme in ORDINARY_SCHEMES


def _integrals(scene: Scene) -> int:
    """Return how many integrals of the gap the scheme sets to 0."""
    return 0 if _exchanges(scene) else scene.coupling.degree - (scene.coupling.scheme == "hermite")


def _falls_between(scene: Scene) -> bool:
    """Return whether a load jumps or bends between equal macro steps."""
    H, start = scene.coupling.H, scene.contact_time or 0.0
    kinks = [t for load in scene.loads if not load.is_finer_than(H) for t in load.kinks]
    steps = [(t - start) / H for t in kinks if start <= t < scene.time.t_end]
    return any(abs(n - round(n)) > _SAME for n in steps)


def _numbers(scene: Scene, body: Abilities, table: str) -> dict[str, Any]:
    followed = body.slopes if _exchanges(scene) else min(body.integrals, body.slopes)
    return {"table": table, "slopes": body.slopes, "followed": followed}


def _needs(asked: str, when: Callable[[Scene], bool], instead: str, *abilities: str) -> list[Rule]:
    """Return a rule for each of the ``abilities`` that a body must have for what is ``asked``."""
    most = Abilities()
    return [
        Rule(
            lambda s, body, table, ability=ability: when(s) and getattr(body, ability) < getattr(most, ability),
            f"{asked}: the body in [{{table}}] cannot do that, {_LACKS[ability]}; {instead}",
            _numbers,
        )
        for ability in abilities
    ]


#: What a scene asks of a body that it cannot do; a rule is asked of the scene, what the body can do, and its table.
LACKING: tuple[Rule, ...] = (
    *_needs(
        "{coupling.scheme}",
        lambda s: not _exchanges(s),
        'use scheme = "jacobi" or "gauss_seidel" with [contact] law = "link" or "compliance", without [stop]',
        "state",
    ),
    *_needs("{coupling.scheme}", lambda s: s.coupling.scheme == "hermite", 'use scheme = "energy"', "velocity"),
    *_needs("{coupling.degree}", lambda s: _exchanges(s) and s.coupling.degree > 0, _LEFT_OUT, "velocity"),
    *_needs("{contact.damping}", lambda s: _exchanges(s) and s.contact.damping > 0.0, _LEFT_OUT, "velocity"),
    *_needs(
        "{contact.law}",
        lambda s: s.joins and s.contact.facts.strikes,
        'use "compliance", "link" or "tie"',
        *_TO_BE_STRUCK,
    ),
    *_needs("[stop]", lambda s: s.stop is not None, "leave it out", *_TO_BE_STRUCK),
    *_needs(
        "[coupling] relative_tolerance, absolute_tolerance",
        lambda s: s.coupling.adaptive,
        "use macro_step",
        *("any_size", "velocity", "integrals"),
    ),
    Rule(
        lambda s, body, table: s.coupling.degree > body.slopes,
        "{coupling.degree}: the body in [{table}] cannot do that, its input takes derivatives of order {slopes} at "
        "most (canInterpolateInputs; FMI 3.0 has none); use degree = {followed}",
        _numbers,
    ),
    Rule(
        lambda s, body, table: _integrals(s) > body.integrals,
        f"{{coupling.degree}}: the body in [{{table}}] cannot do that, {_LACKS['integrals']}; "
        "use degree = {followed}",
        _numbers,
    ),
    *_needs("{time.t_end}", lambda s: not s.coupling.adaptive and s.equal_steps[1] != 0.0, _MULTIPLE, "any_size"),
    *_needs(
        "[[loads]]: a step ends where each jumps or bends",
        lambda s: not s.coupling.adaptive and _falls_between(s),
        _MULTIPLE,
        "any_size",
    ),
)


def refusals(scene: Scene, abilities: Mapping[str, Abilities]) -> list[str]:
    """Return why ``scene`` cannot be run with bodies of these ``abilities``, by table, each with a remedy."""
    return [line for table, body in abilities.items() for line in told(scene, LACKING, body, table)]


#: What a capability allows, for people: (capability, how a body shows it, what is offered with it, what without it).
OFFERED = (
    ("state", "canGetAndSetFMUstate", 'scheme "energy", tie, transmission, foundation', '"jacobi", "gauss_seidel"'),
    ("any_size", "canHandleVariableCommunicationStepSize", "events, adaptive steps", "equal macro steps only"),
    ("serialized", "canSerializeFMUstate", "--checkpoint and resume", "no checkpoints"),
    ("slopes", "canInterpolateInputs", "degree 1, 2", "degree 0"),
    ("integrals", "integral, integral_2", "degree 1, 2; adaptive steps", "degree 0"),
    ("velocity", "velocity", "events, hermite, adaptive steps", "the mean over a step in its place"),
    ("impulse", "impulse", "rigid impacts, foundation", '"compliance", "link", "tie" of equal velocities'),
    ("energies", "kinetic_energy, potential_energy", "the whole ledger", "the ledger of the interface"),
)
