"""Event-driven reference for a beam without inertia and a rigid law.

Equilibrium, K (q + α_b q̇) = e C + F, leaves the tip's deviation w from its deflection u_F under the loads. State of
every phase: X = (y, z, w, D), D the energy dissipated so far [J]::

    free    α_b ẇ = −w (w = 0 for α_b = 0),   m ż = s,       s = f_s − α_s z − k1 y − k2 y³
    joined  w = y − u_F,   C = k (w + α_b z),   m ż = s − C
    seated  y = φ, z = 0, N = C − s

Phases and events are those of `laws` and `transitions`. A tip that is let go undamped jumps to u_F, and ½ k w² is lost;
meeting the spring costs nothing. Integrated by scipy's DOP853, whose root finding locates the events.
"""

from __future__ import annotations

import itertools
import time as clock
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from ..results.trajectory import COLUMNS, Event, Trajectory
from ..scene import Beam, Scene
from .hybrid_system import ReferenceFailure
from .laws import Motion, Phase, Watch, law_of

_AT_ONCE = 20
_NOISE = 64.0 * float(np.finfo(float).eps)


def simulate(
    scene: Scene,
    *,
    rtol: float = 1e-12,
    atol: float = 1e-15,
    sample_times: Sequence[float] | np.ndarray | None = None,
    velocity_perturbation: float = 0.0,
    t_end: float | None = None,
) -> Trajectory:
    """Run a scene whose ``beam.fidelity`` is ``"quasi_static"``; parameters as of `event_driven.simulate`.

    ``velocity_perturbation`` is added to the spring's initial velocity [m/s].

    Raises
    ------
    ReferenceFailure
        If an integration or the event logic cannot go on.
    ValueError
        If the law is another.
    """
    if scene.loads:
        raise ValueError("[[loads]]: with a quasi-static beam, this reference knows constant loads only")
    if not law_of(scene).rigid:
        raise ValueError(
            f"contact.law = {scene.contact.law!r}: with a quasi-static beam, this reference knows a tie only"
        )
    return _Run(scene, rtol, atol, velocity_perturbation, t_end).execute(sample_times)


def _statics(beam: Beam) -> tuple[float, float, float]:
    """(k, u_F, ½ work of the loads) by the influence function G(x, ξ) of a unit force at ξ."""
    L, h = beam.length, beam.length / beam.n_elements
    EI = beam.young_modulus * beam.second_moment_of_area
    KAG = beam.shear_coefficient * beam.area * beam.shear_modulus
    nodes, weights = np.polynomial.legendre.leggauss(5)

    def integral(f: Callable[[np.ndarray], np.ndarray], *breaks: float) -> float:
        edges = np.unique([0.0, L, *breaks])
        parts = itertools.pairwise(edges)
        return float(sum(0.5 * (b - a) * weights @ f(0.5 * (a + b) + 0.5 * (b - a) * nodes) for a, b in parts))

    def influence(x: float, at: np.ndarray) -> np.ndarray:
        low, high = np.minimum(x, at), np.maximum(x, at)
        return np.asarray(low / KAG + low**2 * (3.0 * high - low) / (6.0 * EI))

    def load(x: np.ndarray) -> np.ndarray:
        return beam.distributed_load + beam.tip_load_coefficient * np.maximum(0.0, 1.0 - (L - x) / h)

    def deflection(x: float) -> float:
        return integral(lambda at: influence(x, at) * load(at), L - h, x)

    work = integral(lambda x: load(x) * np.array([deflection(at) for at in x]), L - h)
    return 1.0 / float(influence(L, np.array([L]))[0]), deflection(L), 0.5 * work


