"""What Python programs call: results loaded, saved and handed on, and bodies of one's own."""

from functools import partial

import numpy as np
import pytest
import tomli_w
from bodies import bodies_of
from commands import printed

import springbeam
from springbeam import RunStopped, SceneError, Simulation, load_scene, simulate, with_changes
from springbeam.scene import scene_from_dict
from springbeam.scene.laws import Compliance

SOFT = with_changes(load_scene("soft"), time={"t_end": 0.2}, coupling={"macro_step": 1e-3, "degree": 2})


# -- handed on ------------------------------------------------------------------------------------------------------


def test_a_run_that_is_made_step_by_step_is_a_trajectory_on_the_way():
    scene = with_changes(load_scene("soft"), time={"t_end": 0.1}, beam={"n_elements": 8})
    with springbeam.Simulation(scene) as sim:
        assert len(sim.run) == 0
        assert all(sim.step() for _ in range(40))
        halfway = sim.run
        state = sim.state
        assert halfway.summary["status"] == "running"
        assert (halfway.time[-1], halfway.phase[-1]) == (state.time, state.phase.name)
        assert halfway.summary["macro_steps"] == state.macro_steps == 40
        while sim.step():
            pass
        assert (sim.done, sim.step(), sim.run.summary["status"]) == (True, False, "done")
        assert np.array_equal(halfway.at(0.00512).y, sim.run.at(0.00512).y)
    assert halfway.steps.tobytes() == sim.run.steps[:41].tobytes()


# -- bodies of one's own --------------------------------------------------------------------------------------------

HITS = with_changes(load_scene("soft"), coupling={"degree": 2, "macro_step": 5e-4}, time={"t_end": 0.14})


mass = partial(springbeam.PointMass, 1.0)


class Silent(springbeam.Body):
    """Nothing but what a body must do: no shape, no energies, no force that holds it."""

    def __init__(self, body):
        self.body = body
        self.mass = body.mass
        self.mark = body.mark
        self.rewind = body.rewind
        self.advance = body.advance
        self.motion = body.motion
        self.apply_impulse = body.apply_impulse


def test_a_body_need_not_tell_its_shape_or_energies():
    scene = with_changes(HITS, time={"t_end": 0.05})
    with bodies_of(scene) as (beam, _):
        run = simulate(scene, upper=Silent(beam))
    assert np.abs(run.y - simulate(scene).y).max() < 1e-9
    assert len(run.shapes[0]) == 0
    assert np.array_equal(run.e_beam, np.zeros(len(run)))
    assert "a body reports no energies, so the energy balance is not checked" in run.summary["warnings"]


class Unstruck(springbeam.PointMass):
    """Takes no impulse."""

    apply_impulse = springbeam.Body.apply_impulse


APART = with_changes(
    SOFT, stop=None, time={"t_end": 0.1}, coupling={"degree": 0}, beam={"approach": "elastic", "n_elements": 4}
)


@pytest.mark.parametrize(
    ("change", "body", "says"),
    [
        ({"contact": {"law": "tie"}}, mass(-0.1), 'law = "tie": the upper end starts at 0 m .* -0.1 m; let'),
        (
            {"contact": {"law": "tie"}},
            Unstruck(1.0, 0.0, -2.0),
            r"start with -1 and -2 m/s .* body in \[spring\] does not take",
        ),
        ({"contact": {"law": "compliance"}}, mass(0.1), "the lower one at 0.1 m; it must start there or above"),
        ({"stop": {"position": -0.1}}, mass(-0.2), r"position = -0.1: .* \[spring\] starts below .* -0.2 m"),
        (
            {"beam": {"initial_deflection_slope": 0.05, "approach": "undeformed"}},
            mass(0.0, 1.0),
            r'approach = "undeformed": the body in \[spring\] starts with 1 m/s, but nothing moves until .* t = 0.05 s',
        ),
    ],
)
def test_a_start_that_cannot_be_is_refused_whoever_made_the_body(change, body, says):
    start = body.motion()
    with pytest.raises(SceneError, match=says):
        simulate(with_changes(APART, **change), lower=body)
    assert body.motion() == start


