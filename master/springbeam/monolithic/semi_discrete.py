"""The Timoshenko beam in space: elements of degree p on a uniform mesh, and the basis in which it is integrated.

Semi-discrete form (Ahn & Tate, eqs. (1)–(5), (59); theirs is p = 1)::

    M q̈ + α_b K q̇ + K q = e C(t) + F,     q = (θ₁, u₁, …, θ_N, u_N),     eᵀq = u(L)

u and θ are Lagrange polynomials on the Gauss–Lobatto nodes of each element, so q holds their values there. The
stiffness is also kept as K = BᵀB, where B holds √weight × strain at the Gauss points: frequencies are taken as
singular values of B, since eigenvalues of K carry an absolute error ε·ω_max² that spoils the low ones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial import legendre

from ..scene import Beam, Load, Scene
from ..scene.statics import SHAPE_POINTS

if TYPE_CHECKING:
    import scipy.sparse as sp

#: Up to this many unknowns matrices are dense, and all modes are computed, also where few are wanted.
_DENSE_SIZE = 400
#: What lies in a space but for this share adds nothing to it.
_DEPENDENT = 1e-10


@dataclass(frozen=True)
class SemiDiscreteBeam:
    """Matrices of the clamped beam; 2N unknowns, N = n p, node i has θᵢ at 2(i−1) and uᵢ at 2(i−1)+1.

    Attributes
    ----------
    n_elements, degree : int
        n and p.
    length : float
        L [m].
    M, K : (2N, 2N) matrices
        Mass [kg·m², kg], consistent or averaged, and stiffness [N·m, N, N/m]; sparse above `_DENSE_SIZE`, as is B.
    B : (rows, 2N) matrix
        Strain factor, K = BᵀB.
    slope_shape : (2N,) array
        u = x, θ = 0.
    """

    n_elements: int
    degree: int
    length: float
    M: np.ndarray | sp.csr_matrix
    K: np.ndarray | sp.csr_matrix
    B: np.ndarray | sp.csr_matrix
    slope_shape: np.ndarray

    @property
    def size(self) -> int:
        return 2 * self.n_elements * self.degree

    @property
    def tip(self) -> int:
        """Index of u(L)."""
        return self.size - 1

    @property
    def tip_vector(self) -> np.ndarray:
        """e, with eᵀq = u(L)."""
        return np.eye(1, self.size, self.tip)[0]

    def interpolated(
        self, fractions: np.ndarray = SHAPE_POINTS, of_u: int = 1, *, slopes: bool = False
    ) -> np.ndarray | sp.csr_matrix:
        """Return the (k, 2N) matrix that takes q to u or, with ``of_u`` = 0, θ at k ``fractions`` of the length.

        Or to their slopes [1/m]. Where two elements meet they are those of the one towards the tip, of whose error
        they have the order.
        """
        position = fractions * self.n_elements
        element = np.minimum(position.astype(int), self.n_elements - 1)
        nodes = element[:, None] * self.degree + np.arange(self.degree + 1)
        values = _lagrange(self.degree, position - element)[slopes] * (self.n_elements / self.length) ** slopes
        rows = np.arange(len(fractions))[:, None]
        return _scatter(rows, 2 * nodes + of_u, values[:, None, :], self.size + 2)[:, 2:]

    def nodal(self, x: np.ndarray, forces: np.ndarray) -> np.ndarray:
        """Return the load vector, (2N,), of ``forces`` [N] at the places ``x`` [m] of the beam, both (k,)."""
        return self.interpolated(x / self.length).T @ forces


def inner_forces(beam: Beam, mesh: SemiDiscreteBeam, q: np.ndarray) -> np.ndarray:
    """Return EI θ_x [N·m] and KAG (u_x − θ) [N] at `SHAPE_POINTS` of q + α_b q̇, (2N, k): shape (42, k)."""
    EI = beam.young_modulus * beam.second_moment_of_area
    KAG = beam.shear_coefficient * beam.area * beam.shear_modulus
    bent, slid = (mesh.interpolated(SHAPE_POINTS, of_u, slopes=True) @ q for of_u in (0, 1))
    return np.vstack([EI * bent, KAG * (slid - mesh.interpolated(SHAPE_POINTS, 0) @ q)])


def _lagrange(degree: int, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return values and slopes at ``x`` in [0, 1] of the Lagrange polynomials on the p + 1 Gauss–Lobatto nodes.

    Shapes (len(x), p + 1). The nodes are the ends and the zeros of P_p'.
    """
    nodes = _lobatto(degree)
    to_legendre = np.linalg.inv(legendre.legvander(2.0 * nodes - 1.0, degree))
    values = legendre.legvander(2.0 * x - 1.0, degree) @ to_legendre
    slopes = legendre.legval(2.0 * x - 1.0, 2.0 * legendre.legder(to_legendre)).T
    return values, slopes


