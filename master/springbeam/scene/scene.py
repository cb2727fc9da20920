"""A whole scene: its tables, and values that follow from them before anything is built or loaded."""

import math
import re
from typing import Annotated, Any, NamedTuple

from pydantic import Field, model_validator
from typing_extensions import Self

from .laws import LAW, Contact, SoftLaw, TransmissionContact
from .loads import SIGNAL, Load
from .partners import LOWER, UPPER, ForeignFmu, Partner
from .schemes import SCHEME, Coupling, EnergyCoupling, Scheme
from .tables import Beam, Spring, Stop, Table, Time, key

#: Times closer than the first of these fractions of H are one; a step shorter than the second would drown in rounding.
SAME = 1e-9
SHORTEST_STEP = 1e-6


class StartHeight(NamedTuple):
    """A height [m], and ``"table.key"`` of the key that gives it."""

    key: str
    value: float


class Scene(Table):
    """The tables of a scene; those that it does not have are ``None``.

    ``upper`` is the table ``[beam]``, ``lower`` is ``[spring]``, whatever body they describe; ``beam`` and ``spring``
    are these where they are our own.
    `springbeam.scene.reading` makes scenes that can be run; a scene made by hand is not held against the rules.
    """

    title: str = key("–", "what the scene is, for pictures and reports", "")
    accuracy: float | None = key(
        "–", "largest relative error of motion, contact times and impulses; picks scheme, steps and tolerances", None,
        gt=0.0, lt=1.0,
    )  # fmt: skip
    time: Time
    upper: Annotated[Beam | Partner, UPPER] | None = Field(None, alias="beam")
    lower: Annotated[Spring | Partner, LOWER] | None = Field(None, alias="spring")
    stop: Stop | None = None
    contact: Annotated[Contact, LAW] = TransmissionContact()
    coupling: Annotated[Scheme, SCHEME] = EnergyCoupling()
    loads: Annotated[tuple[Annotated[Load, SIGNAL], ...], Field(strict=False)] = ()

    @model_validator(mode="after")
    def _lower_body_at_gap(self) -> Self:
        """Set the position of the lower body by ``gap``; the rules reject keys that it has itself."""
        if self.lower is not None and self.contact.gap != 0.0:
            follows = dict.fromkeys(set(self.lower.AT_GAP) - self.lower.model_fields_set, -self.contact.gap)
            lower = self.lower.model_copy(update=follows)
            lower.model_fields_set.difference_update(follows)
            self.__dict__["lower"] = lower  # the scene is frozen
        return self

    @property
    def beam(self) -> Beam | None:
        """Our beam, if it is the upper body."""
        return self.upper if isinstance(self.upper, Beam) else None

    @property
    def spring(self) -> Spring | None:
        """Our spring, if it is the lower body."""
        return self.lower if isinstance(self.lower, Spring) else None

    def under(self, table: str) -> Table | None:
        """Return the content of ``[table]``, whatever body that is."""
        return getattr(self, {"beam": "upper", "spring": "lower"}.get(table, table))

    def flat(self) -> dict[str, Any]:
        """Return the values of all keys that follow from no others, by ``"table.key"`` or ``"loads.0.key"``.

        Those outside the tables go by their names.
        """
        data = self.model_dump(exclude_none=True)
        tables = data | {f"loads.{i}": load for i, load in enumerate(data.pop("loads", ()))}
        outside = {name: value for name, value in data.items() if not isinstance(value, dict)}
        within = {name: content for name, content in tables.items() if isinstance(content, dict)}
        return outside | {f"{name}.{key}": value for name, content in within.items() for key, value in content.items()}

    @property
    def joins(self) -> bool:
        """Whether there are two bodies."""
        return self.upper is not None and self.lower is not None

    @property
    def partners(self) -> dict[str, Partner]:
        """The bodies that are not our own, by table."""
        places = {"beam": self.upper, "spring": self.lower}
        return {name: body for name, body in places.items() if not isinstance(body, (Beam, Spring, type(None)))}

    @property
    def foreign(self) -> dict[str, ForeignFmu]:
        """The FMUs that others made, by table."""
        return {name: body for name, body in self.partners.items() if isinstance(body, ForeignFmu)}

    @property
    def fmus(self) -> tuple[str, ...]:
        """Names of our FMUs that the scene needs; a beam without inertia needs none."""
        beam = self.beam is not None and not self.massless
        return ("beam",) * beam + ("spring",) * (self.spring is not None)

    @property
    def static(self) -> bool:
        """Whether the run starts at rest, in heights that are found when the bodies are there."""
        return self.time.initial_state == "static"

    @property
    def massless(self) -> bool:
        """Whether the upper body is our beam without inertia."""
        return self.beam is not None and self.beam.fidelity == "quasi_static"

    @property
    def degree(self) -> int:
        """Degree of the contact force over a step: the given one, else the highest that our bodies allow.

        Only a run knows what FMUs of others and bodies of the caller allow.
        """
        if self.coupling.degree is not None:
            return self.coupling.degree
        if self.coupling.exchanges:
            return 0
        if self.beam is not None and self.beam.integrator != "modal" and not self.massless:
            return 0
        return min((body.integrals for body in self.foreign.values()), default=2)

    @property
    def soft_law(self) -> SoftLaw | None:
        """The contact force, where it is a function of the penetration; ``None`` of a rigid law, or of no contact."""
        return self.contact.force() if self.coupled else None

    @property
    def elastic_stop(self) -> bool:
        """Whether the contact law acts between the tip and the stop: there is no spring, and the law is soft."""
        alone = self.upper is not None and self.lower is None and self.stop is not None
        return alone and self.contact.soft

    @property
    def coupled(self) -> bool:
        """Whether a contact law acts at all: between the tip and the spring top, or an elastic stop."""
        return self.upper is not None and (self.lower is not None or self.elastic_stop)

    def at_start(self, table: str) -> StartHeight | None:
        """Return the position of the end of the body ``[table]``, or of the stop, at the start.

        ``None`` if only an FMU knows it, or if it is computed. For our spring it is Ψ, for our beam s₀ L, or its static
        deflection if it is released without inertia and damping.
        """
        body = self.under(table)
        if body is None or body.START is None or self.static:
            return None
        height: float = getattr(body, body.START)
        if isinstance(body, Beam):
            from .statics import tip_load_deflection  # numpy, which the keys alone do not need

            static = self.massless and body.approach == "elastic" and body.alpha_b == 0.0
            height = tip_load_deflection(body) if static else height * body.length
        return StartHeight(f"{table}.{body.START}", height)

    @property
    def equilibrium(self) -> float | None:
        """Ψ [m], position of the unloaded lower end at the start; ``None`` if only an FMU knows it."""
        return None if self.lower is None or self.lower.START is None else getattr(self.lower, self.lower.START)

    @property
    def tip_target(self) -> StartHeight | None:
        """The body that the upper end meets first: the lower body, else the stop.

        ``None`` if there is none, if only an FMU knows its position, or if the law joins the ends at once.
        """
        if self.upper is None or self.contact.lasting:
            return None
        return self.at_start("stop" if self.lower is None else "spring")

    @property
    def initial_clearance(self) -> float | None:
        """Height [m] of the upper end above `tip_target` at the start, 0 where only rounding separates them."""
        tip = self.at_start("beam")
        target = self.tip_target
        if tip is None or target is None:
            return None
        return 0.0 if math.isclose(tip.value, target.value, rel_tol=1e-12) else tip.value - target.value

    @property
    def duration(self) -> float:
        """Length of the run [s]: from `contact_time` on if the tip arrives undeformed."""
        return self.time.t_end - (self.contact_time or 0.0)

    @property
    def contact_time(self) -> float | None:
        """First contact t_c [s] of an undeformed approach; ``None`` if it cannot be computed beforehand."""
        clearance = self.initial_clearance
        if self.beam is None or clearance is None or self.beam.approach == "elastic":
            return None
        velocity = self.beam.initial_velocity_slope * self.beam.length
        if clearance == 0.0 and velocity <= 0.0:
            return 0.0
        return -clearance / velocity if clearance > 0.0 > velocity else math.inf

    @property
    def equal_steps(self) -> tuple[int, float]:
        """Number of whole macro steps up to t_end, and the size of a last, shorter one [s], 0 if there is none.

        A negligible remainder joins the step before it.
        """
        H = self.coupling.H
        span = self.duration
        whole = math.floor(span / H * (1.0 + 1e-12))
        rest = span - whole * H
        if rest <= SAME * H:
            return whole, 0.0
        return (whole, rest) if rest >= SHORTEST_STEP * H or whole == 0 else (whole - 1, rest + H)


#: The tables by their names in a file.
TABLES: dict[str, type[Table]] = {
    "time": Time,
    "beam": Beam,
    "spring": Spring,
    "stop": Stop,
    "contact": Contact,
    "coupling": Coupling,
}


def split_key(text: str) -> tuple[str, str] | None:
    """Return table and key of ``"table.key"`` or ``"loads.0.key"``; ``None`` if it is neither."""
    match = re.fullmatch(r"\s*(loads\.\d+|[^.\s]+)\.(\S.*?)\s*", text, re.DOTALL)
    return None if match is None else (match[1], match[2])
