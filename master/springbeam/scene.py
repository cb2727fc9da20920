"""Scene files: what is simulated and how, validated before anything is built or loaded.

A scene is a TOML file with the tables ``[time]``, ``[beam]``, ``[spring]``, ``[stop]``, ``[contact]`` and
``[coupling]``; a missing ``[beam]``, ``[spring]`` or ``[stop]`` is a scene without it. Field names are those of
the FMU parameters; units are SI.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

Positive = Annotated[float, Field(gt=0.0)]
NonNegative = Annotated[float, Field(ge=0.0)]


class SceneError(ValueError):
    """A scene that cannot be run; the message names the file, the table, the key and what would be allowed."""


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)


class Time(_Table):
    t_end: Positive  #: end of the run [s]; it starts at 0


class Beam(_Table):
    """Kelvin–Voigt Timoshenko beam, clamped at x = 0 (Ahn & Tate, (1)–(5))."""

    density: Positive = 1.0  #: ρ [kg/m³]
    area: Positive = 1.0  #: A [m²]
    second_moment_of_area: Positive = 1.0  #: I [m⁴]
    young_modulus: Positive = 1.0  #: E [Pa]
    shear_modulus: Positive = 1.0  #: G [Pa]
    shear_coefficient: Positive = 1.0  #: K [–]
    length: Positive = 1.0  #: L [m]
    alpha_b: NonNegative = 0.0  #: Kelvin–Voigt retardation time [s]
    n_elements: Annotated[int, Field(ge=1, le=1_000_000)] = 50
    n_modes: Annotated[int, Field(ge=0)] = 0  #: lowest modes kept; 0 = all
    reduced_integration: bool = False
    integrator: Literal["modal", "generalized_alpha"] = "modal"
    rho_inf: Annotated[float, Field(ge=0.0, le=1.0)] = 1.0  #: generalized-α only; 1 = midpoint rule (62)
    distributed_load: float = 0.0  #: f_b, uniform [N/m]
    tip_load_coefficient: float = 0.0  #: last hat-function coefficient of f_b [N/m]
    initial_deflection_slope: float = 0.0  #: u⁰ = s x
    initial_velocity_slope: float = 0.0  #: u_t⁰ = s x [1/s]
    approach: Literal["undeformed", "elastic"] = "undeformed"

    @model_validator(mode="after")
    def _modes_exist(self) -> Beam:
        if self.n_modes > 2 * self.n_elements:
            raise ValueError(f"n_modes = {self.n_modes}: {self.n_elements} elements have {2 * self.n_elements} modes")
        return self


class Spring(_Table):
    """Duffing spring m ÿ + α_s ẏ + k1 y + k2 y³ = −C + N + f_s (Ahn & Tate, (6))."""

    mass: Positive = 1.0  #: m [kg]
    damping: NonNegative = 0.0  #: α_s [N·s/m]
    linear_stiffness: float = 1.0  #: k1 [N/m]
    cubic_stiffness: float = 0.0  #: k2 [N/m³]
    equilibrium: float = 0.0  #: Ψ [m]: where the top starts
    external_force: float = 0.0  #: f_s [N]
    initial_velocity: float = 0.0  #: z at the start [m/s]


class Stop(_Table):
    """Rigid foundation: 0 ≤ N ⊥ y − φ ≥ 0 (Ahn & Tate, (8))."""

    position: float  #: φ [m]
    restitution: Annotated[float, Field(ge=0.0, le=1.0)] = 1.0  #: e


class Contact(_Table):
    law: Literal["transmission", "compliance", "paper"] = "transmission"
    impact: Literal["inelastic", "rest", "tip"] = "inelastic"
    stiffness: NonNegative = 1.0e4  #: λ_nc [N/m^p]
    exponent: Annotated[float, Field(ge=1.0)] = 3.0  #: p


class Coupling(_Table):
    scheme: Literal["energy", "hermite"] = "energy"
    degree: Annotated[int, Field(ge=0, le=2)] = 0  #: of the contact force over a step
    macro_step: Positive = 0.004  #: H [s]
    tolerance: Annotated[float, Field(gt=0.0, le=1e-3)] = 1.0e-12

    @model_validator(mode="after")
    def _degree_of_scheme(self) -> Coupling:
        if self.scheme == "hermite" and self.degree == 0:
            raise ValueError("degree = 0: hermite needs degree 1 or 2")
        return self


class Scene(_Table):
    """A validated scene. ``beam``, ``spring`` and ``stop`` are ``None`` where the scene does not have them."""

    title: str = ""
    time: Time
    beam: Beam | None = None
    spring: Spring | None = None
    stop: Stop | None = None
    contact: Contact = Contact()
    coupling: Coupling = Coupling()

    @model_validator(mode="after")
    def _consistent(self) -> Scene:
        if self.beam is None and self.spring is None:
            raise ValueError("a scene needs [beam], [spring] or both")
        if self.spring is not None and self.stop is not None and self.stop.position >= self.spring.equilibrium:
            raise ValueError(
                f"stop.position = {self.stop.position}: the foundation must lie below "
                f"spring.equilibrium = {self.spring.equilibrium}"
            )
        if self.coupling.macro_step > self.time.t_end:
            raise ValueError(f"coupling.macro_step = {self.coupling.macro_step}: larger than time.t_end")
        if self.contact.law == "compliance" and self.coupling.scheme != "energy":
            raise ValueError("contact.law = 'compliance' needs coupling.scheme = 'energy'")
        if self.contact.law == "compliance" and self.coupling.degree != 0:
            raise ValueError("contact.law = 'compliance' needs coupling.degree = 0 (discrete gradient)")
        return self


def shipped_scenes() -> dict[str, Path]:
    """Names and files of the scenes that come with the package."""
    folder = Path(str(resources.files("springbeam") / "scenes"))
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def load_scene(path_or_name: str | Path, overrides: Iterable[str] = ()) -> Scene:
    """Read and validate a scene.

    Parameters
    ----------
    path_or_name
        A TOML file, or the name of a shipped scene.
    overrides
        ``"table.key=value"`` strings, the value in TOML syntax (a bare word is taken as a string).

    Raises
    ------
    SceneError
        If the file cannot be read or the scene cannot be run.
    """
    path = Path(path_or_name)
    if path.suffix != ".toml" and not path.exists():
        shipped = shipped_scenes()
        if str(path_or_name) not in shipped:
            raise SceneError(
                f"{path_or_name}: neither a file nor a shipped scene; shipped scenes: {', '.join(shipped)}"
            )
        path = shipped[str(path_or_name)]
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise SceneError(f"{path}: cannot be read as TOML: {error}") from error
    for override in overrides:
        _override(data, override)
    return scene_from_dict(data, source=str(path))


def scene_from_dict(data: dict[str, Any], source: str = "scene") -> Scene:
    """Validate a scene given as nested dictionaries; ``source`` names it in errors."""
    try:
        return Scene.model_validate(data)
    except ValidationError as error:
        lines = [f"{source}: {_place(e['loc'])}{_explain(e)}" for e in error.errors()]
        raise SceneError("\n".join(lines)) from None


def with_changes(scene: Scene, **tables: dict[str, Any]) -> Scene:
    """A validated copy with keys changed: ``with_changes(scene, coupling={"macro_step": 1e-3})``."""
    data = scene.model_dump(exclude_none=True)
    for table, changes in tables.items():
        data[table] = {**data.get(table, {}), **changes}
    return scene_from_dict(data)


def _override(data: dict[str, Any], override: str) -> None:
    target, separator, text = override.partition("=")
    table, dot, key = target.strip().partition(".")
    if not separator or not dot or not key:
        raise SceneError(f"--set {override}: expected table.key=value")
    try:
        value = tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        value = text.strip()
    data.setdefault(table, {})
    if not isinstance(data[table], dict):
        raise SceneError(f"--set {override}: {table} is not a table")
    data[table][key] = value


def _place(loc: tuple[int | str, ...]) -> str:
    names = [str(part) for part in loc]
    if not names:
        return ""
    return f"[{names[0]}]: " if len(names) == 1 else f"[{names[0]}] {'.'.join(names[1:])}: "


def _explain(error: Any) -> str:
    if error["type"] == "extra_forbidden":
        return f"unknown key; allowed: {', '.join(_allowed_keys(error['loc']))}"
    if error["type"] == "missing":
        return "missing; it has no default"
    message = error["msg"].removeprefix("Value error, ")
    return message if error["type"] == "value_error" else f"{error['input']!r} is not allowed: {message}"


def _allowed_keys(loc: tuple[int | str, ...]) -> list[str]:
    if len(loc) == 1:
        return list(Scene.model_fields)
    tables = {"time": Time, "beam": Beam, "spring": Spring, "stop": Stop, "contact": Contact, "coupling": Coupling}
    return list(tables[str(loc[0])].model_fields)
