"""The master with bodies of one's own: impacts that die out, refused steps, the ledger."""

import pytest

from springbeam import RunStopped, SpringDamper, simulate
from springbeam.bodies.protocol import Abilities, StepRefused
from springbeam.scene import load_scene, with_changes


def soft(n=6, **tables):
    """The scene `soft` on a coarse beam, for a tie, a foundation impact, a release and a second meeting."""
    tables["beam"] = {"n_elements": n, **tables.get("beam", {})}
    tables.setdefault("time", {"t_end": 0.3})
    coupling = {"degree": 2, "macro_step": 1e-3}
    return with_changes(load_scene("soft"), **{**tables, "coupling": {**coupling, **tables.get("coupling", {})}})


# -- steps that fail ------------------------------------------------------------------------------------------------


class Stuck(SpringDamper):
    """Makes no step that begins at 0.05 s or later."""

    def advance(self, time, size, *forces):
        if time < 0.0495:
            return super().advance(time, size, *forces)
        self.tried.append(size)
        raise StepRefused("stuck")


@pytest.mark.parametrize(("any_size", "halvings"), [(True, 20), (False, 0)])
def test_a_step_that_stays_refused_is_halved_20_times(any_size, halvings):
    """If it may have any size. The run then stops where that step begins; what was made before is kept."""
    scene = with_changes(load_scene("duffing"), time={"t_end": 0.1}, coupling={"macro_step": 1e-3})
    body = Stuck(1.0, 3.0)
    body.tried = []
    body.abilities = Abilities(any_size=any_size)
    with pytest.raises(RunStopped) as stopped:
        simulate(scene, lower=body)
    run = stopped.value.run
    assert body.tried == pytest.approx([1e-3 * 0.5**n for n in range(halvings + 1)], rel=1e-12)
    assert (stopped.value.cause, run.summary["halved_steps"]) == ("stuck", halvings)
    assert stopped.value.time == run.time[-1] == pytest.approx(0.05, rel=1e-12)


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


class Boastful(SpringDamper):
    """Reports more kinetic energy than it has: by ``more`` [J], once it moves."""

    more = 0.0

    def energies(self):
        right = super().energies()
        return right._replace(kinetic=right.kinetic + self.more * (right.kinetic > 0.0))


@pytest.mark.parametrize(
    ("share", "warns", "stops"), [(5e-9, False, False), (2e-8, True, False), (5e-4, True, False), (2e-3, True, True)]
)
def test_energy_that_appears_is_named(share, warns, stops):
    """A warning and a stop from the scheme's bounds on: 1e-8 and 1e-3 where the coupling creates no energy."""
    scene = soft(time={"t_end": 0.05}, coupling={"degree": 0})
    body = Boastful(1.0, 3.0)
    body.more = share * simulate(scene, check=False).e_total[0]
    try:
        run = simulate(scene, lower=body, check=False)
    except RunStopped as stopped:
        run = stopped.run
    assert (run.summary["status"] == "stopped") == stops
    named = [w for w in run.summary["warnings"] if "changed the energy" in w]
    assert (len(named), run.summary["resolved"]) == (warns, False if warns else None)
    for warning in named:
        percent = float(warning.partition(" by ")[2].partition(" %")[0])
        assert percent == pytest.approx(100.0 * share / (1.0 + share), rel=0.2)


@pytest.mark.parametrize(
    ("stiffness", "exponent", "macro_step", "degree"),
    [(1e15, 1.0, 4e-3, 1), (1e17, 1.0, 4e-3, 1), (1e18, 1.0, 4e-3, 1), (1e10, 1.0, 2e-2, 1), (1e10, 1.5, 2e-2, 2)],
)
def test_the_force_of_a_stiff_contact_is_found_in_whole_steps(stiffness, exponent, macro_step, degree):
    """At 1e15 N/m and more Newton's method needs the derivative of the force: a difference reaches over the kink at
    p = 0. In long steps it needs a start by a softened law."""
    law = {"law": "compliance", "stiffness": stiffness, "exponent": exponent}
    coupling = {"scheme": "energy", "degree": degree, "macro_step": macro_step}
    run = simulate(soft(10, contact=law, stop=None, time={"t_end": 0.1}, coupling=coupling), check=False)
    assert run.summary["halved_steps"] == 0
    assert run.summary["max_energy_residual"] < 1e-11


def test_a_contact_too_stiff_for_its_degree_is_made_in_shorter_steps_and_keeps_the_energy():
    """λ = 1e18 N/m, ω of the contact times H 1e7: the force of some steps is not found. A rounding of the tip's
    position, 1e-18 m, is 1 N there: over 1e-7 m of the motion 1e-6 of the energy."""
    law = {"law": "compliance", "stiffness": 1e18, "exponent": 1.0}
    coupling = {"scheme": "energy", "degree": 2, "macro_step": 4e-3}
    run = simulate(soft(10, contact=law, stop=None, time={"t_end": 0.1}, coupling=coupling), check=False)
    assert 0 < run.summary["halved_steps"] < 0.5 * run.summary["macro_steps"]
    assert run.summary["max_energy_residual"] < 1e-5
