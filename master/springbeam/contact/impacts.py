"""Impulses of impacts, and the energy that they take away (``docs/model.md``, "What happens at an event")."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Impact:
    """Impulses [N·s], upward on each body, and the energy they take away [J]."""

    on_beam: float = 0.0
    on_spring: float = 0.0
    of_foundation: float = 0.0
    energy_loss: float = 0.0


NO_IMPACT = Impact()


def meeting(v: float, z: float, tip_mass: float, mass: float) -> Impact:
    """Return the impact of tip [m/s, kg] and spring top [m/s, kg].

    J = (z − v)/(1/m_tip + 1/m), equal and opposite, and both leave with one velocity. A massless tip takes no impulse.
    """
    if tip_mass == 0.0:
        return NO_IMPACT
    reduced = 1.0 / (1.0 / tip_mass + 1.0 / mass)
    j = reduced * (z - v)
    return Impact(on_beam=j, on_spring=-j, energy_loss=0.5 * reduced * (z - v) ** 2)


def rebound(velocity: float, mass: float, restitution: float) -> tuple[float, float]:
    """Return the impulse −(1+e) m w [N·s] that reverses w to −e w, and its loss ½ m w² (1 − e²) [J]."""
    # Taken from 0, the impulse on nothing is 0 and not −0.
    return 0.0 - (1.0 + restitution) * mass * velocity, 0.5 * mass * velocity**2 * (1.0 - restitution**2)


def foundation_impact(v: float, z: float, tip_mass: float, mass: float, restitution: float) -> Impact:
    """Return the impact of tip and spring top [m/s, kg] on the foundation; a mass of 0 [kg] takes no part.

    Each velocity is reversed by itself, so nothing is lost at e = 1.
    """
    on_beam, loss_beam = rebound(v, tip_mass, restitution)
    on_spring, loss_spring = rebound(z, mass, restitution)
    return Impact(on_beam, on_spring, on_spring + on_beam, loss_spring + loss_beam)
