"""Stability: what the classes of the grid mean, a small part of it, and critical macro steps as predicted."""

import itertools
import pickle
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import judge
import numpy as np
import pytest
from bodies import couple
from draw import AT_REST, EXTREME, SLICES, drawn, scene_dict, slice_cells
from grid import Grid
from judge import CLASSES, Reference, ended, judged
from worked import Part

from springbeam import RunStopped, load_scene, simulate, with_changes
from springbeam.bodies.factory import load_bodies
from springbeam.bodies.fmu_bodies import FmuBeam
from springbeam.bodies.protocol import NO_FORCE
from springbeam.coupling import coupling_of
from springbeam.monolithic.semi_discrete import modal_beam
from springbeam.run.ledger import APPROXIMATE, EXACT
from springbeam.run.master import Master
from springbeam.scene import Beam, scene_from_dict
from springbeam.scene.files import tomllib
from springbeam.scene.frequencies import slowest_frequency
from springbeam.scene.laws import LAW
from springbeam.scene.linearised import hilltop, spring_frequency
from springbeam.scene.statics import bending_stiffness, shear_stiffness, tip_compliance, tip_inertia, tip_reach
from springbeam.studies.predict import THRESHOLD, critical_step, linear_pair

SMALL = {"time": {"t_end": 0.05}, "beam": {"n_elements": 5}, "coupling": {"macro_step": 2e-3}}


@lru_cache
def done(scheme="energy", degree=0, **beam):
    changes = {**SMALL, "beam": {**SMALL["beam"], **beam}}
    changes["coupling"] = {"macro_step": 2e-3, "scheme": scheme, "degree": degree}
    if scheme != "energy":  # an exchange needs a soft law
        changes["contact"] = {"law": "compliance", "stiffness": 100.0, "exponent": 1.5}
    return simulate(with_changes(load_scene("soft"), **changes))


def judge_cell(cell):
    return Grid().record(cell)


def changed(run, warnings=None, **columns):
    summary = run.summary if warnings is None else {**run.summary, "warnings": list(warnings)}
    return replace(run, columns={**run.columns, **columns}, summary=summary)


# -- classes --------------------------------------------------------------------------------------------------------


TABLE = tomllib.loads(Path(__file__).with_name("judged.toml").read_text(encoding="utf-8"))
#: What `energy`, which creates none, and an exchange may change.
BOUNDS = {"energy": EXACT, "jacobi": APPROXIMATE}


@pytest.mark.parametrize(
    "case", TABLE["energy"], ids=lambda case: f"{case['scheme']}-{case['bounds']:g}-{case['kind']}"
)
def test_energy_that_changes_is_judged_by_the_scheme_and_by_what_is_said(case):
    run = done(case["scheme"], 1)
    share = case["bounds"] * BOUNDS[case["scheme"]]
    residual = share * np.linspace(0.0, run.e_total[0], len(run))
    outcome = judged(changed(run, case["warnings"], energy_residual=residual), case.get("cause", ""))
    assert outcome["kind"] == case["kind"]
    if case["kind"] != "stopped":
        # Over the largest energy of the run, which an exchange has changed by less than 1e-4 of it.
        assert outcome["residual"] == pytest.approx(share, rel=1e-6 if case["scheme"] == "energy" else 1e-4)


def test_a_cell_is_stopped_by_what_its_last_steps_show_when_it_is_cut(monkeypatch):
    """They are checked a thousand together, so here not before the cut."""
    monkeypatch.setattr(judge, "_MOST_STEPS", 3)
    monkeypatch.setattr(judge, "_MOST_PER_MACRO_STEP", 0.0)
    outcome = judge_cell(short(coupling=("compliance", "jacobi", 0), depth=1e-6, exponent=1.0))
    assert outcome["kind"] == "stopped"
    assert "jacobi of degree 0 has changed the energy" in outcome["reason"]


@pytest.mark.parametrize("name", TABLE["found"])
def test_a_scene_that_was_found_garbage_is_none(name):
    found = dict(TABLE["found"][name])
    kinds = found.pop("kinds")
    reason = found.pop("reason")
    outcome = judge.judge(scene_from_dict({**found, "beam": Beam.ones() | found["beam"]}))
    assert outcome["kind"] in kinds
    assert reason in outcome["reason"]
    assert outcome["residual"] < EXACT


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


