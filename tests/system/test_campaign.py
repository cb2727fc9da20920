"""Scenes that are shipped, drawn and met before: each run keeps the same promises.

Energy is kept, or the run says by how much not. Where the run does not warn, its motion is that of the reference. What
is saved is what is loaded and what is exported, to the last bit. Bodies that an earlier run has left step as new ones.
What cannot run is refused by one error that names a key, and leaves nothing.
"""

from functools import cache

import numpy as np
import pytest
import scenes
import tomli_w
from commands import command, printed
from draw import USUAL, drawn, scene_dict
from hypothesis import given, settings
from hypothesis import strategies as st
from judge import judge

import springbeam
from springbeam import SceneError, simulate, with_changes
from springbeam.bodies.fmu import release
from springbeam.results.files import load_trajectory
from springbeam.run.ledger import bounds
from springbeam.scene import load_scene, shipped_scenes
from springbeam.scene.plausibility import EFFECTS, warnings_of

#: Algorithm 1 is compared with what the paper reports, in test_paper.py.
SHIPPED = [name for name in shipped_scenes() if not name.startswith("paper")]
MET = [f"{group}/{name}" for group in ("kept", "effects", "recorded") for name in scenes.group(group)]
DRAWN = {f"drawn {number}": scene_dict(cell) for number, cell in enumerate(drawn(USUAL, 8, seed=3))}


def made(name):
    if name in DRAWN:
        return scenes.scene.scene_from_dict(DRAWN[name])
    scene = load_scene(name) if name in SHIPPED else scenes.named(name)
    return with_changes(scene, {"time.t_end": min(scene.time.t_end, 0.2)}) if name in SHIPPED else scene


@cache
def run_of(name):
    release()
    return simulate(made(name))


def counts(run):
    """Return the numbers of a summary that no clock gives."""
    found = {name: value for name, value in run.summary.items() if name not in ("wall_time", "setup_time")}
    return found | {"errors": {**found.get("errors", {}), "wall_time": None}}


def same(one, other):
    """Return whether two runs have the same columns and shapes, to the last bit."""
    pairs = [(one[name], other[name]) for name in one.columns]
    pairs += zip(one.shapes or (), other.shapes or (), strict=True)
    return list(one.columns) == list(other.columns) and all(np.array_equal(a, b) for a, b in pairs)


@pytest.mark.parametrize("name", [*SHIPPED, *MET])
def test_energy_is_kept_or_what_is_lost_is_said(name):
    run = run_of(name)
    scene = run.scene
    relative = max(scene.coupling.tolerance, 0.0 if scene.spring is None else scene.spring.relative_tolerance)
    most, _ = bounds(relative, exchanges=scene.coupling.exchanges)
    said = any("energy" in warning for warning in run.summary["warnings"])
    assert (run.summary["status"], run.time[-1]) == ("done", scene.time.t_end)
    assert run.summary["max_energy_residual"] <= most or said
    for lost in (run.e_dissipated, run.e_impact_loss):  # is not given back
        assert np.diff(lost).min(initial=0.0) >= -1e-12 * np.abs(run.e_total).max()


@pytest.mark.parametrize(
    "name", [*(n for n in SHIPPED if n != "pulse"), *DRAWN]
)  # the reference takes minutes for its pulses
def test_a_run_that_does_not_warn_is_that_of_the_reference(name):
    """`judge` compares it, and finds what no run may have: a column that is not finite, bodies in one another."""
    try:
        scene = made(name)
    except SceneError:
        return  # drawn keys that do not go together
    found = judge(scene)
    assert found["kind"] in ("conserved", "dissipative", "approximate"), found["reason"]
    assert found["warns"] or found["factor"] is None or found["factor"] <= 1.0


