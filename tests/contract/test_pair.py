"""Beam and spring with nothing but three connections, as tools that only connect ports run them.

Judged against the master's `compliance` law on the same scene, whose own error at its finest step is below 1e-5 m.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssv

import springbeam

TIMES = np.array([0.05, 0.1, 0.2, 0.4])  # in contact, after the first and further foundation impacts
LAW = {"compliance_stiffness": 1e6, "compliance_exponent": 1.5}
E0 = 1 / 6  # ρAs²/6 + ρIs²/6·0: kinetic energy of u_t = −x, the rotation being at rest


@pytest.fixture(scope="module")
def reference() -> np.ndarray:
    scene = springbeam.load_scene("soft")
    contact = scene.contact.model_copy(update={"law": "compliance", "stiffness": 1e6, "exponent": 1.5})
    coupling = scene.coupling.model_copy(update={"macro_step": 1e-4, "scheme": "energy", "degree": 0})
    trajectory = springbeam.simulate(scene.model_copy(update={"contact": contact, "coupling": coupling}))
    return np.interp(TIMES, trajectory.time, trajectory.y)


def run_pair(beam: Any, spring: Any, size: float, end: float = 0.4, late: bool = False, **parameters: float) -> Any:
    """Rows (time, y, total energy). `late`: all outputs are read before inputs are set."""
    b, s = beam.instance(), spring.instance()
    for k in (b, s):
        k.setup()
    settings = {"young_modulus": 100.0, "shear_modulus": 100.0, "n_elements": 50, "initial_velocity_slope": -1.0}
    for name, value in settings.items():
        b.set(name, value)
    settings = {"linear_stiffness": 3.0, "cubic_stiffness": -0.2, "contact_law": 2, **LAW}
    settings |= {"stop_enabled": True, "stop_position": -0.015, "late_exchange": late, **parameters}
    for name, value in settings.items():
        s.set(name, value)
    for k in (b, s):
        assert k.call("fmi2EnterInitializationMode") == 0

    def exchange() -> None:
        u, v = b.get("tip_displacement", "tip_velocity")
        force = s.get("reaction")
        s.set("tip_displacement", u)
        s.set("tip_velocity", v)
        b.set("tip_force", force if late else s.get("reaction"))

    exchange()
    for k in (b, s):
        assert k.call("fmi2ExitInitializationMode") == 0
    rows = []
    for i in range(round(end / size)):
        for k in (b, s):
            k.step(i * size, size)
        exchange()
        energy = sum(b.get("kinetic_energy", "strain_energy"))
        energy += sum(s.get("kinetic_energy", "potential_energy", "contact_energy"))
        rows.append(((i + 1) * size, s.get("displacement"), energy))
    return np.array(rows).T


def error(rows: Any, reference: np.ndarray, times: int = 4) -> float:
    return float(np.max(np.abs(np.interp(TIMES, rows[0], rows[1]) - reference)[:times]))


def test_pair_agrees_with_the_master_where_the_step_does_not_resolve_the_contact(
    beam: Any, spring: Any, reference: np.ndarray
) -> None:
    # At 1e-3 s the tip's contact oscillates faster than the step (ωH ≈ 2): held force, predicted tip.
    coarse = run_pair(beam, spring, 1e-3, tip_mass=0.0058)
    fine = run_pair(beam, spring, 1e-4, tip_mass=0.0058)
    # Motion of 15 mm amplitude; the master itself is 1.4e-4 m off at this step.
    assert error(coarse, reference) < 3e-4
    assert error(coarse, reference, times=1) < 3e-5
    assert error(fine, reference) < 3e-5
    assert coarse[2].max() < 1.1 * E0
    assert fine[2].max() < 1.001 * E0


def test_pair_with_the_law_integrated_under_the_extrapolated_tip_converges_at_first_order(
    beam: Any, spring: Any, reference: np.ndarray
) -> None:
    errors = [error(run_pair(beam, spring, h, end=0.05), reference, times=1) for h in (5e-5, 2e-5)]
    assert errors[0] < 3e-4
    assert 1.5 < errors[0] / errors[1] < 5.0  # H ratio 2.5: first order


def test_pair_of_a_tool_that_reads_outputs_first(beam: Any, spring: Any, reference: np.ndarray) -> None:
    # The force then lags by a step: half the step is needed (ωH ≈ 1/2).
    rows = run_pair(beam, spring, 2.5e-4, late=True, tip_mass=0.0058)
    assert error(rows, reference) < 3e-4
    assert rows[2].max() < 1.01 * E0


def test_reaction_follows_the_tip_without_a_step(spring: Any) -> None:
    k = spring.running(contact_law=2, **LAW)
    assert k.get("reaction") == 0.0
    k.set("tip_displacement", -4e-4)
    assert k.get("reaction") == pytest.approx(1e6 * 4e-4**1.5, rel=1e-14)
    assert k.get("contact_energy") == pytest.approx(1e6 * 4e-4**2.5 / 2.5, rel=1e-14)
    k.set("tip_displacement", 1e-4)
    assert k.get("reaction") == 0.0


def test_held_contact_belongs_to_the_state(spring: Any) -> None:
    k = spring.running(contact_law=2, tip_mass=0.01, **LAW)

    def go(time: float) -> list[list[float]]:
        rows = []
        for i in range(5):
            k.set("tip_displacement", -1e-4 * (i + 1))
            k.set("tip_velocity", -0.1)
            k.step(time + i * 1e-3, 1e-3)
            rows.append(k.outputs())
        return rows

    go(0.0)
    blob = k.serialized()
    first = go(5e-3)
    assert max(row[k.fmu.outputs.index("reaction")] for row in first) > 0.0
    fresh = spring.instance()
    status, token = fresh.try_deserialize(blob)
    assert status == 0, fresh.message
    fresh.restore(token)
    k.free()
    k = fresh
    assert go(5e-3) == first


def test_ssp_says_what_the_scene_says(fmu_folder: Path) -> None:
    scene = springbeam.load_scene("soft")
    with zipfile.ZipFile(fmu_folder / "spring_beam.ssp") as archive:
        root = ET.fromstring(archive.read("resources/soft.ssv"))
        for name in ("beam", "spring"):
            assert archive.read(f"resources/{name}.fmu") == (fmu_folder / f"{name}.fmu").read_bytes()
    values = {p.get("name"): p[0].get("value") for p in root.iter() if p.tag.endswith("}Parameter")}
    assert scene.beam is not None
    assert scene.spring is not None
    assert scene.stop is not None
    for name in ("young_modulus", "shear_modulus", "n_elements", "initial_velocity_slope"):
        assert float(values[f"beam.{name}"]) == getattr(scene.beam, name)
    for name in ("linear_stiffness", "cubic_stiffness"):
        assert float(values[f"spring.{name}"]) == getattr(scene.spring, name)
    assert float(values["spring.stop_position"]) == scene.stop.position


def test_ssp_in_fmpy(fmu_folder: Path, reference: np.ndarray) -> None:
    path = str(fmu_folder / "spring_beam.ssp")
    size = 2.5e-4
    result = simulate_ssp(
        path, stop_time=0.4 + size / 2, step_size=size, parameter_set=read_ssv(path, "resources/soft.ssv")
    )
    # FMPy labels a step's result with the step's start, and its first step has all inputs zero.
    y = np.interp(TIMES, result["time"] + size, result["spring.displacement"])
    assert np.max(np.abs(y - reference)) < 3e-4
