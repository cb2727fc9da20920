"""The master on exact bodies: events against the event-driven reference, refused steps, the ledger."""

import pytest
from bodies import simulate, stopping
from scenes import scene_from_dict

from springbeam.bodies.protocol import Abilities, StepRefused
from springbeam.scene import load_scene, with_changes


def soft(n=6, **tables):
    """The scene `soft` on a coarse beam, for a tie, a foundation impact, a release and a second meeting."""
    tables["beam"] = {"n_elements": n, **tables.get("beam", {})}
    tables.setdefault("time", {"t_end": 0.3})
    coupling = {"degree": 2, "macro_step": 1e-3}
    return with_changes(load_scene("soft"), **{**tables, "coupling": {**coupling, **tables.get("coupling", {})}})


# -- against the reference ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("e", "size"), [(0.5, 1e-3), (0.97, 10.0)])
def test_a_bouncing_mass_comes_to_rest_after_its_geometric_series(e, size):
    """Constant load g, from height d: rest after t₁ + 2 v₁ (e + e² + …)/g, where e ≥ 0.97 bounces hundreds of times at
    once. Cut off are rebounds below 1e-8 v₁ or over within 1e-9 H; the impacts lose all of the energy."""
    g = 10.0
    d = 0.05
    v = (2.0 * g * d) ** 0.5
    t1 = (2.0 * d / g) ** 0.5
    rest = t1 + 2.0 * v / g * e / (1.0 - e)
    scene = scene_from_dict({
        "time": {"t_end": rest + 5.0 * size},
        "spring": {"linear_stiffness": 0.0, "external_force": -g, "equilibrium": d},
        "stop": {"position": 0.0, "restitution": e},
        "coupling": {"macro_step": size},
    })  # fmt: skip
    trajectory = simulate(scene)
    assert [event.kind for event in trajectory.events].count("seated") == 1
    assert trajectory.events[-1].time == pytest.approx(rest, abs=(2e-8 * v / g + 1e-9 * size) / (1.0 - e))
    assert trajectory.e_impact_loss[-1] == pytest.approx(g * d, rel=1e-12)
    assert trajectory.z[-1] == 0.0


# -- steps that fail ------------------------------------------------------------------------------------------------


def wrapped(**overrides):
    """A `wrap` for `simulate`: the spring with methods that get the body's own one first."""

    def wrap(beam, spring):
        for name, function in overrides.items():
            own = getattr(spring, name)
            setattr(spring, name, lambda *a, f=function, own=own: f(own, *a))
        return beam, spring

    return wrap


@pytest.mark.parametrize(("any_size", "halvings"), [(True, 20), (False, 0)])
def test_a_step_that_stays_refused_is_halved_20_times(any_size, halvings):
    """If it may have any size. The run then stops where that step begins; what was made before is kept."""
    scene = with_changes(load_scene("duffing"), time={"t_end": 0.1}, coupling={"macro_step": 1e-3})
    tried = []

    def advance(own, time, size, *forces):
        if time < 0.0495:
            return own(time, size, *forces)
        tried.append(size)
        raise StepRefused("stuck")

    def wrap(beam, spring):
        spring.abilities = Abilities(any_size=any_size)
        return wrapped(advance=advance)(beam, spring)

    trajectory, stopped = stopping(scene, wrap)
    assert tried == pytest.approx([1e-3 * 0.5**n for n in range(halvings + 1)], rel=1e-12)
    assert (stopped.cause, trajectory.summary["halved_steps"]) == ("stuck", halvings)
    assert stopped.time == trajectory.time[-1] == pytest.approx(0.05, rel=1e-12)


# -- the ledger -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("where", ["beam", "spring", "contact"])
def test_what_damping_takes_is_told_where_it_is_lost(where):
    damping = {"beam": {"alpha_b": 1e-2}, "spring": {"damping": 2.0}, "contact": {"damping": 2.0}}[where]
    linked = soft(stop=None, contact={"law": "link", "stiffness": 1e3}, coupling={"scheme": "energy"})
    run = simulate(with_changes(linked, **{where: damping}))
    lost = {f"loss_{part}": run.e_dissipated[-1] * (part == where) for part in ("beam", "spring", "contact")}
    assert {name: run.summary[name] for name in lost} == pytest.approx(lost, rel=1e-12)
    assert run.e_dissipated[0] == 0.0
    assert run.e_dissipated[-1] > 1e-3 * run.e_total[0]


@pytest.mark.parametrize(
    ("share", "warns", "stops"), [(5e-9, False, False), (2e-8, True, False), (5e-4, True, False), (2e-3, True, True)]
)
def test_energy_that_appears_is_named(share, warns, stops):
    """A spring that reports more kinetic energy than it has: a warning and a stop from the scheme's bounds on.

    1e-8 and 1e-3 where the coupling creates no energy.
    """
    scene = soft(time={"t_end": 0.05}, coupling={"degree": 0})
    total = simulate(scene).e_total[0]

    def energies(own):
        values = own()
        return values._replace(kinetic=values.kinetic + share * total * (values.kinetic > 0.0))

    trajectory, stopped = stopping(scene, wrapped(energies=energies))
    named = [w for w in trajectory.summary["warnings"] if "changed the energy" in w]
    assert (len(named), trajectory.summary["resolved"]) == (warns, False if warns else None)
    for warning in named:
        percent = float(warning.partition(" by ")[2].partition(" %")[0])
        assert percent == pytest.approx(100.0 * share / (1.0 + share), rel=0.2)
    assert (stopped is not None) is stops


def test_a_contact_too_stiff_for_its_degree_is_made_in_shorter_steps_and_keeps_the_energy():
    """λ = 1e18 N/m, ω of the contact times H 1e7: the force of some steps is not found. A rounding of the tip's
    position, 1e-18 m, is 1 N there: over 1e-7 m of the motion 1e-6 of the energy."""
    law = {"law": "compliance", "stiffness": 1e18, "exponent": 1.0}
    coupling = {"scheme": "energy", "degree": 2, "macro_step": 4e-3}
    run = simulate(soft(10, contact=law, stop=None, time={"t_end": 0.1}, coupling=coupling))
    assert 0 < run.summary["halved_steps"] < 0.5 * run.summary["macro_steps"]
    assert run.summary["max_energy_residual"] < 1e-5