@pytest.mark.parametrize("name", [*SHIPPED, *MET])
def test_a_run_made_again_or_saved_is_the_same_to_the_last_bit(name, here):
    run = run_of(name)
    again = simulate(run.scene)  # with the bodies that are kept
    assert same(run, again)
    assert counts(run) == counts(again)
    assert run.events == again.events
    run.save("run")
    loaded = springbeam.load("run")
    assert same(run, loaded)
    assert loaded.events == run.events
    assert loaded.scene == run.scene
    printed("export", "run")
    rows = np.genfromtxt("run/trajectory.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    for column in run.columns:
        assert np.array_equal(np.atleast_1d(rows[column]), run[column]), column


@pytest.mark.parametrize("name", ["kept/transmission", "kept/compliance", "kept/loads"])
def test_either_version_of_fmi_gives_the_same_bits(name, monkeypatch):
    monkeypatch.setenv("SPRINGBEAM_FMI", "3.0")
    other = simulate(made(name))
    assert same(run_of(name), other)
    assert run_of(name).events == other.events


#: Other values of keys, each of which changes a run of most scenes.
OTHERS = {
    "beam.n_elements": 3,
    "beam.element_degree": 2,
    "beam.reduced_integration": True,
    "beam.mass_matrix": "averaged",
    "beam.integrator": "midpoint",
    "beam.n_modes": 3,
    "stop.restitution": 0.25,
    "contact.stiffness": 2e3,
    "contact.exponent": 1.25,
    "contact.damping": 0.5,
    "contact.force_window": 3e-3,
    "coupling.degree": 1,
    "coupling.tolerance": 1e-3,
}


@settings(max_examples=40)
@given(name=st.sampled_from(sorted(scenes.group("effects"))), place=st.sampled_from(sorted(OTHERS)))
def test_a_key_that_plays_no_part_is_named_and_only_that(name, place):
    table, key = place.split(".")
    scene = scenes.named(f"effects/{name}")
    if scene.under(table) is None or (table == "coupling" and name in ("beam", "spring")):
        return  # an accuracy gives a scheme to one body as well: nothing is said of it
    if (name, place) == ("beam and soft stop", "coupling.tolerance"):
        return  # the response of a linear beam to a wall is known after one step: its force is found to rounding
    try:
        changed = with_changes(scene, **{table: {key: OTHERS[place]}})
    except SceneError:
        return
    named = [
        line for line in warnings_of(changed) if line.startswith(f"[{table}] {key} = ") and "plays no part" in line
    ]
    if getattr(scene.under(table), key) != OTHERS[place]:
        run = run_of(f"effects/{name}")
        other = simulate(changed)
        figures = [{k: v for k, v in counts(each).items() if k not in ("scene", "warnings")} for each in (run, other)]
        figures = [{k: v for k, v in each.items() if not isinstance(v, dict)} for each in figures]
        assert (same(run, other) and figures[0] == figures[1]) == bool(named)


def test_every_key_that_may_play_no_part_is_drawn():
    assert {place for places, *_ in EFFECTS for place in places} <= OTHERS.keys()


OPTIONS = scenes.TABLE["options"]


@settings(max_examples=40)
@given(names=st.sets(st.sampled_from(sorted(OPTIONS)), max_size=3))
def test_options_run_together_or_are_refused(tmp_path_factory, names):
    folder = tmp_path_factory.mktemp("options")
    words = " ".join(OPTIONS[name] for name in sorted(names)).split()
    settings_ = {word.partition("=")[0]: word for word in words if "=" in word and word[:2] != "--"}  # the last counts
    left_out = {word.removeprefix("no-") for word in words if word.startswith("no-")}
    tables = {
        name: table for name, table in scenes.TABLE["scenes"]["in pairs of options"].items() if name not in left_out
    }
    (folder / "scene.toml").write_text(tomli_w.dumps(scenes.completed(tables)))
    options = [word for word in words if "=" not in word and word.removeprefix("no-") not in left_out]
    arguments = [*options, "--no-plots", "--out", folder / "run", *(f"--set={word}" for word in settings_.values())]
    result = command("run", folder / "scene.toml", *arguments)
    if result.exit_code == 2:
        keys = [place.rpartition(".")[2] for place in settings_]
        for line in result.stderr.splitlines():
            assert any(word in line for word in (*keys, *left_out, *(w for w in words if w.startswith("--"))))
        assert (result.stdout, [path.name for path in folder.iterdir()]) == ("", ["scene.toml"])
        return
    assert (result.exit_code, result.stderr) == (0, "")
    run = load_trajectory(folder / "run")
    assert (run.summary["status"], run.time[-1]) == ("done", run.scene.time.t_end)
    if "interval" in names:
        rows = np.loadtxt(folder / "run/trajectory.csv", delimiter=",", skiprows=1, usecols=0)
        assert rows / 1e-3 == pytest.approx(np.round(rows / 1e-3), abs=1e-9)
