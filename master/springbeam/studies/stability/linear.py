"""The coupled step of a linear pair as a matrix: exact bodies, any scheme, its spectral radius.

Bodies are oscillators ξ̈ + c ξ̇ + ω² ξ = b F with the interface displacement w = bᵀξ. With S the response to a unit
impulse and S_j its j-fold integral (S₋₁ = Ṡ), a step of size h under F(τ) = Σ F_j τʲ/j! is exact::

    ξ(h) = (Ṡ + cS) ξ₀ + S ξ̇₀ + b Σ F_j S_{j+1}      ∫ξ, ∫∫ξ: each index one, two higher
    ξ̇(h) = −ω²S ξ₀ + Ṡ ξ̇₀ + b Σ F_j S_j

Nothing here uses the bodies or the solvers of a run, except the conditions that define a scheme.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial, inf, sqrt

import numpy as np
from numpy.polynomial import legendre
from scipy.linalg import block_diag

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
    def mass(self) -> float:
        """What an impulse at the interface meets [kg]; ∞ of a wall, which has no modes."""
        mobility = float(self.b @ self.b)
        return 1.0 / mobility if mobility > 0.0 else inf

    def step(self, h: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return the exact step over ``h`` [s] as matrices.

        The first two give the state (ξ, ξ̇) at its end from that at its start, (2r, 2r), and from F, Ḟ, F̈ there,
        (2r, 3); the others give the `Motion` at its end from these, (4, 2r) and (4, 3).
        """
        S = impulse_integrals(self.omega2, self.c, h)
        parts = [(S[k] + self.c * S[k + 1], S[k + 1], S[k + 2 : k + 5]) for k in (0, 1, 2)]  # of ξ, ∫ξ, ∫∫ξ
        parts.insert(1, (-self.omega2 * S[1], S[0], S[1:4]))  # of ξ̇
        of_state = [np.hstack([np.diag(place), np.diag(rate)]) for place, rate, _ in parts]
        of_force = [(self.b * forced).T for _, _, forced in parts]
        motion, pushed = (np.array([self.b @ row for row in rows]) for rows in (of_state, of_force))
        return np.vstack(of_state[:2]), np.vstack(of_force[:2]), motion, pushed


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


def amplification(pair: LinearPair, scheme: str, degree: int, h: float) -> np.ndarray:
    """Return the matrix of one macro step of size ``h`` [s], for states (ξ, ξ̇) of the beam, then of the spring."""
    (A, of_C, u, u_of_C), (B, of_force, y, y_of_force) = pair.beam.step(h), pair.spring.step(h)
    ends = block_diag(*(np.kron(np.eye(2), body.b) for body in (pair.beam, pair.spring)))  # u, v, y, z at the start
    p, rate = ends[2:] - ends[:2]
    moved = np.hstack([-u, y])  # what C = 0 does to the `Motion` of y − u
    exchanged = scheme in ("jacobi", "gauss_seidel")
    C = other = np.zeros((3, len(p)))  # C, Ċ, C̈ at the start, on the beam and on the spring
    if exchanged:
        C = other = np.array([pair.stiffness * p + pair.damping * rate, degree * pair.stiffness * rate, 0.0 * p])
    if scheme == "gauss_seidel":  # as `coupling.exchange.Exchange`
        tip = np.hstack([u, 0.0 * y]) + u_of_C @ C
        expected = ends[2] + degree * h * ends[3]
        at_end = pair.stiffness * (expected - tip[0]) + pair.damping * (ends[3] - tip[1])
        other = np.array([C[0], (at_end - C[0]) / h, 0.0 * p] if degree else [at_end, 0.0 * p, 0.0 * p])
    if not exchanged:
        C = other = _solved(pair, scheme, degree, h, moved, u_of_C + y_of_force, p)
    return np.asarray(block_diag(A, B) + np.vstack([of_C @ C, -of_force @ other]))


def _solved(
    pair: LinearPair, scheme: str, degree: int, h: float, moved: np.ndarray, by_force: np.ndarray, p: np.ndarray
) -> np.ndarray:
    """Return C, Ċ, C̈ of a step by ``energy`` or ``hermite``, in closed form what the solvers of `coupling` find.

    Of a soft law C has the first Legendre coefficients of k p̃ + c p̃′. Of a tie, its limit for k → ∞, the numbers that
    p̃ is made of are zero. ``moved`` less ``by_force`` @ (C, Ċ, C̈) is the `Motion` of y − u, ``p`` that at the start.
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
    derivatives = np.transpose([force.derivatives(row, h) for row in np.eye(n).tolist()])
    coefficients = np.linalg.solve(own + numbers @ by_force @ derivatives, numbers @ moved + np.outer(from_start, p))
    return np.asarray(derivatives @ coefficients)


def spectral_radius(pair: LinearPair, scheme: str, degree: int, h: float) -> float:
    """Return the largest modulus of an eigenvalue of `amplification`."""
    units = np.concatenate(
        [np.repeat(1.0, len(v)) if rate else np.maximum(np.sqrt(np.abs(v)), 1.0 / h)
         for v in (pair.beam.omega2, pair.spring.omega2) for rate in (False, True)]
    )  # fmt: skip
    # In units of velocity throughout: eigenvalues stay, rounding does not see the frequencies.
    matrix = amplification(pair, scheme, degree, h) * units[:, None] / units
    return float(np.abs(np.linalg.eigvals(matrix)).max())
