"""Ahn & Tate's Algorithm 1, step for step, with (52)–(56) and (62)–(65), as a monolithic code.

Line numbers in comments are those of the printed algorithm. Where it leaves something open the choice has a name:

``contact.impact``
    z at t_c: ``"tip"`` the tip's velocity (line 5), which in the semi-discrete model does not jump, so that it is also
    the average of eq. (11); else 0 (section 6).
``y_temp`` (lines 16–17, "accommodate the transmission condition")
    ``"equation"``: (53) starts from the tip's position u instead of yˡ, and line 29 forms z from the true yˡ.
    ``"guess"``: u is where Newton's method starts; (53) keeps yˡ.
    ``"both"``: u takes the place of yˡ in (53) and in line 29.
``y == φ`` (line 20)
    y ≤ φ.
Lines 11 and 14 leave a third case, y ≤ Ψ < u: nothing is changed.

Line 18 overwrites the tip by the spring's position. The force on the tip that would do so is recovered from the tip's
row of (62) and its work is booked (``e_injected_beam``), like what exchanging yˡ adds to the spring
(``e_injected_spring``): nothing else in the model pays for either.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from functools import partial
from typing import Literal, get_args

import numpy as np
import scipy.sparse.linalg as spla

from ..results.trajectory import Event, EventKind, Trajectory
from ..scene import Scene
from .algorithm1_ledger import PairState, StepLedger
from .hybrid_system import ReferenceFailure
from .semi_discrete import SemiDiscreteBeam, assemble

YTemp = Literal["equation", "guess", "both"]

_MAX_ITERATIONS = 50


class AlgorithmFailure(ReferenceFailure):
    """Newton's method did not converge, or the solution overflows; ``trajectory`` holds what came before."""

    trajectory: Trajectory | None = None


def simulate(
    scene: Scene,
    *,
    y_temp: YTemp = "equation",
    tolerance: float = 1e-12,
) -> Trajectory:
    """Run Algorithm 1 with h_t = ``coupling.macro_step`` on a scene with beam and spring, and a shorter last step to
    ``time.t_end`` where that is off the grid.

    Parameters
    ----------
    y_temp
        See the module.
    tolerance
        Of Newton's method, on the change of the unknown [m].

    Returns
    -------
    Trajectory
        A row per step from t_c on (from 0 with ``approach = "elastic"``). ``contact_force``, ``compliance_force`` and
        ``tie_reaction`` are means over the step that ends in the row. ``e_total`` is (63) + ``e_dissipated``, and
        ``energy_residual`` what the algorithm has injected. Extra columns: ``e_injected_beam``,
        ``e_injected_spring`` [J], and ``case`` (11, 14, or 0 where neither line holds).
        ``summary["newton"]`` holds Newton iterations per solve (Table 2), counted up to and including the first step
        |Δ| ≤ ``tolerance``: ``beam`` of line 9, (62) at the tip; ``spring`` of lines 10 and 17, (53), and each by
        itself, ``spring_predicted`` and ``spring_joined``. ``solves`` of (53) were made; ``time_per_step`` is in s.

    Raises
    ------
    ValueError
        If the scene is not one that Algorithm 1 is written for.
    AlgorithmFailure
        With the time and the trajectory so far, where an iteration fails or the solution overflows.
    """
    if scene.beam is None or scene.spring is None:
        raise ValueError("Algorithm 1 needs [beam] and [spring]")
    if scene.loads or scene.massless:
        raise ValueError("Algorithm 1 knows no [[loads]] and needs a dynamic [beam]")
    if y_temp not in get_args(YTemp):
        raise ValueError(f"y_temp = {y_temp!r}: one of {', '.join(get_args(YTemp))}")
    return _Algorithm(scene, y_temp, tolerance).run()


