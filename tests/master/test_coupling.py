"""Couplings by themselves: their energy, what they exchange, and what fails."""

import numpy as np
import pytest
from bodies import bodies_of, couple, solve
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.polynomial import legendre
from scenes import scene_from_dict

from springbeam import PointMass, SpringDamper
from springbeam.coupling.exchange import Exchange
from springbeam.coupling.projection import Projection
from springbeam.coupling.protocol import NotConverged
from springbeam.coupling.soft import SoftSolver
from springbeam.coupling.solver import StepSolver
from springbeam.monolithic.semi_discrete import modal_beam
from springbeam.scene.laws import Compliance, KelvinVoigt, Link


def pair(n, stiffness=100.0, **spring):
    """Return the scene of a beam, EI = KAG = ``stiffness``, that meets a spring at 1 m/s."""
    beam = {"n_elements": n, "young_modulus": stiffness, "shear_modulus": stiffness, "initial_velocity_slope": -1.0}
    return scene_from_dict({"time": {"t_end": 1.0}, "beam": beam, "spring": spring, "coupling": {"degree": 2}})


@pytest.mark.parametrize("degree", [0, 1, 2])
@pytest.mark.parametrize(("frequency", "mass", "k2"), [(0.5, 1.0, 0.0), (5.0, 0.01, 3e3), (1000.0, 100.0, 3e3)])
def test_energy_schemes_conserve_energy(degree, frequency, mass, k2):
    """60 steps. A gap of the tolerance costs C·1e-12·(motion), at most 1e-11 of the energy where C is the image of
    mismatched velocities, and up to 1000 times that is accepted where the bodies' rounding is."""
    scene = pair(6, 1e6, mass=mass, linear_stiffness=3.0, cubic_stiffness=k2)
    size = frequency / modal_beam(scene.beam).omega.max()
    with bodies_of(scene) as (beam, spring):
        j = 1.0 / (1.0 / beam.mass + 1.0 / spring.mass)  # of an inelastic impact
        beam.apply_impulse(j)
        spring.apply_impulse(-j)
        start, *rows = couple(StepSolver(degree, 1e-12), size, 60, beam, spring)
    assert max(abs(row.energy - start.energy) for row in rows) < 1e-8 * start.energy


DAMPED = [Compliance(1e4, 1.5, 0.5), Compliance(1e6, 1.0, 5.0), KelvinVoigt(1e4, 1.0, 5.0), Link(1e4, 3.0)]


@pytest.mark.parametrize("law", DAMPED, ids=repr)
@pytest.mark.parametrize(("degree", "size"), [(0, 1e-3), (1, 2e-2), (2, 2e-2)])
def test_what_damping_takes_is_counted(law, degree, size):
    """The bodies' and the law's energies and what the law dissipated: constant to rounding, at any step."""
    coupling = SoftSolver(law, degree, 1e-13)
    with bodies_of(pair(4, linear_stiffness=3.0, cubic_stiffness=-0.2)) as bodies:
        rows = couple(coupling, size, 60, *bodies)
    assert coupling.state.dissipated > 1e-4
    assert max(abs(row.energy - rows[0].energy) for row in rows) < 1e-12 * rows[0].energy


@pytest.mark.parametrize(("sequential", "degree", "pressed"), [
    (False, 0, 2.0), (False, 1, 2.0 + 1.0), (True, 0, 2.0 + 1.0 - 0.002), (True, 1, 2.0 + 1.0 - 0.004 / 3.0),
])  # fmt: skip
def test_exchanged_forces_are_of_the_ends_as_they_were_exchanged(sequential, degree, pressed):
    """p = 2 mm grows by 0.5 m/s over 4 ms, λ = 1 kN/m: the mean force on the lower mass is λ p at the start, 2 N,
    half-way of its continuation, or with the tip where the force on it, 2 or 2 + 500 t N, has brought it."""
    upper = PointMass(8.0, 0.0, -0.25)
    lower = PointMass(8.0, 2e-3, 0.25)
    lower.take_place(upper=False)
    solve(Exchange(Compliance(1e3, 1.0), sequential, degree), 4e-3, upper, lower)
    assert 8.0 * (0.25 - lower.motion().velocity) / 4e-3 == pytest.approx(pressed, abs=1e-9)


