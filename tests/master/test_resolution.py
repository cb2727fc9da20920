"""Whether a macro step resolves the motion: frequencies beside the mesh's, and the criterion from both sides."""

import numpy as np
import pytest
from bodies import DuffingBody, Upper, pair_of
from scenes import scene_from_dict

from springbeam import simulate
from springbeam.contact.phases import Joint, Phase
from springbeam.monolithic.semi_discrete import modal_beam
from springbeam.results.records import STEP
from springbeam.run.resolution import curve_error, peak_force_doubt, why_not_resolved
from springbeam.run.setup import set_up
from springbeam.run.stepping import Pair
from springbeam.scene import load_scene, with_changes
from springbeam.scene.frequencies import fastest_frequency, mesh_frequency, slowest_frequency
from springbeam.scene.statics import lowest_frequency, tip_compliance

BEAMS = ["soft", "steel-bumper", "vibro-impact", "bar-impact"]
PAIR = load_scene("soft")


@pytest.mark.parametrize("name", BEAMS)
def test_the_slowest_frequency_is_that_of_the_mesh_and_without_one_exact(name):
    beam = load_scene(name).beam
    assert slowest_frequency(beam) == pytest.approx(modal_beam(beam).omega[0], rel=2e-3)
    fine = {"n_elements": 8, "element_degree": 4, "reduced_integration": False, "n_modes": 0}
    exact = modal_beam(beam.model_copy(update=fine)).omega[0]
    assert lowest_frequency(beam) == pytest.approx(exact, rel=2e-9)


def test_a_mesh_that_locks_has_higher_frequencies():
    """Eight elements of a slender beam are 51 times too stiff; what shears fastest is held by the section's turning."""
    beam = load_scene("steel-bumper").beam.model_copy(update={"n_elements": 8, "reduced_integration": False})
    omega = modal_beam(beam).omega
    assert (slowest_frequency(beam), mesh_frequency(beam)) == pytest.approx((omega[0], omega[-1]), rel=2e-3)


def test_the_fastest_frequency_is_the_meshs_or_that_of_the_last_mode_kept():
    for mass in ("averaged", "consistent"):
        beam = PAIR.beam.model_copy(update={"mass_matrix": mass})
        omega = modal_beam(beam).omega
        assert fastest_frequency(beam) == pytest.approx(omega[-1], rel=1e-3)
    fewer = beam.model_copy(update={"n_modes": 10})
    assert omega[8] < fastest_frequency(fewer) < omega[10]
    every = fewer.model_copy(update={"integrator": "midpoint"})
    assert fastest_frequency(every) == fastest_frequency(beam)


def records(count=2, size=1e-3):
    """Records of ``count`` steps of ``size`` in which nothing moves."""
    steps = np.zeros(count + 1, STEP)
    steps["size"][1:] = size
    steps["time"] = size * np.arange(count + 1)
    return steps


def judged(scene, misplaced=0.0, between=0.0, steps=None):
    """Return why a run of ``scene`` would not be resolved."""
    with pair_of(scene) as pair:
        return why_not_resolved(pair, records() if steps is None else steps, misplaced, between)


@pytest.mark.parametrize("turn", [1.0, 3.0, 2.0 * np.pi, 8.0])
def test_the_curve_of_an_oscillation_is_as_wrong_as_is_said(turn):
    """A mass on a spring, which rows show exactly: in 40 steps that are no whole period every phase comes by."""
    omega = 10.0
    H = turn / 10.0
    table = {"element": "spring_damper", "mass": 1.0, "stiffness": omega**2, "displacement": 0.5, "velocity": 3.0}
    coupling = {"macro_step": H, "degree": 0}
    run = simulate({"time": {"t_end": 40.0 * H}, "beam": table, "coupling": coupling})
    times = np.linspace(0.0, run.time[-1], 4001)
    wrong = np.abs(run.at(times)["u_tip"] - 0.5 * np.cos(omega * times) - 0.3 * np.sin(omega * times)).max()
    said = curve_error(turn) * np.hypot(0.5, 0.3)
    assert 0.9 * said <= wrong + 1e-12 if turn != 2.0 * np.pi else True
    assert wrong <= 1.01 * said
    assert turn == 3.0 or run.summary["resolved"] is (curve_error(turn) < 0.005)  # the last moment alone shows 1.6 %


def test_what_creeps_has_nothing_to_resolve():
    """A spring turns by 5 rad in a step, damped a little less and a little more than critically."""
    for share, resolved in ((0.99, False), (1.01, True)):
        lone = {"mass": 4.0, "linear_stiffness": 1.0, "damping": 4.0 * share}
        scene = scene_from_dict({"time": {"t_end": 90.0}, "spring": lone, "coupling": {"macro_step": 10.0}})
        assert simulate(scene).summary["resolved"] is resolved


# -- soft contacts --------------------------------------------------------------------------------------------------

STIFF = with_changes(
    PAIR,
    time={"t_end": 0.1},
    beam={"n_elements": 10},
    contact={"law": "compliance", "stiffness": 1e8, "exponent": 1.0},
    coupling={"macro_step": 1e-3},
)


