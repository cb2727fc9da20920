"""What may meet: the ends of two bodies, the law between them, and the foundation below."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import inf

from ..bodies.protocol import Body
from ..scene.laws import SoftLaw


@dataclass(frozen=True)
class Rigid:
    """A law that holds ends together where they meet, by whatever force that takes."""

    lasting: bool = False  #: from the start and for good, for either sign of the force
    ties: bool = False  #: for either sign of the force as long as the ends are below Ψ; above, they only push


@dataclass(frozen=True)
class Interface:
    """Two ends, what acts between them, and the foundation below.

    Parameters
    ----------
    upper, lower
        The bodies; a wall in place of one that is absent.
    law
        What acts between the ends; ``None`` where nothing does, as of one body alone.
    equilibrium
        Ψ: the height below which a law that ties does so [m].
    floor, restitution
        φ: the height of the rigid foundation [m], ``None`` without one; e of impacts on it.
    alone
        Whether nothing but the foundation is below the tip: the tip itself strikes it, and rests on it.
    """

    upper: Body
    lower: Body
    law: SoftLaw | Rigid | None
    equilibrium: float
    floor: float | None = None
    restitution: float = 1.0
    alone: bool = False

    @cached_property
    def tip_share(self) -> float:
        """The tip's part in the velocity with which joined ends go on."""
        return common_velocity(1.0, 0.0, self.upper.mass, self.lower.mass)

    def reduced_mass(self, *, seated: bool = False) -> float:
        """Return the reduced mass of both ends [kg]; the tip's mass while the lower end is ``seated``.

        0 of ends that have no mass, or none that moves.
        """
        masses = [self.upper.mass] if seated else [self.upper.mass, self.lower.mass]
        if min(masses) == 0.0:
            return 0.0
        inverse = sum(1.0 / mass for mass in masses)
        return 1.0 / inverse if inverse > 0.0 else 0.0


def common_velocity(v: float, z: float, tip_mass: float, mass: float) -> float:
    """Return the velocity with which joined ends of velocities v and z [m/s] go on: that of their momentum."""
    if tip_mass == inf:
        return v
    if mass == inf:
        return z
    return (tip_mass * v + mass * z) / (tip_mass + mass)
