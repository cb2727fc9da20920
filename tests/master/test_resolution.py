"""Whether a macro step resolves the motion: frequencies beside the mesh's, and the criterion from both sides."""

from math import factorial

import numpy as np
import pytest
from bodies import DuffingBody, Upper
from scenes import scene_from_dict

from springbeam import simulate
from springbeam.contact.phases import Joint, Phase
from springbeam.monolithic.semi_discrete import modal_beam
from springbeam.run.setup import set_up
from springbeam.run.stepping import Pair
from springbeam.scene import load_scene, shipped_scenes, with_changes
from springbeam.scene.frequencies import fastest_frequency, impact_frequency, mesh_frequency, slowest_frequency
from springbeam.scene.resolution import lateness, not_resolved, peak_force_doubt, slow_oscillations
from springbeam.scene.statics import lowest_frequency, tip_compliance

BEAMS = [name for name in shipped_scenes() if load_scene(name).beam is not None]
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


@pytest.mark.parametrize(("turn", "resolved"), [(0.98, True), (1.02, False)])
def test_one_radian_of_the_slowest_oscillation_is_the_limit(turn, resolved):
    scene = with_changes(PAIR, coupling={"macro_step": turn / slowest_frequency(PAIR.beam)})
    assert (not_resolved(scene) is None) is resolved
    lone = {
        "time": {"t_end": 9.0},
        "spring": {"mass": 4.0, "linear_stiffness": 1.0, "damping": 3.0},
        "coupling": {"macro_step": 2.0 * turn},
    }
    told = not_resolved(scene_from_dict(lone))
    assert told is None if resolved else "macro_step <= 1.9e+00 s resolves it" in told
    swept = {"on": "tip", "signal": "chirp", "frequency": 10.0, "frequency_end": 20.0, "duration": 0.6}
    driven = with_changes(PAIR, loads=[swept], coupling={"macro_step": turn / (40.0 * np.pi)})
    assert (not_resolved(driven) is None) is resolved


def test_what_creeps_or_has_no_inertia_has_nothing_to_resolve():
    coarse = with_changes(PAIR, coupling={"macro_step": 0.2})
    assert "slowest oscillation of the beam" in not_resolved(coarse)
    assert not_resolved(with_changes(coarse, beam={"alpha_b": 1.0})) is None
    assert not_resolved(with_changes(coarse, beam={"fidelity": "quasi_static"}, coupling={"degree": 2})) is None
    tolerances = with_changes(PAIR, coupling={"relative_tolerance": 1e-3})
    assert not_resolved(tolerances) is None
    critical = {"beam": ("alpha_b", 2.0 / slowest_frequency(PAIR.beam)), "spring": ("damping", 2.0 * 3.0**0.5)}
    for name, (key, damping) in critical.items():
        for share in (0.99, 1.01):
            swings = [found for found, *_ in slow_oscillations(with_changes(PAIR, **{name: {key: share * damping}}))]
            assert (name in swings) is (share < 1.0)


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
    """Soft ones and tied ones, by degree; 1 % of what measured loads leave out, and 0.5 % between the rows."""
    for seen, limit in (("left_out", 0.01), ("between_rows", 0.005)):
        assert (not_resolved(STIFF, **{seen: limit * share}) is None) is resolved
    for scene, limits in ((STIFF, (0.006, 0.002, 0.001)), (PAIR, (0.0025, 0.002, 0.001))):
        told = not_resolved(with_changes(scene, coupling={"degree": degree}), share * limits[degree])
        assert (told is None) is resolved
        assert resolved or ("a higher coupling.degree" in told) is (degree < 2)


def test_what_resolves_ends_that_are_elsewhere_is_said():
    adaptive, off = {"coupling": {"relative_tolerance": 1e-3}}, 0.012
    for scene in (STIFF, PAIR):
        assert not_resolved(with_changes(scene, **adaptive), off).endswith("; smaller tolerances resolve it")
    low = with_changes(STIFF, coupling={"degree": 0})
    for seen, share in (({"misplaced": 4.0 * 0.006}, 0.25), ({"left_out": 0.08}, 0.5), ({"between_rows": 0.01}, 0.25)):
        told = not_resolved(low, **seen)
        named = float(told.split("coupling.macro_step <= ")[1].split()[0])
        assert named == pytest.approx(0.95 * share * STIFF.coupling.H, rel=0.03)
        assert told.endswith("a higher coupling.degree allows longer ones") is ("misplaced" in seen)
    midpoint = not_resolved(with_changes(STIFF, beam={"integrator": "midpoint"}), off)
    assert midpoint.endswith("resolves it")


