"""Contact laws and phases: who is joined to whom, what an impact does, when a contact ends. Pure functions.

``docs/model.md`` states the laws; section names below are its.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from .scene import Spring


class Joint(Enum):
    """How the beam's tip and what lies below it are joined."""

    FREE = "free"  #: no contact force
    TIED = "tied"  #: bilateral, u_tip = y < Ψ
    TOUCH = "touch"  #: unilateral, 0 ≤ C ⊥ u_tip − y ≥ 0


@dataclass(frozen=True)
class Phase:
    joint: Joint = Joint.FREE
    #: The lower end is held by the foundation: the spring at y = φ or, without a spring, the tip itself.
    seated: bool = False

    def __str__(self) -> str:
        return "seated" if self.seated else self.joint.value


@dataclass(frozen=True)
class Impact:
    """Impulses [N·s], upward on each body, and the energy they take away [J]."""

    on_beam: float = 0.0
    on_spring: float = 0.0
    of_foundation: float = 0.0
    energy_loss: float = 0.0


def meeting(kind: str, v: float, z: float, tip_mass: float, mass: float) -> Impact:
    """Tip [m/s, kg] meets spring top [m/s, kg] (design: section "Interface laws").

    ``inelastic``: J = (z − v)/(1/m_tip + 1/m), equal and opposite, both leave with one velocity; ``rest``: velocities
    are kept; ``tip``: z := v (Ahn & Tate, Algorithm 1, line 5), which takes the energy from nowhere and books it.
    """
    if kind == "inelastic":
        reduced = 1.0 / (1.0 / tip_mass + 1.0 / mass)
        j = reduced * (z - v)
        return Impact(on_beam=j, on_spring=-j, energy_loss=0.5 * reduced * (z - v) ** 2)
    if kind == "tip":
        return Impact(on_spring=mass * (v - z), energy_loss=0.5 * mass * (z * z - v * v))
    return Impact()


def rebound(velocity: float, mass: float, restitution: float) -> tuple[float, float]:
    """Impulse −(1+e) m w [N·s] that reverses w to −e w, and its loss ½ m w² (1 − e²) [J]."""
    return -(1.0 + restitution) * mass * velocity, 0.5 * mass * velocity**2 * (1.0 - restitution**2)


def foundation_impact(z: float | None, mass: float, v: float | None, tip_mass: float, restitution: float) -> Impact:
    """The lower end strikes the foundation: the spring at ``z``, and the tip at ``v`` if it is tied to it.

    ``None`` marks an end that does not take part. Each velocity is reversed by itself, so nothing is lost at e = 1.
    """
    on_spring, loss_spring = rebound(z, mass, restitution) if z is not None else (0.0, 0.0)
    on_beam, loss_beam = rebound(v, tip_mass, restitution) if v is not None else (0.0, 0.0)
    return Impact(on_beam, on_spring, on_spring + on_beam, loss_spring + loss_beam)


def spring_force(spring: Spring, y: float) -> float:
    """k1 y + k2 y³ − f_s [N]: what the seated spring hands to the foundation besides C (Ahn & Tate, (6))."""
    return spring.linear_stiffness * y + spring.cubic_stiffness * y**3 - spring.external_force
