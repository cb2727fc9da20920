"""The tables of a scene file, one class each: meaning, unit, default and range of every key.

Field names are those of the FMU parameters; units are SI. `springbeam.scene.rules` has what several tables decide.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

#: Up to this many unknowns all modes may be kept; the full eigenproblem grows with the cube.
ALL_MODES_UP_TO = 1000


#: Most modes of a mesh with more.
MOST_MODES = 1000


#: Most modes times unknowns: 40 bytes each while the modes are found, so 1 GB.
MOST_MODE_VALUES = 25_000_000


#: Most elements times their degree.
MOST_ELEMENTS = 1_000_000


Positive = Annotated[float, Field(gt=0.0)]


NonNegative = Annotated[float, Field(ge=0.0)]


class SceneError(ValueError):
    """A scene that cannot be run; the message names the file, the table, the key and what would be allowed."""


class Table(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)


class Time(Table):
    t_end: Positive  #: end of the run [s]; it starts at 0


class Beam(Table):
    """Kelvin–Voigt Timoshenko beam, clamped at x = 0 (Ahn & Tate, (1)–(5))."""

    density: Positive = 1.0  #: ρ [kg/m³]
    area: Positive = 1.0  #: A [m²]
    second_moment_of_area: Positive = 1.0  #: I [m⁴]
    young_modulus: Positive = 1.0  #: E [Pa]
    shear_modulus: Positive = 1.0  #: G [Pa]
    shear_coefficient: Positive = 1.0  #: K [–]
    length: Positive = 1.0  #: L [m]
    alpha_b: NonNegative = 0.0  #: Kelvin–Voigt retardation time [s]
    n_elements: Annotated[int, Field(ge=1, le=MOST_ELEMENTS)] = 50
    element_degree: Annotated[int, Field(ge=1, le=12)] = 1  #: of u and θ in an element; 1 is the paper's
    n_modes: Annotated[int, Field(ge=0)] = 0  #: lowest modes kept; 0 = all
    reduced_integration: bool = False
    #: "averaged" with the lumped one, so that short waves travel at the right speed; the paper's is consistent.
    mass_matrix: Literal["consistent", "averaged"] = "consistent"
    integrator: Literal["modal", "generalized_alpha"] = "modal"
    rho_inf: Annotated[float, Field(ge=0.0, le=1.0)] = 1.0  #: generalized-α only; 1 = midpoint rule (62)
    distributed_load: float = 0.0  #: f_b, uniform [N/m]
    tip_load_coefficient: float = 0.0  #: last hat-function coefficient of f_b [N/m]
    initial_deflection_slope: float = 0.0  #: u⁰ = s x
    initial_velocity_slope: float = 0.0  #: u_t⁰ = s x [1/s]
    approach: Literal["undeformed", "elastic"] = "undeformed"
    #: "quasi_static": without inertia, a tip compliance; mesh, modes, integrator and density then play no part.
    fidelity: Literal["dynamic", "quasi_static"] = "dynamic"

    @property
    def damped_numerically(self) -> bool:
        """Whether the integrator takes energy that nothing books."""
        return self.fidelity == "dynamic" and self.integrator == "generalized_alpha" and self.rho_inf < 1.0

    @model_validator(mode="after")
    def _modes_exist(self) -> Beam:
        unknowns, degree = 2 * self.n_elements * self.element_degree, self.element_degree
        mesh = f"n_elements = {self.n_elements}" + (f" of element_degree = {degree}" if degree > 1 else "")
        if self.n_elements * degree > MOST_ELEMENTS:
            raise ValueError(
                f"n_elements = {self.n_elements}: times element_degree = {degree} it must be at most {MOST_ELEMENTS}"
            )
        if self.n_modes > unknowns:
            raise ValueError(f"n_modes = {self.n_modes}: {mesh} has only {unknowns} modes; use 0 for all of them")
        if self.integrator == "modal" and self.n_modes == 0 and unknowns > ALL_MODES_UP_TO:
            raise ValueError(
                f"n_modes = 0: {mesh} has {unknowns} modes, too many to keep them all (allowed up to "
                f'{ALL_MODES_UP_TO}); use n_modes = 64, or integrator = "generalized_alpha"'
            )
        if self.integrator == "modal" and unknowns > ALL_MODES_UP_TO:
            most = min(MOST_MODES, unknowns // 2)
            if self.n_modes > most:
                raise ValueError(
                    f"n_modes = {self.n_modes}: at most {most} of the {unknowns} modes of {mesh} are found"
                )
            if self.n_modes * unknowns > MOST_MODE_VALUES:
                raise ValueError(
                    f"n_modes = {self.n_modes}: with {mesh} they take {40 * self.n_modes * unknowns / 1e9:.3g} GB; "
                    f"use n_modes = {MOST_MODE_VALUES // unknowns} or less, or fewer n_elements"
                )
        return self


class Spring(Table):
    """Duffing spring m ÿ + α_s ẏ + k1 y + k2 y³ = −C + N + f_s (Ahn & Tate, (6))."""

    mass: Positive = 1.0  #: m [kg]
    damping: NonNegative = 0.0  #: α_s [N·s/m]
    linear_stiffness: float = 1.0  #: k1 [N/m]
    cubic_stiffness: float = 0.0  #: k2 [N/m³]
    equilibrium: float = 0.0  #: Ψ [m]: where the top starts
    external_force: float = 0.0  #: f_s [N]
    initial_velocity: float = 0.0  #: z at the start [m/s]
    relative_tolerance: Annotated[float, Field(gt=0.0, le=1e-2)] = 1e-12  #: IDA's
    absolute_tolerance: Annotated[float, Field(gt=0.0, le=1e-2)] = 1e-14  #: IDA's, of y [m] and z [m/s]


class Stop(Table):
    """Rigid foundation: 0 ≤ N ⊥ y − φ ≥ 0 (Ahn & Tate, (8))."""

    position: float  #: φ [m]
    restitution: Annotated[float, Field(ge=0.0, le=1.0)] = 1.0  #: e


class Contact(Table):
    """What force C belongs to the penetration p = y − u_tip (``docs/model.md``, "Interface laws")."""

    law: Literal["transmission", "compliance", "tie", "link", "paper"] = "transmission"
    impact: Literal["inelastic", "rest", "tip"] = "inelastic"
    stiffness: NonNegative = 1.0e4  #: λ_nc [N/m^p], of "link" [N/m]
    exponent: Annotated[float, Field(ge=1.0, le=100.0)] = 3.0  #: p; "link" has none
    damping: NonNegative = 0.0  #: "compliance": χ [s/m] (Hunt & Crossley 1975); "link": c [N·s/m]
    #: Over which the force is averaged before its peak is taken [s]; `springbeam.scene.resolution.force_window`.
    force_window: Annotated[float | None, Field(gt=0.0)] = None

    @property
    def rigid(self) -> bool:
        """Whether ends that have met share one position."""
        return self.law in ("transmission", "tie")

    @property
    def lasting(self) -> bool:
        """Whether the law joins the ends from the start and for good, for either sign of C."""
        return self.law in ("tie", "link")


#: Keys that set the length of macro steps: the one, or the others.
STEP_KEY, TOLERANCE_KEYS = "macro_step", ("relative_tolerance", "absolute_tolerance")


#: H [s] of a scene that gives neither: that of Ahn & Tate's section 6.
DEFAULT_STEP = 0.004


#: What ``accuracy`` picks, by table: it takes the place of these keys.
PICKED_BY_ACCURACY = {
    "coupling": ("scheme", "degree", STEP_KEY, *TOLERANCE_KEYS, "tolerance"),
    "spring": TOLERANCE_KEYS,
}


#: Schemes that exchange once per macro step, as ordinary masters do.
ORDINARY_SCHEMES = ("gauss_seidel", "jacobi")


class Coupling(Table):
    #: "auto" picks scheme and degree: `springbeam.scene.automatic`.
    scheme: Literal["energy", "hermite", "auto", "gauss_seidel", "jacobi"] = "energy"
    degree: Annotated[int, Field(ge=0, le=2)] = 0  #: of the contact force over a step
    macro_step: Annotated[float | None, Field(gt=0.0)] = None  #: H [s]; `DEFAULT_STEP` where no tolerance is given
    #: Largest error of a step, relative to the motion so far, and absolute [m]; instead of ``macro_step``.
    relative_tolerance: Annotated[float | None, Field(gt=0.0, le=0.1)] = None
    absolute_tolerance: Annotated[float | None, Field(gt=0.0)] = None
    tolerance: Annotated[float, Field(gt=0.0, le=1e-3)] = 1.0e-12
    #: One-way: the driving body does not feel the contact force (law "compliance").
    feedback: Literal["two_way", "beam_drives", "spring_drives"] = "two_way"
    #: Motion of the driving end that one-way coupling may neglect, over the largest penetration.
    feedback_tolerance: Annotated[float, Field(gt=0.0, le=0.1)] = 1.0e-6

    @model_validator(mode="before")
    @classmethod
    def _default_step(cls, data: Any) -> Any:
        if isinstance(data, dict) and all(data.get(key) is None for key in (STEP_KEY, *TOLERANCE_KEYS)):
            return {**data, STEP_KEY: DEFAULT_STEP}
        return data

    @model_validator(mode="after")
    def _step_or_tolerance(self) -> Coupling:
        if self.macro_step is not None and self.adaptive:
            raise ValueError(
                f"macro_step = {self.macro_step}: with relative_tolerance or absolute_tolerance the master chooses its "
                "steps; give either macro_step or tolerances"
            )
        return self

    @property
    def adaptive(self) -> bool:
        """Whether the steps follow from tolerances."""
        return self.relative_tolerance is not None or self.absolute_tolerance is not None

    @property
    def H(self) -> float:
        """The macro step [s]. Raises SceneError if tolerances are given instead."""
        if self.macro_step is None:
            raise SceneError("[coupling] macro_step: needed here; this scene gives tolerances instead")
        return self.macro_step

    @model_validator(mode="after")
    def _degree_of_scheme(self) -> Coupling:
        if self.scheme == "hermite" and self.degree == 0:
            raise ValueError('degree = 0: scheme = "hermite" needs degree 1 or 2')
        if self.scheme == "auto" and self.degree > 0:
            raise ValueError(f'degree = {self.degree}: scheme = "auto" picks the degree; leave it out')
        if self.scheme in ORDINARY_SCHEMES and self.degree > 1:
            raise ValueError(f'degree = {self.degree}: scheme = "{self.scheme}" extrapolates with degree 0 or 1')
        return self
