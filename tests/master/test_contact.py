"""What ends of a contact are left with, and which impacts are the last."""

from math import inf

import pytest
from bodies import interface_of

from springbeam import Motion, load_scene, with_changes
from springbeam.contact.phases import Automaton, Instant, Joint, Phase
from springbeam.motion.events import EventKind
from springbeam.scene.laws import Compliance, KelvinVoigt, Link
from springbeam.studies.linearised import depth


def automaton_of(scene="soft", tip_mass=0.01, mass=1.0, equilibrium=0.0, **tables):
    """The phases of a scene."""
    return Automaton(interface_of(with_changes(load_scene(scene), **tables), tip_mass, mass, equilibrium))


def instant(phase, ends, contact=0.0, tolerance=1e-17, start=None, elapsed=0.0):
    """Where an event happens in a run whose largest speed so far is 3 m/s."""
    return Instant(phase, ends, start or ends, elapsed, contact, tolerance, tolerance, 3.0)


@pytest.mark.parametrize(("kind", "mass"), [("separation", inf), ("separation", 1.0), ("unseated", 1.0)])
def test_a_tip_that_leaves_the_foundation_leaves_at_rest(kind, mass):
    """It rests on the stop, or on a seated spring top, which stays or leaves with it: the foundation gives the impulse.

    A tip that leaves tied to the top with another velocity would strike the foundation at once, or fly higher.
    """
    tip_mass = 0.01
    v = -3.0
    held = Phase(Joint.TIED if mass == inf else Joint.TOUCH, seated=True)
    automaton = automaton_of("beam-on-stop" if mass == inf else "soft", mass=mass)
    ends = Motion(0.0, v, 0.0, 0.0), Motion(0.0, 0.0, 0.0, 0.0)
    found, phase, impact = automaton.after(EventKind(kind), instant(held, ends, contact=-1.0))
    opened = Phase(Joint.TOUCH) if kind == "unseated" else Phase(Joint.FREE, seated=mass < inf)
    assert (found, phase) == (kind, opened)
    assert impact.on_spring == 0.0
    assert impact.of_foundation == impact.on_beam
    assert v + impact.on_beam / tip_mass == pytest.approx(0.0, abs=1e-15)
    assert impact.energy_loss == pytest.approx(0.5 * tip_mass * v**2, rel=1e-12)


@pytest.mark.parametrize("law", [Compliance(1e4, 1.5, 0.5), KelvinVoigt(1e4, 1.5, 5.0), Link(1e4, 3.0)], ids=repr)
@pytest.mark.parametrize("rate", [0.3, -1.9, -2.1])
def test_the_slopes_of_what_damping_adds_are_those_of_its_force(law, rate):
    """Both one-sided laws push no more where the ends part at 2 m/s or faster."""

    def damping(p, rate):
        return law.force(p, rate) - law.force(p)

    p = 0.01
    d = 1e-6
    slopes = (
        (damping(p + d, rate) - damping(p - d, rate)) / (2 * d),
        (damping(p, rate + d) - damping(p, rate - d)) / (2 * d),
    )
    assert law.resistance(p, rate) == pytest.approx((damping(p, rate), *slopes), rel=1e-6, abs=1e-6)


@pytest.mark.parametrize(("z", "kind"), [(-0.5, "retie"), (0.5, "separation")])
def test_a_massless_tip_whose_force_vanishes_at_equilibrium_is_tied_again_if_it_falls(z, kind):
    ends = (Motion(0.0, z, 0.0, 0.0),) * 2
    found, phase, _ = automaton_of(tip_mass=0.0).after(EventKind.SEPARATION, instant(Phase(Joint.TOUCH), ends))
    assert (found, phase.joint) == (kind, Joint.TIED if kind == "retie" else Joint.FREE)


def test_a_depth_is_found_where_the_energy_of_a_little_more_is_no_double():
    """λ p²⁰⁰¹/2001 = 1 J; 2²⁰⁰¹ is too large."""
    assert depth(Compliance(1e-3, 2000.0), 1.0) == pytest.approx(2.001e6 ** (1.0 / 2001.0), rel=1e-15)
