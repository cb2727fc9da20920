"""`springbeam verify`: every exact solution is met, and a wrong parameter is found out."""

import json
from dataclasses import replace
from functools import partialmethod

import pytest
from commands import command, printed
from rich.console import Console
from scipy.integrate import quad
from scipy.special import airy

from springbeam.bodies.fmu_bodies import FmuBeam, FmuSpring
from springbeam.bodies.protocol import StepRefused
from springbeam.cli.checks import report
from springbeam.contact.laws import Compliance
from springbeam.coupling.solver import SCHEMES
from springbeam.studies import verify
from springbeam.studies.verify.alone import Check, section
from springbeam.studies.verify.coupled import _airy_overshoot


def test_exact_solutions_are_met_and_told_in_a_table_of_80_columns():
    console = Console(record=True, width=80)
    found, shown = report(verify.SECTIONS, console), console.export_text()
    assert all(found.values())
    assert [(title, check) for title, checks in found.items() for check in checks if not check.passed] == []
    assert f"{sum(map(len, found.values()))} passed, 0 failed" in shown
    assert all(words in shown for words in (*found, "quantity", "exact", "computed", "error", "bound"))
    assert max(len(line) for line in shown.splitlines()) <= 80
    assert "…" not in shown.replace("… one step late", "").replace("… Gauss–Seidel", "")  # nothing cut off


# -- a wrong parameter fails ----------------------------------------------------------------------------------------


@pytest.fixture
def changed(monkeypatch):
    """Let every body of a kind get ``key`` times ``change``, or another name, instead of what it was asked to have."""

    def change(body, key, change):
        right = body.__init__

        def wrong(self, parameters, *rest):
            value = change if isinstance(change, str) else change * getattr(parameters, key)
            right(self, parameters.model_copy(update={key: value}), *rest)

        monkeypatch.setattr(body, "__init__", wrong)

    return change


@pytest.mark.parametrize(
    ("section", "body", "key", "change"),
    [
        (verify.static_deflection, FmuBeam, "young_modulus", 1.01),
        (verify.static_deflection, FmuBeam, "shear_modulus", 1.01),
        (verify.frequencies, FmuBeam, "density", 1.01),
        (verify.frequencies, FmuBeam, "second_moment_of_area", 0.99),
        (verify.frequencies, FmuBeam, "shear_modulus", 1.01),
        (verify.frequencies, FmuBeam, "mass_matrix", "consistent"),  # its sixth frequency is 0.5 % higher
        (verify.duffing, FmuSpring, "mass", 1.01),
        (verify.duffing, FmuSpring, "cubic_stiffness", 1.01),
        (verify.bar_impact, FmuBeam, "density", 1.01),
        (verify.two_masses, FmuSpring, "linear_stiffness", 1.01),
        (verify.compliant_impact, FmuSpring, "mass", 1.01),
        (verify.compliant_impact, FmuBeam, "density", 1.01),
        (verify.link, FmuBeam, "shear_modulus", 1.01),
        (verify.link, FmuSpring, "linear_stiffness", 1.01),
        (verify.tie, FmuSpring, "mass", 1.01),
        (verify.resonance, FmuBeam, "alpha_b", 1.01),
        (verify.pulse, FmuSpring, "linear_stiffness", 1.01),
        (verify.slow_ramp, FmuBeam, "shear_modulus", 1.01),
    ],
    ids=lambda given: getattr(given, "solution", given).__name__ if callable(given) else str(given),
)
def test_a_body_that_is_off_by_one_percent_fails(section, body, key, change, changed, none_kept):
    changed(body, key, change)
    assert any(not check.passed for check in section())


RIGHT = {method: getattr(FmuBeam, method) for method in ("advance", "energies")}
RESISTANCE = Compliance.resistance


def pushed(self, time, size, force, *rest):
    """The beam gets 1.01 C."""
    return RIGHT["advance"](self, time, size, (1.01 * force[0], *force[1:]), *rest)


def energies(self, part):
    """The beam tells 1.01 of one of its energies."""
    told = RIGHT["energies"](self)
    return told._replace(**{part: 1.01 * getattr(told, part)})


def hardly_damped(law, p, rate):
    """The contact takes 1 % less than χ would."""
    return RESISTANCE(replace(law, damping=0.99 * law.damping), p, rate)


def base_as_force(self, load):
    """The spring takes the acceleration of its base for a force."""
    return [("external_force", 1.0)]


@pytest.mark.parametrize(
    ("section", "owner", "method", "wrong"),
    [
        (verify.energy_scheme, FmuBeam, "advance", pushed),
        (verify.energy_scheme, FmuBeam, "energies", partialmethod(energies, "kinetic")),
        (verify.energy_scheme, FmuBeam, "energies", partialmethod(energies, "potential")),
        (verify.energy_scheme, FmuBeam, "energies", partialmethod(energies, "dissipated")),
        (verify.hunt_crossley, Compliance, "resistance", hardly_damped),
        (verify.moving_base, FmuSpring, "_inputs_of", base_as_force),
    ],
    ids=["force", "kinetic", "potential", "dissipated", "damping", "base"],
)
def test_a_part_that_is_wrong_fails(section, owner, method, wrong, monkeypatch, none_kept):
    monkeypatch.setattr(owner, method, wrong)
    assert any(not check.passed for check in section())


def test_a_scheme_whose_conditions_are_met_late_fails(monkeypatch, none_kept):
    """By 1e-4 H."""
    for degree, right in SCHEMES["energy"].items():

        def wrong(m, size, right=right):
            return tuple(r + 1e-4 * size * m.velocity for r in right(m, size))

        monkeypatch.setitem(SCHEMES["energy"], degree, wrong)
    assert any(not check.passed for check in verify.energy_scheme())


def test_json_is_the_checks_and_a_failed_one_is_exit_code_1(monkeypatch, changed, none_kept):
    monkeypatch.setattr(verify, "SECTIONS", (verify.duffing, verify.static_deflection))
    document = json.loads(printed("verify", "--json"))
    assert document["passed"] is True
    assert [section["title"] for section in document["sections"]] == [section.title for section in verify.SECTIONS]
    for row, check in zip(document["sections"][0]["checks"], verify.duffing(), strict=True):
        assert (row["exact"], row["computed"], row["passed"]) == (check.exact, check.computed, check.passed)
    changed(FmuSpring, "mass", 1.01)
    result = command("verify", "--json")
    assert result.exit_code == 1
    assert json.loads(result.stdout)["passed"] is False
    result = command("verify")
    assert result.exit_code == 1
    assert "FAIL" in result.output


def test_a_case_that_cannot_be_computed_fails_alone_and_with_its_cause():
    @section("Spring", (1.0,), (2.0,), (3.0,))
    def refused(stiffness):
        if stiffness == 2.0:
            raise StepRefused("spring: too stiff")
        yield Check("y", stiffness, stiffness, 0.0, "")

    console = Console(record=True, width=80)
    checks = report([refused], console)["Spring"]
    assert [check.passed for check in checks] == [True, False, True]
    assert "2.0: spring: too stiff" in console.export_text()


# -- the exact values themselves ------------------------------------------------------------------------------------


def test_the_overshoot_of_a_dispersed_step_is_the_integral_of_airy():
    """The integral from the first zero on: Ai is negative below it. `itairy` is good for single precision, 1e-7."""
    first_zero = -2.338107410459767
    value, _ = quad(lambda x: airy(x)[0], first_zero, 20.0, epsabs=1e-12)
    assert _airy_overshoot() == pytest.approx(value, abs=1e-7)
