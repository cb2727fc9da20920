"""The pair end to end: both FMUs and the master, beside ordinary masters, and with as much model as a scene needs."""

import json
from contextlib import closing

import numpy as np
import pytest
from commands import printed
from scenes import scene_from_dict

from springbeam import RunStopped, load_scene, simulate, with_changes
from springbeam.bodies.fmu_bodies import FmuBeam
from springbeam.bodies.protocol import NO_FORCE
from springbeam.monolithic import event_driven
from springbeam.monolithic.semi_discrete import modal_beam
from springbeam.scene import Beam


def run(name, **coupling):
    return simulate(with_changes(load_scene(name), coupling=coupling))


# -- energy ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["soft", "steel-bumper", "beam-on-stop", *(f"paper-fig{k}" for k in (2, 3, 4, 5))])
@pytest.mark.parametrize("factor", [1.0, 5.0, 0.2])
def test_energy_is_conserved_at_any_macro_step(name, factor):
    scene, bound = load_scene(name), 1e-7 if name.startswith("paper") else 1e-9
    trajectory = run(name, macro_step=scene.coupling.macro_step * factor)
    assert trajectory.time[-1] == scene.time.t_end
    assert trajectory.summary["max_energy_residual"] <= bound


def test_what_numerical_damping_takes_is_no_error():
    """ρ∞ = 0 takes a tenth of the energy of `soft`, which no column books: said, but no reason to stop."""
    beam = {"integrator": "generalized_alpha", "rho_inf": 0.0, "n_elements": 10}
    trajectory = simulate(with_changes(load_scene("soft"), beam=beam, coupling={"macro_step": 1e-3}))
    assert trajectory.time[-1] == trajectory.scene.time.t_end
    assert 0.1 < trajectory.summary["max_energy_residual"] < 0.5
    assert any("beam.rho_inf = 0" in warning for warning in trajectory.summary["warnings"])


def test_the_papers_law_injects_all_of_the_energy_residual():
    """Also under a constant load on the spring, whose work, 2e-4 J, is none of it."""
    changes = {"beam": {"n_elements": 20, "n_modes": 0}, "time": {"t_end": 0.7}, "spring": {"external_force": 0.5}}
    found = simulate(with_changes(load_scene("paper-fig2"), contact={"law": "paper"}, **changes))
    injected = found.summary["injected_into_beam"] + found.summary["injected_into_spring"]
    assert abs(injected) > 100.0
    assert found.energy_residual[-1] == pytest.approx(injected, rel=1e-9)


def test_hermite_says_when_the_macro_step_is_too_large():
    """ω_max H = 7 is beyond its stability: the energy changes, and the run says so; at 17 with a light top it stops."""
    hermite = {"scheme": "hermite", "degree": 2}
    summary = run("soft", macro_step=4e-3, **hermite).summary
    assert summary["max_energy_residual"] > 1e-3
    assert any("hermite of degree 2" in warning for warning in summary["warnings"])
    with pytest.raises(RunStopped, match="hermite of degree 2") as stopped:
        simulate(with_changes(load_scene("soft"), spring={"mass": 0.05}, coupling={"macro_step": 1e-2, **hermite}))
    assert 0.0 < stopped.value.time < 0.6


# -- either version of FMI ------------------------------------------------------------------------------------------

LOADS = [
    {"on": "beam", "at": 0.5, "signal": "harmonic", "amplitude": 0.3, "frequency": 4.0},
    {"on": "spring", "signal": "harmonic", "amplitude": 0.2, "frequency": 7.0},
]


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"contact": {"law": "compliance"}},
        {"coupling": {"scheme": "hermite", "degree": 2}, "loads": LOADS},
    ],
)
def test_either_version_of_fmi_gives_the_same_bits(changes, monkeypatch):
    scene = with_changes(load_scene("soft"), time={"t_end": 0.3}, **changes)
    runs = []
    for version in ("2.0", "3.0"):
        monkeypatch.setenv("SPRINGBEAM_FMI", version)
        runs.append(simulate(scene))
    old, new = runs
    assert len(old.events) > 1
    assert old.events == new.events
    pairs = [(old[name], new[name]) for name in old.columns]
    for one, other in (*pairs, (old.steps, new.steps), *zip(old.shapes, new.shapes, strict=True)):
        assert one.tobytes() == other.tobytes()


