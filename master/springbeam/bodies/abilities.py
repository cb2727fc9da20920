"""What a body can do, and what a scene may therefore ask of it: the one table of capabilities and what they allow."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

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


#: What is said of a body that lacks a capability.
_LACKS = {
    "state": "its state cannot be saved (canGetAndSetFMUstate = false)",
    "any_size": "its steps have one size (canHandleVariableCommunicationStepSize = false)",
    "velocity": "it has no velocity",
    "integrals": "it has not integral and integral_2",
    "impulse": "it has no impulse, or of a body of your own no apply_impulse",
}
_SLOPES = "its input takes no derivatives (canInterpolateInputs = false; FMI 3.0 has none)"
_TO_BE_STRUCK = ("state", "any_size", "velocity", "impulse")
#: A share of a step that is rounding.
_SAME = 1e-9


def _lacking(scene: Scene, body: Abilities) -> Iterator[tuple[str, str, str]]:
    """Yield what ``scene`` asks for and ``body`` cannot do: the key, what is missing, and what would work."""
    coupling, contact = scene.coupling, scene.contact
    scheme, degree = f'[coupling] scheme = "{coupling.scheme}"', f"[coupling] degree = {coupling.degree}"
    ordinary = coupling.scheme in ORDINARY_SCHEMES
    exchanged = 'use scheme = "jacobi" or "gauss_seidel" with [contact] law = "link" or "compliance", without [stop]'
    left_out, softer = 'leave it out, or use scheme = "energy"', 'use "compliance", "link" or "tie"'
    tolerances, law = "[coupling] relative_tolerance, absolute_tolerance", f'[contact] law = "{contact.law}"'
    for is_so, asked, abilities, instead in (
        (not ordinary, scheme, ("state",), exchanged),
        (coupling.scheme == "hermite", scheme, ("velocity",), 'use scheme = "energy"'),
        (ordinary and coupling.degree > 0, degree, ("velocity",), left_out),
        (ordinary and contact.damping > 0.0, f"[contact] damping = {contact.damping}", ("velocity",), left_out),
        (scene.joins and contact.facts.strikes, law, _TO_BE_STRUCK, softer),
        (scene.stop is not None, "[stop]", _TO_BE_STRUCK, "leave it out"),
        (coupling.adaptive, tolerances, ("any_size", "velocity", "integrals"), "use macro_step"),
    ):
        for ability in abilities if is_so else ():
            if not getattr(body, ability) or (ability == "integrals" and body.integrals < 2):
                yield asked, _LACKS[ability], instead
    # Integrals of the gap that the scheme sets to 0.
    needed = 0 if ordinary else coupling.degree - (coupling.scheme == "hermite")
    lower = f"use degree = {body.slopes if ordinary else min(body.integrals, body.slopes)}"
    if coupling.degree > body.slopes:
        yield degree, f"its input takes derivatives of order {body.slopes} at most" if body.slopes else _SLOPES, lower
    if needed > body.integrals:
        yield degree, _LACKS["integrals"], lower
    if not coupling.adaptive and not body.any_size:
        H, multiple = scene.coupling.H, f"use a multiple of {scene.coupling.H:g}"
        if scene.equal_steps[1] != 0.0:
            yield f"[time] t_end = {scene.time.t_end}", _LACKS["any_size"], multiple
        for number, load in enumerate(scene.loads):
            kinks = [] if load.is_finer_than(H) else load.kinks
            steps = [(kink - (scene.contact_time or 0.0)) / H for kink in kinks if kink < scene.time.t_end]
            if any(step >= 0.0 and abs(step - round(step)) > _SAME for step in steps):
                yield f"[loads.{number}]: a step ends where it jumps or bends", _LACKS["any_size"], multiple


def refusals(scene: Scene, abilities: Mapping[str, Abilities]) -> list[str]:
    """Return why ``scene`` cannot be run with bodies of these ``abilities``, by table, each with a remedy."""
    return [
        f"{asked}: the body in [{table}] cannot do that, {lacks}; {instead}"
        for table, body in abilities.items()
        for asked, lacks, instead in _lacking(scene, body)
    ]


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
