"""Events of the ends."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class EventKind(str, Enum):
    """Kinds of events; the values are the words in ``events.csv``."""

    IMPACT = "impact"  #: the tip meets what is below it
    STOP_IMPACT = "stop_impact"  #: the lower end strikes the foundation and rebounds
    RELEASE = "release"  #: tied ends rise through Ψ: from here on the contact can only push
    RETIE = "retie"  #: the ends go below Ψ together and are tied
    SEPARATION = "separation"  #: the ends part
    SEATED = "seated"  #: the lower end strikes the foundation and stays there
    UNSEATED = "unseated"  #: the lower end leaves the foundation

    __str__ = str.__str__

    @property
    def collision(self) -> bool:
        """Whether bodies meet that may part again at once."""
        return self in (EventKind.IMPACT, EventKind.STOP_IMPACT)

    @property
    def strikes(self) -> bool:
        """Whether a body collides with the foundation."""
        return self in (EventKind.STOP_IMPACT, EventKind.SEATED)

    @property
    def opens(self) -> bool:
        """Whether tied ends are released."""
        return self in (EventKind.RELEASE, EventKind.SEPARATION)


class Joint(str, Enum):
    """Connection of the beam's tip with the end below it; the values are the words in ``events.csv``."""

    FREE = "free"  #: no contact force
    TIED = "tied"  #: bilateral, u_tip = y < Ψ
    TOUCH = "touch"  #: unilateral, 0 ≤ C ⊥ u_tip − y ≥ 0

    __str__ = str.__str__


@dataclass(frozen=True)
class Event:
    """One event, with its columns in file order; ``y, z, u_tip, v_tip`` are the values after it, ``None`` for an absent
    body, ``joint`` and ``seated`` the phase after it."""

    time: float
    kind: EventKind  #: or its word
    y: float | None = None
    z: float | None = None
    u_tip: float | None = None
    v_tip: float | None = None
    impulse_contact: float = 0.0  #: on the beam's tip, upward [N·s]
    impulse_foundation: float = 0.0  #: of the foundation, upward [N·s]
    energy_loss: float = 0.0  #: [J]
    joint: Joint = Joint.FREE  #: or its word
    seated: bool = False  #: whether the foundation holds the lower end

    def __post_init__(self) -> None:
        object.__setattr__(self, "kind", EventKind(self.kind))
        object.__setattr__(self, "joint", Joint(self.joint))


EVENT_COLUMNS = tuple(Event.__dataclass_fields__)
