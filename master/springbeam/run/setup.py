"""What is run, resolved once from a scene, before there are bodies.

Behind it no module of `run`, `coupling` and `contact` asks a scene: each takes a `Setup`, or what it needs of one.
"""

from __future__ import annotations

from dataclasses import dataclass

from ..bodies.protocol import Abilities
from ..contact.interface import Rigid
from ..scene import Load, Scene
from ..scene import SceneError as SceneError
from ..scene.laws import SoftLaw
from ..scene.scene import SAME as SAME
from ..scene.scene import SHORTEST_STEP as SHORTEST_STEP


@dataclass(frozen=True)
class Setup:
    """What is run: all that a run takes from its scene beside the bodies."""

    start: float  #: [s]
    end: float  #: [s]
    #: Whether there is an upper and a lower body, whoever made it.
    upper: bool
    lower: bool
    law: SoftLaw | Rigid | None  #: between the ends; ``None`` where nothing acts
    law_name: str  #: in the scene, for messages
    equilibrium: float | None  #: Ψ [m]; ``None`` where it is the height at which the lower end starts
    at_rest: bool  #: whether the run starts at rest under the loads
    undeformed: bool  #: whether it starts where an undeformed tip meets the body below
    floor: float | None  #: φ, the height of the rigid foundation [m]
    restitution: float  #: e of impacts on it
    level: float  #: of the wall that is in place of an absent lower body [m]
    loads: tuple[Load, ...]
    scheme: str
    exchanges: bool  #: whether values are exchanged once per macro step, so that the energy may change
    degree: int  #: of the contact force over a step
    tolerance: float  #: relative, of the contact force of a step
    #: H [s], or ``None`` where steps follow from the tolerances, relative and absolute [m].
    macro_step: float | None
    relative_tolerance: float
    absolute_tolerance: float
    force_window: float | None  #: time over which the contact force is averaged before its peak is taken [s]

    @property
    def soft(self) -> SoftLaw | None:
        """The soft law between the ends."""
        return None if isinstance(self.law, Rigid) else self.law

    @property
    def lasting(self) -> bool:
        """Whether the law joins the ends from the start and for good."""
        return self.law is not None and self.law.lasting


def set_up(scene: Scene, *abilities: Abilities) -> Setup:
    """Resolve ``scene`` for bodies of these ``abilities``, those that are not our own."""
    coupling = scene.coupling
    degree = coupling.degree
    if degree is None:
        allowed = [min(body.integrals, body.slopes) for body in abilities]
        degree = min([scene.degree, *allowed])
    law: SoftLaw | Rigid | None = scene.soft_law
    if law is None and scene.coupled:
        law = Rigid(scene.contact.lasting, scene.contact.ties)
    stop = scene.stop
    rigid = None if scene.elastic_stop else stop
    return Setup(
        start=scene.contact_time or 0.0,
        end=scene.time.t_end,
        upper=scene.upper is not None,
        lower=scene.lower is not None,
        law=law,
        law_name=scene.contact.law,
        equilibrium=scene.equilibrium,
        at_rest=scene.static,
        undeformed=scene.beam is not None and scene.beam.approach == "undeformed",
        floor=None if rigid is None else rigid.position,
        restitution=1.0 if rigid is None else rigid.restitution,
        level=0.0 if stop is None else stop.position,
        loads=scene.loads,
        scheme=coupling.scheme,
        exchanges=coupling.exchanges,
        degree=degree,
        tolerance=coupling.tolerance,
        macro_step=coupling.macro_step,
        relative_tolerance=coupling.relative_tolerance or 0.0,
        absolute_tolerance=coupling.absolute_tolerance or 0.0,
        force_window=scene.contact.force_window,
    )
