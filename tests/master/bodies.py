"""Pure-Python test doubles of the two bodies: a modal beam stepped by its matrix exponential, a Duffing spring.

Independent of the FMUs, so that the coupling is tested by itself.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm

from springbeam.subsystem import NO_FORCE, Energies, Force, Motion


class LinearBody:
    """M q̈ + α K q̇ + K q = e F, F = +C: state (q, q̇, ∫w, ∫∫w), stepped exactly."""

    def __init__(self, M, K, e, q, v, alpha=0.0):
        self.M, self.K, self.e, self.alpha = map(np.asarray, (M, K, e, alpha))
        self.q, self.v = np.array(q, float), np.array(v, float)
        self.mass = 1.0 / float(self.e @ np.linalg.solve(self.M, self.e))
        self._integrals = (0.0, 0.0)
        self._dissipated = 0.0
        self._maps = {}
        self.steps = self.rewinds = 0

    def mark(self):
        self._marked = (self.q.copy(), self.v.copy(), self._integrals, self._dissipated)

    def rewind(self):
        self.rewinds += 1
        q, v, self._integrals, self._dissipated = self._marked
        self.q, self.v = q.copy(), v.copy()

    def advance(self, time: float, size: float, contact: Force, foundation: Force = NO_FORCE):
        self.steps += 1
        n = len(self.q)
        if size not in self._maps:
            A = np.zeros((2 * n + 5, 2 * n + 5))
            A[:n, n : 2 * n] = np.eye(n)
            Minv = np.linalg.inv(self.M)
            A[n : 2 * n, :n] = -Minv @ self.K
            A[n : 2 * n, n : 2 * n] = -self.alpha * Minv @ self.K
            A[n : 2 * n, 2 * n] = Minv @ self.e
            A[2 * n, 2 * n + 1] = A[2 * n + 1, 2 * n + 2] = 1.0
            A[2 * n + 3, :n] = self.e
            A[2 * n + 4, 2 * n + 3] = 1.0
            self._maps[size] = expm(A * size)
        x = self._maps[size] @ np.concatenate([self.q, self.v, contact, [0.0, 0.0]])
        self.q, self.v, self._integrals = x[:n], x[n : 2 * n], (float(x[-2]), float(x[-1]))

    def motion(self) -> Motion:
        return Motion(float(self.e @ self.q), float(self.e @ self.v), *self._integrals)

    def energies(self) -> Energies:
        return Energies(
            0.5 * float(self.v @ self.M @ self.v), 0.5 * float(self.q @ self.K @ self.q), self._dissipated, 0.0
        )

    def apply_impulse(self, impulse: float):
        self.v = self.v + np.linalg.solve(self.M, self.e) * impulse

    def close(self): ...


def modal_beam(n: int, stiffness: float = 100.0, slope: float = -1.0) -> LinearBody:
    """An undamped unit Timoshenko beam of ``n`` P1 elements, EI = KAG = ``stiffness``, moving as u̇ = slope·x."""
    h = 1.0 / n
    M, K = np.zeros((2 * n + 2,) * 2), np.zeros((2 * n + 2,) * 2)
    for i in range(n):
        d = slice(2 * i, 2 * i + 4)
        m = h / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]])
        k = np.array([[1.0, -1.0], [-1.0, 1.0]]) / h
        s = 0.5 * np.array([[-1.0, 1.0], [-1.0, 1.0]])  # ∫ ψ_i ψ_j'
        Ke, Me = np.zeros((4, 4)), np.zeros((4, 4))
        Me[::2, ::2] = Me[1::2, 1::2] = m
        Ke[::2, ::2], Ke[1::2, 1::2], Ke[::2, 1::2], Ke[1::2, ::2] = k + m, k, -s, -s.T
        M[d, d] += Me
        K[d, d] += stiffness * Ke
    e = np.zeros(2 * n)
    e[-1] = 1.0
    v = np.zeros(2 * n)
    v[1::2] = slope * h * np.arange(1, n + 1)
    return LinearBody(M[2:, 2:], K[2:, 2:], e, np.zeros(2 * n), v)


class DuffingBody:
    """m ÿ + k1 y + k2 y³ = −C + N by DOP853 at 1e-13."""

    def __init__(self, mass=1.0, k1=3.0, k2=-0.2, y=0.0, z=0.0, damping=0.0):
        self.mass, self.k1, self.k2, self.damping = mass, k1, k2, damping
        self.x = np.array([y, z, 0.0, 0.0, 0.0])
        self.steps = self.rewinds = 0

    def mark(self):
        self._marked = self.x.copy()

    def rewind(self):
        self.rewinds += 1
        self.x = self._marked.copy()

    def advance(self, time: float, size: float, contact: Force, foundation: Force = NO_FORCE):
        self.steps += 1
        c = [n - p for n, p in zip(foundation, contact, strict=True)]

        def rhs(t, x):
            f = c[0] + t * (c[1] + 0.5 * t * c[2])
            acceleration = (f - self.damping * x[1] - self.k1 * x[0] - self.k2 * x[0] ** 3) / self.mass
            return [x[1], acceleration, x[0], x[2], self.damping * x[1] ** 2]

        start = [self.x[0], self.x[1], 0.0, 0.0, self.x[4]]
        scale = 1e-14 * np.array([1e-2, 1e-2, 1e-2 * size, 1e-2 * size**2, 1e-2])
        self.x = solve_ivp(rhs, (0.0, size), start, method="DOP853", rtol=2.3e-14, atol=scale, first_step=size / 4).y[:, -1]

    def motion(self) -> Motion:
        return Motion(float(self.x[0]), float(self.x[1]), float(self.x[2]), float(self.x[3]))

    def energies(self) -> Energies:
        y, z = self.x[0], self.x[1]
        return Energies(0.5 * self.mass * z * z, 0.5 * self.k1 * y * y + 0.25 * self.k2 * y**4, self.x[4], 0.0)

    def apply_impulse(self, impulse: float):
        self.x[1] += impulse / self.mass

    def close(self): ...
