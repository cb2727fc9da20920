"""`springbeam verify`: every exact solution is met, and a wrong parameter is found out."""

import json
from dataclasses import replace

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


@pytest.fixture(scope="module")
def told():
    """The checks by section, and what is printed of them."""
    console = Console(record=True, width=80)
    return report(verify.SECTIONS, console), console.export_text()


@pytest.mark.parametrize("section", verify.SECTIONS, ids=lambda section: section.solution.__name__)
def test_exact_solutions_are_met(section, told):
    checks = told[0][section.title]
    assert checks
    assert [check for check in checks if not check.passed] == []


def test_they_are_told_in_a_table_of_80_columns(told):
    found, shown = told
    assert f"{sum(map(len, found.values()))} passed, 0 failed" in shown
    assert all(words in shown for words in (*found, "quantity", "exact", "computed", "error", "bound"))
    assert max(len(line) for line in shown.splitlines()) <= 80
    assert "…" not in shown.replace("… one step late", "").replace("… Gauss–Seidel", "")  # nothing cut off


# -- a wrong parameter fails ----------------------------------------------------------------------------------------


def changed(body, key, factor):
    """The body gets ``key`` times ``factor`` instead of what it was asked to have."""
    right = body.__init__

    def wrong(self, parameters, *rest):
        right(self, parameters.model_copy(update={key: factor * getattr(parameters, key)}), *rest)

    def mistake(patch):
        patch.setattr(body, "__init__", wrong)

    mistake.__name__ = f"{key}-{factor}"
    return mistake


def force_off(patch):
    """The beam gets 1.01 C."""
    right = FmuBeam.advance
    patch.setattr(
        FmuBeam, "advance", lambda self, t, size, c, *rest: right(self, t, size, (1.01 * c[0], *c[1:]), *rest)
    )


def energy_off(part):
    """The beam tells 1.01 of one of its energies."""
    right = FmuBeam.energies

    def wrong(self):
        told = right(self)
        return told._replace(**{part: 1.01 * getattr(told, part)})

    def mistake(patch):
        patch.setattr(FmuBeam, "energies", wrong)

    mistake.__name__ = f"energy_off_{part}"
    return mistake


def consistent(patch):
    """Every mesh has the consistent mass: its sixth frequency is 0.5 % higher."""
    right = FmuBeam.__init__

    def wrong(self, beam, *rest):
        right(self, beam.model_copy(update={"mass_matrix": "consistent"}), *rest)

    patch.setattr(FmuBeam, "__init__", wrong)


def gap_left_open(patch):
    """The scheme's conditions are met 1e-4 H late."""
    for degree, right in SCHEMES["energy"].items():

        def wrong(m, size, right=right):
            return tuple(r + 1e-4 * size * m.velocity for r in right(m, size))

        patch.setitem(SCHEMES["energy"], degree, wrong)


def undamped(patch):
    """The contact takes 1 % less than χ would."""
    right = Compliance.resistance
    patch.setattr(
        Compliance, "resistance", lambda law, p, rate: right(replace(law, damping=0.99 * law.damping), p, rate)
    )


def base_as_force(patch):
    """The spring takes the acceleration of its base for a force."""
    patch.setattr(FmuSpring, "_inputs_of", lambda self, load: [("external_force", 1.0)])


@pytest.mark.parametrize(
    ("section", "mistake"),
    [
        (verify.static_deflection, changed(FmuBeam, "young_modulus", 1.01)),
        (verify.static_deflection, changed(FmuBeam, "shear_modulus", 1.01)),
        (verify.frequencies, changed(FmuBeam, "density", 1.01)),
        (verify.frequencies, changed(FmuBeam, "second_moment_of_area", 0.99)),
        (verify.frequencies, changed(FmuBeam, "shear_modulus", 1.01)),
        (verify.frequencies, consistent),
        (verify.energy_scheme, force_off),
        (verify.energy_scheme, energy_off("kinetic")),
        (verify.energy_scheme, energy_off("potential")),
        (verify.energy_scheme, energy_off("dissipated")),
        (verify.duffing, changed(FmuSpring, "mass", 1.01)),
        (verify.duffing, changed(FmuSpring, "cubic_stiffness", 1.01)),
        (verify.bar_impact, changed(FmuBeam, "density", 1.01)),
        (verify.two_masses, changed(FmuSpring, "linear_stiffness", 1.01)),
        (verify.energy_scheme, gap_left_open),
        (verify.compliant_impact, changed(FmuSpring, "mass", 1.01)),
        (verify.compliant_impact, changed(FmuBeam, "density", 1.01)),
        (verify.hunt_crossley, undamped),
        (verify.link, changed(FmuBeam, "shear_modulus", 1.01)),
        (verify.link, changed(FmuSpring, "linear_stiffness", 1.01)),
        (verify.tie, changed(FmuSpring, "mass", 1.01)),
        (verify.resonance, changed(FmuBeam, "alpha_b", 1.01)),
        (verify.pulse, changed(FmuSpring, "linear_stiffness", 1.01)),
        (verify.slow_ramp, changed(FmuBeam, "shear_modulus", 1.01)),
        (verify.moving_base, base_as_force),
    ],
    ids=lambda given: getattr(given, "solution", given).__name__,
)
def test_a_mistake_of_one_percent_fails(section, mistake, monkeypatch, none_kept):
    mistake(monkeypatch)
    assert any(not check.passed for check in section())


def test_json_is_the_checks_and_a_failed_one_is_exit_code_1(monkeypatch, none_kept):
    monkeypatch.setattr(verify, "SECTIONS", (verify.duffing, verify.static_deflection))
    document = json.loads(printed("verify", "--json"))
    assert document["passed"] is True
    assert [section["title"] for section in document["sections"]] == [section.title for section in verify.SECTIONS]
    for row, check in zip(document["sections"][0]["checks"], verify.duffing(), strict=True):
        assert (row["exact"], row["computed"], row["passed"]) == (check.exact, check.computed, check.passed)
    changed(FmuSpring, "mass", 1.01)(monkeypatch)
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
