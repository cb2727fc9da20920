"""One body, made in each of the ways there are: what holds for one kind holds for all of them."""

import functools

import numpy as np
import oscillator
import pytest

from springbeam import PointMass, SceneError, SpringDamper, simulate, with_changes
from springbeam.bodies.protocol import NO_FORCE, Abilities
from springbeam.scene import load_scene, scene_from_dict

M = 3.0
K = 40.0
C = 0.2
#: A mass on a linear spring and damper as a table ``[spring]``.
OWN = {"mass": M, "linear_stiffness": K, "damping": C}
ELEMENT = {"element": "spring_damper", "mass": M, "stiffness": K, "damping": C}
FOREIGN = {**oscillator.ALL, "force_sign": -1, "parameters": {"m": M, "k": K, "c": C}}
KINDS = ("own", "element", "element of the caller's", "foreign")


@pytest.fixture(scope="module")
def below(tmp_path_factory):
    """Return the table ``[spring]`` of a kind of body, and how the caller gives it."""
    folder = tmp_path_factory.mktemp("kinds")

    @functools.cache
    def made(**said):
        return str(oscillator.made(folder / f"{len(list(folder.iterdir()))}.fmu", **said))

    def of_kind(kind, **said):
        tables = {"element": ELEMENT, "foreign": {**FOREIGN, "fmu": made(**said) if kind == "foreign" else ""}}
        return tables.get(kind, OWN), {"lower": SpringDamper(M, K, C)} if kind == "element of the caller's" else {}

    return of_kind


def above(spring, **tables):
    """A mass of 2 kg that moves down by 0.3 m/s, tied to the body below."""
    scene = {
        "time": {"t_end": 0.5},
        "beam": {"element": "point_mass", "mass": 2.0, "velocity": -0.3},
        "spring": spring,
        "contact": {"law": "tie"},
        "coupling": {"macro_step": 0.02},
    }
    return scene_from_dict({**scene, **tables})


@pytest.mark.parametrize("kind", KINDS)
def test_they_move_alike(below, kind):
    """m ẍ + c ẋ + k x = 0 of both masses together, with the momentum of the upper one."""
    spring, bodies = below(kind)
    run = simulate(above(spring), **bodies)
    decay = 0.5 * C / (2.0 + M)
    mass = 2.0 + M
    omega = np.sqrt(K / mass - decay**2)
    exact = -0.3 * 2.0 / mass / omega * np.exp(-decay * run.time) * np.sin(omega * run.time)
    assert np.abs(run.y - exact).max() < 1e-11
    assert run.summary["degree"] == 2


@pytest.mark.parametrize(("kind", "upper"), [
    ("element of the caller's", "own"), ("foreign", "element of the caller's"),
])  # fmt: skip
def test_steps_of_one_size_are_counted_from_where_the_run_starts(below, kind, upper):
    """Our beam arrives at 0.1501 s, another body at 0: each time 30 steps of 10 ms remain, and no other is made."""
    spring, bodies = below(kind, variable=False)
    start = 0.1501 if upper == "own" else 0.0
    scene = with_changes(
        load_scene("soft"),
        time={"t_end": start + 0.3},
        beam={"initial_deflection_slope": 0.1501, "n_elements": 4},
        contact={"law": "compliance", "stiffness": 10.0, "exponent": 1.0},
        coupling={"macro_step": 0.01},
        stop=None,
        spring=None,
    )
    scene = with_changes(scene, spring=spring)
    if "lower" in bodies:
        bodies["lower"].abilities = Abilities(any_size=False)
    if upper != "own":
        bodies["upper"] = PointMass(1.0, displacement=0.1501, velocity=-1.0)
    run = simulate(scene, **bodies)
    assert run.time[0] == pytest.approx(start, rel=1e-12)
    assert run.steps["size"][1:] == pytest.approx(np.full(30, 0.01), rel=1e-9)


class Held(SpringDamper):
    """Takes the force that a step starts with for that of the whole step, as a first body of one's own does."""

    def advance(self, time, size, contact, foundation=NO_FORCE):
        return super().advance(time, size, (contact[0], 0.0, 0.0), (foundation[0], 0.0, 0.0))


class Forgetful(SpringDamper):
    """Tells no integrals."""

    def advance(self, time, size, contact, foundation=NO_FORCE):
        return super().advance(time, size, contact, foundation)._replace(integral=0.0, integral_2=0.0)


@pytest.mark.parametrize("place", ["upper", "lower"])
@pytest.mark.parametrize(("kind", "lacks"), [(Held, "follows derivatives of the force"), (Forgetful, "integral_2")])
@pytest.mark.parametrize("y", [0.0, -1e3])
def test_a_body_that_ignores_what_a_degree_needs_is_run_with_degree_0_and_refused_a_higher_one(place, kind, lacks, y):
    """At 1 km a response of 1 mm is seen as well as at 0."""
    given = with_changes(above(OWN), contact={"law": "link", "stiffness": 50.0}, spring={"equilibrium": y})
    given = with_changes(given, beam={"displacement": y})
    start = {"displacement": y, "velocity": -0.3}
    run = simulate(given, **{place: kind(2.0, K, **start)})
    assert (run.summary["degree"], run.summary["status"]) == (0, "done")
    assert run.summary["max_energy_residual"] < 1e-9
    assert np.ptp(run.u_tip) > 0.01
    again = kind(2.0, K, **start)
    with pytest.raises(SceneError, match=rf"degree = 1: .* {lacks}.*; use degree = 0"):
        simulate(with_changes(given, coupling={"degree": 1}), **{place: again})
    assert again.motion()[:2] == (y, -0.3)