@pytest.mark.parametrize("degree", [0, 1, 2])
@pytest.mark.parametrize(("share", "resolved"), [(0.99, True), (1.01, False)])
def test_ends_that_the_law_would_have_elsewhere_are_said(degree, share, resolved):
    """Soft ones and tied ones, by degree; 0.5 % between the rows."""
    assert (judged(STIFF, between=0.005 * share) is None) is resolved
    for scene, limits in ((STIFF, (0.006, 0.004, 0.0005)), (PAIR, (0.0025, 0.002, 0.001))):
        told = judged(with_changes(scene, coupling={"degree": degree}), share * limits[degree])
        assert (told is None) is resolved
        assert resolved or ("a higher coupling.degree" in told) is (degree < 2)


@pytest.mark.parametrize("seen", [{"misplaced": 4.0 * 0.006}, {"between": 2.0 * 0.005}])
def test_the_steps_that_resolve_it_are_named(seen):
    """An error four times the limit falls with H², one of the curves with H; half of what that allows is named."""
    told = judged(with_changes(STIFF, coupling={"degree": 0}), **seen)
    named = float(told.split("coupling.macro_step <= ")[1].split()[0])
    assert named == pytest.approx(0.95 * 0.25 * STIFF.coupling.H, rel=0.03)
    assert told.endswith("a higher coupling.degree allows longer ones") is ("misplaced" in seen)


@pytest.mark.parametrize("degree", [0, 1, 2])
def test_a_beam_without_inertia_is_as_late_as_is_said(degree):
    """It swings with the spring on it 5 times; a step of the coupling is late as Gauss collocation is."""
    beam = {**PAIR.beam.model_dump(), "fidelity": "quasi_static", "initial_velocity_slope": 0.0}
    tables = {"beam": beam, "spring": {"mass": 2.0, "linear_stiffness": 3.0, "initial_velocity": -1.0}}
    scene = scene_from_dict({**tables, "contact": {"law": "tie"}, "time": {"t_end": 10.0}})
    omega = ((3.0 + 1.0 / tip_compliance(scene.beam)) / 2.0) ** 0.5
    scene = with_changes(scene, time={"t_end": 10.0 * np.pi / omega})
    H = (0.1, 0.4, 1.5)[degree] / omega
    run = simulate(with_changes(scene, coupling={"degree": degree, "macro_step": H}))
    wrong = np.abs(run.y + np.sin(omega * run.time) / omega).max() * omega
    assert wrong > 1e-6
    assert run.summary["misplaced_ends"] == pytest.approx(wrong, rel=(0.2, 0.2, 0.6)[degree])


@pytest.mark.parametrize("share", [0.99, 1.01])
def test_waves_that_the_midpoint_rule_makes_late_have_a_limit(share):
    """Without an impact 0.01 rad: of those of a load at 20 Hz, of which n steps that turn by x make n x³/12."""
    load = {"on": "tip", "signal": "harmonic", "frequency": 20.0}
    beam = {"n_elements": 10, "integrator": "midpoint"}
    scene = with_changes(PAIR, beam=beam, loads=[load], coupling={"degree": 0}, contact={"law": "compliance"})
    count = 50
    H = share * (12.0 * 0.01 / count) ** (1.0 / 3.0) / (40.0 * np.pi)
    assert (judged(scene, steps=records(count, H)) is None) is (share < 1.0)


@pytest.mark.parametrize("start", [{}, {"initial_velocity_slope": 0.0, "initial_deflection_slope": 0.03}])
def test_a_beam_that_lags_behind_its_own_waves_is_said(start):
    """Nothing strikes, no energy is lost, and tolerances see a smooth tip: the modal integrator is exact."""
    beam = {**PAIR.beam.model_dump(), "n_elements": 8, "approach": "elastic", **start}
    period = 2.0 * np.pi / slowest_frequency(PAIR.beam)
    free = scene_from_dict({"time": {"t_end": 2.0 * period}, "beam": beam})
    midpoint = {"integrator": "midpoint"}

    def off(**coupling):
        run = simulate(with_changes(free, coupling=coupling, beam=midpoint))
        exact = simulate(with_changes(free, coupling={"macro_step": period / 300.0})).at(run.time)
        told = [text for text in run.summary["warnings"] if text.startswith("not resolved: the midpoint rule")]
        assert run.summary["resolved"] is not bool(told)
        return np.abs(run.u_tip - exact.u_tip).max() / np.abs(exact.u_tip - exact.u_tip[0]).max(), told

    for steps in ({"macro_step": period / 60.0}, {"relative_tolerance": 1e-3}):
        far, (warning,) = off(**steps)
        assert far > 0.03
    far, told = off(macro_step=float(warning.split("macro_step <= ")[1].split()[0]))
    assert not told
    assert 5e-4 < far < 0.01


