"""Inputs over a step, and the inner forces of the beam: derivatives hold for one step, impulses act once."""

import numpy as np
import pytest
from scenes import table

# -- inputs over a step: derivatives hold for one step, impulses act once; output derivatives -------------------------


def polynomial(k, name, f, t=0.0):
    """Sets f₀ + f₁τ + f₂τ²/2 as it is seen from time t on."""
    k.set(name, f[0] + f[1] * t + f[2] * t * t / 2)
    k.derive(name, 1, f[1] + f[2] * t)
    k.derive(name, 2, f[2])


@pytest.mark.parametrize("f", [(0.8, 5.0, -7.0), (0.8, 0.0, -7.0)], ids=["both", "second"])
def test_derivatives_hold_for_one_step_the_value_stays(case, f):
    """One sets them one by one, the other in one call."""
    once = case.moving()
    again = case.moving()
    polynomial(once, case.force, f)
    again.set(case.force, f[0])
    again.derive_at_once(case.force, *f[1:])
    for k in (once, again):
        k.step(0.0, 0.05)
    assert once.get(case.force) == 0.8
    polynomial(again, case.force, (0.8, 0.0, 0.0))
    for k in (once, again):
        k.step(0.05, 0.05)
    assert once.outputs() == again.outputs()


def test_an_impulse_acts_once_at_the_start_of_the_next_step(case):
    """Without damping it changes the energy by its work J (v⁻ + v⁺)/2 with v⁺ = v⁻ + J/m, exactly, and never again."""
    J = -0.3
    H = 0.05
    is_beam = case.name == "beam"
    k = case.moving(**({"alpha_b": 0.0} if is_beam else {"damping": 0.0}))
    stored = ("kinetic_energy", "strain_energy" if is_beam else "potential_energy")
    mass = k.get("tip_mass") if is_beam else 1.0
    k.step(0.0, H)
    before = sum(k.get(*stored))
    velocity = k.get(case.velocity)
    k.set(case.impulse, J)
    assert k.get(case.impulse, case.velocity) == [J, velocity]
    for i in (1, 2):
        k.step(i * H, H)
        assert k.get(case.impulse) == 0.0
        assert sum(k.get(*stored)) - before == pytest.approx(J * (2 * velocity + J / mass) / 2, rel=1e-9)


VALUES = table("contract/values.toml")
LOADED = VALUES["loaded"]


@pytest.mark.parametrize("variant", [0, 1])
def test_every_output_has_its_rate(case, variant):
    """Against central differences over 2e-5 s, with an error of h² times the third derivative."""
    k = case.moving(**LOADED[case.name][variant])
    # Of the last step, or counted.
    steps = ("stop_force", "stop_impulse", "internal_steps", "displacement_integral", "tip_displacement_integral")
    names = [n for n in case.outputs if not n.startswith(steps)]
    h = 1e-5
    moving = 0
    time = 0.0

    def advance(size):
        nonlocal time
        if "tip_displacement" in LOADED[case.name][variant]:
            k.set("tip_displacement", 0.45 + 0.1 * time)
        k.step(time, size)
        time += size

    advance(0.05)
    advance(h)  # of this size forecasts are
    before = k.get(*names)
    advance(h)
    rates = [k.derivative(n) for n in names]
    advance(h)
    for name, rate, a, b in zip(names, rates, before, k.get(*names), strict=True):
        difference = (b - a) / (2 * h)
        assert rate == pytest.approx(difference, rel=2e-4, abs=1e-7 + 1e-15 * abs(a) / h), name
        moving += rate != 0.0
    assert moving >= 6
    for name in case.outputs:
        k.derivative(name)
    path = {"beam": "tip_displacement", "spring": "displacement"}[case.name]
    assert k.derivative(f"{path}_integral") == k.get(path)
    assert k.derivative(f"{path}_integral_2") == k.get(f"{path}_integral")


def test_contact_force_is_ignored_by_the_law_inside(spring):
    values = {"contact_law": 2, "displacement": 0.1}
    plain = spring.running(**values)
    pressed = spring.running(**values, contact_force=5.0)
    for k in (plain, pressed):
        k.step(0.0, 0.01)
    assert plain.outputs() == pressed.outputs()


@pytest.mark.parametrize("arrives", ["tip_displacement", "tip_velocity", "tip_velocity_forecast", "tip_response"])
def test_a_tip_that_arrives_where_there_is_no_law_is_told(spring, arrives):
    k = spring.running(**{arrives: 0.1})
    k.step(0.0, 1e-3)
    assert "contact_law = 1: there is no contact" in k.message


# -- What an engineer loads the pair for: forces, moments, stresses, gravity, a start at rest; impacts of the spring


X = np.linspace(0.0, 1.0, 21)


def along(k, name):
    return np.array(k.get(*[f"{name}[{i}]" for i in range(1, 22)]))


MESHES = [
    {"n_elements": 13},
    {"n_elements": 13, "integrator": 2, "reduced_integration": True},
    {"n_elements": 20, "n_modes": 4},
    {"n_elements": 7, "element_degree": 3, "mass_matrix": 2},
]


@pytest.mark.parametrize("mesh", MESHES)
def test_a_cantilever_at_rest_has_the_forces_of_statics(beam, mesh):
    """Q = P + q (L − x), M = P (L − x) + q (L − x)²/2, and a point force at x = 0.5: to rounding on any mesh."""
    point = 0.7
    g = 1.6
    height = 0.1
    # EI = KAG = 1
    section = {"density": 3.0, "area": 2.0, "second_moment_of_area": 4.0, "young_modulus": 0.25, "shear_modulus": 0.5}
    k = beam.running(**mesh, **section, initial_state=2, tip_force=2.0, tip_load=0.5, distributed_load=-3.0, gravity=g,
                     section_height=height, **{"point_force[1]": point})  # fmt: skip
    q = -3.0 - 3.0 * 2.0 * g
    P = 2.5
    shear = P + q * (1.0 - X) + point * (X <= 0.5)
    moment = P * (1.0 - X) + q * (1.0 - X) ** 2 / 2 + point * np.maximum(0.0, 0.5 - X)
    assert along(k, "shear_force") == pytest.approx(shear, abs=2e-14)
    assert along(k, "bending_moment") == pytest.approx(moment, abs=2e-14)
    assert k.get("clamp_force", "clamp_moment") == pytest.approx([-shear[0], -moment[0]], abs=2e-14)
    assert k.get("max_bending_stress") == pytest.approx(abs(moment).max() * height / 2 / 4.0, rel=1e-13)
    u = k.get("tip_displacement")
    if "n_modes" not in mesh:  # full integration makes linear elements stiffer
        flexible = mesh.get("element_degree", 1) > 1
        exact = P * (1 / 3 + 1) + q * (1 / 8 + 1 / 2) + point * (0.5**2 * (3 - 0.5) / 6 + 0.5)
        assert u == pytest.approx(exact, rel=1e-12 if flexible else 5e-3)
    k.step(0.0, 0.1)
    assert k.get("tip_displacement") == pytest.approx(u, abs=1e-14 * abs(u))
    assert k.get("kinetic_energy") < 1e-24
