"""The tables of a scene file, one class each: meaning, unit, default and range of every key.

Field names are those of the FMU parameters; units are SI. `springbeam.scene.rules` has conditions on several tables,
`springbeam.scene.messages` makes the JSON Schema from them, `springbeam.cli.keys` lists them.
"""

import re
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import reduce
from itertools import chain
from math import pi
from operator import or_
from sys import float_info
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, TypeVar

from pydantic import (
    BaseModel,
    ConfigDict,
    Discriminator,
    Field,
    GetCoreSchemaHandler,
    ModelWrapValidatorHandler,
    SerializerFunctionWrapHandler,
    Tag,
    model_serializer,
    model_validator,
)
from pydantic_core import CoreSchema, core_schema
from typing_extensions import Self

if TYPE_CHECKING:
    import numpy as np

#: Up to this many unknowns all modes may be kept; the full eigenproblem grows with the cube.
ALL_MODES_UP_TO = 1000
#: Most modes of a mesh with more, and of the continuous beam.
MOST_MODES = 1000
#: Most modes times unknowns: 40 bytes each while the modes are found, so 1 GB.
MOST_MODE_VALUES = 25_000_000
#: Most elements of degree 1; of degree p fewer by p(p + 1)/2, by which the band of their matrices grows.
MOST_ELEMENTS = 1_000_000


#: Options of commands, and their names in Python if these differ.
_OPTION = re.compile(r"(?<!\S)--([a-z]+)")
_ARGUMENTS = {"set": "overrides", "map": "names"}


class SceneError(ValueError):
    """A scene that cannot be run; the message names the file, the table, the key and the allowed values."""


class ArgumentError(SceneError):
    """An argument that cannot be used.

    ``typed`` names options of the command, as ``--vary``; the text of the error names the arguments of Python.
    """

    def __init__(self, typed: str) -> None:
        self.typed = typed
        super().__init__(_OPTION.sub(lambda option: _ARGUMENTS.get(option[1], option[1]), typed))


def key(
    unit: str,
    meaning: str,
    default: Any = ...,
    *,
    otherwise: str = "",
    **bounds: float,
) -> Any:
    """Declare a key of a table: its unit ("–" for none), one line of meaning, its default (none: it must be given).

    ``otherwise`` describes a default that is no fixed value; ``bounds`` are pydantic's gt, ge, le, lt.
    """
    extra: dict[str, Any] = {"unit": unit, "otherwise": otherwise}
    return Field(default, description=meaning, json_schema_extra=extra, **bounds)  # type: ignore[call-overload]


#: Groups of keys that give the same values; those of the first follow from the others.
Ways = tuple[tuple[str, ...], ...]


def _plain(value: Any) -> Any:
    """Return ``value``, or a dictionary of values, with numbers and arrays of numpy as Python's."""
    if isinstance(value, dict):
        return {name: _plain(content) for name, content in value.items()}
    return value.tolist() if hasattr(value, "tolist") else value