class _Run:
    def __init__(
        self, scene: Scene, rtol: float, atol: float, velocity_perturbation: float, t_end: float | None
    ) -> None:
        assert scene.beam is not None
        assert scene.spring is not None
        self.scene, self.beam, self.spring, self.law = scene, scene.beam, scene.spring, law_of(scene)
        self.rtol, self.atol = rtol, atol
        self.t_end = scene.time.t_end if t_end is None else min(t_end, scene.time.t_end)
        self.k, self.rest, self.stored = _statics(self.beam)
        self.alpha, self.psi = self.beam.alpha_b, self.spring.equilibrium
        self.phi = None if scene.stop is None else scene.stop.position
        self.phase = Phase("free")
        self.loss = 0.0
        self.events: list[Event] = []
        self.rows: list[tuple[float, np.ndarray, Phase, float]] = []
        self.time = 0.0
        tip = self.beam.initial_deflection_slope * self.beam.length
        self.arriving = self.beam.initial_velocity_slope * self.beam.length
        if self.beam.approach == "undeformed" and tip > self.psi:
            self.time, tip = (tip - self.psi) / -self.arriving, self.psi
        elif self.beam.approach == "elastic" and self.alpha == 0.0:
            tip = self.rest
        if self.beam.approach == "elastic":
            self.arriving = self._tip_velocity(tip - self.rest)
        self.X = np.array([self.psi, self.spring.initial_velocity + velocity_perturbation, tip - self.rest, 0.0])
        if self.law.start != "free" and self.arriving == self.X[1]:  # joined already
            self.phase, self.X[2] = Phase(self.law.start), self.X[0] - self.rest

    # Equations ------------------------------------------------------------------------------------------------------

    def _tip_velocity(self, w: float) -> float:
        return -w / self.alpha if self.alpha > 0.0 else 0.0

    def _spring_force(self, X: np.ndarray) -> np.ndarray:
        s, y, z = self.spring, X[0], X[1]
        return np.asarray(s.external_force - s.damping * z - s.linear_stiffness * y - s.cubic_stiffness * y**3)

    def _contact(self, phase: Phase, X: np.ndarray) -> np.ndarray:
        """C [N]; X of shape (4, …)."""
        if phase.contact == "free":
            return np.zeros_like(X[0])
        return np.asarray(self.k * (X[0] - self.rest + self.alpha * X[1]))

    def _derivative(self, _: float, X: np.ndarray) -> np.ndarray:
        phase, force = self.phase, self._spring_force(X)
        z_dot = 0.0 if phase.seated else (float(force) - float(self._contact(phase, X))) / self.spring.mass
        rate = self._tip_velocity(X[2]) if phase.contact == "free" else X[1]
        lost = self.spring.damping * X[1] ** 2 + self.alpha * self.k * rate**2
        return np.array([0.0 if phase.seated else X[1], z_dot, rate, lost])

    def _motion(self, phase: Phase, X: np.ndarray) -> Motion:
        """Interface quantities of X of shape (4, …); the beam has no modes."""
        C, s, y, z = self._contact(phase, X), self._spring_force(X), X[0], X[1]
        free, seated = phase.contact == "free", phase.seated
        v = np.asarray(self._tip_velocity(X[2])) if free else z
        N, z_dot = (C - s, np.zeros_like(y)) if seated else (np.zeros_like(y), (s - C) / self.spring.mass)
        return Motion(self.rest + X[2], v, y, z, C, N, np.zeros(0), z_dot)

    def _watched(self) -> list[Watch]:
        """Functions that are ≥ 0 as long as the phase lasts."""
        watched = self.law.watched(self.phase)
        if self.phase.seated:
            return [*watched, Watch("unseat", lambda m: m.N, "N")]
        if (phi := self.phi) is not None:
            return [*watched, Watch("stop", lambda m: m.y - phi, "m")]
        return watched

    # Run ------------------------------------------------------------------------------------------------------------

    def execute(self, sample_times: Sequence[float] | np.ndarray | None) -> Trajectory:
        began = clock.perf_counter()
        every_event = sample_times is None
        if sample_times is None:
            H = self.scene.coupling.H
            samples = np.append(np.arange(self.time, self.t_end - 1e-9 * H, H), self.t_end)
        else:
            samples = np.asarray(sample_times, dtype=float)
        samples = samples[samples >= self.time]
        if every_event:
            self._record(self.time, self.X)
        joins = self.law.start != "free"
        touches = self.rest + self.X[2] - self.X[0] <= _NOISE * abs(self.psi) and self.arriving <= self.X[1]
        if self.phase.contact == "free" and (joins or touches):
            self._go_on("meet")
        evaluations = 0
        while self.time < self.t_end:
            due = self._due()
            if due is None:
                due, solution = self._integrate()
                evaluations += solution.nfev
                for at in samples[(samples >= solution.t[0]) & (samples < self.time)]:
                    self._record(float(at), solution.sol(at))
            if every_event or due is None:
                self._record(self.time, self.X)
            if due is not None:
                self._handle(due)
                if every_event:
                    self._record(self.time, self.X)
            at_once = len(self.events) - _AT_ONCE - 1
            if at_once >= 0 and self.events[at_once].time == self.time:
                raise ReferenceFailure(f"{len(self.events)} events by t = {self.time!r} s: they do not end")
        return self._trajectory(clock.perf_counter() - began, evaluations)

    def _record(self, time: float, X: np.ndarray) -> None:
        self.rows.append((time, np.array(X), self.phase, self.loss))

    def _value(self, watch: Watch, X: np.ndarray) -> float:
        return float(watch.function(self._motion(self.phase, X)))

    def _due(self) -> Watch | None:
        """An event whose function is zero, but for rounding, and falling."""
        step = 1e-9 * self.t_end
        for watch in self._watched():
            value = self._value(watch, self.X)
            ahead = self._value(watch, self.X + step * self._derivative(self.time, self.X))
            noise = _NOISE * (1.0 if watch.unit == "N" else 1.0 / self.k)
            noise *= self.k * (abs(self.X[0]) + abs(self.psi) + abs(self.rest))
            if value <= noise and ahead < min(value, -noise):
                return watch
        return None

    def _integrate(self) -> tuple[Watch | None, Any]:
        """To the first event or t_end; the event, and scipy's solution."""
        # scipy takes a function that stays at zero, as those of a pair at rest at Ψ, for an event.
        watched = self._watched() if np.any(self._derivative(self.time, self.X)) else []
        # Events are looked for at the ends of steps: none may hold two crossings of one function.
        s, rigid = self.spring, self.k + abs(self.spring.linear_stiffness)
        reach = abs(self.X[0]) + abs(self.X[1]) * np.sqrt(s.mass / rigid)
        longest = 0.1 * np.sqrt(s.mass / (rigid + 3.0 * abs(s.cubic_stiffness) * reach**2))

        def event_of(watch: Watch) -> Callable[[float, np.ndarray], float]:
            def event(_: float, X: np.ndarray) -> float:
                return self._value(watch, X)

            event.terminal, event.direction = True, -1.0  # type: ignore[attr-defined]
            return event

        solution = solve_ivp(
            self._derivative, (self.time, self.t_end), self.X, method="DOP853", rtol=self.rtol, atol=self.atol,
            dense_output=True, max_step=longest, events=[event_of(watch) for watch in watched],
        )  # fmt: skip
        if solution.status < 0:
            raise ReferenceFailure(f"t = {solution.t[-1]!r} s: {solution.message}")
        self.time, self.X = float(solution.t[-1]), solution.y[:, -1].copy()
        hit = [watch for watch, times in zip(watched, solution.t_events, strict=True) if len(times)]
        return (hit[0] if hit else None), solution

    # Events ---------------------------------------------------------------------------------------------------------

    def _handle(self, event: Watch) -> None:
        X = self.X
        if event.level is not None:
            X[0], X[2] = event.level, event.level - self.rest
        if event.name == "stop":
            self._strike()
        elif event.name == "unseat":
            self.phase = Phase(self.phase.contact)
            self._emit("unseated")
        else:
            self._go_on(event.name)

    def _go_on(self, happened: str) -> None:
        """Into the phase that the law has next; what an undamped tip springs back with when it is let go is lost."""
        X, lost = self.X, 0.0
        if happened == "meet":
            X[2] = X[0] - self.rest
        contact, kind = self.law.after(happened, self)
        if contact == "free" and self.alpha == 0.0:
            lost, X[2] = 0.5 * self.k * X[2] ** 2, 0.0
        self.phase = Phase(contact, self.phase.seated)
        assert kind is not None
        self._emit(kind, energy_loss=lost)

    def below(self) -> bool:
        """Return whether the joined ends are below Ψ or about to be."""
        height, rate = self.X[0] - self.psi, float(self.X[1])
        if rate == 0.0:
            rate = float(self._spring_force(self.X) - self._contact(Phase("tied"), self.X))
        noise = _NOISE * abs(self.psi)
        return bool(height < -noise or (abs(height) <= noise and rate <= 0.0))

    def pressed(self) -> bool:
        """Return whether C > 0 if the ends stay together."""
        return bool(self._contact(Phase("touch"), self.X) > 0.0)

    def _strike(self) -> None:
        """Newton's impact law on the foundation; the joined tip follows."""
        assert self.scene.stop is not None
        X, e, m = self.X, self.scene.stop.restitution, self.spring.mass
        X[0], arriving = self.phi, float(X[1])
        if self.phase.contact != "free":
            X[2] = X[0] - self.rest
        X[1] = -e * arriving
        push = float(self._spring_force(X) - self._contact(self.phase, X))
        seats = e == 0.0 or 0.5 * m * X[1] ** 2 <= -push * 1e-12 * (self.psi - X[0])
        X[1] = 0.0 if seats else X[1]
        self.phase = Phase(self.phase.contact, seated=seats)
        self._emit(
            "seated" if seats else "stop_impact",
            impulse_foundation=m * (float(X[1]) - arriving),
            energy_loss=0.5 * m * (arriving**2 - float(X[1]) ** 2),
        )

    def _emit(self, kind: str, **values: float) -> None:
        self.loss += values.get("energy_loss", 0.0)
        y, z, w, _ = (float(x) for x in self.X)
        rate = self._tip_velocity(w) if self.phase.contact == "free" else z
        self.events.append(Event(self.time, kind, y, z, self.rest + w, rate, **values))

    # Result ---------------------------------------------------------------------------------------------------------

    def _trajectory(self, wall_time: float, evaluations: int) -> Trajectory:
        columns: dict[str, list[float]] = {}
        s = self.spring
        for time, X, phase, loss in self.rows:
            y, z, w, dissipated = (float(x) for x in X)
            C = float(self._contact(phase, X))
            free = phase.contact == "free"
            v, u = self._tip_velocity(w) if free else z, self.rest + w
            inside = float(self.law.inside(np.float64(C), np.float64(u)))
            row = {
                "time": time, "u_tip": u, "v_tip": v, "y": y, "z": z, "contact_force": C, "compliance_force": inside,
                "tie_reaction": C - inside, "gap": u - y, "velocity_mismatch": 0.0 if free else v - z,
                "foundation_force": C - float(self._spring_force(X)) if phase.seated else 0.0,
                "e_beam": 0.5 * self.k * w * w + self.k * w * self.rest + self.stored,
                "e_spring": 0.5 * s.mass * z**2 + 0.5 * s.linear_stiffness * y**2 + 0.25 * s.cubic_stiffness * y**4,
                "e_contact": 0.0, "e_dissipated": dissipated, "e_impact_loss": loss,
                "e_load": -self.k * w * self.rest - 2.0 * self.stored - s.external_force * y,
            }  # fmt: skip
            for name, value in row.items():
                columns.setdefault(name, []).append(value)
        arrays = {name: np.array(values) for name, values in columns.items()}
        arrays["phase"] = np.array([phase.name for _, _, phase, _ in self.rows], dtype="<U8")
        arrays["e_total"] = np.sum([arrays[n] for n in arrays if n.startswith("e_")], axis=0)
        arrays["energy_residual"] = arrays["e_total"] - arrays["e_total"][0]
        if self.phi is None:
            del arrays["foundation_force"]
        summary = {
            "reference": "quasi_static", "method": "DOP853", "wall_time": wall_time,
            "counts": {"derivatives": evaluations, "events": len(self.events)},
            "tolerances": {"rtol": self.rtol, "atol": self.atol},
        }  # fmt: skip
        return Trajectory(
            self.scene, {name: arrays[name] for name in COLUMNS if name in arrays}, self.events, None, summary
        )