def _lobatto(degree: int) -> np.ndarray:
    """Return the p + 1 Gauss–Lobatto nodes in [0, 1]."""
    inner = legendre.legroots(legendre.legder(np.eye(degree + 1)[degree]))  # of P_p'
    return np.concatenate([[0.0], 0.5 + 0.5 * inner, [1.0]])


def _gauss(points: int) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes and weights of the Gauss–Legendre rule on [0, 1]."""
    nodes, weights = legendre.leggauss(points)
    return 0.5 + 0.5 * nodes, 0.5 * weights


def assemble(beam: Beam) -> SemiDiscreteBeam:
    """Assemble the beam of a scene.

    With ``reduced_integration`` the shear takes p Gauss points instead of p + 1.
    """
    n = beam.n_elements
    p = beam.element_degree
    h = beam.length / n
    bending = beam.young_modulus * beam.second_moment_of_area
    shear = beam.shear_coefficient * beam.area * beam.shear_modulus
    inertia = np.diag([beam.density * beam.second_moment_of_area, beam.density * beam.area])

    # Element unknowns (θ₀, u₀, …, θ_p, u_p). p + 1 points integrate squares of degree p exactly.
    x, w = _gauss(p + 1)
    values, _ = _lagrange(p, x)
    element_mass = (values.T * w) @ values
    if beam.mass_matrix == "averaged":
        # Ainsworth & Wajid (2010): Gauss–Lobatto on the nodes lumps the mass, row by row, and errs −1/p times as much.
        element_mass = (element_mass + p * np.diag(element_mass.sum(axis=1))) / (p + 1)
    mass = np.kron(h * element_mass, inertia)
    x_bend, w_bend = _gauss(p)
    _, slopes = _lagrange(p, x_bend)
    bend = np.sqrt(bending / h * w_bend)[:, None] * np.kron(slopes, [1.0, 0.0])
    x_shear, w_shear = _gauss(p if beam.reduced_integration else p + 1)
    at, slopes = _lagrange(p, x_shear)
    slide = np.sqrt(shear * h * w_shear)[:, None] * (np.kron(slopes / h, [0.0, 1.0]) - np.kron(at, [1.0, 0.0]))
    strain = np.concatenate([bend, slide])

    elements = np.arange(n)
    columns = 2 * p * elements[:, None] + np.arange(2 * (p + 1))  # with the clamped node's two unknowns still in front
    M = _scatter(columns, columns, mass, 2 * (n * p + 1))
    B = _scatter(len(strain) * elements[:, None] + np.arange(len(strain)), columns, strain, 2 * (n * p + 1))
    B = B[:, 2:]

    slope = np.zeros(2 * (n * p + 1))
    slope[columns[:, 1::2]] = h * (elements[:, None] + _lobatto(p))
    return SemiDiscreteBeam(n, p, beam.length, M[2:, 2:], B.T @ B, B, slope[2:])


def points(beam: Beam) -> tuple[np.ndarray, np.ndarray]:
    """Return places x [m] along the beam, and how much of its length [m] each stands for: a Gauss rule an element."""
    x, w = _gauss(beam.element_degree + 3)
    h = beam.length / beam.n_elements
    return h * (np.arange(beam.n_elements)[:, None] + x).ravel(), h * np.tile(w, beam.n_elements)


def constant_forces(beam: Beam) -> tuple[np.ndarray, np.ndarray]:
    """Return the loads that do not vary as places [m] and forces [N]; the tip's hat function is that of Figure 3."""
    x, dx = points(beam)
    hat = np.maximum(0.0, 1.0 - beam.n_elements * (1.0 - x / beam.length))
    return x, (beam.distributed_load + beam.tip_load_coefficient * hat) * dx


