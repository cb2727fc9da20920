"""Pure-Python test doubles of the two bodies, exact to rounding for a contact force quadratic in time.

Independent of the FMUs and of `springbeam.monolithic`, so that the coupling is tested by itself:

* `ModalBody`: a linear body in its modes, each stepped by its matrix exponential;
* `DuffingBody`: m ÿ + α ẏ + k1 y + k2 y³ = −C + N + f_s by Taylor series of order 22.

Both count their steps and rewinds.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.linalg import eigh, expm

from springbeam.bodies.force import combined, work_on
from springbeam.bodies.protocol import NO_FORCE, BeamBody, Body, Energies, Force, Motion
from springbeam.results.recording import MemoryRecorder
from springbeam.results.trajectory import Trajectory
from springbeam.run.outcome import RunStopped
from springbeam.run.simulation import Simulation
from springbeam.scene import Beam, Scene
from springbeam.scene.statics import SHAPE_POINTS

_EPS = float(np.finfo(float).eps)


class ModalBody(BeamBody):
    """ä + α ω² ȧ + ω² a = b C + f per mode, w = bᵀa; F = +C.

    Parameters
    ----------
    omega, b, f : (r,) arrays
        Frequencies [rad/s], end shape [kg^-1/2], load.
    a, v : (r,) arrays
        Initial state.
    sampler : (21, r) array or None
        a → shape.
    """

    def __init__(self, omega, b, a, v, f=0.0, alpha=0.0, sampler=None):
        self.omega, self.b = np.asarray(omega, float), np.asarray(b, float)
        self.a, self.v = np.array(a, float), np.array(v, float)
        self.f = np.broadcast_to(np.asarray(f, float), self.omega.shape)
        self.alpha, self._sampler = alpha, sampler
        self.mass = 1.0 / float(self.b @ self.b)
        self._integrals = (0.0, 0.0)
        self._dissipated = self._work = 0.0
        self._maps = {}
        self._load = np.zeros((3, len(self.omega)))
        self.steps = self.rewinds = 0

    def mark(self):
        self._marked = (self.a, self.v, self._integrals, self._dissipated, self._work)
        self._moved = False

    def rewind(self):
        if self._moved:
            self.rewinds += 1
            self.a, self.v, self._integrals, self._dissipated, self._work = self._marked
            self._moved = False

    def expect_loads(self, loads):
        self._patterns = [self.pattern(load) for load in loads]

    def pattern(self, load):
        """What a unit of the load is in the modes; `beam_body` knows more than the tip."""
        assert load.on == "tip"
        return self.b

    def set_loads(self, forces):
        self._load = sum(np.outer(f, pattern) for f, pattern in zip(forces, self._patterns, strict=True))

    def advance(self, time: float, size: float, contact: Force, foundation: Force = NO_FORCE) -> Motion:
        self.steps += 1
        self._moved = True
        p = np.outer(contact, self.b) + self._load
        p[0] += self.f
        before, (f, df, ddf) = self.a, self._load
        i1, i2 = self._step(size, p)
        # By parts, as `springbeam.bodies.force.work_on`.
        once, twice = i1 - before * size, i2 - before * (0.5 * size * size)
        ends = f + size * (df + 0.5 * size * ddf)
        self._work += float(ends @ (self.a - before) - df @ once - ddf @ (size * once - twice))
        self._integrals = (float(self.b @ i1), float(self.b @ i2))
        return self.motion()

    def _step(self, h, p):
        """State per mode (ωa, ȧ, p, ṗ, p̈, ∫a, ∫∫a); dissipation by W(2h) = W(h) + E(h)ᵀW(h)E(h)."""
        if h not in self._maps:
            r = len(self.omega)
            A = np.zeros((r, 7, 7))
            A[:, 0, 1], A[:, 1, 0], A[:, 1, 1] = self.omega, -self.omega, -self.alpha * self.omega**2
            A[:, 1, 2] = A[:, 2, 3] = A[:, 3, 4] = 1.0
            A[:, 5, 0] = 1.0 / self.omega
            A[:, 6, 5] = 1.0
            doublings = max(0, int(np.ceil(np.log2(h * np.abs(A).sum(axis=2).max()))) - 1)
            small = h / 2**doublings
            E, W = expm(A * small), np.zeros((r, 7, 7))
            nodes, weights = np.polynomial.legendre.leggauss(12)
            for x, w in zip(nodes, weights, strict=True):
                rate = expm(A * (0.5 * (x + 1.0) * small))[:, 1, :]
                W += 0.5 * w * small * rate[:, :, None] * rate[:, None, :]
            W *= self.alpha * self.omega[:, None, None] ** 2
            for _ in range(doublings):
                W = W + np.swapaxes(E, 1, 2) @ W @ E
                E = E @ E
            self._maps[h] = (E, W)
        E, W = self._maps[h]
        zero = np.zeros_like(self.a)
        x = np.stack([self.omega * self.a, self.v, *p, zero, zero], axis=1)
        self._dissipated += float(np.einsum("ri,rij,rj", x, W, x))
        x = np.einsum("rij,rj->ri", E, x)
        self.a, self.v = x[:, 0] / self.omega, x[:, 1]
        return x[:, 5], x[:, 6]

    def motion(self) -> Motion:
        return Motion(float(self.b @ self.a), float(self.b @ self.v), *self._integrals)

    def energies(self) -> Energies:
        stretch = self.omega * self.a
        load = -float(self.f @ self.a) - self._work
        return Energies(0.5 * float(self.v @ self.v), 0.5 * float(stretch @ stretch), self._dissipated, load)

    def apply_impulse(self, impulse: float):
        self.v = self.v + self.b * impulse
        self._moved = True

    def shape(self) -> np.ndarray:
        return self._sampler @ self.a


def beam_body(beam: Beam, slope: float | None = None) -> ModalBody:
    """The scene's beam: P1 elements, full integration, all modes. ``slope`` replaces initial_deflection_slope."""
    n, h = beam.n_elements, beam.length / beam.n_elements
    bending = beam.young_modulus * beam.second_moment_of_area
    shear = beam.shear_coefficient * beam.shear_modulus * beam.area
    M, K = np.zeros((2 * n + 2,) * 2), np.zeros((2 * n + 2,) * 2)
    m = h / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]])
    k = np.array([[1.0, -1.0], [-1.0, 1.0]]) / h
    s = 0.5 * np.array([[-1.0, 1.0], [-1.0, 1.0]])  # ∫ ψ_i ψ_j'
    for i in range(n):
        d = slice(2 * i, 2 * i + 4)
        Ke, Me = np.zeros((4, 4)), np.zeros((4, 4))
        Me[::2, ::2] = beam.density * beam.second_moment_of_area * m
        Me[1::2, 1::2] = beam.density * beam.area * m
        Ke[::2, ::2], Ke[1::2, 1::2] = bending * k + shear * m, shear * k
        Ke[::2, 1::2], Ke[1::2, ::2] = -shear * s, -shear * s.T
        M[d, d] += Me
        K[d, d] += Ke
    clamp_mass = M[2:, 1].copy()  # of the clamp's deflection on the others
    M, K = M[2:, 2:], K[2:, 2:]
    squares, basis = eigh(K, M)
    x = np.zeros(2 * n)
    x[1::2] = h * np.arange(1, n + 1)
    load = np.zeros(2 * n)
    load[1::2] = beam.distributed_load * h
    load[-1] *= 0.5
    load[-1] += beam.tip_load_coefficient * h / 3.0
    load[-3] += beam.tip_load_coefficient * h / 6.0
    nodes = np.linspace(0.0, 1.0, n + 1)
    deflection = np.vstack([np.zeros((1, 2 * n)), basis[1::2]])
    line = basis.T @ (M @ x)
    gauss, weights = np.polynomial.legendre.leggauss(4)

    def pattern(load):
        if load.on == "tip":
            return basis[-1]
        if load.on == "base":
            return -basis.T @ (M @ np.tile([0.0, 1.0], n)) - basis.T @ clamp_mass
        at = np.zeros(n + 1)
        if load.at is not None:
            k = min(int(load.at * n), n - 1)
            at[[k, k + 1]] = k + 1 - load.at * n, load.at * n - k
        else:
            for k in range(n):
                s = 0.5 * (gauss + 1.0)
                f = 0.5 * h * weights * np.polynomial.polynomial.polyval((k + s) / n, load.shape or [1.0])
                at[[k, k + 1]] += f @ (1.0 - s), f @ s
        return basis[1::2].T @ at[1:]

    body = ModalBody(
        np.sqrt(squares),
        basis[-1],
        (beam.initial_deflection_slope if slope is None else slope) * line,
        beam.initial_velocity_slope * line,
        basis.T @ load,
        beam.alpha_b,
        np.array([np.interp(SHAPE_POINTS, nodes, column) for column in deflection.T]).T,
    )
    body.pattern = pattern
    return body