def test_what_rows_that_are_right_hide_between_them_is_said():
    """The modal integrator is exact at the rows of a beam let go bent, whose faster modes turn far in a step."""
    beam = {**PAIR.beam.model_dump(), "n_elements": 8, "approach": "elastic", "initial_velocity_slope": 0.0}
    period = 2.0 * np.pi / slowest_frequency(PAIR.beam)
    free = scene_from_dict({"time": {"t_end": 2.0 * period}, "beam": {**beam, "initial_deflection_slope": 0.03}})
    exact = simulate(with_changes(free, coupling={"macro_step": period / 1000.0}))
    times = np.linspace(0.0, exact.time[-1], 401)

    def off(size):
        run = simulate(with_changes(free, coupling={"macro_step": size}))
        told = [text for text in run.summary["warnings"] if "between the rows" in text]
        assert run.summary["resolved"] is not bool(told)
        assert np.abs(run.u_tip - exact.at(run.time).u_tip).max() < 1e-9
        way = np.abs(exact.u_tip - exact.u_tip[0]).max()
        return np.abs(run.at(times).u_tip - exact.at(times).u_tip).max() / way, told

    far, (warning,) = off(period / 10.0)
    assert far > 0.01
    far, told = off(float(warning.split("macro_step <= ")[1].split()[0]))
    assert not told
    assert far < 0.01


@pytest.mark.parametrize(("on", "coupling"), [("base", {}), ("tip", {"relative_tolerance": 1e-2})])
def test_a_table_in_resonance_with_a_mode_that_turns_far_in_a_step_is_said(tmp_path, on, coupling):
    """The third mode turns 9 rad in each of 12 steps to a period: what drives it is not in their polynomials."""
    sizes = {"density": 1e3, "area": 0.01, "second_moment_of_area": 8.3e-6, "young_modulus": 1e7, "shear_modulus": 4e6}
    slender = {**sizes, "n_elements": 8, "reduced_integration": True}
    beam = scene_from_dict({"time": {"t_end": 1.0}, "beam": slender}).beam
    first, _, third = modal_beam(beam).omega[:3]
    end = 4.0 * np.pi / first
    file = tmp_path / "table.csv"
    times = np.linspace(0.0, end, 800)
    np.savetxt(file, np.column_stack([times, np.sin(third * times)]), delimiter=",")
    load = {"on": on, "signal": "table", "file": str(file), "interpolation": "cubic"}
    scene = scene_from_dict({"time": {"t_end": end}, "beam": slender, "loads": [load]})

    def run(**coupling):
        return simulate(with_changes(scene, coupling=coupling))

    exact = run(macro_step=end / 400.0)
    coarse = run(**coupling or {"macro_step": end / 24.0})
    off = np.abs(coarse.u_tip - exact.at(coarse.time).u_tip).max() / np.abs(exact.u_tip).max()
    told = [text for text in coarse.summary["warnings"] if "and the loads" in text]
    assert exact.summary["resolved"] is True
    assert coarse.summary["resolved"] is not bool(told)
    # Over its range, of which the coarse run has a part.
    assert off / 3.5 < coarse.summary["misplaced_ends"] < 8.0 * off
    if not coupling:
        assert off > 0.3
        assert run(macro_step=float(told[0].split("macro_step <= ")[1].split()[0])).summary["resolved"] is True


def test_a_stiff_link_that_does_not_swing_has_nothing_to_resolve():
    """From rest under a load: as the tie, though the link turns 90 rad a step; met at speed it swings."""
    link = with_changes(STIFF, stop=None, contact={"law": "link"}, coupling={"degree": 2, "macro_step": 1.5e-3})
    still = {"beam": {"initial_velocity_slope": 0.0, "approach": "elastic"}, "spring": {"external_force": -1.0}}
    assert simulate(with_changes(link, **still)).summary["resolved"] is True
    assert simulate(link).summary["resolved"] is False


@pytest.mark.parametrize(("factor", "told"), [(1.01, False), (0.99, True)])
def test_a_peak_force_that_depends_on_the_mesh_is_told(factor, told):
    """Fastest shear wave √12 c/h, c = √(KG/ρ) = 10 m/s, h = 1/50: 2.5 of its periods are 9.07 ms."""

    def doubt(window, **changes):
        with pair_of(with_changes(PAIR, **changes)) as pair:
            return peak_force_doubt(pair, window, 0.0)

    window = factor * 2.5 * 2.0 * np.pi / (np.sqrt(12.0) * 10.0 * 50.0)
    said = doubt(window)
    assert (said is not None) == told
    assert not told or "contact.force_window >= 0.0095 s" in said
    assert doubt(window, contact={"law": "compliance"}) is None  # it has a peak of its own


def test_ends_move_with_both_masses_unless_the_lower_one_is_held():
    tip = 2.0
    top = 1.0
    both = Pair(set_up(PAIR), Upper(tip), DuffingBody(top))
    assert both.reduced_mass(Phase(Joint.TIED)) == pytest.approx(tip * top / (tip + top), rel=1e-15)
    assert both.reduced_mass(Phase(Joint.TIED, seated=True)) == tip
