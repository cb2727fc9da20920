"""Parts of the grid of extreme scenes, a beam that is given another force, and critical macro steps as predicted."""

import pickle

import pytest
from bodies import couple
from draw import AT_REST
from grid import Grid
from worked import Part

from springbeam import RunStopped, load_scene, simulate, with_changes
from springbeam.bodies.factory import load_bodies
from springbeam.bodies.own import FmuBeam
from springbeam.bodies.protocol import NO_FORCE
from springbeam.coupling import coupling_of
from springbeam.monolithic.semi_discrete import modal_beam
from springbeam.scene.laws import LAW
from springbeam.scene.statics import tip_reach
from springbeam.studies.predict import THRESHOLD, critical_step, linear_pair


def judge_cell(cell):
    return Grid().record(cell)


# -- classes --------------------------------------------------------------------------------------------------------


# -- mutations ------------------------------------------------------------------------------------------------------

#: What the beam is given for the force of a step, beside which is that of the step before.
FAULTS = {
    "half of it": lambda force, before: tuple(0.5 * x for x in force),
    "1.01 of it": lambda force, before: tuple(1.01 * x for x in force),
    "that of the step before": lambda force, before: before,
    "its second derivative reversed": lambda force, before: (*force[:2], -force[2]),
}


def short(**coupling):
    """A cell near the scene `soft`, in steps that resolve it."""
    return {"slice": "", **AT_REST, "n_elements": 4, "macro_step": 0.02, "steps": 40, **coupling}


@pytest.mark.parametrize(("law", "fault"), [("transmission", "half of it"), *(("compliance", name) for name in FAULTS)])
def test_a_beam_that_is_given_another_force_is_garbage(monkeypatch, fault, law):
    """With half of it 116 cells had said "0 garbage": they warned, and the bound was that of the warning."""
    cell = short(coupling=(law, "energy", 2))
    right = judge_cell(cell)
    assert right["kind"] in ("dissipative", "conserved")
    assert not right["warns"]
    assert right["error_motion"] < 1e-6
    advance = FmuBeam.advance
    seen = {"time": None, "force": NO_FORCE, "before": NO_FORCE}

    def wrong(self, time, size, force, *foundation):
        if time != seen["time"]:
            seen.update(time=time, before=seen["force"])
        seen["force"] = force
        return advance(self, time, size, FAULTS[fault](force, seen["before"]), *foundation)

    monkeypatch.setattr(FmuBeam, "advance", wrong)
    assert judge_cell(cell)["kind"] == "garbage"


# -- a part of it ---------------------------------------------------------------------------------------------------


def test_a_part_of_the_grid_has_no_garbage_and_depends_on_nothing_else():
    """A record is that of its cell, whatever has been computed before.

    But for errors near rounding, whose digits differ, and how far a run goes that stops: it is checked every second.
    """
    part = Part()
    records = part.computed()
    for name in ("9", "6", "5", "2"):
        again = part.record(part.cases()[name])
        errors = [record.pop("error_motion") or 0.0 for record in (again, records[name])]
        assert errors[0] == pytest.approx(errors[1], abs=1e-6)
        assert records[name] | {"do_steps": None} == again | {"do_steps": None}
    assert [(r["kind"], r["reason"]) for r in records.values() if r["kind"] == "garbage"] == []
    assert {r["kind"] for r in records.values()} >= {"conserved", "dissipative", "approximate", "stopped"}


# -- critical macro steps: measured with the FMUs, as they are predicted -----------------------------------------


def linear_scene(law, stiffness, scheme, degree, H=4e-3):
    """`soft` with two elements, linear spring and contact (λ in N/m), at rest and without a stop."""
    spring = {"cubic_stiffness": 0.0, "equilibrium": 0.0, "external_force": 0.0, "initial_velocity": 0.0}
    beam = {"distributed_load": 0.0, "initial_deflection_slope": 0.0, "initial_velocity_slope": 0.0}
    return with_changes(
        load_scene("soft"),
        stop=None,
        beam={**beam, "n_elements": 2, "approach": "elastic"},
        spring=spring,
        contact=LAW.kept({"law": law, "stiffness": stiffness, "exponent": 1.0}, law),
        coupling={"scheme": scheme, "degree": degree, "macro_step": H},
    )


def growth(scene, steps=2000):
    """The factor by which amplitudes grow per macro step, of the second half of the steps."""
    beam, top, _ = load_bodies(scene, 0.0, scene.degree)
    reduced = 1.0 / (1.0 / beam.mass + 1.0 / top.mass)
    beam.apply_impulse(-reduced)
    top.apply_impulse(reduced)
    asked = scene.coupling
    coupling = coupling_of(asked.scheme, scene.degree, asked.tolerance, scene.soft_law, tip_reach(scene.beam))
    rows = couple(coupling, asked.H, steps, beam, top)
    beam.close()
    top.close()
    return (rows[-1].energy / rows[steps // 2].energy) ** (1.0 / steps)


def pair_of(scene):
    return linear_pair(scene, modal_beam(scene.beam))


@pytest.mark.parametrize("case", [("link", 1e8, "jacobi", 0), ("link", 1e4, "gauss_seidel", 1)])
def test_measured_as_predicted(case):
    """Within 1 %."""
    _, _, scheme, degree = case
    H = critical_step(pair_of(linear_scene(*case)), scheme, degree)
    below, *above = (growth(linear_scene(*case, share * H)) - 1.0 for share in (0.99, 1.003, 1.01))
    assert below < THRESHOLD < max(above)


@pytest.mark.parametrize(("scheme", "degree"), [("jacobi", 1), ("gauss_seidel", 0)])
def test_a_stiff_contact_gains_energy_and_the_run_says_so(scheme, degree):
    """The error can pass from one process to another, as from the workers of a study."""
    law = {"law": "compliance", "stiffness": 1e8, "exponent": 1.0}
    coupling = {"scheme": scheme, "degree": degree, "macro_step": 0.004}
    with pytest.raises(RunStopped, match=f"{scheme} of degree {degree}") as stopped:
        simulate(with_changes(load_scene("soft"), time={"t_end": 0.2}, contact=law, coupling=coupling))
    passed_on = pickle.loads(pickle.dumps(stopped.value))
    assert (str(passed_on), len(passed_on.run)) == (str(stopped.value), len(stopped.value.run))
