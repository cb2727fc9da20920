"""Predict stability and cost of a scene before a run.

The scene is linearised where it is stiffest: the hardening spring at the largest deflection and the contact law at the
largest penetration that the energy at first contact allows; a softening spring at rest.

The coupled step of a linear pair by an exchange (``jacobi``, ``gauss_seidel``) as a matrix: exact bodies, its spectral
radius. The scheme ``energy`` creates no energy at any H.

Bodies are oscillators ξ̈ + c ξ̇ + ω² ξ = b F with the interface displacement w = bᵀξ. With S the response to a unit
impulse and S_j its j-fold integral (S₋₁ = Ṡ), a step of size h under F(τ) = Σ F_j τʲ/j! is exact::

    ξ(h) = (Ṡ + cS) ξ₀ + S ξ̇₀ + b Σ F_j S_{j+1}      ∫ξ, ∫∫ξ: each index one, two higher
    ξ̇(h) = −ω²S ξ₀ + Ṡ ξ̇₀ + b Σ F_j S_j

Nothing here uses the bodies or the solvers of a run, but `cost_of`, which times them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from ..monolithic.semi_discrete import ModalBeam, modal_beam
from ..run.companion import LONGER
from ..run.outcome import RunStopped
from ..run.runner import Simulation
from ..scene import Beam, Scene, with_changes
from ..scene.plausibility import warnings_of
from ..scene.statics import locking, lowest_frequency, shear_stiffness, tip_compliance, tip_inertia
from .linearised import closing_speed, contact_energy, depth, spring_frequency, spring_stiffness

#: A coupling is called unstable where its spectral radius exceeds 1 by more than this: e-fold growth in 1000 steps.
THRESHOLD = 1e-3
#: Beams with more modes are predicted with so many.
MOST_MODES = 128
#: Modes with less than this share of 1/m_tip are left out: the tip neither excites nor shows them.
_UNMOVED = 1e-12
#: ωH up to which a mode is slow: 2π steps a period.
_SLOW = 1.0
#: Steps that are made to see how long one takes.
_TIMED = 64
#: The search for a critical macro step begins here, in units of 1/(rate of the contact).
_SEARCH = 1e-2


def predict(scene: Scene) -> dict[str, Any]:
    """Predict the coupling of ``scene`` (no FMU is loaded).

    Returns
    -------
    dict
        ``None`` if the scene lacks a needed body or key:

        * ``estimates``: by hand calculation, see `_estimates`; ``frequencies``: the lowest three of the beam's mesh
          [Hz];
        * ``macro_step``: H [s];
        * ``omega_1``, ``omega_max``: lowest and highest frequency kept of the beam; ``spring_frequency`` of the
          linearised spring, 0 where it does not oscillate; ``contact_frequency`` of tip and spring top on the
          linearised contact law [rad/s];
        * ``tip_mass`` [kg]; ``impedance`` Z = √(KAG ρA) [N·s/m];
        * ``modes`` of the beam, ``slow_modes`` among them, with ωH ≤ 1, and ``static_shapes``, which are
          kept in addition if not all modes are;
        * ``exchange``: for a scheme that can be unstable, ``scheme``, ``degree``, ``spectral_radius`` at H,
          ``critical_step``, the smallest unstable H [s], and ``threshold`` of the spectral radius above 1, from which
          on it is unstable;
        * ``notes``.
    """
    H = scene.coupling.H
    beam = scene.beam
    modal = None
    pair = None
    names = ("omega_1", "omega_max", "tip_mass", "slow_modes", "modes", "static_shapes", "contact_frequency")
    prediction: dict[str, Any] = {
        "estimates": _estimates(scene),
        "frequencies": [],
        "macro_step": H,
        "spring_frequency": None if scene.spring is None else spring_frequency(scene),
        "impedance": None if beam is None else math.sqrt(shear_stiffness(beam) * beam.density * beam.area),
        "exchange": None,
    } | dict.fromkeys(names)
    notes = warnings_of(scene)
    if scene.coupled and (doubted := scene.contact.doubted(closing_speed(scene))) is not None:
        notes.append(doubted)
    notes += [f"[{table}] is not our own body: its frequencies are not known beforehand" for table in scene.partners]
    if scene.accuracy is not None:
        notes.append(f"accuracy = {scene.accuracy:g} picks scheme and macro step by itself; this is about those given")
    if scene.massless:
        notes.append("a quasi-static beam has no inertia and no step of its own: nothing to predict")
    elif beam is not None:
        reduced = _reduced(beam)
        modal = modal_beam(reduced)
        kept = reduced.modes_kept
        slow = int(np.sum(modal.omega[:kept] * H <= _SLOW))
        frequencies = modal.omega / (2.0 * math.pi)
        ends = (float(modal.omega[0]), float(modal.omega[-1]), 1.0 / modal.inverse_tip_mass)
        prediction |= dict(zip(names, (*ends, slow, kept, len(modal.omega) - kept), strict=False))
        prediction["frequencies"] = frequencies[:3].tolist()
        if reduced is not beam:
            notes.append(f"predicted with the lowest {MOST_MODES} modes of the beam")
        if beam.integrator == "midpoint":
            notes.append("predicted for exact modes; the midpoint rule adds no energy of its own")
    if modal is not None:
        pair = linear_pair(scene, modal)
    if pair is not None:
        prediction["contact_frequency"] = pair.contact_frequency if pair.soft else None
        scheme = scene.coupling.scheme
        degree = scene.degree
        # The scheme energy is stable at any H.
        if scene.coupling.exchanges:
            prediction["exchange"] = {
                "scheme": scheme,
                "degree": degree,
                "spectral_radius": spectral_radius(pair, scheme, degree, H),
                "critical_step": critical_step(pair, scheme, degree),
                "threshold": THRESHOLD,
            }
    elif not notes:
        notes.append("nothing to couple: a scene with one body and no stop under its tip")
    return prediction | {"notes": notes}


def cost_of(scene: Scene) -> dict[str, float | None]:
    """Return how many ``macro_steps`` a run of ``scene`` takes, and about how many ``seconds`` with its companion.

    Some steps are made, and timed; ``None`` where they fail. Raises the errors of `springbeam.Simulation`.
    """
    scene = with_changes(scene, accuracy=None)
    number = math.ceil(scene.duration / scene.coupling.H)
    with Simulation(scene) as simulation:
        times = [perf_counter()]
        try:
            while len(times) <= _TIMED and simulation.step():
                times.append(perf_counter())
        except RunStopped:
            return {"macro_steps": number, "seconds": None}
    a_step = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    return {"macro_steps": number, "seconds": (1.0 + 1.0 / LONGER) * number * a_step}


def _estimates(scene: Scene) -> dict[str, float | None]:
    """Return properties of ``scene`` by hand calculation; ``None`` if it has no such property.

    ``frequency`` is the lowest of the beam, tip free, without a mesh [Hz], ``tip_stiffness`` static, 1/(L³/3EI + L/KAG)
    [N/m], ``locking`` the static stiffness of the mesh over that of the beam; ``contact_time`` is that of the first
    contact of an undeformed approach [s], ``contact_duration`` half a period of spring and beam together [s].
    """
    beam = scene.beam
    spring = scene.spring
    duration = None
    if beam is not None and spring is not None and not scene.contact.lasting:
        stiffness = spring.linear_stiffness + 1.0 / tip_compliance(beam)
        if stiffness > 0.0:
            duration = math.pi * math.sqrt((spring.mass + tip_inertia(beam)) / stiffness)
    return {
        "beam_mass": None if beam is None else beam.density * beam.area * beam.length,
        "frequency": None if beam is None or scene.massless else lowest_frequency(beam) / (2.0 * math.pi),
        "tip_stiffness": None if beam is None else 1.0 / tip_compliance(beam),
        "locking": None if beam is None else locking(beam),
        "spring_mass": None if spring is None else spring.mass,
        "spring_stiffness": None if spring is None else spring.linear_stiffness,
        "contact_time": scene.contact_time,
        "contact_duration": duration,
    }


def _reduced(beam: Beam) -> Beam:
    fewer = {"n_modes": MOST_MODES, "integrator": "modal"}
    return beam if beam.modes_kept <= MOST_MODES else beam.model_copy(update=fewer)


# -- the linearised scene -------------------------------------------------------------------------------------------


def linear_pair(scene: Scene, modal: ModalBeam) -> LinearPair | None:
    """Return the beam's modes and the spring with k1 + 3 k2 (y − y₀)² at its stiffest; without one, tip and foundation.

    ``None`` where the scene joins no two bodies.
    """
    if scene.spring is None and scene.stop is None:
        return None
    moved = modal.tip**2 > _UNMOVED * modal.inverse_tip_mass
    omega2 = modal.omega[moved] ** 2
    beam = LinearBody(omega2, modal.alpha * omega2, modal.tip[moved])
    low = LinearBody(np.zeros(0), np.zeros(0), np.zeros(0))
    if scene.spring is not None:
        m = scene.spring.mass
        low = LinearBody(
            np.array([spring_stiffness(scene) / m]), np.array([scene.spring.damping / m]), np.array([m**-0.5])
        )
    law = scene.soft_law
    if law is None:
        return LinearPair(beam, low)
    depth_reached = depth(law, contact_energy(scene)) if law.one_sided else 0.0
    return LinearPair(beam, low, law.slope(depth_reached), law.resistance(depth_reached, 0.0)[2] if law.damped else 0.0)


# -- critical steps -------------------------------------------------------------------------------------------------


def critical_step(pair: LinearPair, scheme: str, degree: int, threshold: float = THRESHOLD) -> float | None:
    """Return the smallest H [s] with a spectral radius above 1 + ``threshold``, to 1e-3 of itself; None without one.

    For an exchange, which adds to a step about (r H)², r the rate of the contact law on both ends. The search begins
    where that is 1e-4, and proceeds by factors of 2 until the slowest mode turns 10 rad.
    """
    rates = np.sqrt(np.abs(np.concatenate([pair.beam.omega2, pair.spring.omega2])))
    slowest = float(rates[rates > 0.0].min())

    def excess(size: float) -> float:
        return spectral_radius(pair, scheme, degree, size) - 1.0 - threshold

    H = _SEARCH / pair.contact_rate
    while excess(H) > 0.0:
        H *= 0.5
    while H * slowest <= 10.0:
        if excess(2.0 * H) > 0.0:
            stable = H
            unstable = 2.0 * H
            while unstable - stable > 1e-3 * stable:
                middle = 0.5 * (stable + unstable)
                stable, unstable = (stable, middle) if excess(middle) > 0.0 else (middle, unstable)
            return unstable
        H *= 2.0
    return None


# -- the coupled step as a matrix -------------------------------------------------------------------------------------


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
    from ..monolithic.oscillators import GAUSS, Oscillators  # a second to load: only for exchanges

    at_end = Oscillators(omega2, c).weights(h, slice(-1, None))
    forces = [(h * GAUSS.nodes) ** j / math.factorial(j) for j in range(5)]
    return np.vstack([at_end.start[1, 1], at_end.start[0, 1], forces @ at_end.force[0, 0]])


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
        """Mass that an impulse at the interface moves [kg]; ∞ for a wall, which has no modes."""
        mobility = float(self.b @ self.b)
        return 1.0 / mobility if mobility > 0.0 else math.inf

    def step(self, h: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return the exact step over ``h`` [s] as matrices.

        The first two give the state (ξ, ξ̇) at its end from that at its start, (2r, 2r), and from F, Ḟ, F̈ there,
        (2r, 3); the others give displacement and velocity of the interface at its end from these, (2, 2r) and (2, 3).
        """
        S = impulse_integrals(self.omega2, self.c, h)
        parts = [(S[0] + self.c * S[1], S[1], S[2:5]), (-self.omega2 * S[1], S[0], S[1:4])]  # of ξ, of ξ̇
        of_state = [np.hstack([np.diag(place), np.diag(rate)]) for place, rate, _ in parts]
        of_force = [(self.b * forced).T for _, _, forced in parts]
        motion, pushed = (np.array([self.b @ row for row in rows]) for rows in (of_state, of_force))
        return np.vstack(of_state), np.vstack(of_force), motion, pushed


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
        """Return √(k (1/m_tip + 1/m)) of a soft law [rad/s], 0 for a tie."""
        return math.sqrt(self.stiffness * (1.0 / self.beam.mass + 1.0 / self.spring.mass)) if self.soft else 0.0

    @property
    def contact_rate(self) -> float:
        """Return the larger of the frequency and the damping rate of a soft law, c (1/m_tip + 1/m) [1/s]."""
        return max(self.contact_frequency, self.damping * (1.0 / self.beam.mass + 1.0 / self.spring.mass))