def unit_forces(beam: Beam, load: Load) -> tuple[np.ndarray, np.ndarray]:
    """Return what a unit of ``load`` does to the beam as places [m] and forces [N]; none if it acts on the spring."""
    if load.on == "spring":
        return np.zeros(0), np.zeros(0)
    if load.on == "tip" or load.at is not None:
        return np.array([(load.at or 1.0) * beam.length]), np.ones(1)
    x, dx = points(beam)
    shape = (-beam.density * beam.area,) if load.on == "base" else load.shape or (1.0,)
    return x, np.polynomial.polynomial.polyval(x / beam.length, shape) * dx


def _scatter(rows: np.ndarray, columns: np.ndarray, elements: np.ndarray, width: int) -> np.ndarray | sp.csr_matrix:
    """Return the sum of ``elements`` (n, r, c), or one for all, at their ``rows`` (n, r) and ``columns`` (n, c)."""
    i, j, values = np.broadcast_arrays(rows[:, :, None], columns[:, None, :], elements)
    shape = (int(rows.max()) + 1, width)
    if width <= _DENSE_SIZE + 2:
        matrix = np.zeros(shape)
        np.add.at(matrix, (i, j), values)
        return matrix
    from scipy.sparse import coo_matrix  # a third of a second to load, as all that is sparse: only for fine meshes

    return coo_matrix((values.ravel(), (i.ravel(), j.ravel())), shape=shape).tocsr()


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
    inner : (42, r) array
        a + α_b ȧ → bending moments and shear forces there.
    basis : (N, r) array
        q = basis @ a.
    """

    omega: np.ndarray
    tip: np.ndarray
    load: np.ndarray
    slope_shape: np.ndarray
    sampler: np.ndarray
    inner: np.ndarray
    basis: np.ndarray
    alpha: float

    @property
    def inverse_tip_mass(self) -> float:
        """eᵀM⁻¹e [1/kg]: what a tip impulse of 1 N·s adds to the tip's velocity."""
        return float(self.tip @ self.tip)


@lru_cache(maxsize=2)
def modal_beam(beam: Beam) -> ModalBeam:
    """Diagonalise the scene's beam: all modes, or the lowest ``n_modes`` with modal truncation augmentation.

    The augmented space is spanned by the lowest modes, the static shapes K⁻¹e and K⁻¹(uniform load), and the start
    u = x, θ = 0, whatever the loads and starts are; Rayleigh–Ritz in it.
    """
    discrete = assemble(beam)
    omega, basis = _rayleigh_ritz(
        discrete, _augmented_space(discrete, beam) if beam.modes_kept < discrete.size else None
    )
    return ModalBeam(
        omega=omega,
        tip=basis[discrete.tip].copy(),
        load=basis.T @ discrete.nodal(*constant_forces(beam)),
        slope_shape=basis.T @ (discrete.M @ discrete.slope_shape),
        sampler=discrete.interpolated() @ basis,
        inner=inner_forces(beam, discrete, basis),
        basis=basis,
        alpha=beam.alpha_b,
    )