@pytest.mark.parametrize("degree", [0, 1, 2])
def test_a_step_makes_a_contact_late_as_gauss_collocation_does(degree):
    """Its step is the diagonal Padé quotient of exp(ix), whose phase falls short of x by this, to leading order."""
    x, s = 0.3, degree + 1
    numerator = sum(
        factorial(2 * s - k) * factorial(s) / (factorial(2 * s) * factorial(k) * factorial(s - k)) * (1j * x) ** k
        for k in range(s + 1)
    )
    exact = 1.0 - 2.0 * np.angle(numerator) / x
    assert lateness(with_changes(STIFF, coupling={"degree": degree}), x) == pytest.approx(exact, rel=0.02)


MIDPOINT = {"n_elements": 10, "integrator": "midpoint"}
#: Frequency of a beam without inertia and the spring [rad/s].
TOGETHER = ((3.0 + 1.0 / tip_compliance(PAIR.beam)) / PAIR.spring.mass) ** 0.5


@pytest.mark.parametrize(("share", "resolved"), [(0.99, True), (1.01, False)])
def test_steps_of_the_midpoint_rule_may_lag_behind_what_an_impact_sets_off(share, resolved):
    """n steps that turn it by x lag by n x³/12: 1 rad of the fastest waves is the limit, those that die out left out;
    where nothing strikes 0.01 rad of what is as fast as a load; or 0.015 rad of a beam without inertia together with
    the spring. The modal integrator and degree 2 do not lag."""

    def said(omega, limit, other, **tables):
        turn = share * (12.0 * limit / (omega * PAIR.duration)) ** 0.5
        given = with_changes(PAIR, **tables, coupling={"degree": 0, "macro_step": turn / omega})
        assert (not_resolved(given) is None) is resolved
        assert not_resolved(with_changes(given, **other)) is None

    for alpha in (0.01, 0.0):
        midpoint = {**MIDPOINT, "alpha_b": alpha}
        waves = impact_frequency(with_changes(PAIR, beam=midpoint).beam) if alpha == 0.0 else 0.15 / alpha
        said(waves, 1.0, {"beam": {"integrator": "modal"}}, beam=midpoint)
        soft = {"contact": {"law": "compliance"}, "loads": [{"on": "tip", "signal": "harmonic", "frequency": 20.0}]}
        slow = min(40.0 * np.pi, waves)
        said(slow, 0.01, {"beam": {"integrator": "modal"}}, beam=midpoint, **soft)
        bent = {**midpoint, "approach": "elastic", "initial_deflection_slope": 0.01}
        said(waves, 1.0, {"beam": {"integrator": "modal"}}, beam=bent, contact={"law": "compliance"})
        arrived = {**midpoint, "initial_deflection_slope": 0.01}  # on a spring that it meets bent
        met = {"contact": {"law": "compliance"}, "spring": {"equilibrium": 0.01 * PAIR.beam.length}, "stop": None}
        said(waves, 1.0, {"beam": {"integrator": "modal"}}, beam=arrived, **met)
    said(TOGETHER, 0.015, {"coupling": {"degree": 2}}, beam={"fidelity": "quasi_static"})


@pytest.mark.parametrize(("beam", "omega", "limit"), [
    (MIDPOINT, impact_frequency(with_changes(PAIR, beam=MIDPOINT).beam), 1.0),
    ({"fidelity": "quasi_static"}, TOGETHER, 0.015),
])  # fmt: skip
def test_the_step_that_is_named_keeps_what_lags_at_its_limit(beam, omega, limit):
    """5 % shorter than that: three times as long, they lag by nine times as much."""
    size = (12.0 * limit / (omega * PAIR.duration)) ** 0.5 / omega
    told = not_resolved(with_changes(PAIR, beam=beam, coupling={"degree": 0, "macro_step": 3.0 * size}))
    assert float(told.split("macro_step <= ")[1].split()[0]) == pytest.approx(0.95 * size, rel=0.05)


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
    exact = simulate(with_changes(free, coupling={"macro_step": period / 5000.0}))
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