def test_an_error_in_a_body_of_ones_own_is_reported_at_once(monkeypatch):
    """Without 20 halvings of the step: it is called once more after the last step that is made."""
    advance = springbeam.PointMass.advance
    steps = []

    def failing(self, time, *rest):
        steps.append(time)
        if time >= 0.03:
            raise OverflowError("too fast")
        return advance(self, time, *rest)

    monkeypatch.setattr(springbeam.PointMass, "advance", failing)
    with pytest.raises(RunStopped) as stopped:
        simulate(with_changes(APART, contact={"law": "compliance"}), lower=mass())
    assert stopped.value.cause == "OverflowError: too fast"
    assert stopped.value.time == pytest.approx(0.03, abs=APART.coupling.macro_step)
    assert sum(time >= 0.03 for time in steps) == 1


def test_a_scene_may_be_a_name_a_file_or_tables(tmp_path):
    tables = {"time": {"t_end": 0.01}, "spring": {"mass": 1.0, "linear_stiffness": 3.0, "equilibrium": 0.1}}
    (tmp_path / "my.toml").write_text(tomli_w.dumps(tables))
    runs = [simulate(scene) for scene in (tables, tmp_path / "my.toml", scene_from_dict(tables))]
    assert len({run.steps.tobytes() for run in runs}) == 1
    with Simulation("duffing") as simulation:
        assert simulation.scene == load_scene("duffing")
    with pytest.raises(SceneError, match="sofft: no such file, and no shipped scene; did you mean soft"):
        simulate("sofft")


def test_a_simulation_gives_its_fmus_back_once_and_steps_no_more():
    """Closed twice, its instances served two later runs at once, each of which moved the other's."""
    scene = with_changes(load_scene("soft"), time={"t_end": 0.1}, beam={"n_elements": 8})
    alone = springbeam.simulate(scene)
    first = springbeam.Simulation(scene)
    first.step()
    first.close()
    for makes_steps in (first.step, first.finish):
        with pytest.raises(ValueError, match="is closed"):
            makes_steps()
    second = springbeam.Simulation(scene)
    first.close()
    with second, springbeam.Simulation(scene) as third:
        while second.step():
            third.step()
        assert second.run.steps.tobytes() == alone.steps.tobytes()


# -- in a notebook --------------------------------------------------------------------------------------------------


def test_a_dataset_has_each_time_once_and_both_sides_of_an_impact():
    run = simulate(with_changes(SOFT, {"time.t_end": 0.16}))
    dataset = run.to_xarray()
    assert (np.diff(dataset.time.values) > 0.0).all()
    assert float(dataset.y.sel(time=0.1, method="nearest")) == run.y[np.abs(run.time - 0.1).argmin()]
    stop = next(event for event in run.events if event.kind == "stop_impact")
    struck = dataset.sel(event_time=stop.time, time=stop.time)
    # Restitution 1; the velocity changes by |ÿ| times the distance of two doubles before it.
    rounding = 2.0 * np.abs(run.a_y).max() * np.spacing(stop.time)
    assert float(struck.z) == pytest.approx(-float(struck.z_before), abs=rounding, rel=0.0)
    assert float(struck.z) == stop.z


def test_a_run_is_drawn_into_axes_of_the_callers():
    matplotlib = pytest.importorskip("matplotlib")
    run = simulate(with_changes(SOFT, {"time.t_end": 0.02}))
    figure = matplotlib.figure.Figure()
    ax = figure.add_subplot()
    assert run.plot("positions", ax=ax) is figure
    lines = {line.get_label(): line for line in ax.lines}
    assert np.allclose(lines["spring top y"].get_ydata().min() / run.y.min(), 1e3)  # in mm
    with pytest.raises(ValueError, match="no picture 'moments' for axes"):
        run.plot("moments", ax=ax)


def test_a_study_from_python_is_that_of_its_command(here):
    pandas = pytest.importorskip("pandas")
    seen = []
    vary = {"spring.mass": [1, 2.5], "time.t_end": [0.01]}
    found = springbeam.sweep("soft", vary, ["u_tip_min"], directory="kept", progress=seen.append)
    printed("sweep", "soft", "--vary=spring.mass=1,2.5", "--vary=time.t_end=0.01", "--metric=u_tip_min", "--out=by",
            "--workers=1", "--no-plots")  # fmt: skip
    rows = pandas.read_csv("by/sweep.csv")
    assert found.table["u_tip_min"].tolist() == rows["u_tip_min"].tolist()
    assert (seen, found.ok, repr(found).splitlines()[0]) == ([1, 2], True, "runs      2 done")
    again = springbeam.sweep("soft", vary, ["u_tip_min"], directory="kept", progress=seen.append)
    assert (len(seen), again.table.equals(found.table)) == (2, True)  # nothing was computed again
    assert "spring.mass" in found.plot().axes[0].get_xlabel()
    with pytest.raises(SceneError, match=r"vary spring\.masss=1: "):
        springbeam.sweep("soft", {"spring.masss": [1]})