# -- the command ----------------------------------------------------------------------------------------------------


def test_run_leaves_the_promised_columns_and_numbers(tmp_path):
    printed("run", "soft", "--out", tmp_path / "out", "--set", "time.t_end=0.1", "--no-plots")
    header, events = ((tmp_path / "out" / name).read_text().split("\n")[0] for name in ("trajectory.csv", "events.csv"))
    promised = (
        "time,u_tip,v_tip,y,z,contact_force,foundation_force,gap,phase,e_beam,e_spring,e_contact,e_dissipated,"
        "e_impact_loss,e_total,energy_residual"
    )
    assert set(promised.split(",")) <= set(header.split(","))
    assert events == "time,kind,y,z,u_tip,v_tip,impulse_contact,impulse_foundation,energy_loss"
    told = {"scene", "version", "wall_time", "macro_steps", "beam_steps", "spring_steps", "events", "warnings"}
    assert told <= json.loads((tmp_path / "out" / "summary.json").read_text()).keys()


def test_a_cantilever_under_a_sudden_force_meets_an_elastic_stop():
    """Slender limit of L = 1, R = 0.1, E = 1e10, ρ = 1e6, −1000 N, a stop of 1e8 N/m at a gap of 1e-4.

    Cubic Hermite elements, exact in time from contact to contact, have u(0.1315 s) = −1.840e-6, −1.838e-6 m and
    v(0.1566 s) = −4.52e-3, −4.50e-3 m/s for 50 and 100 elements: v depends on the fastest modes.
    """
    area, inertia, thin = np.pi * 0.01, np.pi / 4.0 * 1e-4, 1e-4
    beam = {
        "density": 1e6, "area": area, "second_moment_of_area": thin * inertia, "young_modulus": 1e10 / thin,
        "shear_modulus": 1e16 * inertia / area, "shear_coefficient": 1.0, "length": 1.0,
        "n_elements": 20, "element_degree": 4,
        "reduced_integration": True, "approach": "elastic",
    }  # fmt: skip
    table = {
        "time": {"t_end": 0.16},
        "beam": beam,
        "stop": {"position": -1e-4},
        "contact": {"law": "compliance", "stiffness": 1e8, "exponent": 1.0},
        "coupling": {"macro_step": 1e-4, "degree": 2},
        "loads": [{"on": "tip", "amplitude": -1000.0}],
    }
    found = simulate(scene_from_dict(table))
    at = found.at([0.1315, 0.1566])
    assert at.u_tip[0] == pytest.approx(-1.838e-6, rel=3e-3)
    assert at.v_tip[1] == pytest.approx(-4.51e-3, rel=1e-2)
    assert found.summary["max_energy_residual"] < 1e-11


ORDINARY = [("jacobi", 0), ("jacobi", 1), ("gauss_seidel", 0), ("gauss_seidel", 1)]


def soft(stiffness, size, scheme, degree, t_end):
    law = {"law": "compliance", "stiffness": stiffness, "exponent": 1.0}
    coupling = {"scheme": scheme, "degree": degree, "macro_step": size}
    return with_changes(load_scene("soft"), time={"t_end": t_end}, contact=law, coupling=coupling)


@pytest.mark.parametrize(("scheme", "degree"), ORDINARY)
def test_a_stiff_contact_gains_energy_and_the_run_says_so(scheme, degree):
    with pytest.raises(RunStopped, match=f"{scheme} of degree {degree}"):
        simulate(soft(1e8, 0.004, scheme, degree, 0.2))


