"""The Timoshenko beam in space: P1/P1 elements on a uniform mesh, and the basis in which it is integrated.

Semi-discrete form (Ahn & Tate, eqs. (1)–(5), (59))::

    M q̈ + α_b K q̇ + K q = e C(t) + F,     q = (θ₁, u₁, …, θₙ, uₙ),     eᵀq = u(L)

The stiffness is also kept as K = BᵀB, where B holds √weight × strain at the integration points: frequencies are
taken as singular values of B, since eigenvalues of K carry an absolute error ε·ω_max² that spoils the low ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from ..scene import Beam
from ..trajectory import SHAPE_POINTS

#: Up to this many unknowns all modes are computed, also where few are wanted.
_DENSE_SIZE = 400


@dataclass(frozen=True)
class SemiDiscreteBeam:
    """Matrices of the clamped beam; N = 2n unknowns, node i has θᵢ at 2(i−1) and uᵢ at 2(i−1)+1.

    Attributes
    ----------
    M, K : (N, N) csc matrices
        Consistent mass [kg·m², kg] and stiffness [N·m, N, N/m].
    B : (rows, N) csr matrix
        Strain factor, K = BᵀB.
    uniform_load : (N,) array
        ∫ ψ dx in the deflection rows: the load vector of f_b = 1 N/m.
    hat_load : (N,) array
        ∫ ψₙ ψ dx in the deflection rows: the load vector of f_b = ψₙ(x) (Figures 3 and 5).
    slope_shape : (N,) array
        u = x, θ = 0.
    """

    n_elements: int
    length: float
    M: sp.csc_matrix
    K: sp.csc_matrix
    B: sp.csr_matrix
    uniform_load: np.ndarray
    hat_load: np.ndarray
    slope_shape: np.ndarray

    @property
    def size(self) -> int:
        return 2 * self.n_elements

    @property
    def tip(self) -> int:
        """Index of u(L)."""
        return self.size - 1

    @property
    def tip_vector(self) -> np.ndarray:
        """e, with eᵀq = u(L)."""
        e = np.zeros(self.size)
        e[self.tip] = 1.0
        return e

    def deflection_sampler(self) -> sp.csr_matrix:
        """(21, N) matrix: q → u at the fractions `SHAPE_POINTS` of the length (linear interpolation)."""
        position = SHAPE_POINTS * self.n_elements
        left = np.minimum(position.astype(int), self.n_elements - 1)
        weight = position - left
        sampler = sp.lil_matrix((len(SHAPE_POINTS), self.size))
        for row, (node, w) in enumerate(zip(left, weight, strict=True)):
            if node > 0:
                sampler[row, 2 * node - 1] = 1.0 - w
            sampler[row, 2 * node + 1] = w
        return sampler.tocsr()


def assemble(beam: Beam) -> SemiDiscreteBeam:
    """Assemble the beam of a scene, with full or one-point (``reduced_integration``) integration of the shear."""
    n = beam.n_elements
    h = beam.length / n
    bending = beam.young_modulus * beam.second_moment_of_area
    shear = beam.shear_coefficient * beam.area * beam.shear_modulus
    inertia = np.diag([beam.density * beam.second_moment_of_area, beam.density * beam.area])

    # Element unknowns (θ₀, u₀, θ₁, u₁).
    mass = np.kron(h / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]]), inertia)
    points = [0.5] if beam.reduced_integration else [0.5 - 0.5 / np.sqrt(3.0), 0.5 + 0.5 / np.sqrt(3.0)]
    strains = [np.sqrt(bending * h) * np.array([-1.0 / h, 0.0, 1.0 / h, 0.0])]
    strains += [np.sqrt(shear * h / len(points)) * np.array([-(1.0 - x), -1.0 / h, -x, 1.0 / h]) for x in points]
    strain = np.array(strains)

    nodes = np.arange(n)
    columns = 2 * nodes[:, None] + np.arange(4)  # with the clamped node's two unknowns still in front
    M = _scatter(np.repeat(columns[:, :, None], 4, axis=2), np.repeat(columns[:, None, :], 4, axis=1), mass, n)
    rows = len(strain) * nodes[:, None] + np.arange(len(strain))
    B = _scatter(np.repeat(rows[:, :, None], 4, axis=2), np.repeat(columns[:, None, :], len(strain), axis=1), strain, n)
    M = M[2:, 2:].tocsc()
    B = B[:, 2:].tocsr()

    uniform = np.zeros(2 * n)
    uniform[1::2] = h
    uniform[-1] = h / 2.0
    hat = np.zeros(2 * n)
    hat[-1] = h / 3.0
    if n > 1:
        hat[-3] = h / 6.0
    slope = np.zeros(2 * n)
    slope[1::2] = h * np.arange(1, n + 1)
    return SemiDiscreteBeam(n, beam.length, M, (B.T @ B).tocsc(), B, uniform, hat, slope)


def _scatter(rows: np.ndarray, columns: np.ndarray, element: np.ndarray, n: int) -> sp.csr_matrix:
    values = np.broadcast_to(element, (n, *element.shape))
    shape = (int(rows.max()) + 1, 2 * (n + 1))
    return sp.coo_matrix((values.ravel(), (rows.ravel(), columns.ravel())), shape=shape).tocsr()


@dataclass(frozen=True)
class ModalBeam:
    """The beam in M-orthonormal coordinates a with diagonal stiffness: ä + α_b ω² ȧ + ω² a = b C + f.

    Attributes
    ----------
    omega : (r,) array
        Natural frequencies of what is integrated, ascending [rad/s].
    tip : (r,) array
        b: u(L) = bᵀa.
    load : (r,) array
        f, of the scene's distributed loads.
    slope_shape : (r,) array
        Coordinates of u = x, θ = 0.
    sampler : (21, r) array
        a → deflection at `SHAPE_POINTS`.
    basis : (N, r) array
        q = basis @ a.
    """

    omega: np.ndarray
    tip: np.ndarray
    load: np.ndarray
    slope_shape: np.ndarray
    sampler: np.ndarray
    basis: np.ndarray
    alpha: float

    @property
    def inverse_tip_mass(self) -> float:
        """eᵀM⁻¹e [1/kg]: what a tip impulse of 1 N·s adds to the tip's velocity."""
        return float(self.tip @ self.tip)


