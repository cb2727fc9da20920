"""The pair end to end: both FMUs and the master, beside ordinary masters, and with as much model as a scene needs."""

import json

import pytest
from commands import printed

from springbeam import RunStopped, load_scene, simulate, with_changes


def run(name, **coupling):
    return simulate(with_changes(load_scene(name), coupling=coupling))


# -- energy ---------------------------------------------------------------------------------------------------------


def test_what_numerical_damping_takes_is_no_error():
    """ρ∞ = 0 takes a tenth of the energy of `soft`, which no column books: said, but no reason to stop."""
    beam = {"integrator": "generalized_alpha", "rho_inf": 0.0, "n_elements": 10}
    trajectory = simulate(with_changes(load_scene("soft"), beam=beam, coupling={"macro_step": 1e-3}))
    assert trajectory.time[-1] == trajectory.scene.time.t_end
    assert 0.1 < trajectory.summary["max_energy_residual"] < 0.5
    assert any("beam.rho_inf = 0" in warning for warning in trajectory.summary["warnings"])


def test_the_papers_law_injects_all_of_the_energy_residual():
    """A constant load on the spring acts, whose work, 2e-4 J, is none of it."""
    changes = {"beam": {"n_elements": 20, "n_modes": 0}, "time": {"t_end": 0.7}, "spring": {"external_force": 0.5}}
    found = simulate(with_changes(load_scene("paper-fig2"), contact={"law": "paper"}, **changes))
    injected = found.summary["injected_into_beam"] + found.summary["injected_into_spring"]
    assert abs(injected) > 100.0
    assert found.energy_residual[-1] == pytest.approx(injected, rel=1e-9)


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


ORDINARY = [("jacobi", 0), ("jacobi", 1), ("gauss_seidel", 0), ("gauss_seidel", 1)]


def soft(stiffness, size, scheme, degree, t_end):
    law = {"law": "compliance", "stiffness": stiffness, "exponent": 1.0}
    coupling = {"scheme": scheme, "degree": degree, "macro_step": size}
    return with_changes(load_scene("soft"), time={"t_end": t_end}, contact=law, coupling=coupling)


@pytest.mark.parametrize(("scheme", "degree"), ORDINARY)
def test_a_stiff_contact_gains_energy_and_the_run_says_so(scheme, degree):
    with pytest.raises(RunStopped, match=f"{scheme} of degree {degree}"):
        simulate(soft(1e8, 0.004, scheme, degree, 0.2))