@pytest.mark.parametrize("scheme", ["jacobi", "gauss_seidel"])
def test_what_the_law_dissipates_is_booked(scheme):
    """χ = 0.5 s/m: what is left once that is booked is of order 1, and far below what the law takes."""
    left = []
    for size in (2e-5, 1e-5):
        scene = soft(1e3, size, scheme, 0, 0.02)
        run = simulate(with_changes(scene, contact={"damping": 0.5, "exponent": 1.5}))
        left.append(run.summary["max_energy_residual_joule"])
    assert np.log2(left[0] / left[1]) == pytest.approx(1.0, abs=0.1)
    assert run.e_dissipated[-1] > 100.0 * left[1]


@pytest.mark.parametrize(("scheme", "degree"), ORDINARY)
def test_order_is_degree_plus_one_where_the_contact_is_resolved(scheme, degree):
    """λ = 100 N/m: ω_contact H = √(λ/m_tip) H ≤ 0.07; displacement of the spring while the contact lasts."""
    errors = []
    for size in (4e-4, 2e-4):
        scene = soft(100.0, size, scheme, degree, 0.03)
        trajectory = simulate(scene)
        reference = event_driven.simulate(scene, sample_times=trajectory.time)
        errors.append(np.abs(trajectory.y - reference.y).max())
    assert np.log2(errors[0] / errors[1]) == pytest.approx(degree + 1, abs=0.4)


@pytest.mark.parametrize("reduced", [False, True])
@pytest.mark.parametrize(("degree", "n"), [(1, 12), (2, 6), (3, 4), (5, 2), (12, 1)])
def test_the_fmu_vibrates_with_the_frequencies_of_the_reference(degree, n, reduced):
    """After a unit tip impulse v_tip(t) = Σ φ_k(L)² cos ω_k t: every frequency and every tip value takes part."""
    beam = Beam.with_ones(
        young_modulus=3.0, shear_modulus=7.0, n_elements=n, element_degree=degree, reduced_integration=reduced
    )
    modes, size = modal_beam(beam), 0.05
    with closing(FmuBeam(beam, 0.0, 0.0)) as body:
        assert 1.0 / body.mass == pytest.approx(modes.inverse_tip_mass, rel=1e-12)
        body.apply_impulse(1.0)
        for step in range(40):
            body.advance(step * size, size, NO_FORCE)
            t = (step + 1) * size
            exact = np.sum(modes.tip**2 * np.cos(modes.omega * t))
            # Two independent eigenproblems: ω_max t ≈ 500 rad with frequencies to 1e-13.
            assert body.motion().velocity == pytest.approx(exact, abs=1e-10 * modes.inverse_tip_mass)


def quasi_static(**beam):
    """A loaded beam comes down on a heavy spring that moves already."""
    return scene_from_dict(
        {
            "time": {"t_end": 2.0},
            "beam": {
                "fidelity": "quasi_static", "young_modulus": 30.0, "shear_modulus": 50.0, "alpha_b": 0.05,
                "distributed_load": -1.0, "initial_velocity_slope": -1.0, **beam,
            },
            "spring": {"mass": 2.0, "linear_stiffness": 3.0, "initial_velocity": -0.5},
            "coupling": {"degree": 2, "macro_step": 0.01},
        }
    )  # fmt: skip


def test_without_inertia_is_the_limit_of_a_light_beam():
    """The beam FMU at density ρ → 0: the difference is of first order in ρ, through meeting, release and retie."""
    light = simulate(quasi_static())
    differences = []
    for density in (1e-3, 1e-4, 1e-5):
        beam = {"fidelity": "dynamic", "density": density, "element_degree": 4, "n_elements": 2}
        run = simulate(with_changes(light.scene, beam=beam))
        assert [e.kind for e in run.events] == [e.kind for e in light.events] == ["impact", "release", "retie"]
        differences.append(np.abs(np.interp(light.time, run.time, run.y) - light.y)[light.time < 0.8].max())
    assert differences[0] / differences[1] == pytest.approx(10.0, rel=0.01)
    assert differences[1] / differences[2] == pytest.approx(10.0, rel=0.01)
    assert differences[2] < 1e-6
