"""What integrates one phase of a `HybridSystem`, and scipy doing so.

`exponential` is the other way; the two share the equations of motion and no numerical method.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import DOP853, LSODA, Radau, solve_ivp

from .hybrid_system import HybridSystem, ReferenceFailure
from .laws import Phase

SCIPY_METHODS = {"DOP853": DOP853, "LSODA": LSODA, "Radau": Radau}


@dataclass(frozen=True)
class Method:
    """How a phase is integrated, and how finely where that is scipy's; see `event_driven.simulate`."""

    name: str
    rtol: float
    atol: float
    nodes: int


@dataclass(frozen=True)
class Segment:
    """One accepted step: its states at ``nodes`` [s], from 0 to its size, and what finds those between them."""

    nodes: np.ndarray  #: (k,)
    states: np.ndarray  #: (k, 2r + 5); good enough to find events, exact at both ends
    inside: Callable[[float], np.ndarray]  #: τ [s] → X at the accuracy of the method

    @property
    def size(self) -> float:
        """How long it lasts [s]."""
        return float(self.nodes[-1])

    def state(self, tau: float) -> np.ndarray:
        """Return X at ``tau`` after the start [s]."""
        if tau <= 0.0 or tau == self.size:
            return np.array(self.states[0 if tau <= 0.0 else -1])
        return self.inside(tau)


class RungeKuttaPropagator:
    """scipy's DOP853, LSODA or Radau on the modal form."""

    def __init__(self, system: HybridSystem, phase: Phase, X: np.ndarray, horizon: float, method: Method) -> None:
        self.system, self.phase, self.method = system, phase, method
        self.options: dict[str, Any] = {"rtol": method.rtol, "atol": method.atol}
        if method.name != "DOP853":
            self.options["jac"] = lambda _time, X: system.jacobian(phase, X)
        solver: Any = SCIPY_METHODS[method.name]
        self._solver = solver(self.rhs, 0.0, X.copy(), horizon, **self.options)
        self.elapsed = 0.0  #: since the start [s]

    def rhs(self, _time: float, X: np.ndarray) -> np.ndarray:
        return self.system.derivative(self.phase, X)

    def advance(self, remaining: float, resolution: float = 0.0) -> Segment:
        """Make one step, which may end before or beyond ``remaining``."""
        solver, count = self._solver, self.method.nodes
        start, begin = solver.y.copy(), solver.t
        message = solver.step()
        if solver.status == "failed":
            raise ReferenceFailure(f"{self.method.name} failed in phase {self.phase.name}: {message}")
        self.elapsed = float(solver.t)
        size = solver.t - begin
        nodes = np.linspace(0.0, size, count)
        # DOP853's takes evaluations of its own.
        dense: Any = solver.dense_output() if count != 2 or self.method.name == "LSODA" else None
        states = np.array([start, solver.y]) if count == 2 else dense(begin + nodes).T
        states[0], states[-1] = start, solver.y

        def inside(tau: float) -> np.ndarray:
            if self.method.name == "LSODA":
                # Of the order of the step; and before scipy 1.17 no second LSODA may run while the first goes on.
                X = dense(begin + tau)
            else:
                # Again from the start, because the dense output is a power of the step less accurate.
                options = {"method": self.method.name, "first_step": tau, **self.options}
                X = solve_ivp(self.rhs, (0.0, tau), start, **options).y[:, -1].copy()
            return self.system.synchronise(self.phase, X)

        return Segment(nodes, self.system.synchronise(self.phase, states), inside)