@pytest.mark.parametrize(("moved", "kind"), [(0.009, "dissipative"), (0.011, "garbage")])
def test_a_record_that_was_made_wrong_is_wrong_and_a_right_one_right(moved, kind):
    """Energy, overlap and what the run says are those of a right run; u_tip is moved by a share of its change."""
    run = simulate(with_changes(load_scene("soft"), **{**SMALL, "coupling": {"macro_step": 1e-3}}))
    steps = run.steps.copy()
    for name in ("u_tip", "u_tip_after"):
        steps[name] += moved * np.abs(run.u_tip - run.u_tip[0]).max() * steps["time"] / run.time[-1]
    outcome = judged(replace(run, steps=steps))
    assert (outcome["kind"], outcome["warns"]) == (kind, False)
    assert outcome["factor"] == pytest.approx(moved / judge.WRONG, abs=0.01)
    assert ("does not warn" in outcome["reason"]) is (kind == "garbage")


def test_what_is_wrong_of_a_run_with_an_accuracy_is_any_part_that_is_further_off():
    """The time of its contact is moved by 1.5 times the accuracy, which no error of the motion shows."""
    scene = with_changes(load_scene("soft"), **SMALL).model_copy(update={"accuracy": 1e-2})
    run = simulate(scene)
    late = [replace(event, time=event.time + 0.015 * scene.duration) for event in run.events]
    assert judged(run)["kind"] == "dissipative"
    outcome = judged(replace(run, events=late))
    assert (outcome["kind"], outcome["factor"]) == ("garbage", pytest.approx(1.5, abs=0.1))


def test_a_run_that_warns_is_compared_only_where_the_reference_is_given():
    scene = with_changes(load_scene("soft"), **SMALL)
    run = changed(simulate(scene), ["not resolved"])
    assert judged(run)["factor"] is None
    wrong = judged(run, reference=Reference(with_changes(scene, beam={"density": 1.3})))
    assert (wrong["kind"], wrong["factor"] > 1.0) == ("dissipative", True)


def test_an_ill_conditioned_scene_excuses_a_run(monkeypatch):
    """Two references, of which one is made to differ in what the change of the velocity does."""
    scene = with_changes(load_scene("soft"), **SMALL)
    reference = Reference(with_changes(scene, beam={"density": 1.3}))
    assert 0.5 <= Reference(scene).condition <= 10.0
    run = simulate(scene)
    assert judged(run, reference=reference)["kind"] == "garbage"
    reference.condition = 31.0
    assert judged(run, reference=reference)["factor"] is None


@pytest.mark.parametrize(
    ("column", "last", "phase", "reason"),
    [
        ("z", np.nan, "tied", "z is not finite"),
        ("gap", 2e-9, "tied", "overlap or part by 2.0e-09"),
        ("gap", -2e-9, "free", "overlap or part by 2.0e-09"),
        ("gap", 1.0, "free", ""),
        ("e_dissipated", -1e-6, "tied", "energy lost by damping returns"),
        ("e_impact_loss", -1e-6, "tied", "energy lost by impacts returns"),
    ],
)
def test_what_must_not_be_is_garbage_whatever_the_energy(column, last, phase, reason):
    """A gap is judged over the motion: the largest deflection and the way of a macro step."""
    run = done()
    motion = np.abs(run.shapes[1]).max() + 2e-3 * max(np.abs(run.v_tip).max(), np.abs(run.z).max())
    values = run[column].copy()
    phases = run.phase.copy()
    values[-1] = last * motion if column == "gap" else values[-1] + last
    phases[-1] = phase
    outcome = judged(changed(run, phase=phases, **{column: values}))
    assert (outcome["kind"] == "garbage") is bool(reason)
    assert reason in outcome["reason"]


def test_a_run_that_ends_early_is_stopped_for_its_cause():
    none = {name: values[:0] for name, values in done().columns.items()}
    for run in (done(), changed(done(), **none)):
        outcome = judged(run, "the contact chatters")
        assert (outcome["kind"], outcome["reason"]) == ("stopped", "the contact chatters")


def test_what_cannot_be_run_is_refused_and_a_crash_is_garbage(monkeypatch):
    outcome = judge_cell({**AT_REST, "coupling": ("compliance", "energy", 0), "fidelity": "quasi_static"})
    assert outcome["kind"] == "refused"
    assert "the tip between the beam and" in outcome["reason"]

    def crash(*_, **__):
        raise ZeroDivisionError("nothing there")

    monkeypatch.setattr(Master, "_advance", crash)
    outcome = judge_cell(slice_cells(2)[0])
    assert (outcome["kind"], outcome["reason"]) == ("garbage", "crashed: ZeroDivisionError: nothing there")


