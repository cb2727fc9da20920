"""The tie by itself, on bodies exact to rounding: conditions, energy, orders, cost, stability, failures."""

from itertools import pairwise

import numpy as np
import pytest
from bodies import DuffingBody, Upper, couple, orders, solve, unit_beam

from springbeam.bodies import force
from springbeam.bodies.protocol import NO_FORCE
from springbeam.coupling.protocol import NotConverged
from springbeam.coupling.tie import Tie

SCHEMES = [("energy", 0), ("energy", 1), ("energy", 2), ("hermite", 1), ("hermite", 2)]


def after_impact(n, stiffness=100.0, **spring):
    """A beam that has just met a spring top at rest inelastically."""
    beam, top = unit_beam(n, stiffness), DuffingBody(**spring)
    j = 1.0 / (1.0 / beam.mass + 1.0 / top.mass)
    beam.apply_impulse(j)
    top.apply_impulse(-j)
    return beam, top


# -- the conditions -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("scheme", "degree"), SCHEMES)
def test_a_wild_guess_does_not_loosen_the_conditions(scheme, degree):
    """1e15 N throws the ends by 1e4 km in 10 μs before the force is found; 16 ulp of that, 4e-8 m, are more than the
    whole contact force moves them in such a step."""
    size = 1e-5
    beam, spring = after_impact(6)
    tie = Tie(scheme, degree, 1e-12)
    for guess in ((1e15, 0.0, 0.0), NO_FORCE, NO_FORCE):
        solve(tie, size, beam, spring, guess)
    assert abs(beam.motion().displacement - spring.motion().displacement) <= 1e-12 * size


def test_the_responses_of_64_sizes_are_remembered_those_used_last():
    beam, spring = after_impact(2)
    tie = Tie("energy", 0, 1e-12)
    sizes = [1e-3 * (1.0 + k / 100.0) for k in range(66)]
    for size in (*sizes[:64], sizes[0], *sizes[64:]):
        solve(tie, size, beam, spring)
    assert list(tie.state.of_size) == [*sizes[3:64], sizes[0], *sizes[64:]]


# -- energy ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("degree", [0, 1, 2])
@pytest.mark.parametrize("frequency", [0.5, 5.0, 1000.0])
@pytest.mark.parametrize(("mass", "k2"), [(0.01, 0.3), (1.0, 0.0), (1.0, 3e3), (100.0, 3e3)])
def test_energy_schemes_conserve_energy(degree, frequency, mass, k2):
    """60 steps. A gap of the tolerance costs C·1e-12·(motion), at most 1e-11 of the energy where C is the image of
    mismatched velocities, and up to 1000 times that is accepted where the bodies' rounding is; hermite changes it by
    1e-4 and more."""
    beam, spring = after_impact(6, 1e6, mass=mass, k1=3.0, k2=k2)
    start, *rows = couple(Tie("energy", degree, 1e-12), frequency / beam.omega.max(), 60, beam, spring)
    assert max(abs(row.energy - start.energy) for row in rows) < 1e-8 * start.energy


# -- orders ---------------------------------------------------------------------------------------------------------

T = 0.064


def smooth_phase(scheme, degree, count):
    """u, u̇ and the mean of both limits of C at the macro points inside (0, T), shape (count − 1,) each."""
    size = T / count
    _, *rows = couple(Tie(scheme, degree, 1e-12), size, count, *after_impact(3))
    u = np.array([(row.upper.displacement, row.upper.velocity) for row in rows[:-1]]).T
    c = [0.5 * (force.value(a.force, size) + b.force[0]) for a, b in pairwise(rows)]
    return u[0], u[1], np.array(c)


@pytest.fixture(scope="module")
def reference():
    """hermite of degree 2 at T/512: displacement and velocity to 1e-15, C to 1e-10 N."""
    return smooth_phase("hermite", 2, 512)


@pytest.mark.parametrize(
    ("scheme", "degree", "counts", "expected"),
    [
        ("energy", 0, (64, 128), (4, 2, 2)),
        ("energy", 1, (32, 64), (4, 2, 2)),
        ("energy", 2, (8, 16), (8, 4, 4)),
        ("hermite", 1, (32, 64), (4, 4, 2)),
        ("hermite", 2, (16, 32), (6, 6, 4)),
    ],
)
def test_orders_of_displacement_velocity_and_force(scheme, degree, counts, expected, reference):
    """Smooth tied phase. Steps of each scheme are such that the errors are above rounding and ω_max·H < 1."""
    errors = []
    for count in counts:
        every = 512 // count
        inside = slice(count // 8, None)  # the force of the first steps carries the impact
        differences = [
            np.abs(ours - exact[every - 1 :: every])
            for ours, exact in zip(smooth_phase(scheme, degree, count), reference, strict=True)
        ]
        errors.append([differences[0].max(), differences[1].max(), differences[2][inside].max()])
    observed = [orders(column, (2.0, 1.0))[0] for column in np.array(errors).T]
    assert observed == pytest.approx(expected, abs=0.4)


# -- cost and failures ----------------------------------------------------------------------------------------------


class Deaf(DuffingBody):
    """Jumps to where the contact force does not push the tip: no force closes the gap."""

    def advance(self, time, size, contact, foundation=NO_FORCE):
        super().advance(time, size, NO_FORCE, foundation)
        self.y = -0.5 if contact[0] > 0.0 else 0.5
        return self.motion()


def test_not_converged_carries_the_gap_that_is_left():
    with pytest.raises(NotConverged) as caught:
        solve(Tie("energy", 0, 1e-12), 1e-3, unit_beam(4), Deaf())
    # The tip, falling 1 mm, is on the other side of zero from where the end jumps to: 0.5 m at least.
    assert 0.499 <= caught.value.residual < float("inf")
    assert f"{caught.value.residual:.3g} m" in str(caught.value)


class Grainy(DuffingBody):
    """Tells its displacement in multiples of ``grain`` [m]."""

    grain = 1.0

    def motion(self):
        exact = super().motion()
        return exact._replace(displacement=self.grain * round(exact.displacement / self.grain))


@pytest.mark.parametrize(("grain", "found"), [(1e-13, True), (1e-11, False)])
def test_a_body_may_be_rounded_by_a_thousand_tolerances_and_no_more(grain, found):
    """The tolerance is 1e-12 of the distance in a step, 0.5 m/s · 1 ms."""
    upper, lower = Upper(1.0, 100.0, 0.0, z=0.5), Grainy(1.0, 50.0, 0.0, z=0.5)
    lower.grain = grain
    if found:
        rows = couple(Tie("energy", 0, 1e-12), 1e-3, 20, upper, lower)
        assert max(abs(row.upper.displacement - row.lower.displacement) for row in rows) <= grain
    else:
        with pytest.raises(NotConverged):
            couple(Tie("energy", 0, 1e-12), 1e-3, 20, upper, lower)
