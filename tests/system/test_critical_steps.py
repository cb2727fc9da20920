"""Critical macro steps: measured by the FMUs as predicted by the spectral radius (docs/stability.md has predictions).

The FMUs are coupled by the solvers of a run, without events: the linear closed contact is stepped until its growth
shows. A closed contact of law `compliance` with exponent 1 is a `link`, which also pulls: as that it is measured.
"""

import pytest
from bodies import couple

from springbeam import load_scene, with_changes
from springbeam.bodies.factory import load_bodies
from springbeam.contact.laws import law_of
from springbeam.coupling import coupling_of
from springbeam.monolithic.semi_discrete import modal_beam
from springbeam.studies.stability.predict import THRESHOLD, critical_step, linear_pair


def linear_scene(law, stiffness, scheme, degree, H=4e-3):
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


def growth(scene, steps=2000):
    """The factor by which amplitudes grow per macro step, of the second half of the steps."""
    beam, top = load_bodies(scene, 0.0)
    # Tied ends start with one velocity; in contact it is their relative motion that grows.
    if scene.contact.rigid:
        impulses = beam.mass, top.mass
    else:
        reduced = 1.0 / (1.0 / beam.mass + 1.0 / top.mass)
        impulses = -reduced, reduced
    for body, impulse in zip((beam, top), impulses, strict=True):
        body.apply_impulse(impulse)
    rows = couple(coupling_of(scene, law_of(scene)), scene.coupling.H, steps, beam, top)
    beam.close()
    top.close()
    return (rows[-1].energy / rows[steps // 2].energy) ** (1.0 / steps)


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
    """Within 1 %; ``hermite`` is unstable in bands that may be narrower than that."""
    _, _, scheme, degree = case
    factor = 1.005 if scheme == "hermite" else None
    H = critical_step(pair_of(linear_scene(*case)), scheme, degree, factor=factor)
    below, *above = (growth(linear_scene(*case, share * H)) - 1.0 for share in (0.99, 1.003, 1.01))
    assert below < THRESHOLD < max(above)