def amplification(pair: LinearPair, scheme: str, degree: int, h: float) -> np.ndarray:
    """Return the matrix of one macro step of size ``h`` [s], for states (ξ, ξ̇) of the beam, then of the spring.

    For an exchange, which has a soft law.
    """
    (A, of_C, u, u_of_C) = pair.beam.step(h)
    (B, of_force, y, _) = pair.spring.step(h)
    ends = block_diag(*(np.kron(np.eye(2), body.b) for body in (pair.beam, pair.spring)))  # u, v, y, z at the start
    p, rate = ends[2:] - ends[:2]
    # C, Ċ, C̈ at the start, on the beam and on the spring
    C = other = np.array([pair.stiffness * p + pair.damping * rate, degree * pair.stiffness * rate, 0.0 * p])
    if scheme == "gauss_seidel":  # as `coupling.exchange.Exchange`
        tip = np.hstack([u, 0.0 * y]) + u_of_C @ C
        expected = ends[2] + degree * h * ends[3]
        at_end = pair.stiffness * (expected - tip[0]) + pair.damping * (ends[3] - tip[1])
        other = np.array([C[0], (at_end - C[0]) / h, 0.0 * p] if degree else [at_end, 0.0 * p, 0.0 * p])
    return block_diag(A, B) + np.vstack([of_C @ C, -of_force @ other])


def spectral_radius(pair: LinearPair, scheme: str, degree: int, h: float) -> float:
    """Return the largest modulus of an eigenvalue of `amplification`."""
    units = np.concatenate(
        [np.repeat(1.0, len(v)) if rate else np.maximum(np.sqrt(np.abs(v)), 1.0 / h)
         for v in (pair.beam.omega2, pair.spring.omega2) for rate in (False, True)]
    )  # fmt: skip
    # In units of velocity throughout: eigenvalues stay, rounding does not see the frequencies.
    matrix = amplification(pair, scheme, degree, h) * units[:, None] / units
    return float(np.abs(np.linalg.eigvals(matrix)).max())