@pytest.mark.parametrize("on", ["tip", "base"])
@pytest.mark.parametrize("coupling", [{}, {"relative_tolerance": 1e-2}])
def test_a_table_in_resonance_with_a_mode_that_turns_far_in_a_step_is_said(tmp_path, on, coupling):
    """The third mode turns 9 rad in each of 12 steps to a period: what drives it is not in their polynomials."""
    sizes = {"density": 1e3, "area": 0.01, "second_moment_of_area": 8.3e-6, "young_modulus": 1e7, "shear_modulus": 4e6}
    slender = {**sizes, "n_elements": 8, "reduced_integration": True}
    beam = scene_from_dict({"time": {"t_end": 1.0}, "beam": slender}).beam
    first, _, third = modal_beam(beam).omega[:3]
    end, file = 4.0 * np.pi / first, tmp_path / "table.csv"
    times = np.linspace(0.0, end, 2000)
    np.savetxt(file, np.column_stack([times, np.sin(third * times)]), delimiter=",")
    load = {"on": on, "signal": "table", "file": str(file), "interpolation": "cubic"}
    scene = scene_from_dict({"time": {"t_end": end}, "beam": slender, "loads": [load]})

    def run(**coupling):
        return simulate(with_changes(scene, coupling=coupling))

    exact = run(macro_step=end / 1000.0)
    coarse = run(**coupling or {"macro_step": end / 24.0})
    off = np.abs(coarse.u_tip - exact.at(coarse.time).u_tip).max() / np.abs(exact.u_tip).max()
    told = [text for text in coarse.summary["warnings"] if "tables of loads" in text]
    assert exact.summary["resolved"] is True
    assert coarse.summary["resolved"] is not bool(told)
    assert bool(told) == (off > 0.01)
    if not coupling:
        assert off > 0.3
        assert run(macro_step=float(told[0].split("macro_step <= ")[1].split()[0])).summary["resolved"] is True


def test_a_stiff_link_that_does_not_swing_has_nothing_to_resolve():
    """From rest under a load: as the tie, though the link turns 90 rad a step; met at speed it swings."""
    link = with_changes(STIFF, stop=None, contact={"law": "link"}, coupling={"degree": 2, "macro_step": 1.5e-3})
    still = {"beam": {"initial_velocity_slope": 0.0, "approach": "elastic"}, "spring": {"external_force": -1.0}}
    assert simulate(with_changes(link, **still)).summary["resolved"] is True
    assert simulate(link).summary["resolved"] is False


def test_a_peak_force_that_depends_on_the_mesh_is_told():
    """Fastest shear wave √12 c/h, c = √(KG/ρ) = 10 m/s, h = 1/50: 2.5 of its periods are 9.07 ms; the default window is
    a fiftieth of the slowest period, 9.86 ms. A soft law has a peak of its own."""
    period = 2.0 * np.pi / (np.sqrt(12.0) * 10.0 * 50.0)
    for factor, told in ((1.01, False), (0.99, True)):
        scene = with_changes(load_scene("soft"), contact={"force_window": factor * 2.5 * period})
        assert (peak_force_doubt(scene) is not None) == told
    assert "contact.force_window >= 0.0095 s" in peak_force_doubt(scene)
    for changes in ({"law": "compliance"}, {"law": "link"}, {"force_window": 1.0}):
        assert peak_force_doubt(with_changes(scene, contact=changes)) is None
    # Waves that are not kept settle nothing: of 5 modes the fastest counts.
    slow = 2.5 * 2.0 * np.pi / fastest_frequency(with_changes(scene, beam={"n_modes": 5}).beam)
    for factor, told in ((1.01, False), (0.99, True)):
        few = with_changes(scene, beam={"n_modes": 5}, contact={"force_window": factor * slow})
        assert (peak_force_doubt(few) is not None) == told


def test_ends_move_with_both_masses_unless_the_lower_one_is_held():
    tip, top = 2.0, 1.0
    both = Pair(set_up(PAIR), Upper(tip), DuffingBody(top))
    assert both.reduced_mass(Phase(Joint.TIED)) == pytest.approx(tip * top / (tip + top), rel=1e-15)
    assert both.reduced_mass(Phase(Joint.TIED, seated=True)) == tip
