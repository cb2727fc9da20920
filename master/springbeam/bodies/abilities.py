"""What a body can do, and what a scene may therefore ask of it: the one table of capabilities and what they allow."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from ..scene import Scene
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

    @property
    def degree(self) -> int:
        """Return the highest degree of the contact force; integrals that are not told are found by substeps."""
        return min(2 if self.any_size else self.integrals, self.slopes)


class Need(NamedTuple):
    """What a scene needs of a body."""

    asked: str  #: the key that asks for it, with its value
    has: bool
    lacks: str  #: what is missing
    instead: str  #: what would work


_STATE = "its state cannot be saved (canGetAndSetFMUstate = false)"
_SIZES = "its steps have one size (canHandleVariableCommunicationStepSize = false)"
_SLOPES = "its input takes no derivatives (canInterpolateInputs = false; FMI 3.0 has none)"
_VELOCITY, _INTEGRALS = "it has no velocity", "it has not integral and integral_2"
_IMPULSE = "it has no impulse, or of a body of your own no apply_impulse"


#: A share of a step that is rounding.
_SAME = 1e-9


def needs(scene: Scene, body: Abilities) -> Iterator[Need]:
    """Yield all that ``scene`` needs of a body."""
    coupling, contact = scene.coupling, scene.contact
    scheme, degree = f'[coupling] scheme = "{coupling.scheme}"', f"[coupling] degree = {coupling.degree}"
    ordinary = coupling.scheme in ORDINARY_SCHEMES
    if not ordinary:
        exchanged = (
            'use scheme = "jacobi" or "gauss_seidel" with [contact] law = "link" or "compliance", without [stop]'
        )
        yield Need(scheme, body.state, _STATE, exchanged)
    if coupling.scheme == "hermite":
        yield Need(scheme, body.velocity, _VELOCITY, 'use scheme = "energy"')
    if coupling.degree > 0:
        lower = f"use degree = {body.slopes if ordinary else body.degree}"
        slopes = _SLOPES if body.slopes == 0 else f"its input takes derivatives of order {body.slopes} at most"
        yield Need(degree, body.slopes >= coupling.degree, slopes, lower)
        if not ordinary:
            missing = f"{_INTEGRALS}, and {_SIZES}"
            yield Need(degree, body.any_size or body.integrals >= coupling.degree, missing, lower)
    if ordinary:
        changing = {degree: coupling.degree > 0, f"[contact] damping = {contact.damping}": contact.damping > 0.0}
        for asked in (asked for asked, is_so in changing.items() if is_so):
            yield Need(asked, body.velocity, _VELOCITY, 'leave it out, or use scheme = "energy"')
    struck = {f'[contact] law = "{contact.law}"': scene.joins and contact.facts.strikes}
    struck |= {"[stop]": scene.stop is not None}
    for asked in (asked for asked, is_so in struck.items() if is_so):
        instead = "leave it out" if asked == "[stop]" else 'use "compliance", "link" or "tie"'
        yield Need(asked, body.state, _STATE, instead)
        yield Need(asked, body.any_size, _SIZES, instead)
        yield Need(asked, body.velocity, _VELOCITY, instead)
        yield Need(asked, body.impulse, _IMPULSE, instead)
    if coupling.adaptive:
        asked = "[coupling] relative_tolerance, absolute_tolerance"
        yield Need(asked, body.any_size, _SIZES, "use macro_step")
        yield Need(asked, body.velocity, _VELOCITY, "use macro_step")
        yield Need(asked, body.integrals == 2, _INTEGRALS, "use macro_step")
    elif not body.any_size:
        H, multiple = scene.coupling.H, f"use a multiple of {scene.coupling.H:g}"
        yield Need(f"[time] t_end = {scene.time.t_end}", scene.equal_steps[1] == 0.0, _SIZES, multiple)
        for number, load in enumerate(scene.loads):
            steps = [(kink - (scene.contact_time or 0.0)) / H for kink in load.kinks(H) if kink < scene.time.t_end]
            whole = all(step < 0.0 or abs(step - round(step)) <= _SAME for step in steps)
            yield Need(f"[loads.{number}]: a step ends where it jumps or bends", whole, _SIZES, multiple)


def refusals(scene: Scene, abilities: Mapping[str, Abilities]) -> list[str]:
    """Return why ``scene`` cannot be run with bodies of these ``abilities``, by table, each with a remedy."""
    return [
        f"{need.asked}: the body in [{table}] cannot do that, {need.lacks}; {need.instead}"
        for table, body in abilities.items()
        for need in needs(scene, body)
        if not need.has
    ]


#: What a capability allows, for people: (capability, how a body shows it, what is offered with it, what without it).
OFFERED = (
    ("state", "canGetAndSetFMUstate", 'scheme "energy", tie, transmission, foundation', '"jacobi", "gauss_seidel"'),
    ("any_size", "canHandleVariableCommunicationStepSize", "events, adaptive steps", "equal macro steps only"),
    ("serialized", "canSerializeFMUstate", "--checkpoint and resume", "no checkpoints"),
    ("slopes", "canInterpolateInputs", "degree 1, 2", "degree 0"),
    ("integrals", "integral, integral_2", "degree 1, 2; adaptive steps", "degree 1, 2 by four substeps a step"),
    ("velocity", "velocity", "events, hermite, adaptive steps", "the mean over a step in its place"),
    ("impulse", "impulse", "rigid impacts, foundation", '"compliance", "link", "tie" of equal velocities'),
    ("energies", "kinetic_energy, potential_energy", "the whole ledger", "the ledger of the interface"),
)