# -- the projected law by itself: its work is what the law stores and takes, to rounding -----------------------------

EPS = float(np.finfo(float).eps)
SMALLEST = float(np.finfo(float).smallest_subnormal)
SIZE = 0.01


def series(projection, start, x):
    """Legendre coefficients of the penetration's polynomial, from its defining conditions."""
    d = projection.degree
    rows = [[1.0] * (d + 2), [(-1.0) ** k for k in range(d + 2)]]
    rows += [[(1.0 / (2 * j + 1)) if k == j else 0.0 for k in range(d + 2)] for j in range(d)]
    return np.linalg.solve(np.array(rows), [x[0], start, *x[1:]])


def work(projection, a, start, x):
    """∫ C ṗ dτ: only the first d + 1 Legendre coefficients of ṗ meet those of C."""
    rates = legendre.legder(series(projection, start, x))
    return float(sum(2.0 / (2 * k + 1) * c * rate for k, (c, rate) in enumerate(zip(a, rates, strict=True))))


@given(
    start=st.floats(-1e-2, 1e-2), end=st.floats(-1e-2, 1e-2), mean=st.floats(-1e-2, 1e-2), skew=st.floats(-5e-3, 5e-3),
    degree=st.sampled_from([0, 1, 2]), q=st.floats(1.0, 4.0), chi=st.floats(0.0, 3.0),
)  # fmt: skip
@example(start=0.0, end=2.9e-158, mean=2.9e-158, skew=0.0, degree=2, q=1.0, chi=0.0)
def test_damping_never_gives_energy(start, end, mean, skew, degree, q, chi):
    """The energy is kept to 64 roundings; below 1e-308 J a rounding is the smallest double, whatever their size."""
    law = Compliance(1e4, q, chi)
    projection = Projection(law, degree)
    x = [end, mean, skew][: degree + 1]
    a = projection.force(start, SIZE, x)
    gained = law.potential(end) - law.potential(start)
    largest = abs(start) + sum(map(abs, x))  # whether less than a rounding of it touches is not told
    scale = abs(gained) + sum(map(abs, a)) * largest + law.potential(largest)
    roundings = 64 * (EPS * scale + SMALLEST)
    dissipated = projection.dissipated(start, SIZE, x) if law.damped else 0.0
    assert dissipated >= -roundings
    assert work(projection, a, start, x) - gained == pytest.approx(dissipated, abs=roundings)


@pytest.mark.parametrize("degree", [0, 1])
def test_a_force_past_all_doubles_is_none(degree):
    with pytest.raises(OverflowError):
        Projection(Compliance(1e300, 2.0), degree).force(1e10, SIZE, [3e10, 2e10][: degree + 1])


class Grainy(SpringDamper):
    """Tells its displacement in multiples of ``grain`` [m]."""

    grain = 1.0

    def motion(self):
        exact = super().motion()
        return exact._replace(displacement=self.grain * round(exact.displacement / self.grain))

    def advance(self, time, size, *forces):
        super().advance(time, size, *forces)
        return self.motion()


@pytest.mark.parametrize(("grain", "found"), [(1e-13, True), (1e-11, False)])
def test_a_body_may_be_rounded_by_a_thousand_tolerances_and_no_more(grain, found):
    """The tolerance is 1e-12 of the distance in a step, 0.5 m/s · 1 ms; a gap of so many is left at most."""
    upper = SpringDamper(1.0, 100.0, velocity=0.5)
    lower = Grainy(1.0, 50.0, velocity=0.5)
    lower.take_place(upper=False)
    lower.grain = grain
    if found:
        rows = couple(StepSolver(0, 1e-12), 1e-3, 20, upper, lower)
        assert max(abs(row.upper.displacement - row.lower.displacement) for row in rows) <= 1e3 * 1e-12 * 0.5e-3
    else:
        with pytest.raises(NotConverged):
            couple(StepSolver(0, 1e-12), 1e-3, 20, upper, lower)