def modal_beam(n: int, stiffness: float = 100.0, slope: float = -1.0) -> ModalBody:
    """An undamped unit beam of ``n`` elements, EI = KAG = ``stiffness``, moving as u̇ = slope·x."""
    return beam_body(
        Beam.with_ones(n_elements=n, young_modulus=stiffness, shear_modulus=stiffness, initial_velocity_slope=slope)
    )


_ORDER = 22


class DuffingBody(Body):
    """m ÿ + α ẏ + k1 y + k2 y³ = −C + N + f_s by Taylor series in steps short enough for rounding."""

    def __init__(self, mass=1.0, k1=3.0, k2=-0.2, y=0.0, z=0.0, damping=0.0, external=0.0):
        self.mass, self.k1, self.k2, self.damping, self.external = mass, k1, k2, damping, external
        self.y, self.z = float(y), float(z)
        self._integrals = (0.0, 0.0)
        self._dissipated = self._work = 0.0
        self._load = NO_FORCE
        self.steps = self.rewinds = 0

    def mark(self):
        self._marked = (self.y, self.z, self._integrals, self._dissipated, self._work)
        self._moved = False

    def rewind(self):
        if self._moved:
            self.rewinds += 1
            self.y, self.z, self._integrals, self._dissipated, self._work = self._marked
            self._moved = False

    def expect_loads(self, loads):
        self._shares = [-self.mass if load.on == "base" else 1.0 for load in loads]

    def set_loads(self, forces):
        self._load = combined(self._shares, forces)

    def load_on_end(self):
        return self._load

    def advance(self, time: float, size: float, contact: Force, foundation: Force = NO_FORCE) -> Motion:
        self.steps += 1
        self._moved = True
        f0, f1, f2 = (n - p + f for n, p, f in zip(foundation, contact, self._load, strict=True))
        start = self.motion()
        f0 += self.external
        i1 = i2 = done = 0.0
        while done < size:
            tau = done
            y = self._series(f0 + tau * (f1 + 0.5 * tau * f2), f1 + tau * f2, 0.5 * f2)
            h = self._reach(y, size - done)
            if size - done - h < 1e-12 * size:
                h = size - done
                done = size
            else:
                done += h
            if self.damping != 0.0:
                rate = [k * c for k, c in enumerate(y)][1:]
                squares = [sum(rate[i] * rate[k - i] for i in range(k + 1)) for k in range(len(rate))]
                self._dissipated += self.damping * _sum([c / (k + 1) for k, c in enumerate(squares)], h) * h
            new1 = i1 + h * _sum([c / (k + 1) for k, c in enumerate(y)], h)
            i2 += h * i1 + h * h * _sum([c / ((k + 1) * (k + 2)) for k, c in enumerate(y)], h)
            i1 = new1
            self.y, self.z = _sum(y, h), _sum([k * c for k, c in enumerate(y)][1:], h)
        self._integrals = (i1, i2)
        self._work += work_on(self._load, start, self.motion(), size)
        return self.motion()

    def _series(self, *forcing: float) -> list[float]:
        y, z = [self.y, self.z], [self.z]
        squares: list[float] = []
        for k in range(_ORDER - 1):
            f = forcing[k] if k < 3 else 0.0
            f -= self.damping * z[k] + self.k1 * y[k]
            if self.k2 != 0.0:
                squares.append(sum(y[i] * y[k - i] for i in range(k + 1)))
                f -= self.k2 * sum(squares[i] * y[k - i] for i in range(k + 1))
            z.append(f / (self.mass * (k + 1)))
            y.append(z[-1] / (k + 2))
        return y

    @staticmethod
    def _reach(y: list[float], size: float) -> float:
        """Step over which the last coefficients are rounding of the largest term."""
        h = size
        for _ in range(200):
            terms = [abs(c) * h**k for k, c in enumerate(y)]
            if _ORDER * max(terms[-1], terms[-2]) <= 1e-18 * max(terms[1:]) or max(terms) == 0.0:
                return h
            h *= 0.75
        raise AssertionError(f"no step: {y}")

    def motion(self) -> Motion:
        return Motion(self.y, self.z, *self._integrals)

    def energies(self) -> Energies:
        y, z = self.y, self.z
        return Energies(
            0.5 * self.mass * z * z,
            0.5 * self.k1 * y * y + 0.25 * self.k2 * y**4,
            self._dissipated,
            -self.external * y - self._work,
        )

    def apply_impulse(self, impulse: float):
        self.z += impulse / self.mass
        self._moved = True

    def holding_force(self, displacement, velocity):
        y = displacement
        return self.k1 * y + self.k2 * y**3 - self.external + self.damping * velocity


