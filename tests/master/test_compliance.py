"""Normal compliance as a discrete gradient: identities of the force, energy and order of the coupled motion."""

from __future__ import annotations

import numpy as np
import pytest
from bodies import DuffingBody, drift, modal_beam, orders
from scipy.integrate import quad

from springbeam.bodies.protocol import NO_FORCE, Motion
from springbeam.coupling.compliance import Compliance, compliance_energy, compliance_force, discrete_gradient

EPS = float(np.finfo(float).eps)
PAIRS = [(0.0, 1e-3), (1e-3, 0.0), (1e-3, -2e-3), (-1e-3, 5e-4), (1e-3, 1.05e-3), (1e-3, 1.2e-3), (-1e-3, -2e-3)]


@pytest.mark.parametrize("q", [1.0, 1.5, 2.0, 3.0])
@pytest.mark.parametrize(("p0", "p1"), PAIRS)
def test_work_is_the_loss_of_contact_energy(p0, p1, q):
    """Closing, opening, both branches of the quotient, no contact. Rounding of Φ, a few ulp of its larger value."""
    energies = [compliance_energy(p, 1e4, q) for p in (p0, p1)]
    work = -discrete_gradient(p0, p1, 1e4, q) * (p1 - p0)
    assert work == pytest.approx(energies[0] - energies[1], abs=8 * EPS * max(energies))
    assert (discrete_gradient(p0, p1, 1e4, q) == 0.0) == (max(p0, p1) <= 0.0)


@pytest.mark.parametrize("q", [1.0, 1.5, 3.0])
@pytest.mark.parametrize("change", [0.0, 1e-14, 1e-9, 1e-4, -1e-4])
def test_small_changes_do_not_cancel(change, q):
    """DG = λp^q (1 + q δ/2 + q(q−1) δ²/6 + …) for p1 = p(1 + δ): the quotient would lose EPS/δ."""
    p = 2e-3
    series = compliance_force(p, 1e4, q) * (1.0 + q * change / 2 + q * (q - 1.0) * change**2 / 6)
    # The next term is q(q−1)(q−2) δ³/24 ≤ δ³/4.
    assert discrete_gradient(p, p * (1.0 + change), 1e4, q) == pytest.approx(series, rel=4 * EPS + abs(change) ** 3)


@pytest.mark.parametrize("q", [1.0, 1.5, 3.0])
def test_both_branches_meet(q):
    """Change of 10 % of the larger p, from either side: the branches agree to the quotient's cancellation."""
    p1 = 1e-3 / 0.9
    sides = [discrete_gradient(1e-3, p1 * (1.0 + s), 1e4, q) for s in (-1e-12, 1e-12)]
    assert sides[0] == pytest.approx(sides[1], rel=1e-11)


def test_symmetric_and_the_mean_of_the_force_along_the_path():
    for p0, p1 in PAIRS:
        mean = quad(lambda s, a=p0, b=p1: compliance_force(a + s * (b - a), 1e4, 2.0), 0.0, 1.0, points=[0.5])[0]
        assert discrete_gradient(p0, p1, 1e4, 2.0) == pytest.approx(mean, rel=1e-7)
        assert discrete_gradient(p1, p0, 1e4, 2.0) == pytest.approx(discrete_gradient(p0, p1, 1e4, 2.0), rel=1e-14)


def couple(stiffness: float, q: float, size: float, steps: int, n: int = 4):
    """Beam falling on a Duffing spring. Returns (t, u, v, y, z, C) rows and the total energy of each row [J]."""
    beam, spring = modal_beam(n), DuffingBody(k1=3.0, k2=-0.2)
    law = Compliance(stiffness, q, 1e-13)
    rows, energies, guess = [], [], NO_FORCE
    for i in range(steps):
        for body in (beam, spring):
            body.mark()
        p = spring.motion().displacement - beam.motion().displacement
        energies.append(drift((beam, spring)) + compliance_energy(p, stiffness, q))
        rows.append((*beam.motion()[:2], *spring.motion()[:2], guess[0]))
        guess = law.solve(beam, spring, i * size, size, guess, p)
    return np.array(rows), np.array(energies), (beam, spring)


@pytest.mark.parametrize("q", [1.0, 2.0, 3.0])
@pytest.mark.parametrize("stiffness", [1e2, 1e4, 1e6, 1e8, 1e10])
def test_energy_is_conserved_at_any_stiffness(stiffness, q):
    """H = 2 ms, up to √(λ/m_tip) H = 10⁴: rounding of 300 steps, C (1e-13 relative) times what p changes."""
    rows, energies, _ = couple(stiffness, q, 2e-3, 300)
    assert rows[:, 4].max() > 0.0
    assert np.abs(energies - energies[0]).max() < 1e-11 * energies[0]


@pytest.mark.parametrize(("stiffness", "q"), [(1e3, 1.0), (1e5, 2.0)])
def test_second_order_in_a_smooth_contact(stiffness, q):
    """Displacements and velocities at t = 0.05, against the run at H/8: its own error shifts orders by 0.02."""
    t = 0.05
    last = [couple(stiffness, q, t / n, n + 1)[0][-1, :4] for n in (50, 100, 200, 1600)]
    errors = np.abs(np.array(last[:3]) - last[3])
    for column in errors.T:
        assert orders(column, (4.0, 2.0, 1.0)) == pytest.approx([2.0, 2.0], abs=0.25)


@pytest.mark.parametrize("stiffness", [1e2, 1e6])
def test_a_step_of_contact_costs_a_few_advances(stiffness):
    """Secant response, remembered: at most 4 of each body per step on average, where bisection would take 50."""
    _, _, bodies = couple(stiffness, 1.0, 1e-3, 200)
    for body in bodies:
        assert body.steps <= 4 * 200


class Affine:
    """Ends a step at ``free`` + ``response``·C [m]."""

    def __init__(self, free: float, response: float, size: float):
        self.free, self.response, self.mass = free, response, 0.5 * size**2 / abs(response)

    def rewind(self): ...

    def advance(self, time, size, contact):
        self.w = self.free + self.response * contact[0]
        return self.motion()

    def motion(self):
        return Motion(self.w, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("response", [1e-12, 1.0, 1e4])
@pytest.mark.parametrize("depth", [1e-9, 10.0])
def test_forces_are_found_however_far_they_move_the_ends(depth, response):
    """λ = 1e12 N/m, q = 1, contact from the start of the step: C = λ p⁺/2 with p⁺ = depth − 2·response·C. The force at
    C = 0 is up to 1e16 times the one that is looked for."""
    law = Compliance(1e12, 1.0, 1e-12)
    c = law.solve(Affine(-depth, response, 1e-3), Affine(0.0, -response, 1e-3), 0.0, 1e-3, NO_FORCE, 0.0)[0]
    assert c == pytest.approx(1e12 * depth / (2.0 + 2e12 * response), rel=1e-11)
