"""The master on exact bodies: events against the event-driven reference, refused steps, the ledger."""

from dataclasses import replace

import numpy as np
import pytest
from bodies import DuffingBody, Upper, simulate, stopping
from scenes import kinds, scene_from_dict

import springbeam
from springbeam.bodies.protocol import Abilities, StepRefused
from springbeam.results.records import STEP
from springbeam.run.gate import admit
from springbeam.run.ledger import Balance, bounds, errors
from springbeam.run.setup import set_up
from springbeam.run.stepping import Pair
from springbeam.scene import SceneError, load_scene, with_changes


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
    once. Cut off are rebounds below 1e-8 v₁ or over within 1e-9 H; all of the energy is booked as impact losses."""
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


def test_ends_that_start_at_rest_on_each_other_are_joined():
    """And stay so where nothing moves them: a rest is no parting."""
    run = simulate(soft(stop=None, beam={"initial_velocity_slope": 0.0}, time={"t_end": 0.01}))
    assert kinds(run) == ["impact"]
    assert set(run.phase) == {"tied"}
    assert not run.y.any()


def test_a_soft_contact_within_a_step_is_told_where_the_path_of_the_ends_has_it():
    """Two masses of 1 kg, λ = 1 MN/m: they touch for π/1414 s of a step of 10 ms."""
    law = {"law": "compliance", "stiffness": 1e6, "exponent": 1.0}
    tables = {"contact": law, "beam": {"approach": "elastic"}, "stop": None, "time": {"t_end": 0.02}}
    scene = with_changes(load_scene("soft"), **tables, coupling={"degree": 2, "macro_step": 0.01})
    ends = Upper(1.0, 0.0, 0.0, y=4.9e-3, z=-1.0), DuffingBody(1.0, 0.0, 0.0)
    run = simulate(scene, lambda *_: ends)
    there = run.at([event.time for event in run.events])
    assert kinds(run) == ["impact", "separation"]
    assert (len(run), there.time[0] < 6e-3 < there.time[1] < 0.01) == (3, True)
    assert there.gap == pytest.approx([0.0, 0.0], abs=1e-14)
    for name in ("y", "z", "u_tip", "v_tip"):
        assert [getattr(event, name) for event in run.events] == pytest.approx(there[name], rel=1e-10), name


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


@pytest.mark.parametrize(("stiffness", "exponent"), [(1e308, 1.0), (1e4, 100.0)])
def test_a_diagnostic_column_that_overflows_does_not_stop_a_run(stiffness, exponent):
    """With a tie the normal-compliance part drives nothing: the motion is what it is without."""
    scene = soft(stop=None, beam={"initial_velocity_slope": -1e6}, spring={"cubic_stiffness": 0.0})
    plain = simulate(with_changes(scene, contact={"stiffness": 0.0}))
    run = simulate(with_changes(scene, contact={"stiffness": stiffness, "exponent": exponent}))
    assert np.array_equal(run.u_tip, plain.u_tip)
    assert run.compliance_force.max() == 1e150
    assert np.isfinite(run.tie_reaction).all()
    assert [w for w in run.summary["warnings"] if "compliance_force is larger than 1e+150 N" in w]
    assert not any("compliance_force" in warning for warning in plain.summary["warnings"])


# -- the ledger -----------------------------------------------------------------------------------------------------


def test_a_residual_is_relative_to_the_largest_energy_so_far_that_of_the_contact_included():
    """1 J at first; a load then does 99 J of work, which the contact stores but for 1 mJ; and all comes back."""
    steps = np.zeros(3, STEP)
    steps["beam_kinetic"] = [1.0, 0.0, 1.0]
    steps["law_stored"] = [0.0, 99.999, 0.0]
    steps["beam_load"] = [0.0, -99.0, 0]
    steps["energy_at_start"] = 1.0
    share, largest = errors(steps, steps[:1], 0.0)
    assert share == pytest.approx([0.0, -1e-3 / 99.999, 0.0], rel=1e-9)
    assert largest.tolist() == [1.0, 99.999, 99.999]
    # Looked at one by one they are judged alike.
    assert errors(steps[2:], steps[:1], 99.999) == (share[2:], largest[2:])


@pytest.mark.parametrize("where", ["beam", "spring", "contact"])
def test_what_damping_takes_is_told_where_it_is_lost(where):
    damping = {"beam": {"alpha_b": 1e-2}, "spring": {"damping": 2.0}, "contact": {"damping": 2.0}}[where]
    linked = soft(stop=None, contact={"law": "link", "stiffness": 1e3}, coupling={"scheme": "energy"})
    run = simulate(with_changes(linked, **{where: damping}))
    lost = {f"loss_{part}": run.e_dissipated[-1] * (part == where) for part in ("beam", "spring", "contact")}
    assert {name: run.summary[name] for name in lost} == pytest.approx(lost, rel=1e-12)
    assert run.e_dissipated[0] == 0.0
    assert run.e_dissipated[-1] > 1e-3 * run.e_total[0]


@pytest.mark.parametrize(("tolerance", "warns"), [(1e-13, 1e-8), (1e-9, 1e-5), (1e-3, 1e-3)])
def test_a_looser_tolerance_may_change_more_of_the_energy(tolerance, warns):
    """That of the coupling or of a body: an energy 1 % above the bound warns, one below does not."""
    assert bounds(tolerance) == pytest.approx((warns, 1e-3), rel=1e-12)
    steps = np.zeros(2, STEP)
    steps["spring_kinetic"] = 1.0, 1.0 + 0.99 * warns
    steps["energy_at_start"] = 1.0
    for of_coupling, of_body in ((tolerance, 0.0), (1e-15, tolerance)):
        lower = DuffingBody()
        lower.tolerance = of_body
        balance = Balance(Pair(set_up(soft(coupling={"tolerance": of_coupling})), Upper(), lower))
        assert balance.report(steps)[1] == []
    steps["spring_kinetic"][1] = 1.0 + 1.01 * warns
    assert len(balance.report(steps)[1]) == 1


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
    assert (len(named), trajectory.summary["resolved"]) == (warns, not warns)
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


@pytest.mark.parametrize("miss", [2e-13, -2e-13])
def test_an_undeformed_tip_may_miss_what_it_meets_by_the_rounding_of_its_way(miss):
    """It has come down by 1 m/s for 0.5 s, to 1e-12 of that; a start at rest has no way to round."""
    scene = with_changes(load_scene("soft"), beam={"initial_deflection_slope": 0.5})
    setup = set_up(scene)
    assert setup.start == 0.5
    admit(setup, Upper(1.0, y=miss, z=-1.0), DuffingBody(1.0))
    for u, time in ((miss, 0.0), (4.0 * miss, 0.5)):
        with pytest.raises(SceneError, match="the upper end starts at"):
            admit(replace(setup, start=time), Upper(1.0, y=u, z=-1.0), DuffingBody(1.0))


@pytest.mark.parametrize("law", ["compliance", "link"])
@pytest.mark.parametrize("place", ["upper", "lower"])
def test_an_end_without_inertia_is_refused_where_no_force_can_be_found(law, place):
    """A lower one ended in a division by 0."""
    scene = with_changes(load_scene("soft"), beam={"n_elements": 4}, contact={"law": law, "stiffness": 9.0}, stop=None)
    body = DuffingBody(1.0, 3.0, 0.0)
    body.mass = 0.0
    with pytest.raises(SceneError, match=r"mass = 0: only an upper end can be without inertia"):
        springbeam.simulate(scene, **{place: body})