class Upper(DuffingBody):
    """A mass above: C lifts it."""

    def advance(self, time, size, contact, foundation=NO_FORCE):
        return super().advance(time, size, tuple(-c for c in contact), foundation)


def _sum(coefficients: list[float], h: float) -> float:
    total = 0.0
    for c in reversed(coefficients):
        total = total * h + c
    return total


def bodies(scene: Scene) -> tuple[ModalBody | None, DuffingBody | None]:
    """The scene's bodies at `first_contact`."""
    beam = spring = None
    if scene.beam is not None:
        target = scene.tip_target
        kinematic = scene.beam.approach == "undeformed" and target is not None
        beam = beam_body(scene.beam, target[1] / scene.beam.length if kinematic else None)
    if (p := scene.spring) is not None:
        spring = DuffingBody(
            p.mass,
            p.linear_stiffness,
            p.cubic_stiffness,
            p.equilibrium,
            p.initial_velocity,
            p.damping,
            p.external_force,
        )
    return beam, spring


def simulate(scene: Scene, wrap=lambda beam, spring: (beam, spring)) -> Trajectory:
    """The master's run with the doubles (``wrap`` may replace them); ``summary["stopped"]`` holds a RunStopped."""
    beam, spring = wrap(*bodies(scene))
    recorder = MemoryRecorder(scene)
    simulation = Simulation(scene, (scene.contact_time or 0.0), beam, spring, recorder)
    stopped = None
    try:
        simulation.run()
    except RunStopped as error:
        stopped = error
    recorder.finish(simulation.summary())
    trajectory = recorder.trajectory()
    trajectory.summary["stopped"] = stopped
    trajectory.summary["work"] = {
        name: body.steps for name, body in (("beam", beam), ("spring", spring)) if hasattr(body, "steps")
    }
    return trajectory


def orders(errors, sizes) -> list[float]:
    """Observed orders between neighbouring step sizes."""
    pairs = zip(pairwise(errors), pairwise(sizes), strict=True)
    return [float(np.log(e0 / e1) / np.log(h0 / h1)) for (e0, e1), (h0, h1) in pairs]


def drift(bodies_) -> float:
    """Total mechanical energy with what was dissipated and the loads' potential [J]."""
    return sum(sum(body.energies()) for body in bodies_)
