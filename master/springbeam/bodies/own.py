"""Our two FMUs as bodies: a table of the variables of each, and what only they have."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from ..scene import Beam, Load, Spring
from ..scene.modes import tip_decay
from ..scene.statics import SHAPE_POINTS, tip_compliance, tip_reach
from .elements import EndLoaded
from .fmu import Fmu, Value
from .fmu_body import ENERGIES, MOTION, FmuBody, FmuState
from .force import combined
from .port import Port, Reading
from .protocol import (
    Abilities,
    Energies,
    Force,
    InnerForces,
    Motion,
    made_of,
)

#: Length of a trial step of our own bodies over a macro step; it changes their outputs by no more than rounding.
_INSTANT = 1e-8
#: The numbers by which the beam FMU knows its alternatives.
_INTEGRATORS = {"modal": 1, "midpoint": 2}
_MASS_MATRICES = {"consistent": 1, "averaged": 2}
_AT_REST = 2
#: Loads along the beam in powers of x/L.
_DISTRIBUTED = ("distributed_load", "distributed_load_x", "distributed_load_x2", "distributed_load_x3")
#: Variables of `InnerForces` and of `Body.shape`, and their sizes.
_INNER_FORCES = ("tip_acceleration", "clamp_force", "clamp_moment", "max_bending_stress")
_ALONG = ("deflection", "bending_moment", "shear_force")
_POINTS = len(SHAPE_POINTS)
_SHAPE_3 = (_ALONG, _POINTS)
_SHAPE_2 = (tuple(f"{name}[{i}]" for name in _ALONG for i in range(1, _POINTS + 1)), 1)


class OwnBody(FmuBody):
    """A body of an FMU of this project, whose instance may have been another's: see `Fmu.of`."""

    FMU: ClassVar[str]  #: its name
    ROLES: ClassVar[Mapping[str, str]]  #: the variable of each role
    FORCES: ClassVar[tuple[str, ...]] = ("force",)  #: roles of the forces on its end
    reports = True
    _constants: dict[str, float]  #: of the scene, by the inputs that hold them from the start
    #: By input of the FMU: what is added to it by a unit of which load.
    _shares: dict[str, list[tuple[int, float]]]
    #: The loads of a step, and two derivatives of each.
    _loads: tuple[tuple[float, ...], tuple[float, ...]] = ((), ())

    def __init__(self, parameters: dict[str, Value], start_time: float) -> None:
        self.fmu = Fmu.of(self.FMU, parameters, start_time)
        self._leased: Fmu | None = self.fmu  #: until it is given back, once
        self.state = FmuState()
        self._shares = {}
        try:
            self._connect()
            self._begin(*self.fmu.once(Fmu.reading, (self.ROLES["mass"],))())
        except BaseException:
            self.fmu.close()
            raise

    def _connect(self) -> None:
        """Prepare inputs and outputs of a step; with loads, also these and their work."""
        roles = self.ROLES
        loads = self._shares
        energies = (*ENERGIES[:3], "load_work") if loads else ENERGIES
        outputs = tuple(roles[role] for role in (*MOTION, *energies) if role in roles)
        inputs = (*(roles[role] for role in self.FORCES), *loads)
        self._port = self.fmu.once(Port, inputs, (roles["impulse"],), outputs)
        self._acceleration: Reading = self.fmu.once(Fmu.reading, (roles["acceleration"],))

    def expect_loads(self, loads: Sequence[Load]) -> None:
        for number, load in enumerate(loads):
            for name, share in self._inputs_of(load):
                self._shares.setdefault(name, []).append((number, share))
        self._connect()
        self._take(self._port.read())

    def _inputs_of(self, load: Load) -> list[tuple[str, float]]:
        """Return the inputs of the FMU through which ``load`` acts, and their factors."""
        raise NotImplementedError

    def set_loads(self, forces: Sequence[Force]) -> None:
        super().set_loads(forces)
        values = []
        slopes = []
        for name, shares in self._shares.items():
            f, df, ddf = combined([share for _, share in shares], [forces[number] for number, _ in shares])
            values.append(f + self._constants.get(name, 0.0))
            slopes += [df, ddf]
        self._loads = (tuple(values), tuple(slopes))

    def acceleration(self) -> float | None:
        """See `Body.acceleration`; the FMU does not know of an impulse before its next step."""
        return self._acceleration()[0] if self.state.pending == 0.0 else None

    def trial_acceleration(self, time: float, size: float) -> float:
        acceleration: float = self._tried(time, _INSTANT * size, read=self._acceleration)[0]
        return acceleration

    def _given(self, time: float, size: float, contact: Force, foundation: Force) -> tuple[float, ...]:
        c, dc, ddc = contact
        values, slopes = self._loads
        impulse = self.state.pending
        if len(self.FORCES) == 1:  # nothing but the other body presses its end
            return (time, size, c, *values, impulse, dc, ddc, *slopes)
        n, dn, ddn = foundation
        return (time, size, c, n, *values, impulse, dc, ddc, dn, ddn, *slopes)

    def _take(self, reported: tuple[float, ...], size: float = 0.0) -> Motion:
        motion = made_of(Motion, reported[:4])
        self.state = made_of(FmuState, (motion, reported, 0.0))
        return motion

    def energies(self) -> Energies:
        motion, reported, _ = self.state
        kinetic, potential, dissipated, *load = reported[4:]
        if not load:  # the spring has none but its external force
            of_loads = -self._constants["external_force"] * motion.displacement
        else:
            of_loads = -load[0] if self._shares else load[0]
        return made_of(Energies, (kinetic, potential, dissipated, of_loads))

    def close(self) -> None:
        fmu = self._leased
        self._leased = None
        if fmu is not None:  # it may be another body's by now
            fmu.give_back()