def modal_beam(beam: Beam) -> ModalBeam:
    """Diagonalise the scene's beam: all modes, or the lowest ``n_modes`` with modal truncation augmentation.

    The augmented space is spanned by the lowest modes, the static shapes K⁻¹e and K⁻¹(uniform load), K⁻¹(hat load)
    if ``tip_load_coefficient`` is not zero, and u = x, θ = 0 if an initial slope is not zero; Rayleigh–Ritz in it.
    """
    discrete = assemble(beam)
    if 0 < beam.n_modes < discrete.size:
        space = _augmented_space(discrete, beam)
        omega, basis = _rayleigh_ritz(discrete, space)
    else:
        omega, basis = _all_modes(discrete)
    load = beam.distributed_load * discrete.uniform_load + beam.tip_load_coefficient * discrete.hat_load
    return ModalBeam(
        omega=omega,
        tip=basis[discrete.tip].copy(),
        load=basis.T @ load,
        slope_shape=basis.T @ (discrete.M @ discrete.slope_shape),
        sampler=discrete.deflection_sampler() @ basis,
        basis=basis,
        alpha=beam.alpha_b,
    )


def _all_modes(discrete: SemiDiscreteBeam) -> tuple[np.ndarray, np.ndarray]:
    """With M = LLᵀ, the modes are L⁻ᵀ × right singular vectors of B L⁻ᵀ."""
    L = np.linalg.cholesky(discrete.M.toarray())
    factor = scipy.linalg.solve_triangular(L, discrete.B.toarray().T, lower=True).T
    omega, vectors = _singular_modes(factor)
    return omega, scipy.linalg.solve_triangular(L.T, vectors, lower=False)


def _singular_modes(factor: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (ascending) and orthonormal modes of factorᵀfactor."""
    _, sigma, vt = scipy.linalg.svd(factor, full_matrices=factor.shape[0] < factor.shape[1])
    padded = np.zeros(factor.shape[1])
    padded[: len(sigma)] = sigma
    order = np.argsort(padded, kind="stable")
    return padded[order], vt[order].T


def _augmented_space(discrete: SemiDiscreteBeam, beam: Beam) -> np.ndarray:
    solve = spla.factorized(discrete.K)
    if discrete.size <= _DENSE_SIZE or 2 * beam.n_modes > discrete.size:
        modes = _all_modes(discrete)[1][:, : beam.n_modes]
    else:
        _, modes = spla.eigsh(discrete.K, k=beam.n_modes, M=discrete.M, sigma=0.0, v0=np.ones(discrete.size))
    extra = [solve(discrete.tip_vector), solve(discrete.uniform_load)]
    if beam.tip_load_coefficient != 0.0:
        extra.append(solve(discrete.hat_load))
    if beam.initial_deflection_slope != 0.0 or beam.initial_velocity_slope != 0.0:
        extra.append(discrete.slope_shape)
    space = [column / np.sqrt(column @ (discrete.M @ column)) for column in modes.T]
    for shape in extra:
        residual = shape / np.sqrt(shape @ (discrete.M @ shape))
        W = np.array(space).T
        shares = []
        for _ in range(3):  # repeated, because one projection leaves cancellation errors
            residual = residual - W @ (W.T @ (discrete.M @ residual))
            shares.append(np.sqrt(residual @ (discrete.M @ residual)))
            residual /= shares[-1]
        if shares[0] > 1e-10:  # otherwise the shape already lies in the space
            space.append(residual)
    return np.asarray(np.array(space).T)


def _rayleigh_ritz(discrete: SemiDiscreteBeam, space: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    gram = space.T @ (discrete.M @ space)
    L = np.linalg.cholesky(gram)
    orthonormal = scipy.linalg.solve_triangular(L, space.T, lower=True).T
    omega, vectors = _singular_modes(discrete.B @ orthonormal)
    return omega, orthonormal @ vectors
