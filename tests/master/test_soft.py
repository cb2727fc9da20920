"""Soft laws on bodies exact to rounding: energy at any stiffness, orders 2, 4 and 6, cost."""

import numpy as np
import pytest
from bodies import DuffingBody, Upper, couple, orders, solve, unit_beam

from springbeam.bodies.protocol import NO_FORCE, Body, Motion
from springbeam.contact.laws import Compliance, Link
from springbeam.coupling.exchange import Exchange
from springbeam.coupling.protocol import NotConverged, Scales, Step
from springbeam.coupling.soft import SoftSolver

DEGREES = [0, 1, 2]


def couple_by(law, degree, size, steps, upper, lower):
    """The rows; their energies are conserved to 1e-11, through whatever is dissipated."""
    coupling = SoftSolver(law, degree, 1e-13)
    rows = couple(coupling, size, steps, upper, lower)
    assert max(abs(row.energy - rows[0].energy) for row in rows) < 1e-11 * rows[0].energy
    return rows, coupling


@pytest.mark.parametrize("degree", DEGREES)
@pytest.mark.parametrize("q", [1.0, 1.5, 3.0])
@pytest.mark.parametrize("stiffness", [1e2, 1e4, 1e6, 1e8, 1e10])
def test_energy_is_conserved_at_any_stiffness(stiffness, q, degree):
    """H = 2 ms, up to √(λ/m_tip) H = 10⁴: rounding of 100 steps, C (1e-13 relative) times what p changes."""
    rows, _ = couple_by(Compliance(stiffness, q), degree, 2e-3, 100, unit_beam(4), DuffingBody(k1=3.0, k2=-0.2))
    assert max(row.force[0] for row in rows) > 0.0


@pytest.mark.parametrize(("degree", "order"), [(0, 2.0), (1, 4.0), (2, 6.0)])
@pytest.mark.parametrize("q", [1.5, 2.0, 3.0])
def test_the_order_is_twice_the_number_of_coefficients(degree, order, q):
    """y and u at t = 0.08 s, contact throughout, against degree 2 at H/8; for degree 2 as long as it is no rounding."""
    law, t = Compliance({1.5: 3e2, 2.0: 1e4, 3.0: 1e6}[q], q), 0.08
    counts = (4, 8, 16) if degree == 2 else (16, 32, 64)

    def last(d, n):
        rows, _ = couple_by(law, d, t / n, n, unit_beam(2, slope=-0.3), DuffingBody(k1=3.0, k2=-0.2))
        return np.array([rows[-1].upper.displacement, rows[-1].lower.displacement])

    exact = last(2, 8 * counts[-1])
    errors = [np.abs(last(degree, n) - exact).max() for n in counts]
    assert errors[-1] > 1e-14
    assert orders(errors, [1.0 / n for n in counts])[-1] == pytest.approx(order, abs=0.35)


@pytest.mark.parametrize("law", [Compliance(1e4, 1.5, 0.5), Compliance(1e6, 1.0, 5.0), Link(1e4, 3.0)], ids=repr)
@pytest.mark.parametrize("degree", DEGREES)
@pytest.mark.parametrize("size", [1e-3, 2e-2])
def test_what_damping_takes_is_booked(law, degree, size):
    """The bodies' and the law's energies and what the law dissipated: constant to rounding, at any step."""
    rows, coupling = couple_by(law, degree, size, 100, unit_beam(4), DuffingBody(k1=3.0, k2=-0.2))
    assert coupling.state.dissipated > 1e-4
    assert max(abs(row.energy - rows[0].energy) for row in rows) < 1e-12 * rows[0].energy


class Affine(Body):
    """Ends a step at ``free`` + ``response``·C [m]."""

    def __init__(self, free, response, size):
        self.free, self.response, self.mass, self.state = free, response, 0.5 * size**2 / abs(response), 0.0

    def advance(self, time, size, contact, foundation=NO_FORCE):
        self.state = self.free + self.response * contact[0]
        return self.motion()

    def motion(self):
        return Motion(self.state, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("response", [1e-12, 1.0, 1e4])
@pytest.mark.parametrize("depth", [1e-9, 10.0])
def test_forces_are_found_however_far_they_move_the_ends(depth, response):
    """λ = 1e12 N/m, q = 1, contact from the start of the step: C = λ p⁺/2 with p⁺ = depth − 2·response·C. The force at
    C = 0 is up to 1e16 times the one that is looked for."""
    ends = Affine(-depth, response, 1e-3), Affine(0.0, -response, 1e-3)
    c = solve(SoftSolver(Compliance(1e12, 1.0), 0, 1e-12), 1e-3, *ends)[0]
    assert c == pytest.approx(1e12 * depth / (2.0 + 2e12 * response), rel=1e-11)


@pytest.mark.parametrize("law", [Compliance(1e4, 1.5, 0.5), Link(1e4, 3.0)], ids=repr)
def test_a_step_made_at_degree_0_books_what_damping_takes_at_degree_0(law, monkeypatch):
    """The solver fails at degree 2 in every step; energy to rounding all the same, at what degree 0 dissipates."""
    aim = SoftSolver.aim

    def fails_above_0(self, gap, a, descent, size, start):
        if self.degree > 0:
            raise NotConverged(1.0, 1)
        return aim(self, gap, a, descent, size, start)

    monkeypatch.setattr(SoftSolver, "aim", fails_above_0)
    rows, coupling = couple_by(law, 2, 2e-2, 100, unit_beam(4), DuffingBody(k1=3.0, k2=-0.2))
    assert coupling.state.reduced >= 12
    assert coupling.state.dissipated > 1e-4
    assert max(abs(row.energy - rows[0].energy) for row in rows) < 1e-12 * rows[0].energy


@pytest.mark.parametrize("degree", DEGREES)
def test_the_error_of_a_step_is_the_same_in_any_unit_of_mass(degree):
    """Three orders of magnitude more of λ and of both masses move the ends as before."""
    ends = [
        (Motion(u, 0.0, u, 0.5 * u), Motion(u + p, 0.0, u + 0.4 * p, 0.1 * p)) for u, p in ((0.0, 1e-3), (0.1, 3e-3))
    ]
    step = Step(0.0, 0.01, NO_FORCE, NO_FORCE, *ends)
    (light,), (heavy,) = (
        SoftSolver(Compliance(factor, 1.5), degree, 1e-12).local_errors(step, Scales(1.0, 0.5, factor, factor))
        for factor in (1.0, 1e3)
    )
    assert light == pytest.approx(heavy, rel=1e-12)
    assert light[0] > 0.0


@pytest.mark.parametrize(("sequential", "degree", "pressed"), [
    (False, 0, 2.0), (False, 1, 2.0 + 1.0), (True, 0, 2.0 + 1.0 - 0.002), (True, 1, 2.0 + 1.0 - 0.004 / 3.0),
])  # fmt: skip
def test_exchanged_forces_are_of_the_ends_as_they_were_exchanged(sequential, degree, pressed):
    """p = 2 mm grows by 0.5 m/s over 4 ms, λ = 1 kN/m: the mean force on the lower mass is λ p at the start, 2 N,
    half-way of its continuation, or with the tip where the force on it, 2 or 2 + 500 t N, has brought it."""
    upper, lower = Upper(8.0, 0.0, 0.0, y=0.0, z=-0.25), DuffingBody(8.0, 0.0, 0.0, y=2e-3, z=0.25)
    solve(Exchange(Compliance(1e3, 1.0), sequential, degree), 4e-3, upper, lower)
    assert 8.0 * (0.25 - lower.z) / 4e-3 == pytest.approx(pressed, abs=1e-9)
