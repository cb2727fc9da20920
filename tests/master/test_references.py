"""The references: exact solutions, extended precision, and scipy."""

import exact
import numpy as np
import pytest
from exact import coupled, laws
from exact.alone import clamped_free_frequencies
from scenes import kinds, soft

from springbeam.monolithic import event_driven
from springbeam.monolithic.semi_discrete import modal_beam
from springbeam.scene import Beam, with_changes
from springbeam.scene.frequencies import fastest_frequency


def linear(**tables):
    """Return the scene of `soft` with a linear spring."""
    return soft(**{**tables, "spring": {"cubic_stiffness": 0.0, **tables.get("spring", {})}})


# -- the event-driven reference: exact solutions --------------------------------------------------------------------

#: (time, velocity afterwards) of the foundation impact and the release of `soft`, rounded to double: by a program that
#: shared nothing with the package, in 80-bit arithmetic, a Taylor series of order 46 on steps of 4 ms.
EXTENDED_PRECISION = [(0.07122400935981067, 0.298683962257942), (0.14436945620340189, 0.2019135428932935)]


def test_soft_agrees_with_extended_precision():
    """The lowest frequencies carry ε·ω_max/ω_min of their own size."""
    result = event_driven.integrate(soft(50, time={"t_end": 0.15}), sample_times=[0.0, 0.05, 0.15])
    assert kinds(result) == ["impact", "stop_impact", "release"]
    assert (result.events[0].z, result.y[1]) == pytest.approx((-0.0057403607, -0.0087444212), abs=5e-11)
    for event, (time, velocity) in zip(result.events[1:], EXTENDED_PRECISION, strict=True):
        assert event.time == pytest.approx(time, abs=3e-14)
        assert (event.z, event.v_tip) == pytest.approx((velocity, velocity), abs=2e-13)


LAWS = [exact.compliant_impact, exact.hunt_crossley, exact.link, exact.tie]


@pytest.mark.parametrize("section", LAWS, ids=lambda section: section.solution.__name__)
def test_the_reference_meets_the_exact_solutions_of_a_run(section, monkeypatch):
    """The bounds of laws are errors of a coupling and of IDA, of which the reference has neither."""
    monkeypatch.setattr(laws, "run_in_memory", event_driven.integrate)
    for check in section():
        assert check._replace(bound=1e-3 * check.bound).passed, check


def test_the_reference_of_a_bar_on_a_stop_approaches_the_exact_impact(monkeypatch):
    monkeypatch.setattr(coupled, "run_in_memory", event_driven.integrate)
    assert [check.quantity for check in exact.bar_impact.solution(10) if not check.passed] == []


def test_a_damped_contact_lets_go_where_its_ends_part_fast_and_never_pulls():
    contact = {"law": "compliance", "stiffness": 1e3, "exponent": 1.5, "damping": 5.0}
    run = event_driven.integrate(linear(contact=contact, stop=None, time={"t_end": 0.4}))
    slack = (run.phase == "touch") & (run.contact_force == 0.0) & (run.y > run.u_tip)
    assert 30 < np.sum(slack) < 50
    assert np.min(run.contact_force) > -1e-14
    assert run.summary["largest_relative_energy_residual"] < 1e-11


# -- beside scipy ---------------------------------------------------------------------------------------------------


def test_a_spring_that_runs_away_is_a_failure_of_the_reference():
    """½ z² = 12.5 J, the barrier is k1²/4|k2| = 11.25 J high."""
    scene = with_changes(soft(), beam=None, stop=None, time={"t_end": 20.0})
    unchecked = scene.model_copy(update={"lower": scene.spring.model_copy(update={"initial_velocity": 5.0})})
    with pytest.raises(event_driven.ReferenceFailure):
        event_driven.integrate(unchecked, sample_times=[0.0])


# -- its beam -------------------------------------------------------------------------------------------------------


def beam(bending=1.0, shear=1.0, **changes):
    return Beam.with_ones(young_modulus=bending, shear_modulus=shear, **changes)


@pytest.mark.parametrize(("degree", "n"), [(1, 40), (2, 16), (3, 8), (4, 5)])
@pytest.mark.parametrize("reduced", [False, True])
def test_the_order_of_the_frequencies_is_twice_the_degree(degree, n, reduced):
    exact = np.array(clamped_free_frequencies()[:6])
    assert exact[0] == pytest.approx(1.27396492100357, abs=1e-12)
    elements = {"element_degree": degree, "reduced_integration": reduced}
    errors = [modal_beam(beam(n_elements=m, **elements)).omega[:6] / exact - 1.0 for m in (n, 2 * n)]
    orders = np.log2(errors[0] / errors[1])
    # Of higher degrees the errors of the lowest modes are rounding, those of the highest not small yet.
    judged = orders if degree == 1 else orders[2:4]
    assert np.all(np.abs(judged - 2 * degree) < 0.08 * degree)


@pytest.mark.parametrize(("metre", "second"), [(1e-9, 1.0), (1.0, 1e-9), (1e3, 1.0)])
def test_units_do_not_matter(metre, second):
    """Rotations are then far larger than displacements: the sparse modes of a beam of micrometres were lost."""

    def slender(metre, second):
        scales = {"length": metre, "area": 1e-2 * metre**2, "second_moment_of_area": 1e-5 * metre**4}
        stiffness = 1.0 / (metre * second**2)
        mesh = {"n_elements": 22, "element_degree": 12, "n_modes": 19}
        return beam(1e4 * stiffness, 4e3 * stiffness, **scales, density=100.0 / metre**3, **mesh)

    found = modal_beam(slender(metre, second)).omega * second
    expected = modal_beam(slender(1.0, 1.0)).omega
    assert found[:19] == pytest.approx(expected[:19], rel=1e-12)
    # The static shapes lie in the span of the modes but for some 1e-6 of them: what is left has lost so many digits.
    assert found[19:] == pytest.approx(expected[19:], rel=1e-8)


@pytest.mark.parametrize("n_modes", [4, 12, 20])
def test_the_estimated_frequency_of_a_mode_lies_between_its_neighbours(n_modes):
    given = beam(4.0, 9.0, n_elements=40)
    omega = modal_beam(given).omega
    assert fastest_frequency(given) == pytest.approx(omega[-1], rel=1e-3)
    assert omega[n_modes - 2] < fastest_frequency(given.model_copy(update={"n_modes": n_modes})) < omega[n_modes]
