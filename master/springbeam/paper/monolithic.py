"""Ahn & Tate's Algorithm 1, step for step, with (52)–(56) and (62)–(65), as a monolithic code.

Line numbers in comments are those of the printed algorithm. Where it leaves something open the choice has a name:

``at_contact``
    z at t_c: see `springbeam.paper.problem.AtContact`.
``y_temp`` (lines 16–17, "accommodate the transmission condition")
    ``"equation"``: (53) starts from the tip's position u instead of yˡ, and line 29 forms z from the true yˡ.
    ``"guess"``: u is where Newton's method starts; (53) keeps yˡ.
    ``"both"``: u takes the place of yˡ in (53) and in line 29.
``y == φ`` (line 20)
    y ≤ φ.
Lines 11 and 14 leave a third case, y ≤ Ψ < u: nothing is changed.

Line 18 overwrites the tip by the spring's position. The force on the tip that would do so is recovered from the tip's
row of (62) and its work is counted (``e_injected_beam``), like what exchanging yˡ adds to the spring
(``e_injected_spring``): nothing else in the model pays for either.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from ..monolithic.semi_discrete import assemble, constant_forces, inner_forces
from ..motion.events import Event, EventKind, Joint
from ..results.trajectory import Trajectory
from ..scene import Scene
from ..scene.laws import TransmissionContact
from . import problem
from .problem import AlgorithmFailure, AtContact

YTemp = Literal["equation", "guess", "both"]

#: Limits of Newton's method, on the change of the unknown [m].
_MAX_ITERATIONS = 50
_TOLERANCE = 1e-12


class _Row(NamedTuple):
    """Beam and spring after a step; forces are means over it [N]."""

    time: float
    q: np.ndarray  #: unknowns of the mesh [rad, m], their last the tip's deflection
    v: np.ndarray
    y: float  #: [m]
    z: float  #: [m/s]
    phase: str = "free"
    on_tip: float = 0.0  #: on the tip, of whatever kind
    inside: float = 0.0  #: of the law on the tip
    pressing: float = 0.0  #: of the law on the spring
    foundation: float = 0.0
    case: int = 0
    in_contact: bool = False  #: over the step


def algorithm_1(
    scene: Scene,
    *,
    at_contact: AtContact = "rest",
    y_temp: YTemp = "equation",
    progress: Callable[[float], object] = float,
) -> Trajectory:
    """Run Algorithm 1 with h_t = ``coupling.macro_step`` on a scene with beam and spring, and a shorter last step to
    ``time.t_end`` where that is off the grid.

    Parameters
    ----------
    at_contact, y_temp
        See the module.
    progress
        Called with the time [s] at the end of each step.

    Returns
    -------
    Trajectory
        A row per step from t_c on (from 0 with ``approach = "elastic"``). ``contact_force``, ``compliance_force`` and
        ``tie_reaction`` are means over the step that ends in the row. ``e_total`` is (63) + ``e_dissipated``, and
        ``energy_residual`` what the algorithm has injected. Extra columns: ``e_injected_beam``,
        ``e_injected_spring`` [J], and ``case`` (11, 14, or 0 where neither line holds).
        ``summary["iterations_per_solve"]`` are Newton iterations per solve of (53) (Table 2), counted up to and
        including the first step |Δ| ≤ 1e-12 m; ``summary["newton"]`` has those of line 10, ``predicted``, and of line
        17, ``joined``, and the number of ``solves``.

    Raises
    ------
    SceneError
        If the scene is not one that Algorithm 1 is written for.
    AlgorithmFailure
        With the time and the trajectory so far, where an iteration fails or the solution overflows.
    """
    problem.refuse(scene)
    algorithm = _Algorithm(scene, at_contact, y_temp)
    try:
        algorithm.run(progress)
    except AlgorithmFailure as failure:
        failure.trajectory = algorithm.trajectory()
        raise
    return algorithm.trajectory()


class _Algorithm:
    def __init__(self, scene: Scene, at_contact: AtContact = "rest", y_temp: YTemp = "equation") -> None:
        assert scene.beam is not None
        assert scene.spring is not None
        assert isinstance(scene.contact, TransmissionContact)
        self.scene = scene
        self.beam = scene.beam
        self.spring = scene.spring
        self.contact = scene.contact
        self.at_contact = at_contact
        self.y_temp = y_temp
        self.discrete = d = assemble(scene.beam)
        self.load = d.nodal(*constant_forces(scene.beam))
        self._set_step(scene.coupling.H)
        self.phi = -np.inf if scene.stop is None else scene.stop.position
        self.stiffness = 0.0  #: λ_nc as the last step has left it
        self.iterations: dict[str, list[int]] = {"free": [], "beam": [], "predicted": [], "joined": []}
        self.time = scene.contact_time or 0.0  #: [s]
        self.events: list[Event] = []
        self.rows: list[_Row] = []

    def _set_step(self, h: float) -> None:
        """Factorise (62) for steps of ``h`` [s]."""
        d = self.discrete
        alpha = self.beam.alpha_b
        self.h = h
        self.B = 4.0 * d.M + (2.0 * alpha * h - h**2) * d.K
        self.solve = spla.splu(sp.csc_matrix(4.0 * d.M + (h**2 + 2.0 * alpha * h) * d.K)).solve
        #: How (62) answers to a force at the tip.
        self.tip_response: np.ndarray = self.solve(d.tip_vector)

    # Laws -----------------------------------------------------------------------------------------------------------

    def _compliance(self, w: float, stiffness: float) -> tuple[float, float]:
        """Return λ (Ψ − w)₊^p and its derivative by w."""
        depth = max(self.spring.equilibrium - w, 0.0)
        p = self.contact.exponent
        return stiffness * depth**p, -p * stiffness * depth ** (p - 1.0) if depth > 0.0 else 0.0

    def _newton(self, f: Callable[[float], tuple[float, float]], guess: float, solve: str) -> float:
        x = guess
        for k in range(1, _MAX_ITERATIONS + 1):
            value, slope = f(x)
            change = value / slope
            x -= change
            if not np.isfinite(x):
                break
            if abs(change) <= _TOLERANCE:
                self.iterations[solve].append(k)
                return x
        raise AlgorithmFailure(f"Newton's method for the {solve} position does not converge at t = {self.time:.6g} s")

    def _foundation_force(self, y: float, z: float, Y: float) -> tuple[float, float]:
        """Return N of (53) with (54) for a step from (y, z) that ends at ``Y``, and its derivative by ``Y``."""
        p = self.spring
        h = self.h
        x = y - p.unloaded
        X = Y - p.unloaded
        force, slope = self._compliance(Y, self.stiffness)
        value = (
            2.0 * p.mass * ((Y - y) / h - z) / h
            + p.damping * (Y - y) / h
            + 0.5 * p.linear_stiffness * (X + x)
            + 0.25 * p.cubic_stiffness * (X**2 + x**2) * (X + x)
            + 0.5 * (force + self._compliance(y, self.stiffness)[0])
            - p.external_force
        )
        cubic = 0.25 * p.cubic_stiffness * (3.0 * X**2 + 2.0 * X * x + x**2)
        tangent = 2.0 * p.mass / h**2 + p.damping / h + 0.5 * p.linear_stiffness + cubic + 0.5 * slope
        return value, tangent

    # Algorithm ------------------------------------------------------------------------------------------------------

    def run(self, progress: Callable[[float], object]) -> None:
        """Make all steps; `trajectory` has them, also where one fails."""
        self.began = clock.perf_counter()
        row = self._start()
        psi = self.spring.equilibrium
        touched = self.beam.approach == "undeformed" or row.q[-1] <= psi  # else lines 1–4 come first
        self.rows.append(self._first_contact(row)._replace(phase="tied") if touched else row)
        for end, size in problem.steps(self.scene):
            self.time = end
            if size != self.h:
                self._set_step(size)
            row = self._contact_step(self.rows[-1]) if touched else self._free_step(self.rows[-1])
            if not touched and row.q[-1] <= psi:
                touched = True
                row = self._first_contact(row)
            self.rows.append(row)
            progress(end)

    def _start(self) -> _Row:
        beam = self.beam
        shape = self.discrete.slope_shape
        psi = self.spring.equilibrium
        slope = psi / beam.length if beam.approach == "undeformed" else beam.initial_deflection_slope
        return _Row(self.time, slope * shape, beam.initial_velocity_slope * shape, psi, self.spring.initial_velocity)

    def _first_contact(self, row: _Row) -> _Row:
        """Make lines 5 and 6."""
        self.stiffness = self.contact.stiffness
        z = float(row.v[-1]) if self.at_contact == "tip" else row.z
        row = row._replace(y=self.spring.equilibrium, z=z)
        self._note("impact", row)
        return row

    def _note(self, kind: str, row: _Row, impulse: float = 0.0) -> None:
        u, v = float(row.q[-1]), float(row.v[-1])
        event = Event(self.time, EventKind(kind), row.y, row.z, u, v, impulse_foundation=impulse, joint=Joint.TIED)
        self.events.append(event)

    def _unforced(self, row: _Row) -> np.ndarray:
        """Return q of (62) without a force on the tip."""
        M = self.discrete.M
        q: np.ndarray = self.solve(self.B @ row.q + 4.0 * self.h * (M @ row.v) + 2.0 * self.h**2 * self.load)
        return q

    def _free_step(self, before: _Row) -> _Row:
        _, q, v, y, z, *_ = before
        q_new = self._unforced(before)
        y_new = self._newton(partial(self._foundation_force, y, z), y, "free")  # λ_nc = 0 until the first contact
        return _Row(self.time, q_new, 2.0 * (q_new - q) / self.h - v, y_new, 2.0 * (y_new - y) / self.h - z)

    def _contact_step(self, before: _Row) -> _Row:
        """Make lines 8–30."""
        h = self.h
        psi = self.spring.equilibrium
        response = self.tip_response
        q = before.q
        v = before.v
        y = before.y
        z = before.z
        known = self._unforced(before)
        at_start = self._compliance(q[-1], self.stiffness)[0]
        known_tip = float(known[-1] + h**2 * response[-1] * at_start)

        def tip(w: float) -> tuple[float, float]:  # (62), which is nonlinear only there
            force, slope = self._compliance(w, self.stiffness)
            return w - known_tip - h**2 * response[-1] * force, 1.0 - h**2 * response[-1] * slope

        u_new = self._newton(tip, float(q[-1]), "beam")  # line 9
        y_new = self._newton(partial(self._foundation_force, y, z), y, "predicted")  # line 10, N = 0
        case = 0
        foundation = 0.0
        y_used = y
        acting = self.stiffness
        if psi < y_new < u_new:  # lines 11–13: the interior of (62) does not see λ_nc
            case = 11
            self.stiffness = 0.0
        elif u_new <= psi or u_new <= y_new:  # line 14
            case = 14
            self.stiffness = acting = self.contact.stiffness  # line 15
            y_used = y if self.y_temp == "guess" else u_new  # line 16
            y_new = self._newton(partial(self._foundation_force, y_used, z), u_new, "joined")  # line 17
            u_new = y_new  # line 18
            if y_new <= self.phi:  # lines 20–24
                u_new = y_new = self.phi
                foundation, _ = self._foundation_force(y, z, y_new)
        force = (u_new - known[-1]) / response[-1]  # lines 13, 19, 22: the tip's row of (62) is overwritten
        q_new = known + response * force
        on_tip = float(force / (2.0 * h**2))
        v_new = 2.0 * (q_new - q) / h - v  # line 29
        z_new = 2.0 * (y_new - (y_used if self.y_temp == "both" and case == 14 else y)) / h - z
        if not (np.all(np.isfinite(v_new)) and np.isfinite(z_new)):
            raise AlgorithmFailure(f"the solution overflows at t = {self.time:.6g} s")
        ends = ((u_new, q[-1]), (y_new, y))
        inside, pressing = (0.5 * sum(self._compliance(w, acting)[0] for w in pair) for pair in ends)
        seated = case == 14 and y_new == self.phi
        phase = "seated" if seated else "tied" if case == 14 else "free"
        forces = (on_tip, inside, pressing, foundation)
        after = _Row(self.time, q_new, v_new, y_new, z_new, phase, *forces, case, in_contact=True)
        if seated:
            self._note("stop_impact", after, h * foundation)
        return after

    # Result ---------------------------------------------------------------------------------------------------------

    def trajectory(self) -> Trajectory:
        """Return the rows as a result with energies, and the work that no force does.

        That is the work of the overwritten tip on the beam, and of yˡ's exchange on the spring.
        """
        seconds = clock.perf_counter() - self.began
        d = self.discrete
        p = self.spring
        alpha = self.beam.alpha_b
        found = {
            name: np.array(values) for name, values in zip(_Row._fields, zip(*self.rows, strict=True), strict=True)
        }
        q, v, y, z = (found[name] for name in "qvyz")
        h = np.diff(found["time"])
        dq = np.diff(q, axis=0)
        dy = np.diff(y)
        in_contact = found["in_contact"][1:]
        by_spring = p.damping * dy**2 / h
        taken = alpha * np.sum(dq * (d.K @ dq.T).T, axis=1) / h + by_spring
        square = (y - p.unloaded) ** 2
        e_spring = 0.5 * p.mass * z**2 + 0.5 * p.linear_stiffness * square + 0.25 * p.cubic_stiffness * square**2
        worked = (found["foundation"] - found["pressing"] + p.external_force)[1:] * dy - by_spring
        overwritten = (found["on_tip"] - found["inside"])[1:] * dq[:, -1]

        def total(rates: np.ndarray) -> np.ndarray:
            return np.append(0.0, np.cumsum(rates))

        columns = {
            "time": found["time"],
            "phase": found["phase"],
            "u_tip": q[:, -1],
            "v_tip": v[:, -1],
            "y": y,
            "z": z,
            "contact_force": found["on_tip"],
            "compliance_force": found["inside"],
            "foundation_force": found["foundation"],
            "e_beam": 0.5 * np.sum(v * (d.M @ v.T).T, axis=1) + 0.5 * np.sum((d.B @ q.T) ** 2, axis=0),
            "e_spring": e_spring,
            "e_dissipated": total(taken),
            "e_load": -(q @ self.load) - p.external_force * y,
            "case": found["case"].astype(float),
            "e_injected_beam": total(in_contact * overwritten),
            "e_injected_spring": total(in_contact * (np.diff(e_spring) - worked)),
        }
        predicted = self.iterations["predicted"]
        joined = self.iterations["joined"]
        solves = {"predicted": predicted, "joined": joined, "spring": predicted + joined}
        newton = {name: float(np.mean(counts)) if counts else 0.0 for name, counts in solves.items()}
        summary: dict[str, Any] = {
            "algorithm": "monolithic",
            "iterations_per_solve": newton.pop("spring"),
            "newton": {**newton, "solves": len(solves["spring"])},
            "steps_apart": int(np.sum(found["case"] == 11)),
            "wall_time": seconds,
        }
        shapes = np.hstack([q @ d.interpolated().T, inner_forces(self.beam, d, (q + alpha * v).T).T])
        return problem.result(self.scene, columns, shapes, self.events, summary)