def test_a_cell_is_the_scene_that_its_parameters_tell():
    """In units of the beam and of the reach, the deflection in which both bodies hold ½ (m + m_tip) v²."""
    cell = AT_REST | TABLE["cell"] | {"coupling": ("compliance", "energy", 2)}
    scene = scene_from_dict(scene_dict(cell))
    of_bending = bending_stiffness(scene.beam)
    of_shear = shear_stiffness(scene.beam)
    assert (of_bending * of_shear, of_shear / of_bending) == pytest.approx((100.0**2, 4.0 / 2.0**2), rel=1e-14)
    m = 6.0 + tip_inertia(scene.beam)
    k = 1.04 / tip_compliance(scene.beam)
    reach = 2.0 * np.sqrt(m / k)
    assert scene.spring.mass == pytest.approx(6.0, rel=1e-14)
    assert scene.spring.linear_stiffness == pytest.approx(0.04 / 1.04 * k, rel=1e-14)
    assert hilltop(scene.spring) == pytest.approx(6.7 * reach, rel=1e-14)
    assert scene.contact.stiffness * (0.1 * reach) ** 1.5 == pytest.approx(k * reach, rel=1e-14)
    steps = 200 * 0.01 / max(slowest_frequency(scene.beam), np.sqrt(scene.spring.linear_stiffness / 6.0))
    assert (scene.contact_time, scene.duration) == pytest.approx((0.3 * reach / 2.0, steps), rel=1e-12)
    for elasticity, e in (("given", 0.3), ("plastic", 0.0), ("elastic", 1.0)):
        assert scene_dict(cell | {"elasticity": elasticity})["stop"]["restitution"] == e
    near = scene_from_dict(scene_dict(cell | {"approach": "elastic"}))
    assert near.initial_clearance == pytest.approx(0.1 * 2.0 * steps, rel=1e-12)  # a tenth of the run is so high
    light = scene_from_dict(scene_dict(AT_REST | {"mass": 1e-6, "k2_kind": "hardening", "k2": 1e4, "macro_step": 1e3}))
    assert spring_frequency(light) * light.coupling.H <= 30.0  # radians in a macro step


def test_a_hypercube_covers_its_range():
    """Each stratum holds one cell, so the range is covered to 1/300 of its length."""
    cells = drawn(EXTREME, 300, 1)
    for axis in EXTREME:
        if axis.zero:
            assert axis.grid(6)[0] == 0.0 < axis.low < axis.grid(6)[1] < axis.grid(6)[-1] == axis.high
        if axis.values:
            assert {cell[axis.name] for cell in cells} == set(axis.values)
            continue
        place = np.log if axis.log else np.asarray
        values = place(sorted(cell[axis.name] for cell in cells if cell[axis.name] != 0.0))
        low, high = place([axis.low, axis.high])
        assert values[0] == pytest.approx(low, abs=0.02 * (high - low))
        assert values[-1] == pytest.approx(high, abs=0.02 * (high - low))
    assert drawn(EXTREME, 300, 1) == cells != drawn(EXTREME, 300, 2)
    assert cells[0].keys() == AT_REST.keys()


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


# -- what the program writes ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("kinds", "code"), [(CLASSES[:-1], 0), (CLASSES, 1)])
def test_the_tables_count_every_cell_and_garbage_is_written_as_scenes(tmp_path, monkeypatch, kinds, code):
    monkeypatch.syspath_prepend(Path(__file__).parents[2] / "docs")
    grid = Grid(samples=30, resolution=2)
    cells = grid.cases()
    assert len(cells) == 30 + 4 * len(SLICES)
    records = {name: ended(kind) | {"residual": 1e-9} for name, kind in zip(cells, itertools.cycle(kinds))}
    found = grid.findings(records)
    found.written(tmp_path, pictures=False)
    counts = [int(line.split("|")[3]) for line in found.shown[2 : 2 + len(CLASSES)]]
    assert (sum(counts), counts[-1]) == (len(cells), len(found.texts))
    assert (found.code, len(found.texts)) == (code, code * (len(cells) // len(CLASSES)))
    for path in sorted(tmp_path.glob("garbage-*.toml"))[-3:]:  # of slices, which all can be run
        assert load_scene(path).time.t_end > 0.0


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
