"""The coupled step of a linear pair as a matrix: exact bodies, any scheme, its spectral radius.

Bodies are oscillators ξ̈ + c ξ̇ + ω² ξ = b F with the interface displacement w = bᵀξ. With S the response to a unit
impulse and S_j its j-fold integral (S₋₁ = Ṡ), a step of size h under F(τ) = Σ F_j τʲ/j! is exact::

    ξ(h) = (Ṡ + cS) ξ₀ + S ξ̇₀ + b Σ F_j S_{j+1}      ∫ξ, ∫∫ξ: each index one, two higher
    ξ̇(h) = −ω²S ξ₀ + Ṡ ξ̇₀ + b Σ F_j S_j

A step of a scheme is written as what it does to states; those of the identity give its matrix.
Nothing here uses the bodies or the solvers of a run, except the conditions that define a scheme.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import factorial, inf, sqrt

import numpy as np
from numpy.polynomial import legendre

from ...bodies import force
from ...bodies.protocol import Motion
from ...coupling.projection import penetration_series
from ...coupling.tie import SCHEMES
from ...monolithic.oscillators import GAUSS, Oscillators


def impulse_integrals(omega2: np.ndarray, c: np.ndarray, h: float) -> np.ndarray:
    """Return S₋₁ … S₅ at time ``h`` [s]: S_j, j > 0, is the response to the force τ^{j−1}/(j − 1)!.

    Parameters
    ----------
    omega2, c : (r,) arrays
        ω² [1/s²], may be 0 or negative; c ≥ 0 [1/s].

    Returns
    -------
    (7, r) array
        Row j + 1 is S_j [s^{j+1}].
    """
    at_end = Oscillators(omega2, c).weights(h, slice(-1, None))
    forces = [(h * GAUSS.nodes) ** j / factorial(j) for j in range(5)]
    return np.vstack([at_end.S_dot, at_end.S, forces @ at_end.force[0]])


@dataclass(frozen=True)
class LinearBody:
    """Oscillators that one interface force moves.

    Attributes
    ----------
    omega2, c : (r,) arrays
        ω² [1/s²] and c [1/s].
    b : (r,) array
        w = bᵀξ [m] with mass-normalised ξ [m·√kg].
    """

    omega2: np.ndarray
    c: np.ndarray
    b: np.ndarray

    @property
    def size(self) -> int:
        """Length 2r of a state (ξ, ξ̇)."""
        return 2 * len(self.omega2)

    @property
    def mass(self) -> float:
        """What an impulse at the interface meets [kg]; ∞ of a wall, which has no modes."""
        mobility = float(self.b @ self.b)
        return 1.0 / mobility if mobility > 0.0 else inf

    def displacement(self, x: np.ndarray) -> np.ndarray:
        """Return w [m] of states, the columns of ``x``."""
        return np.asarray(self.b @ x[: len(self.b)])

    def velocity(self, x: np.ndarray) -> np.ndarray:
        """Return ẇ [m/s] of states, the columns of ``x``."""
        return np.asarray(self.b @ x[len(self.b) :])


class Step:
    """The exact step of a `LinearBody` over ``h`` [s]."""

    def __init__(self, body: LinearBody, h: float) -> None:
        self.body, self.h = body, h
        S = impulse_integrals(body.omega2, body.c, h)[:, :, None]
        c, omega2, b = (v[:, None] for v in (body.c, body.omega2, body.b))
        # Of ∫ᵏξ, k = 0, 1, 2, and of ξ̇, k = −1: what ξ₀, ξ̇₀ and each F_j add.
        at_start = {k: (S[k] + c * S[k + 1], S[k + 1]) for k in (0, 1, 2)} | {-1: (-omega2 * S[1], S[0])}
        self._rows = [(*at_start[k], [b * S[j] for j in range(k + 2, k + 5)]) for k in (0, -1, 1, 2)]

    def __call__(self, x: np.ndarray, forces: Sequence[np.ndarray | float] = ()) -> tuple[np.ndarray, np.ndarray]:
        """Return states and motions (`Motion` as rows, shape (4, columns)) after the step.

        ``x`` has a state per column; ``forces`` are F, Ḟ, F̈ at the start, as many as there are, per column.
        """
        r = len(self.body.b)
        xi, rate = x[:r], x[r:]
        rows = []
        for of_place, of_rate, of_forces in self._rows:
            row = of_place * xi + of_rate * rate
            for f, g in zip(forces, of_forces, strict=False):
                row = row + g * f
            rows.append(row)
        end, b = np.vstack(rows[:2]), self.body.b
        return end, np.array([self.body.displacement(end), self.body.velocity(end), b @ rows[2], b @ rows[3]])

    def response(self, degree: int) -> tuple[np.ndarray, np.ndarray]:
        """Return states and motions from rest under P₀ … P_degree, a column each."""
        units = [force.derivatives(row.tolist(), self.h) for row in np.eye(degree + 1)]
        return self(np.zeros((self.body.size, degree + 1)), list(np.array(units).T))


@dataclass(frozen=True)
class LinearPair:
    """Beam and spring; the spring takes −C: ``stiffness`` p + ``damping`` ṗ of a soft law, a tie's if both are 0."""

    beam: LinearBody
    spring: LinearBody
    stiffness: float = 0.0  #: [N/m]
    damping: float = 0.0  #: [N·s/m]

    @property
    def soft(self) -> bool:
        """Return whether a soft law joins the ends."""
        return self.stiffness > 0.0 or self.damping > 0.0

    @property
    def contact_frequency(self) -> float:
        """Return √(k (1/m_tip + 1/m)) of a soft law [rad/s], 0 of a tie."""
        return sqrt(self.stiffness * (1.0 / self.beam.mass + 1.0 / self.spring.mass)) if self.soft else 0.0

    def split(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the states of the beam and of the spring."""
        return x[: self.beam.size], x[self.beam.size :]

    def penetration(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return y − u_tip [m] and its rate [m/s]."""
        a, s = self.split(x)
        return (
            self.spring.displacement(s) - self.beam.displacement(a),
            self.spring.velocity(s) - self.beam.velocity(a),
        )


def amplification(pair: LinearPair, scheme: str, degree: int, h: float) -> np.ndarray:
    """Return the matrix of one macro step of size ``h`` [s], for states (ξ, ξ̇) of the beam, then of the spring."""
    states = np.eye(pair.beam.size + pair.spring.size)
    if scheme in ("jacobi", "gauss_seidel"):
        return _exchanged(pair, scheme == "gauss_seidel", degree, h, states)
    return _solved(pair, scheme, degree, h, states)


def _solved(pair: LinearPair, scheme: str, degree: int, h: float, x: np.ndarray) -> np.ndarray:
    """Return states after a step by ``energy`` or ``hermite``, in closed form what the solvers of `coupling` find.

    Of a soft law C has the first Legendre coefficients of k p̃ + c p̃′. Of a tie, its limit for k → ∞, the numbers that
    p̃ is made of are zero.
    """
    n = degree + 1
    own, from_numbers, from_start = np.zeros((n, n)), np.eye(n), np.zeros(n)
    if pair.soft:
        law = pair.stiffness * np.eye(n, n + 1) + pair.damping * 2.0 / h * legendre.legder(np.eye(n + 1))
        own = np.eye(n)
        from_numbers = law @ np.transpose([penetration_series(0.0, unit) for unit in own.tolist()])
        from_start = law @ penetration_series(1.0, [0.0] * n)
    condition = SCHEMES[scheme][degree]
    numbers = from_numbers @ np.array([condition(Motion(*unit), h) for unit in np.eye(4)]).T
    beam, spring = Step(pair.beam, h), Step(pair.spring, h)
    (beam_states, beam_motions), (spring_states, spring_motions) = beam.response(degree), spring.response(degree)
    p, _ = pair.penetration(x)
    a, s = pair.split(x)
    (a, u), (s, y) = beam(a), spring(s)
    coefficients = np.linalg.solve(
        own + numbers @ (beam_motions + spring_motions), numbers @ (y - u) + np.outer(from_start, p)
    )
    return np.vstack([a + beam_states @ coefficients, s - spring_states @ coefficients])


def _exchanged(pair: LinearPair, sequential: bool, degree: int, h: float, x: np.ndarray) -> np.ndarray:
    """Return states after a step of a soft law by ``jacobi`` or ``gauss_seidel``, as `coupling.exchange.Exchange`."""
    beam, spring, k, c = Step(pair.beam, h), Step(pair.spring, h), pair.stiffness, pair.damping
    p, rate = pair.penetration(x)
    a, s = pair.split(x)
    at_start = k * p + c * rate
    forces = [at_start, k * rate][: degree + 1]
    end, u = beam(a, forces)
    if sequential:
        moved = pair.spring.displacement(s) + degree * h * pair.spring.velocity(s)
        at_end = k * (moved - u[0]) + c * (pair.spring.velocity(s) - u[1])
        forces = [at_start, (at_end - at_start) / h] if degree else [at_end]
    return np.vstack([end, spring(s, [-f for f in forces])[0]])


def spectral_radius(pair: LinearPair, scheme: str, degree: int, h: float) -> float:
    """Return the largest modulus of an eigenvalue of `amplification`."""
    units = np.concatenate(
        [np.repeat(1.0, len(v)) if rate else np.maximum(np.sqrt(np.abs(v)), 1.0 / h)
         for v in (pair.beam.omega2, pair.spring.omega2) for rate in (False, True)]
    )  # fmt: skip
    # In units of velocity throughout: eigenvalues stay, rounding does not see the frequencies.
    matrix = amplification(pair, scheme, degree, h) * units[:, None] / units
    return float(np.abs(np.linalg.eigvals(matrix)).max())
