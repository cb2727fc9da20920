"""Exact steps of damped oscillators under polynomial forces, from slow to 2000 radians a step and overdamped."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from springbeam.monolithic.oscillators import GAUSS, STAGES, TARGETS, Oscillators

SIZE = 0.37


def by_matrix_exponential(omega2: float, alpha: float, size: float, start: np.ndarray, c: np.ndarray) -> np.ndarray:
    """(ξ, ξ̇) at ``size`` under the force Σ cₖ (t/SIZE)ᵏ: the force's derivatives make the system homogeneous."""
    A = np.zeros((2 + STAGES, 2 + STAGES))
    A[0, 1] = 1.0
    A[1, :3] = -omega2, -alpha * omega2, 1.0
    for k in range(1, STAGES):
        A[1 + k, 2 + k] = k / SIZE  # entry k holds k-th derivative × SIZEᵏ/k!
    return np.asarray((expm(A * size) @ np.concatenate([start, c]))[:2])


@pytest.mark.parametrize("alpha", [0.0, 1e-3, 0.3, 50.0])
@pytest.mark.parametrize("theta", [1e-6, 1e-2, 1.0, 19.0, 21.0, 300.0, 2500.0])
def test_step_under_a_polynomial_force(theta: float, alpha: float) -> None:
    omega2 = (theta / SIZE) ** 2
    if alpha * omega2 * SIZE > 1e5:
        pytest.skip("scaling and squaring has no digits left")
    c = np.array([0.3, -1.0, 0.5, 0.2, 0.0, 0.0, 0.7, 0.0, 0.0, 0.0, 0.0, -0.4])
    start = np.array([0.8, -0.6])
    w = Oscillators(np.array([omega2]), alpha).weights(SIZE)
    r = np.polynomial.polynomial.polyval(GAUSS.nodes, c)
    for i in (0, STAGES // 2, STAGES):
        exact = by_matrix_exponential(omega2, alpha, TARGETS[i] * SIZE, start, c)
        xi = w.C[i, 0] * start[0] + w.S[i, 0] * start[1] + w.force[i, :, 0] @ r
        xi_dot = w.C_dot[i, 0] * start[0] + w.S_dot[i, 0] * start[1] + w.force_dot[i, :, 0] @ r
        # expm: ε × the norm of its argument.
        tolerance = 1e-14 * max(10.0, theta, alpha * omega2 * SIZE)
        assert xi == pytest.approx(exact[0], abs=tolerance)
        assert xi_dot == pytest.approx(exact[1], abs=tolerance * max(1.0, theta / SIZE, alpha * omega2))


@pytest.mark.parametrize("omega2", [0.0, -9.0])
def test_without_and_with_negative_stiffness(omega2: float) -> None:
    w = Oscillators(np.array([omega2]), 0.0).weights(SIZE)
    exact = by_matrix_exponential(omega2, 0.0, SIZE, np.array([0.8, -0.6]), np.eye(STAGES)[0])
    assert w.C[-1, 0] * 0.8 - w.S[-1, 0] * 0.6 + w.force[-1, :, 0].sum() == pytest.approx(exact[0], rel=1e-14)


def test_critical_damping() -> None:
    """ω = 2/α: S = τ e^{−ωτ}."""
    for theta in (1.0, 100.0):
        omega = theta / SIZE
        S, S_dot = Oscillators(np.array([omega**2]), 2.0 / omega).kernels(np.array([0.1, SIZE]))
        tau = np.array([0.1, SIZE])
        np.testing.assert_allclose(S[:, 0], tau * np.exp(-omega * tau), rtol=1e-10)
        np.testing.assert_allclose(S_dot[:, 0], (1.0 - omega * tau) * np.exp(-omega * tau), rtol=1e-7)


@pytest.mark.parametrize("theta", [1e8, 1e10])
def test_a_mode_that_is_fast_beyond_all_digits_follows_its_force(theta: float) -> None:
    """ξ = f/ω² but for its delay, 2σ/ω² of a time."""
    omega = theta / SIZE
    w = Oscillators(np.array([omega**2]), 1.0 / omega).weights(SIZE)
    f = np.array([1.0, -2.0, 0.7])
    response = w.force[..., 0] @ np.polynomial.polynomial.polyval(GAUSS.nodes, f)
    np.testing.assert_allclose(response * omega**2, np.polynomial.polynomial.polyval(TARGETS, f), atol=1e-7)


def test_components_tell_a_decayed_fast_root_from_a_slow_one() -> None:
    """Overdamped, moving with its slow root alone: the fast root's share is nothing."""
    o = Oscillators(np.array([100.0]), 1.0)
    slow = float(o.slow[0].real)
    rates, amplitudes = o.components(np.array([0.2]), np.array([0.2 * slow]), np.array([0.0]))
    assert rates[0] == pytest.approx(-slow)
    assert rates[1] > 90.0
    assert amplitudes[0] == pytest.approx(0.2, rel=1e-13)
    assert amplitudes[1] < 1e-15