class _Algorithm:
    def __init__(self, scene: Scene, y_temp: YTemp, tolerance: float) -> None:
        assert scene.beam is not None
        assert scene.spring is not None
        self.scene, self.beam, self.spring = scene, scene.beam, scene.spring
        self.y_temp, self.tolerance = y_temp, tolerance
        self.discrete: SemiDiscreteBeam = assemble(scene.beam)
        d = self.discrete
        self.load = scene.beam.distributed_load * d.uniform_load + scene.beam.tip_load_coefficient * d.hat_load
        self._set_step(scene.coupling.H)
        self.phi = -np.inf if scene.stop is None else scene.stop.position
        self.ledger = StepLedger(scene, d, self.load)
        self.iterations: dict[str, list[int]] = {"beam": [], "predicted": [], "joined": []}

    def _set_step(self, h: float) -> None:
        """Factorise (62) for steps of ``h`` [s]."""
        d, alpha = self.discrete, self.beam.alpha_b
        self.h = h
        self.B = (4.0 * d.M + (2.0 * alpha * h - h**2) * d.K).tocsr()
        self.A = (4.0 * d.M + (h**2 + 2.0 * alpha * h) * d.K).tocsc()
        self.solve: Callable[[np.ndarray], np.ndarray] = spla.splu(self.A).solve
        #: A⁻¹e: how (62) answers to a force at the tip.
        self.tip_response = self.solve(d.tip_vector)

    # Laws -----------------------------------------------------------------------------------------------------------

    def _compliance(self, w: float, stiffness: float) -> tuple[float, float]:
        """Return λ (Ψ − w)₊^p and its derivative by w."""
        depth = max(self.spring.equilibrium - w, 0.0)
        p = self.scene.contact.exponent
        slope = -p * stiffness * depth ** (p - 1.0) if depth > 0.0 else 0.0
        return stiffness * depth**p, slope

    def _newton(self, f: Callable[[float], tuple[float, float]], guess: float, solve: str) -> float:
        x = guess
        for k in range(1, _MAX_ITERATIONS + 1):
            value, slope = f(x)
            change = value / slope
            x -= change
            if not np.isfinite(x):
                break
            if abs(change) <= self.tolerance:
                self.iterations[solve].append(k)
                return x
        raise AlgorithmFailure(f"Newton's method for the {solve} position does not converge at t = {self.time:.6g} s")

    def _foundation_force(self, y: float, z: float, stiffness: float, Y: float) -> tuple[float, float]:
        """Return N of (53) with (54) for a step from (y, z) that ends at ``Y``, and its derivative by ``Y``."""
        p, h = self.spring, self.h
        force, slope = self._compliance(Y, stiffness)
        value = (
            2.0 * p.mass * ((Y - y) / h - z) / h
            + p.damping * (Y - y) / h
            + 0.5 * p.linear_stiffness * (Y + y)
            + 0.25 * p.cubic_stiffness * (Y**2 + y**2) * (Y + y)
            + 0.5 * (force + self._compliance(y, stiffness)[0])
            - p.external_force
        )
        tangent = (
            2.0 * p.mass / h**2
            + p.damping / h
            + 0.5 * p.linear_stiffness
            + 0.25 * p.cubic_stiffness * (3.0 * Y**2 + 2.0 * Y * y + y**2)
            + 0.5 * slope
        )
        return value, tangent

    # Algorithm ------------------------------------------------------------------------------------------------------

    def run(self) -> Trajectory:
        self.time, self._began = 0.0, clock.perf_counter()
        self._events: list[Event] = []
        state = PairState(*self._initial_beam(), self.spring.equilibrium, self.spring.initial_velocity)
        touched = self.beam.approach == "undeformed" or state.q[-1] <= self.spring.equilibrium
        if touched:  # nothing to integrate before t_c
            state = self._first_contact(state)
        self.ledger.record(self.time, state, "tied" if touched else "free")
        stiffness = self.scene.contact.stiffness if touched else 0.0
        whole, rest = self.scene.equal_steps
        steps = whole + (rest > 0.0)
        begin = self.time
        for step in range(1, steps + 1):
            if step > whole:
                self._set_step(rest)
            self.time = begin + step * self.h if step <= whole else self.scene.time.t_end
            if touched:
                try:
                    state, stiffness = self._contact_step(state, stiffness)
                except AlgorithmFailure as failure:
                    failure.trajectory = self._trajectory(step)
                    raise
                continue
            state = self._free_beam_step(state)  # lines 1–4
            if state.q[-1] <= self.spring.equilibrium:
                touched, stiffness = True, self.scene.contact.stiffness  # line 6
                state = self._first_contact(state)  # line 5
            self.ledger.record(self.time, state, "tied" if touched else "free")
        return self._trajectory(steps)

    def _initial_beam(self) -> tuple[np.ndarray, np.ndarray]:
        slope, rate = self.beam.initial_deflection_slope, self.beam.initial_velocity_slope
        gap = slope * self.beam.length - self.spring.equilibrium
        if gap < 0.0 or (gap > 0.0 and rate >= 0.0 and self.beam.approach == "undeformed"):
            raise ValueError("Algorithm 1 needs a tip above the spring that moves down")
        if self.beam.approach == "undeformed":
            if gap > 0.0:
                self.time = -gap / (rate * self.beam.length)
            slope = self.spring.equilibrium / self.beam.length
        shape = self.discrete.slope_shape
        return slope * shape, rate * shape

    def _first_contact(self, state: PairState) -> PairState:
        state = state._replace(z=float(state.v[-1]) if self.scene.contact.impact == "tip" else 0.0)
        self._note("impact", state)
        return state

    def _note(self, kind: str, state: PairState, **impulse: float) -> None:
        q, v, y, z = state
        self._events.append(Event(self.time, EventKind(kind), y, z, float(q[-1]), float(v[-1]), **impulse))

    def _right_side(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the right side of (62) without a force on the tip."""
        right: np.ndarray = self.B @ q + 4.0 * self.h * (self.discrete.M @ v) + 2.0 * self.h**2 * self.load
        return right

    def _free_beam_step(self, before: PairState) -> PairState:
        q, v, *_ = before
        new = self.solve(self._right_side(q, v))
        after = before._replace(q=new, v=2.0 * (new - q) / self.h - v)
        self.ledger.dissipate(self.h, before, after)
        return after

    def _tip(self, q: np.ndarray, v: np.ndarray, stiffness: float) -> tuple[float, np.ndarray]:
        """Return u_tip by (62), which is nonlinear only there, and what the beam would do without a force on it."""
        h, response = self.h, self.tip_response
        before = self._compliance(q[-1], stiffness)[0]
        known = self.solve(self._right_side(q, v))
        known_tip = float(known[-1] + h**2 * response[-1] * before)

        def equation(w: float) -> tuple[float, float]:
            force, slope = self._compliance(w, stiffness)
            return w - known_tip - h**2 * response[-1] * force, 1.0 - h**2 * response[-1] * slope

        return self._newton(equation, float(q[-1]), "beam"), known

    def _beam(self, known: np.ndarray, u: float) -> tuple[np.ndarray, float]:
        """Return q by (62) with u_tip given in place of its row, and the mean force on the tip that does so [N]."""
        h, response = self.h, self.tip_response
        force = (u - known[-1]) / response[-1]
        return known + response * force, float(force / (2.0 * h**2))

    def _contact_step(self, before: PairState, stiffness: float) -> tuple[PairState, float]:
        """Make lines 8–30; return the state at l + 1, and λ_nc as the step leaves it."""
        h, psi, (q, v, y, z) = self.h, self.spring.equilibrium, before
        u_new, known = self._tip(q, v, stiffness)  # line 9
        y_new = self._newton(partial(self._foundation_force, y, z, stiffness), y, "predicted")  # line 10, N = 0
        case, foundation, y_used = 0, 0.0, y
        acting = stiffness
        if psi < y_new < u_new:  # lines 11–13: the interior of (62) does not see λ_nc
            case, stiffness = 11, 0.0
        elif u_new <= psi or u_new <= y_new:  # line 14
            case = 14
            stiffness = acting = self.scene.contact.stiffness  # line 15
            u_temp = u_new  # line 16
            y_used = y if self.y_temp == "guess" else u_temp
            y_new = self._newton(partial(self._foundation_force, y_used, z, stiffness), u_temp, "joined")  # line 17
            u_new = y_new  # line 18
            if y_new <= self.phi:  # lines 20–24
                u_new = y_new = self.phi
                foundation, _ = self._foundation_force(y, z, stiffness, y_new)
        q_new, on_tip = self._beam(known, u_new)  # lines 13, 19, 22
        v_new = 2.0 * (q_new - q) / h - v  # line 29
        z_base = y_used if self.y_temp == "both" and case == 14 else y
        z_new = 2.0 * (y_new - z_base) / h - z
        if not (np.all(np.isfinite(v_new)) and np.isfinite(z_new)):
            raise AlgorithmFailure(f"the solution overflows at t = {self.time:.6g} s")
        inside = 0.5 * (self._compliance(u_new, acting)[0] + self._compliance(q[-1], acting)[0])
        pressing = 0.5 * (self._compliance(y_new, acting)[0] + self._compliance(y, acting)[0])
        after = PairState(q_new, v_new, y_new, z_new)
        self.ledger.book(h, before, after, on_tip - inside, pressing, foundation)
        seated = case == 14 and y_new == self.phi
        phase = "seated" if seated else "tied" if case == 14 else "free"
        if seated:
            self._note("stop_impact", after, impulse_foundation=h * foundation)
        self.ledger.record(self.time, after, phase, on_tip, inside, foundation, case)
        return after, stiffness

    # Result ---------------------------------------------------------------------------------------------------------

    def _trajectory(self, steps: int) -> Trajectory:
        def mean(*solves: str) -> float:
            counts = [k for solve in solves for k in self.iterations[solve]]
            return float(np.mean(counts)) if counts else 0.0

        newton = {
            "tolerance": self.tolerance,
            "beam": mean("beam"),
            "spring_predicted": mean("predicted"),
            "spring_joined": mean("joined"),
            "spring": mean("predicted", "joined"),
            "solves": len(self.iterations["predicted"]) + len(self.iterations["joined"]),
            "time_per_step": (clock.perf_counter() - self._began) / max(steps, 1),
        }
        summary = {
            "reference": "algorithm1",
            "y_temp": self.y_temp,
            "newton": newton,
        }
        return self.ledger.trajectory(self._events, summary)