class Table(BaseModel):
    model_config = ConfigDict(
        extra="forbid", frozen=True, allow_inf_nan=False, strict=True, serialize_by_alias=True, defer_build=True
    )

    #: Values that alternative groups of keys give: a table has keys of one group.
    WAYS: ClassVar[tuple[Ways, ...]] = ()
    #: Keys that set the scales of the table: without any of them, the needed ones are 1 (dimensionless).
    SCALES: ClassVar[tuple[str, ...]] = ()
    #: Key of the position of the end, of a body or the stop, at the start; ``None`` if only an FMU knows it.
    START: ClassVar[str | None] = None
    #: Keys of a lower body that ``gap`` of ``[contact]`` gives.
    AT_GAP: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def ones(cls) -> dict[str, float]:
        """Return 1 for all needed keys: the dimensionless table for which exact solutions are stated."""
        return {name: 1.0 for name, field in cls.model_fields.items() if field.is_required()}

    @classmethod
    def with_ones(cls, **keys: Any) -> Self:
        """Return the table of `ones` with some keys changed."""
        return cls(**{**cls.ones(), **keys})

    @classmethod
    def other_ways(cls, name: str) -> set[str]:
        """Return the keys that are alternatives to the key ``name``."""
        return {
            key for ways in cls.WAYS if name in chain(*ways) for group in ways if name not in group for key in group
        }

    @classmethod
    def following(cls, given: set[str], keys: Mapping[str, float]) -> dict[str, float]:
        """Return the keys that follow from those that are ``given``; of ``keys`` a bad or missing value is 1."""
        return {}

    @classmethod
    def _in_range(cls, name: str, value: float) -> bool:
        bounds = cls.model_fields[name].metadata if name in cls.model_fields else ()
        return abs(value) <= float_info.max and all(value > bound.gt for bound in bounds if hasattr(bound, "gt"))

    @model_validator(mode="wrap")
    @classmethod
    def _completed(cls, data: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        if not isinstance(data, dict):
            return handler(data)
        # A key that is not given, as a caller says by None, may be another table's.
        data = {name: value for name, value in _plain(data).items() if value is not None or name in cls.model_fields}
        given = {name for name, value in data.items() if value is not None}
        for name in data:
            if name in given and (others := given & cls.other_ways(name)):
                raise ValueError(f"{', '.join([name, *sorted(others)])}: alternatives; leave one out")
        # A bad value is reported as such, and not what would follow from it.
        sane = {name: x for name, x in data.items() if isinstance(x, (int, float)) and cls._in_range(name, x)}
        follows = cls.following(given, defaultdict(lambda: 1.0, sane))
        if given.isdisjoint(cls.SCALES):
            follows |= {name: one for name, one in cls.ones().items() if name in cls.SCALES}
        follows = {name: value for name, value in follows.items() if name not in given}
        table = handler({**data, **follows})
        table.model_fields_set.difference_update(follows)
        return table

    @model_serializer(mode="wrap")
    def _as_given(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out keys that follow from others: neither given nor the default."""
        fields = type(self).model_fields
        given = self.model_fields_set
        followed = {name for name in fields.keys() - given if getattr(self, name) != fields[name].default}
        return {name: value for name, value in handler(self).items() if name not in followed and value not in ((), [])}


class OfProgram(Table):
    """A table with functions, which a program makes and no file has."""

    model_config = ConfigDict(arbitrary_types_allowed=True)


@dataclass(frozen=True, eq=False)
class OneOf:
    """Annotate a field whose table is one of several, chosen by the value of its key ``name``.

    A table that is added to ``tables`` counts after ``Scene.model_rebuild(force=True)``.
    """

    #: Their common base.
    common: type[Table]
    name: str
    #: One line on ``name``.
    meaning: str
    tables: dict[str, Any]
    #: Its value where it is left out.
    default: str
    #: Values of it by the names that other programs have for them, in small letters and digits.
    elsewhere: Mapping[str, str] = field(default_factory=dict)

    def kind(self, content: Any) -> str:
        """Return which of ``tables`` the content of a table belongs to, or the unknown value of its key."""
        kind = content.get(self.name) if isinstance(content, dict) else getattr(content, self.name, None)
        return self.default if kind is None else str(kind)

    def kept(self, content: dict[str, Any], kind: str) -> dict[str, Any]:
        """Return the part of the content of a table that another alternative can keep: the keys that it has, too."""
        table = self.tables.get(kind)
        return {key: value for key, value in content.items() if table is None or key in table.model_fields}

    @property
    def named(self) -> list[str]:
        """The values that its key may have."""
        return [kind for kind, table in self.tables.items() if self.name in table.model_fields]

    def that_have(self, key: str) -> list[str]:
        """Return the values of its key with which the table has ``key``."""
        return [kind for kind in self.named if key in self.tables[kind].model_fields]

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        tables = (Annotated[table, Tag(kind)] for kind, table in self.tables.items())
        of_file = handler.generate_schema(Annotated[reduce(or_, tables), Discriminator(self.kind)])
        return core_schema.no_info_wrap_validator_function(
            lambda value, validate: value if isinstance(value, OfProgram) else validate(value),
            of_file,
            serialization=core_schema.wrap_serializer_function_ser_schema(
                lambda value, serialize: value.model_dump() if isinstance(value, OfProgram) else serialize(value),
                schema=of_file,
            ),
        )


class Time(Table):
    """The run, which starts at 0."""

    t_end: float = key("s", "end of the run", gt=0.0)
    initial_state: Literal["given", "static"] = key(
        "–", "given: by the keys of the bodies; static: at rest under the loads at the start and the contact force",
        "given",
    )  # fmt: skip


_OF_SECTION = "needed, or width and height, or diameter"


class Beam(Table):
    """Kelvin–Voigt Timoshenko beam, clamped at x = 0 (Ahn & Tate, (1)–(5)).

    Geometry and material have no defaults. Only if neither density, length, section, shear coefficient nor Poisson's
    ratio is given, the beam is dimensionless: the first four are 1, as in the paper's section 6.
    """

    density: float = key("kg/m³", "density ρ", gt=0.0)
    length: float = key("m", "length L", gt=0.0)
    area: float = key("m²", "area A of the section", gt=0.0, otherwise=_OF_SECTION)
    second_moment_of_area: float = key(
        "m⁴", "second moment of area I about the axis of bending", gt=0.0, otherwise=_OF_SECTION
    )
    width: float | None = key("m", "width of a rectangular section", None, gt=0.0)
    height: float | None = key("m", "height of a rectangular section, in the direction of motion", None, gt=0.0)
    diameter: float | None = key("m", "diameter of a round section", None, gt=0.0)
    young_modulus: float = key("Pa", "Young's modulus E", gt=0.0)
    shear_modulus: float = key("Pa", "shear modulus G", gt=0.0, otherwise="needed, or poisson_ratio")
    poisson_ratio: float | None = key("–", "Poisson's ratio ν: G = E/2(1 + ν)", None, gt=-1.0, le=0.5)
    shear_coefficient: float = key(
        "–", "shear coefficient K", gt=0.0, otherwise="5/6 with width and height, 9/10 with diameter; needed with area"
    )
    alpha_b: float = key("s", "Kelvin–Voigt retardation time α_b", 0.0, ge=0.0)
    n_elements: int = key("–", "number of elements", 50, ge=1, le=MOST_ELEMENTS)
    element_degree: int = key("–", "degree of u and θ in an element; 1 is the paper's", 1, ge=1, le=12)
    n_modes: int = key("–", "number of lowest modes kept; 0 keeps all", 0, ge=0)
    reduced_integration: bool = key("–", "integrate the shear energy with one point less, against locking", False)
    mass_matrix: Literal["consistent", "averaged"] = key(
        "–", "the paper's, or averaged with the lumped one so that short waves travel at the right speed", "consistent"
    )
    integrator: Literal["modal", "midpoint"] = key(
        "–", "exact in time for each mode, or the midpoint rule on the whole mesh", "modal"
    )
    distributed_load: float = key("N/m", "uniform load f_b, upward", 0.0)
    tip_load_coefficient: float = key("N/m", "load of the last element's hat function, upward", 0.0)
    initial_deflection_slope: float = key("–", "slope s₀ of the beam at the start: u = s₀ x", 0.0)
    initial_velocity_slope: float = key("1/s", "slope s₁ of its velocity at the start: u̇ = s₁ x, upward", 0.0)
    approach_speed: float | None = key("m/s", "speed of the tip at the start, downward: s₁ = −speed/L", None)
    approach: Literal["undeformed", "elastic"] = key(
        "–", "until first contact the beam turns as a straight line, or moves by its equations", "undeformed"
    )
    fidelity: Literal["dynamic", "quasi_static"] = key(
        "–", "quasi_static: no inertia, so that mesh, modes and integrator have no effect", "dynamic"
    )

    WAYS = (
        (("area", "second_moment_of_area"), ("width", "height"), ("diameter",)),
        (("shear_modulus",), ("poisson_ratio",)),
        (("initial_velocity_slope",), ("approach_speed",)),
    )
    START = "initial_deflection_slope"
    SCALES = (
        *("density", "length", "area", "second_moment_of_area", "width", "height", "diameter"),
        *("poisson_ratio", "shear_coefficient"),
    )
    #: Keys that are not the FMU's.
    GIVEN_ONLY: ClassVar[frozenset[str]] = frozenset(
        ("width", "height", "diameter", "poisson_ratio", "approach_speed", "approach", "fidelity")
    )

    @classmethod
    def following(cls, given: set[str], keys: Mapping[str, float]) -> dict[str, float]:
        follows = {}
        if "area" not in given:  # what is missing is the section
            follows["shear_coefficient"] = 1.0
        if {"width", "height"} <= given:
            follows["area"] = keys["width"] * keys["height"]
            follows["second_moment_of_area"] = follows["area"] * keys["height"] * keys["height"] / 12.0
            follows["shear_coefficient"] = 5.0 / 6.0
        if "diameter" in given:
            square = keys["diameter"] * keys["diameter"]
            follows["area"] = pi * square / 4.0
            follows["second_moment_of_area"] = pi * square * square / 64.0
            follows["shear_coefficient"] = 9.0 / 10.0
        if "poisson_ratio" in given:
            follows["shear_modulus"] = keys["young_modulus"] / (2.0 * (abs(1.0 + keys["poisson_ratio"]) or 1.0))
        if "approach_speed" in given:
            follows["initial_velocity_slope"] = 0.0 - keys["approach_speed"] / (keys["length"] or 1.0)
        return follows

    @property
    def section_height(self) -> float:
        """Height of the section in the direction of motion [m]; 0 if only its area and second moment are known."""
        return self.height or self.diameter or 0.0

    @property
    def unknowns(self) -> int:
        """Unknowns of the mesh."""
        return 2 * self.n_elements * self.element_degree

    @property
    def modes_kept(self) -> int:
        """Number of modes that take part: all of the mesh if the scene names none, or the integrator has no modes."""
        return self.n_modes if self.n_modes and self.integrator == "modal" else self.unknowns


_BY_GAP = "0.0, or −gap of [contact]"
_Heights = TypeVar("_Heights", float, "np.ndarray")

#: Keys of tolerances, relative and absolute.
TOLERANCE_KEYS = ("relative_tolerance", "absolute_tolerance")


class Spring(Table):
    """Duffing spring m ÿ + α_s ẏ + k1 x + k2 x³ = −C + N + f_s, x = y − unloaded (Ahn & Tate, (6)).

    Mass and linear stiffness have no defaults. Only if neither is given, the spring is dimensionless: both are 1.
    """

    START = "equilibrium"
    AT_GAP = ("equilibrium", "unloaded")
    SCALES = ("mass", "linear_stiffness")

    mass: float = key("kg", "mass m", gt=0.0)
    damping: float = key("N·s/m", "damping α_s", 0.0, ge=0.0)
    linear_stiffness: float = key("N/m", "linear stiffness k1")
    cubic_stiffness: float = key("N/m³", "cubic stiffness k2: above 0 it hardens, below it softens", 0.0)
    equilibrium: float = key(
        "m", "height Ψ of the top at the start, below which a rigid law ties the ends", 0.0, otherwise=_BY_GAP
    )
    unloaded: float = key("m", "height y₀ of the top where the spring is without force", 0.0, otherwise=_BY_GAP)
    external_force: float = key("N", "constant force f_s on the top, upward", 0.0)
    initial_velocity: float = key("m/s", "velocity of the top at the start, upward", 0.0)
    relative_tolerance: float = key("–", "relative tolerance of its motion", 1e-12, gt=0.0, le=1e-2)
    absolute_tolerance: float = key("m, m/s", "absolute tolerance of its motion, of y and z", 1e-30, gt=0.0, le=1e-2)

    def force(self, y: _Heights) -> _Heights:
        """Return k1 x + k2 x³ − f_s [N]: the force that holds the top at ``y`` [m], as the foundation does."""
        x = y - self.unloaded
        return self.linear_stiffness * x + self.cubic_stiffness * x**3 - self.external_force

    def stiffness(self, y: _Heights) -> _Heights:
        """Return k1 + 3 k2 x² [N/m] at heights ``y`` [m]."""
        return self.linear_stiffness + 3.0 * self.cubic_stiffness * (y - self.unloaded) ** 2

    @property
    def softens(self) -> bool:
        """Whether it softens: its stiffness is positive near ``unloaded`` and decreases further out."""
        return self.cubic_stiffness < 0.0 < self.linear_stiffness


class Stop(Table):
    """Rigid foundation: 0 ≤ N ⊥ y − φ ≥ 0 (Ahn & Tate, (8))."""

    START = "position"

    position: float = key("m", "height φ, not above that of the spring's top")
    restitution: float = key("–", "restitution e: speed after an impact over that before", 1.0, ge=0.0, le=1.0)
