"""The FMUs beside exact solutions (tests/exact): each is met, and a wrong parameter is found out."""

from dataclasses import replace
from functools import partialmethod

import exact
import pytest

from springbeam.bodies.own import FmuBeam, FmuSpring
from springbeam.coupling import solver
from springbeam.scene.laws import Compliance, KelvinVoigt


@pytest.mark.parametrize("section", exact.SECTIONS, ids=lambda section: section.solution.__name__)
def test_the_fmus_meet_the_exact_solution(section):
    checks = list(section())
    assert checks
    assert [check for check in checks if not check.passed] == []


# -- a wrong parameter fails ----------------------------------------------------------------------------------------


@pytest.fixture
def changed(monkeypatch):
    """Let every body of a kind get ``key`` times ``change`` instead of what it was asked to have."""

    def change(body, key, change):
        right = body.__init__

        def wrong(self, parameters, *rest):
            right(self, parameters.model_copy(update={key: change * getattr(parameters, key)}), *rest)

        monkeypatch.setattr(body, "__init__", wrong)

    return change


@pytest.mark.parametrize(
    ("section", "body", "key", "change"),
    [
        (exact.static_deflection, FmuBeam, "young_modulus", 1.01),
        (exact.duffing, FmuSpring, "cubic_stiffness", 1.01),
        (exact.bar_impact, FmuBeam, "density", 1.01),
        (exact.compliant_impact, FmuSpring, "mass", 1.01),
        (exact.link, FmuBeam, "shear_modulus", 1.01),
        (exact.resonance, FmuBeam, "alpha_b", 1.01),
    ],
    ids=lambda given: getattr(given, "solution", given).__name__ if callable(given) else str(given),
)
def test_a_body_that_is_off_by_one_percent_fails(section, body, key, change, changed, none_kept):
    changed(body, key, change)
    assert any(not check.passed for check in section())


RIGHT = {method: getattr(FmuBeam, method) for method in ("advance", "energies")}
RESISTANCE = {law: law.resistance for law in (Compliance, KelvinVoigt)}


def pushed(self, time, size, force, *rest):
    """The beam gets 1.01 C."""
    return RIGHT["advance"](self, time, size, (1.01 * force[0], *force[1:]), *rest)


def energies(self, part):
    """The beam tells 1.01 of one of its energies."""
    told = RIGHT["energies"](self)
    return told._replace(**{part: 1.01 * getattr(told, part)})


def hardly_damped(law, p, rate):
    """The contact takes 1 % less than its damping would."""
    return RESISTANCE[type(law)](replace(law, damping=0.99 * law.damping), p, rate)


@pytest.mark.parametrize(
    ("section", "owner", "method", "wrong"),
    [
        (exact.energy_scheme, FmuBeam, "advance", pushed),
        (exact.energy_scheme, FmuBeam, "energies", partialmethod(energies, "kinetic")),
        (exact.energy_scheme, FmuBeam, "energies", partialmethod(energies, "potential")),
        (exact.energy_scheme, FmuBeam, "energies", partialmethod(energies, "dissipated")),
        (exact.hunt_crossley, Compliance, "resistance", hardly_damped),
        (exact.kelvin_voigt, KelvinVoigt, "resistance", hardly_damped),
    ],
    ids=["force", "kinetic", "potential", "dissipated", "damping", "damper"],
)
def test_a_part_that_is_wrong_fails(section, owner, method, wrong, monkeypatch, none_kept):
    monkeypatch.setattr(owner, method, wrong)
    assert any(not check.passed for check in section())


def test_a_scheme_whose_conditions_are_met_late_fails(monkeypatch, none_kept):
    """By 1e-4 H."""

    def late(right):
        return lambda m, size: tuple(r + 1e-4 * size * m.velocity for r in right(m, size))

    monkeypatch.setattr(solver, "CONDITIONS", tuple(map(late, solver.CONDITIONS)))
    assert any(not check.passed for check in exact.energy_scheme())


# -- the exact values themselves ------------------------------------------------------------------------------------