def test_other_studies_from_python(tmp_path):
    scene = with_changes(SOFT, {"time.t_end": 0.02, "beam.n_elements": 4})
    checked = springbeam.crosscheck(scene)
    assert (checked.ok, checked.document["verdict"]) == (True, "agrees")
    settled = springbeam.converge(scene, ["u_tip_end"], levels=3)
    assert list(settled.document) == ["elements", "modes"]
    run = simulate(scene)
    np.savetxt(tmp_path / "y.csv", np.column_stack([run.time, run.y])[::4], delimiter=",", header="time,y", comments="")
    fitted = springbeam.fit(scene, tmp_path / "y.csv", {"spring.linear_stiffness": "1:9"}, shift=0.0)
    (key,) = fitted.document["keys"]
    assert (key["key"], key["value"]) == ("spring.linear_stiffness", pytest.approx(3.0, rel=1e-4))


# -- loads and laws of one's own ------------------------------------------------------------------------------------


def test_a_function_is_a_load_like_its_signal():
    """Over a step of ωH = 0.04 both are projected to rounding: 8 Gauss points are exact to (ωH/2)¹⁶."""
    own = springbeam.FunctionLoad(on="tip", function=lambda t: -3.0 * np.sin(40.0 * t), fastest=40.0)
    same = {"on": "tip", "signal": "harmonic", "amplitude": -3.0, "frequency": 20.0 / np.pi}
    made, known = (simulate(with_changes(SOFT, loads=[load])) for load in (own, same))
    assert np.abs(made.y - known.y).max() <= 1e-13 * np.abs(known.y).max()
    assert np.allclose(made["load_0"], known["load_0"], rtol=1e-14, atol=1e-14)
    assert springbeam.crosscheck(with_changes(made.scene, {"time.t_end": 0.02, "beam.n_elements": 4})).ok


def test_a_function_moves_a_wall_if_its_derivative_is_given():
    tables = {"time.t_end": 0.1, "contact.law": "tie", "coupling.macro_step": 1e-3}
    bodies = {"beam": {"element": "point_mass", "mass": 1.0}, "spring": {"element": "moving_wall"}}
    cam = {"on": "wall", "function": lambda t: 0.01 * t**3}
    scene = {**tables, **bodies, "loads": [springbeam.FunctionLoad(**cam, derivative=lambda t: 0.03 * t**2)]}
    run = simulate(scene)
    assert np.abs(run.u_tip - 0.01 * run.time**3).max() < 1e-17
    with pytest.raises(ValueError, match="has no derivative, by which a wall moves; give it one"):
        simulate({**scene, "loads": [springbeam.FunctionLoad(**cam)]})


def test_a_law_of_ones_own_is_the_one_that_has_the_same_force():
    soft = {"law": "compliance", "stiffness": 1e4, "exponent": 1.5, "damping": 0.3}
    own, known = (simulate(with_changes(SOFT, contact=law)) for law in (Compliance(1e4, 1.5, 0.3), soft))
    assert np.array_equal(own.y, known.y)
    assert np.array_equal(own.contact_force, known.contact_force)
    with pytest.raises(SceneError, match="no reference has it"):
        springbeam.crosscheck(own.scene)


def test_accuracy_and_times_are_arguments_of_a_run():
    scene = with_changes(SOFT, {"time.t_end": 0.05, "beam.n_elements": 4})
    times = [0.0, 0.0123, 0.05]
    accurate = simulate(scene, accuracy=1e-3, times=times)
    assert accurate.time.tolist() == times
    assert accurate.summary["accuracy"]["asked"] == 1e-3
    assert accurate.y.tolist() == simulate(with_changes(scene, accuracy=1e-3)).at(times).y.tolist()
