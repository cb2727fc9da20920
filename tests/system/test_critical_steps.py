"""Critical macro steps: measured by the FMUs as predicted by the spectral radius (docs/stability.md has predictions).

The FMUs are coupled by the solvers of a run, without events: the linear closed contact is stepped until its growth
shows. A closed contact of law `compliance` with exponent 1 is a `link`, which also pulls: as that it is measured.
"""

import math
from itertools import product

import pytest

from springbeam import load_scene, with_changes
from springbeam.bodies import force
from springbeam.bodies.factory import load_bodies
from springbeam.bodies.protocol import NO_FORCE
from springbeam.contact.laws import law_of
from springbeam.coupling import coupling_of
from springbeam.monolithic.semi_discrete import modal_beam
from springbeam.studies.stability.linear import spectral_radius
from springbeam.studies.stability.predict import THRESHOLD, critical_step, linear_pair

pytestmark = pytest.mark.usefixtures("fmu_folder")

#: Growth of the energy at which the rate is told, and how many macro steps it may take to get there.
GROWN, MOST_STEPS = 1e10, 8000
#: Distances from a predicted critical H, of itself, at which stability and instability are sought. The first ones are
#: small: ``hermite`` is unstable in bands that can be 0.2 % wide.
SOUGHT = (0.001, 0.003, 0.01, 0.03, 0.1)
LARGE_STEP = 0.004


def linear_scene(law, stiffness, scheme, degree, H=LARGE_STEP):
    """`soft` with two elements, linear spring and contact (λ in N/m), at rest and without a stop."""
    spring = {"cubic_stiffness": 0.0, "equilibrium": 0.0, "external_force": 0.0, "initial_velocity": 0.0}
    beam = {"distributed_load": 0.0, "initial_deflection_slope": 0.0, "initial_velocity_slope": 0.0}
    return with_changes(
        load_scene("soft"),
        stop=None,
        beam={**beam, "n_elements": 2, "approach": "elastic"},
        spring=spring,
        contact={"law": law, "stiffness": stiffness, "exponent": 1.0},
        coupling={"scheme": scheme, "degree": degree, "macro_step": H},
    )


def growth(scene, most=MOST_STEPS):
    """The factor by which amplitudes grow per macro step, of the second half of the steps up to `GROWN`."""
    H, soft = scene.coupling.H, not scene.contact.rigid
    coupling, guess = coupling_of(scene, law_of(scene)), NO_FORCE
    beam, top = load_bodies(scene, 0.0)

    def energy():
        stored = sum(body.energies().kinetic + body.energies().potential for body in (beam, top))
        apart = top.motion().displacement - beam.motion().displacement
        return stored + (0.5 * scene.contact.stiffness * apart**2 if soft else 0.0)

    try:
        # Tied ends start with one velocity; in contact it is their relative motion that grows.
        reduced = 1.0 / (1.0 / beam.mass + 1.0 / top.mass)
        beam.apply_impulse(-reduced if soft else beam.mass)
        top.apply_impulse(reduced if soft else top.mass)
        energies = [energy()]
        while len(energies) <= most and energies[-1] < GROWN * energies[0]:
            beam.mark()
            top.mark()
            ends = (beam.motion(), top.motion())
            step = coupling.solve(beam, top, H * (len(energies) - 1), H, ends, guess)
            guess = force.shifted(step.contact, H)
            energies.append(energy())
    finally:
        beam.close()
        top.close()
    n = len(energies) - 1
    return float((energies[n] / energies[n // 2]) ** (0.5 / (n - n // 2)))


def measured(case, near):
    """The H near ``near`` at which `growth` passes 1 + `THRESHOLD`, to 0.2 % of itself."""

    def unstable(H):
        return growth(linear_scene(*case, H)) > 1.0 + THRESHOLD

    low = next(H for x in SOUGHT if not unstable(H := near * (1.0 - x)))
    high = next(H for x in SOUGHT if unstable(H := near * (1.0 + x)))
    while high > 1.002 * low:
        middle = math.sqrt(low * high)
        low, high = (low, middle) if unstable(middle) else (middle, high)
    return math.sqrt(low * high)


def pair_of(scene):
    return linear_pair(scene, modal_beam(scene.beam))


@pytest.mark.parametrize(
    "case",
    [
        ("link", 1e8, "jacobi", 0),
        ("link", 1e8, "gauss_seidel", 0),
        ("link", 1e4, "jacobi", 1),
        ("link", 1e4, "gauss_seidel", 1),
        ("tie", 1.0, "hermite", 1),
        ("tie", 1.0, "hermite", 2),
    ],
)
def test_measured_as_predicted(case):
    """Growth over 4000 steps at the threshold is e⁴, told to some percent: 1 % of H."""
    _, _, scheme, degree = case
    factor = 1.005 if scheme == "hermite" else None
    predicted = critical_step(pair_of(linear_scene(*case)), scheme, degree, factor=factor)
    assert measured(case, predicted) == pytest.approx(predicted, rel=0.01)


@pytest.mark.parametrize("H", [4e-3, 0.1])
@pytest.mark.parametrize(("law", "stiffness", "degree"), [*product(["link"], [1e4, 1e8], [0, 1, 2]), ("tie", 1.0, 0)])
def test_energy_is_stable_at_any_step(law, stiffness, degree, H):
    """λ = 1e8 N/m, H = 0.1 s: 1e5 times the critical H of `jacobi`; rounding of the preload is 1e-6 per step."""
    scene = linear_scene(law, stiffness, "energy", degree, H)
    assert critical_step(pair_of(scene), "energy", degree) is None
    assert spectral_radius(pair_of(scene), "energy", degree, H) == pytest.approx(1.0, abs=1e-10)
    assert growth(scene, 1000) == pytest.approx(1.0, abs=1e-5)