def singular_modes(factor: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return ascending frequencies and orthonormal modes of factorᵀfactor; factor has no fewer rows than columns."""
    _, sigma, vt = np.linalg.svd(factor, full_matrices=False)
    return sigma[::-1], vt[::-1].T


def _augmented_space(discrete: SemiDiscreteBeam, beam: Beam) -> np.ndarray:
    """Return the lowest modes, the start and the static shapes, (2N, n_modes + 3).

    Sorted by how slowly they converge in modes: what depends on those before adds nothing to those after it, either.
    """
    dense = isinstance(discrete.K, np.ndarray)
    # Without units of length and time, in unknowns (L θ, u): no wanted eigenvalue of K⁻¹M far below 1.
    unit = np.where(np.arange(discrete.size) % 2, 1.0, 1.0 / discrete.length)[:, None]
    loads = unit * np.column_stack([discrete.tip_vector, discrete.nodal(*points(beam))])
    if dense:
        static = np.linalg.solve(unit * discrete.K * unit.T, loads)
    else:
        import scipy.sparse.linalg as spla
        from scipy.sparse import diags

        D = diags(unit[:, 0])
        K = (D @ discrete.K @ D).tocsc()
        static = spla.splu(K).solve(loads)
    if dense or 2 * beam.n_modes > discrete.size:
        modes = _rayleigh_ritz(discrete)[1][:, : beam.n_modes]
    else:
        M = (D @ discrete.M @ D).tocsc()
        fastest = K.diagonal().max() / M.diagonal().min()  # rad²/s²
        modes = unit * spla.eigsh(K / fastest, k=beam.n_modes, M=M, sigma=0.0, v0=np.ones(discrete.size))[1]
    return np.column_stack([modes, discrete.slope_shape, unit * static])


def _rayleigh_ritz(discrete: SemiDiscreteBeam, space: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies and modes in a space, given by its columns, or of all; columns that depend on others count
    once."""
    times, solve = _mass_root(discrete)
    within = np.eye(discrete.size)
    if space is not None:
        columns = times(space)
        q, r = np.linalg.qr(columns / np.linalg.norm(columns, axis=0))
        within = q[:, np.abs(np.diag(r)) > _DEPENDENT]
    orthonormal = solve(within)
    omega, vectors = singular_modes(discrete.B @ orthonormal)
    return omega, orthonormal @ vectors


def _mass_root(
    discrete: SemiDiscreteBeam,
) -> tuple[Callable[[np.ndarray], np.ndarray], Callable[[np.ndarray], np.ndarray]]:
    """Return functions of U and U⁻¹ on columns, M = UᵀU: lengths and angles of Uq are those of the kinetic energy."""
    M = discrete.M
    if isinstance(M, np.ndarray):
        U = np.linalg.cholesky(M).T
        return partial(np.matmul, U), partial(np.linalg.solve, U)
    from scipy.linalg import cholesky_banded, solve_banded
    from scipy.sparse import diags

    band = 2 * discrete.degree + 1
    bands = cholesky_banded([np.pad(M.diagonal(k), (k, 0)) for k in range(band, -1, -1)])
    upper = diags([bands[band - k, k:] for k in range(band + 1)], range(band + 1))
    return upper.dot, partial(solve_banded, (0, band), bands)


#: Angle [rad] that a load turns in a step at most.
_TURN = 1.0


class ModalLoads:
    """Patterns and values of the loads.

    Attributes
    ----------
    patterns : (loads, r) array
        Modal forces of a unit of each load.
    on_spring : (loads,) array
        Forces on the spring top of a unit of each load [N].
    kinks : list of float
        When a load jumps or bends [s], ascending.
    longest_step : float
        What resolves the loads [s].
    """

    def __init__(self, scene: Scene, beam: ModalBeam | None) -> None:
        self._loads = scene.loads
        modes = 0 if beam is None else len(beam.omega)
        self.patterns = np.zeros((len(scene.loads), modes))
        self.on_spring = np.zeros(len(scene.loads))
        mass = 0.0 if scene.spring is None else scene.spring.mass
        for i, load in enumerate(scene.loads):
            if beam is not None and scene.beam is not None and load.on != "spring":
                self.patterns[i] = beam.basis.T @ assemble(scene.beam).nodal(*unit_forces(scene.beam, load))
            if load.on in ("spring", "base"):
                self.on_spring[i] = 1.0 if load.on == "spring" else -mass
        self.kinks = sorted({time for load in scene.loads for time in load.edges})
        rates = [load.rate if load.wave is None else load.wave[0] for load in scene.loads]
        self.longest_step = min((_TURN / rate for rate in rates if rate > 0.0), default=np.inf)
        self._until = np.inf

    def __len__(self) -> int:
        return len(self._loads)

    def smooth_from(self, time: float) -> float:
        """Let `values` be smooth up to when a load jumps or bends after ``time`` [s]; return that, or infinity [s]."""
        kink = next((kink for kink in self.kinks if kink > time), np.inf)
        self._until = np.nextafter(kink, 0.0)
        return kink

    def values(self, times: np.ndarray) -> np.ndarray:
        """Return the loads, each in its unit, at ``times`` [s] of shape (...), shape (..., loads)."""
        at = np.minimum(times, self._until)
        values = [load.value(at) for load in self._loads]
        return np.stack(values, axis=-1) if values else np.zeros((*np.shape(times), 0))
