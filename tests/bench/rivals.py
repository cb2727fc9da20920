"""What a good user of scipy would write instead: the modal equations of motion, handed to `scipy.integrate.solve_ivp`.

The state is X = (x, ẋ), x the coordinates of the beam's modes and of the spring's top, so that a right-hand side is a
few products of vectors (with 20 modes one matrix product takes as long, with 100 half as long again). LSODA and Radau
are given the Jacobian. Events are given to ``solve_ivp``, which stops at them. What they do to the state is the
reference's (`HybridState`), so that both solve one problem; its time is not counted.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from statistics import median
from time import perf_counter
from typing import Any, NamedTuple, cast

import numpy as np
from scipy.integrate import solve_ivp

from springbeam.monolithic.event_driven import initial
from springbeam.monolithic.hybrid_system import HybridSystem, ReferenceFailure
from springbeam.monolithic.laws import Link, ReferencePhase, Watch
from springbeam.monolithic.transitions import HybridState
from springbeam.results.distance import motion
from springbeam.results.trajectory import Trajectory
from springbeam.scene import Scene
from springbeam.studies.tables import Row

#: Relative tolerances of scipy's solvers; they are stable from loose ones on, at the step that they take themselves.
TOLERANCES = {
    "DOP853": (1e-1, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10),
    "LSODA": (1e-3, 1e-5, 1e-7, 1e-9),
    "Radau": (1e-2, 1e-4, 1e-6, 1e-8),
}
#: A solution that takes longer is given up [s].
_LIMIT = 10.0


class Solved(NamedTuple):
    """A solution by scipy."""

    columns: dict[str, np.ndarray]  #: u_tip, y [m] at the times asked for, as far as the scene has them
    seconds: float  #: that ``solve_ivp`` has taken
    evaluations: int  #: of right-hand sides


class Rival:
    """A scene as scipy solves it; the matrices are made once, before any clock runs.

    Not for a quasi-static beam, which has no equation of motion. Raises ValueError for a law without a reference.
    """

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._system = HybridSystem(scene)
        self._phases: dict[ReferencePhase, _Phase] = {}

    def solve(
        self, method: str, rtol: float, atol: float, times: Sequence[float] | np.ndarray, limit: float = np.inf
    ) -> Solved:
        """Return the motion at ascending ``times`` [s] by a ``method`` of scipy, one of `TOLERANCES`.

        Raises ReferenceFailure if the solver fails, or takes more than ``limit`` seconds.
        """
        s = self._system
        wanted = np.asarray(times, dtype=float)
        seconds = 0.0
        evaluations = 0
        state = HybridState(s, *initial(s, 0.0))
        n = 2 * s.n
        found = np.empty((len(wanted), s.size))
        found[wanted <= state.time] = state.X
        state.start()
        while state.time < wanted[-1]:
            if state.phase not in self._phases:
                self._phases[state.phase] = _Phase(s, state.phase)
            phase = self._phases[state.phase]
            until = min(wanted[-1], s.loads.smooth_from(state.time))
            watched = state.watched()
            inside = np.flatnonzero((wanted > state.time) & (wanted < until))
            options: dict[str, Any] = {"rtol": rtol, "atol": atol, "t_eval": [*wanted[inside], until]}
            if method != "DOP853" and phase.jacobian is not None:
                options["jac"] = phase.jacobian
            rhs = phase.rhs if limit == np.inf else _limited(phase.rhs, perf_counter() + limit - seconds, limit)
            options["events"] = [phase.event(watch, state.X) for watch in watched]
            began = perf_counter()
            solution = solve_ivp(rhs, (state.time, until), phase.start(state.X), method, **options)
            seconds += perf_counter() - began
            evaluations += solution.nfev
            if solution.status < 0:
                raise ReferenceFailure(f"{method} failed in phase {state.phase.name}: {solution.message}")
            states = np.reshape(solution.y[:n], (n, -1)).T[: len(inside)]
            found[inside[: len(states)], :n] = states
            happened = next((k for k, at in enumerate(solution.t_events or ()) if len(at)), None)
            state.time, X = (until, solution.y[:, -1]) if happened is None else (
                float(solution.t_events[happened][-1]), solution.y_events[happened][-1]
            )  # fmt: skip
            state.X[:n], state.X[s.T] = X[:n], state.time
            if happened is not None:
                state.happen(watched[happened])
            found[wanted == state.time] = state.X
        columns = {"u_tip": found[:, s.A] @ s.tip} if self._scene.beam is not None else {}
        return Solved(columns | ({"y": found[:, s.A] @ s.top} if s.has_spring else {}), seconds, evaluations)


def rows(scene: Scene, exact: Trajectory, times: np.ndarray, repeats: int = 3) -> Iterator[Row]:
    """Yield what `springbeam.studies.tradeoff` records of its own configurations: error and median time [s] of each.

    ``exact`` has rows at ``times`` [s]. Finer tolerances of a method that has taken too long are left out.
    """
    if scene.massless:  # a quasi-static beam has no equation of motion
        return
    reach = max(float(np.abs(exact[k]).max()) for k in ("u_tip", "y") if k in exact.columns) or 1.0
    rival = Rival(scene)
    for method, tolerances in TOLERANCES.items():
        for rtol in tolerances:
            row: Row = {"family": method, "setting": f"rtol {rtol:.0e}"}
            try:
                solved = [rival.solve(method, rtol, 1e-3 * rtol * reach, times, _LIMIT) for _ in range(repeats)]
            except ReferenceFailure as failed:
                yield row | {"status": "stopped", "error": str(failed)}
                break
            seconds = median(one.seconds for one in solved)
            yield (
                row
                | {"status": "done", "cost_wall_time": seconds}
                | {"error_motion": motion(solved[0].columns, exact.columns)}
            )


def _limited(rhs: Callable[..., np.ndarray], deadline: float, limit: float) -> Callable[..., np.ndarray]:
    """Return ``rhs``, which gives up after the ``deadline``."""

    def limited(time: float, X: np.ndarray) -> np.ndarray:
        if perf_counter() > deadline:
            raise ReferenceFailure(f"takes more than {limit:g} s; it is at t = {time:.6g} s")
        return rhs(time, X)

    return limited


class _Phase:
    """The equations of one phase of contact, and the functions that end it."""

    def __init__(self, s: HybridSystem, phase: ReferencePhase) -> None:
        self._system = s
        self._phase = phase
        self._held = s.held(phase)
        self._soft = s.scene.coupled and not s.joined(phase) and s.law.acts(phase.contact)
        self._damped = bool(np.any(s.c))
        self._hardening = s.spring.cubic_stiffness / s.spring.mass**2
        self.jacobian: Callable[[float, np.ndarray], np.ndarray] | None = None
        if not self._soft or isinstance(s.law, Link):  # linear but for the cubic spring
            units = np.eye(2 * s.n + 2 * s.alone)
            self.jacobian = self._jacobian
            top = s.n - 1
            self._linear = np.transpose([0.5 * (self.rhs(0.0, unit) - self.rhs(0.0, -unit)) for unit in units])
            two = 2.0 * units[top]
            self._cubic = (0.25 * (self.rhs(0.0, two) - self.rhs(0.0, -two)) - self._linear[:, top]) / 3.0
            self._linear[:, top] -= self._cubic

    def start(self, X: np.ndarray) -> np.ndarray:
        """Return scipy's state, which has the tip above a stop as well, so that its error is controlled by itself."""
        s = self._system
        return np.concatenate((X[: 2 * s.n], (X[s.A] @ s.tip, X[s.V] @ s.tip) if s.alone else ()))

    def rhs(self, time: float, X: np.ndarray) -> np.ndarray:
        s = self._system
        n = self._system.n
        x = X[:n]
        x_dot = X[n : 2 * n]
        p = s.load - s.omega2 * x
        if self._damped:
            p -= s.c * x_dot
        if self._hardening:
            p[-1] -= self._hardening * x[-1] ** 3
        if len(s.loads):
            p += s.loads.values(np.array(time)) @ s.patterns
        if self._soft:
            p += s.between * float(s.law.force(s.floor + x @ (s.top - s.tip), x_dot @ (s.top - s.tip)))
        p -= (self._held.rows @ p) @ self._held.along
        return np.concatenate((x_dot, p, (X[-1], s.tip @ p) if s.alone else ()))

    def _jacobian(self, time: float, X: np.ndarray) -> np.ndarray:
        J = self._linear.copy()
        top = self._system.n - 1
        J[:, top] += 3.0 * X[top] ** 2 * self._cubic
        return np.asarray(J)

    def event(self, watch: Watch, start: np.ndarray) -> Callable[[float, np.ndarray], float]:
        """Return the function of an event, with the marks that ``solve_ivp`` looks for.

        One that starts at zero, as after its own event, counts from where it first exceeds rounding, either way.
        """
        s = self._system
        state = np.zeros(self._system.size)
        A = self._system.A

        def other(time: float, X: np.ndarray) -> float:
            state[: 2 * s.n], state[s.T] = X[: 2 * s.n], time
            return float(watch.function(s.motion(self._phase, state)))

        quick: dict[str, Callable[[float, np.ndarray], float]] = {
            "meet": lambda _, X: s.between @ X[A],
            "stop": lambda _, X: (X[-2] if s.alone else s.top @ X[A]) - s.stop.position,
            "release": lambda _, X: s.law.equilibrium - s.top @ X[A],
            "retie": lambda _, X: s.top @ X[A] - s.law.equilibrium,
        }
        if s.scene.elastic_stop:
            quick = {}
        function = quick.get(watch.name, other)
        noise = s.noise(watch.unit, start)
        counts = function(float(start[s.T]), self.start(start)) > noise

        def rising(time: float, X: np.ndarray) -> float:
            nonlocal counts
            value = function(time, X)
            counts = counts or value > noise
            return value if counts or value < -noise else noise

        found: Any = function if counts else rising
        found.terminal = True
        found.direction = -1.0
        return cast("Callable[[float, np.ndarray], float]", found)