class FmuBeam(OwnBody):
    """``beam.fmu`` as a body."""

    FMU = "beam"
    ROLES = MappingProxyType(
        {
            "force": "tip_force",
            "impulse": "tip_impulse",
            "mass": "tip_mass",
            "displacement": "tip_displacement",
            "velocity": "tip_velocity",
            "integral": "tip_displacement_integral",
            "integral_2": "tip_displacement_integral_2",
            "acceleration": "tip_acceleration",
            "potential_energy": "strain_energy",
            **{name: name for name in ("kinetic_energy", "dissipated_energy", "load_potential", "load_work")},
        }
    )

    def __init__(
        self,
        beam: Beam,
        start_time: float,
        deflection_slope: float,
        loads: Sequence[Load] = (),
        held_by: float | None = None,
    ) -> None:
        """Start at ``start_time`` [s] with u = ``deflection_slope``·x, or at rest.

        ``loads`` say where point forces may act; it rests under them and a tip force ``held_by`` [N] if that is given.
        """
        self._beam = beam
        if beam.integrator != "modal":  # it sees the mean of a force
            self.abilities = Abilities(slopes=0)
        self.damping = beam.alpha_b / tip_compliance(beam)
        self.reach = tip_reach(beam)
        self._points = sorted({load.at for load in loads if load.at is not None})
        self._constants = {"distributed_load": beam.distributed_load}
        parameters: dict[str, Any] = {name: value for name, value in beam if name not in beam.GIVEN_ONLY}
        parameters["integrator"] = _INTEGRATORS[beam.integrator]
        parameters["mass_matrix"] = _MASS_MATRICES[beam.mass_matrix]
        parameters["initial_deflection_slope"] = deflection_slope
        parameters["section_height"] = beam.section_height
        parameters |= {f"point_force_position[{k}]": at for k, at in enumerate(self._points, 1)}
        if held_by is not None:
            parameters |= {"initial_state": _AT_REST, "tip_force": held_by}
            for load in loads:
                for name, share in self._inputs_of(load) if load.on != "spring" else ():
                    parameters[name] = parameters.get(name, 0.0) + share * float(load.value(start_time))
        super().__init__(parameters, start_time)
        self._inner_forces = self.fmu.once(Fmu.reading, _INNER_FORCES)
        # FMI 2.0 knows no arrays.
        self._shape = self.fmu.once(Fmu.reading, *(_SHAPE_2 if self.fmu.version == "2.0" else _SHAPE_3))

    def _inputs_of(self, load: Load) -> list[tuple[str, float]]:
        if load.on == "tip":
            return [("tip_load", 1.0)]
        if load.on == "base":
            return [("base_acceleration", 1.0)]
        if load.at is not None:
            return [(f"point_force[{self._points.index(load.at) + 1}]", 1.0)]
        shape = load.shape or [1.0]
        return [(name, share) for name, share in zip(_DISTRIBUTED, shape, strict=False) if share != 0.0]

    def stiffness(self, displacement: Any) -> float:
        return 1.0 / tip_compliance(self._beam)

    def decay(self, time: float, size: float, speed: float) -> float:
        return tip_decay(self._beam)

    def start_under(self, contact: float) -> None:
        values, _ = self._loads
        self.fmu.write({"tip_force": contact, **dict(zip(self._shares, values, strict=True))})

    def inner_forces(self) -> InnerForces:
        return made_of(InnerForces, self._inner_forces())

    def shape(self) -> np.ndarray:
        """See `Body.shape`."""
        return np.array(self._shape())


class FmuSpring(OwnBody, EndLoaded):
    """``spring.fmu`` as a body; contact law and foundation are the master's."""

    FMU = "spring"
    ROLES = MappingProxyType(
        {
            "force": "contact_force",
            "integral": "displacement_integral",
            "integral_2": "displacement_integral_2",
            **{name: name for name in ("foundation_force", "impulse", "mass", "displacement", "velocity")},
            **{name: name for name in ("acceleration", "kinetic_energy", "potential_energy")},
            **{name: name for name in ("dissipated_energy", "load_work")},
        }
    )
    FORCES = ("force", "foundation_force")

    def __init__(self, spring: Spring, start_time: float, displacement: float | None = None) -> None:
        """Start at ``start_time`` [s] with y = ``displacement`` [m], which is Ψ if left out."""
        self._spring = spring
        self.damping = spring.damping
        self.tolerance = spring.relative_tolerance
        self._constants = {"external_force": spring.external_force}
        parameters: dict[str, Any] = spring.model_dump(exclude={"initial_velocity"})
        parameters |= {key: getattr(spring, key) for key in spring.AT_GAP}  # also where they follow from a gap
        parameters["displacement"] = spring.equilibrium if displacement is None else displacement
        parameters["velocity"] = spring.initial_velocity
        super().__init__(parameters, start_time)

    def stiffness(self, displacement: Any) -> Any:
        return self._spring.stiffness(displacement)

    def holding_force(self, displacement: float, velocity: float) -> float:
        return self._spring.force(displacement) + self._spring.damping * velocity

    def _inputs_of(self, load: Load) -> list[tuple[str, float]]:
        return [("base_acceleration" if load.on == "base" else "external_force", 1.0)]

    def expect_loads(self, loads: Sequence[Load]) -> None:
        OwnBody.expect_loads(self, loads)
        EndLoaded.expect_loads(self, loads)
