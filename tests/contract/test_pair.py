"""Beam and spring with nothing but their connections, as tools that only connect ports run them.

Scene `soft` with the compliance law, λ = 1e6, p = 1.5: the contact oscillates faster than steps of 1 ms (ωH ≈ 2).
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
from scipy.integrate import solve_ivp

import springbeam

LAW = {"compliance_stiffness": 1e6, "compliance_exponent": 1.5}
E0 = 1 / 6  # ρAs²/6 + ρIs²/6·0: kinetic energy of u_t = −x, the rotation being at rest
BEAM = {"young_modulus": 100.0, "shear_modulus": 100.0, "n_elements": 50, "initial_velocity_slope": -1.0}
SPRING = {"linear_stiffness": 3.0, "cubic_stiffness": -0.2, "contact_law": 2, "stop_enabled": True}
SPRING |= {"stop_position": -0.015, **LAW}
#: Connected by name, whether the pair looks ahead or not; `reaction` goes to `tip_force`.
BY_NAME = ["tip_displacement", "tip_velocity", "tip_velocity_forecast"]

STORED = ["kinetic_energy", "potential_energy", "contact_energy"]


class Pair:
    """Both FMUs and their connections. `late`: all outputs are read before inputs are set."""

    def __init__(self, beam: Any, spring: Any, size: float, look_ahead: bool = True, late: bool = True) -> None:
        self.size, self.late, self.time = size, late, 0.0
        self.beam, self.spring = beam.instance(), spring.instance()
        self.ahead = {"communication_step": size} if look_ahead else {}
        self.connected = BY_NAME

    def start(self, **parameters: float) -> Pair:
        """Parameters of the beam are in `BEAM` or unknown to the spring."""
        of_beam = {n: v for n, v in parameters.items() if n not in self.spring.fmu.variables}
        of_spring = {n: v for n, v in parameters.items() if n not in of_beam}
        self.beam.enter(**{**BEAM, **self.ahead, **of_beam})
        if self.ahead:
            names = ["tip_response", "tip_response_2", "tip_velocity_forecast"]
            of_spring = {**self.ahead, **dict(zip(names, self.beam.get(*names), strict=True)), **of_spring}
        self.spring.enter(**{**SPRING, **of_spring})
        self.exchange()
        for k in (self.beam, self.spring):
            assert k.call("fmi2ExitInitializationMode") == 0
        return self

    def exchange(self) -> None:
        force = self.spring.get("reaction")
        for name in self.connected:
            self.spring.set(name, self.beam.get(name))
        self.beam.set("tip_force", force if self.late else self.spring.get("reaction"))

    def energy(self) -> float:
        names = ["kinetic_energy", "strain_energy", "dissipated_energy", "load_potential"]
        total = sum(self.beam.get(*names))
        return float(total + sum(self.spring.get(*STORED, "dissipated_energy", "impact_loss")))

    def run(self, end: float) -> np.ndarray:
        """Rows (time, y, total energy), from the next step on."""
        rows = []
        while self.time < end - self.size / 2:
            for k in (self.beam, self.spring):
                k.step(self.time, self.size)
            self.time += self.size
            self.exchange()
            rows.append((self.time, self.spring.get("displacement"), self.energy()))
        return np.array(rows).T


def at_milliseconds(rows: np.ndarray) -> np.ndarray:
    return np.interp(np.arange(1, round(rows[0, -1] * 1e3) + 1) * 1e-3, rows[0], rows[1])


def test_pair_that_looks_ahead_agrees_with_the_master_at_the_same_step(
    beam: Any, spring: Any, reference: np.ndarray, master_run: dict[float, np.ndarray]
) -> None:
    differences = []
    for size, of_master in master_run.items():
        y = at_milliseconds(Pair(beam, spring, size).start().run(0.4))
        differences.append(np.abs(y - of_master).max())
        # As good as the master: its own error is 2.3e-4 m at 1 ms, of a motion of 30 mm.
        assert np.abs(y - reference).max() < 1.1 * np.abs(of_master - reference).max()
    # Same forces but for the first step, whose tip is foreseen with an error of order H³ (u_tt grows from 0).
    assert differences[0] < 4e-5
    assert differences[1] < differences[0] / 8


def test_pair_that_looks_ahead_does_not_depend_on_the_order_of_reading(beam: Any, spring: Any) -> None:
    runs = [Pair(beam, spring, 1e-3, late=late).start().run(0.1) for late in (True, False)]
    assert np.array_equal(*runs)


@pytest.mark.parametrize("stiffness", [1e4, 1e6, 1e9])
@pytest.mark.parametrize(
    "body",
    [
        {},
        {"alpha_b": 1e-3},
        {"n_modes": 20},
        {"integrator": 2},
        {"distributed_load": -0.7, "tip_load_coefficient": -0.3},
        {"external_force": -2.0},
        {"compliance_damping": 0.5},
    ],
    ids=str,
)
def test_pair_that_looks_ahead_conserves_energy(beam: Any, spring: Any, body: Any, stiffness: float) -> None:
    for size in (1e-3, 4e-3):
        _, y, energy = Pair(beam, spring, size).start(compliance_stiffness=stiffness, **body).run(0.2)
        energy += -body.get("external_force", 0.0) * y
        assert energy[2:] == pytest.approx(energy[2], abs=2e-12)  # IDA's 1e-12, of 1/6 J
        # The first step, foreseen by the mean velocity over two.
        assert energy[2] == pytest.approx(E0, rel=1e-3 if size == 1e-3 else 1e-2)


def test_pair_with_the_law_integrated_under_the_extrapolated_tip_converges_at_first_order(
    beam: Any, spring: Any, reference: np.ndarray
) -> None:
    errors = []
    for size in (5e-5, 2e-5):
        rows = Pair(beam, spring, size, look_ahead=False, late=False).start().run(0.05)
        errors.append(abs(rows[1, -1] - reference[49]))
    assert errors[0] < 3e-4
    assert 1.5 < errors[0] / errors[1] < 5.0  # H ratio 2.5: first order


def test_beam_that_looks_ahead_says_where_its_free_tip_goes(beam: Any) -> None:
    size = 1e-3
    k = beam.running(**BEAM, communication_step=size, alpha_b=1e-4)
    plain = beam.running(**BEAM, alpha_b=1e-4)
    for i in range(20):
        for one in (k, plain):
            one.set("tip_force", 0.1 * i)
            one.step(i * size, size)
    # What goes by the state alone is the same.
    others = [n for n in beam.outputs if n not in ("tip_velocity_forecast", "tip_response", "tip_response_2")]
    assert k.get(*others) == plain.get(*others)
    u, w = k.get("tip_displacement", "tip_velocity_forecast")
    (_, rate), v = k.derivative("tip_velocity_forecast"), plain.get("tip_velocity")
    # Its rate is that of the motion under the force that acts, though it foresees none.
    token, h = k.state(), 1e-8
    k.step(20 * size, h)
    assert (k.get("tip_velocity_forecast") - w) / h == pytest.approx(rate, rel=1e-5)
    k.restore(token)
    k.set("tip_force", 0.0)
    free = k.derivative("tip_velocity_forecast")[1]
    assert abs(free - rate) > 10.0
    # An input that changes the motion ahead changes what is said of it at once.
    k.set("distributed_load", -3.0)
    assert k.get("tip_velocity_forecast") < w - 1e-3
    k.set("distributed_load", 0.0)
    assert k.get("tip_velocity_forecast") == w
    for one in (k, plain):
        one.set("tip_force", 0.0)
        for i in (20, 21):
            one.step(i * size, size)
    assert k.get("tip_displacement") == pytest.approx(u + 2 * size * w, abs=1e-15)
    assert plain.get("tip_velocity") == pytest.approx(v + 2 * size * free, abs=1e-13)


def test_a_last_step_of_rounding_is_made_under_the_held_force(beam: Any, spring: Any) -> None:
    size = 1e-3
    pair, twin = Pair(beam, spring, size).start(), Pair(beam, spring, size).start()
    for one in (pair, twin):
        one.run(0.05)
    before = pair.energy()
    for k in (pair.beam, pair.spring):
        k.step(pair.time, 3e-14)
    pair.exchange()
    assert pair.energy() == pytest.approx(before, abs=1e-12)
    assert pair.spring.get("reaction") == twin.spring.get("reaction")
    pair.time += 3e-14
    assert pair.run(0.1)[1] == pytest.approx(twin.run(0.1)[1], abs=1e-10)  # 1 m/s times the rounding, and its effect
    assert pair.spring.try_step(pair.time, 2e-9) == 2  # no rounding any more: 2e-6 of the step
    pair.spring.step(pair.time, size * (1 + 1e-9))  # as a tool's times may have it


def gauss_seidel(pair: Pair, first: str, steps: int = 100, delayed: bool = False) -> list[float]:
    """Step one after the other, passing on after each; ``delayed``: what the second gets is of a step before."""
    beam, spring = pair.beam, pair.spring
    signals = {
        "beam": [(beam, n, spring, n) for n in pair.connected],
        "spring": [(spring, "reaction", beam, "tip_force")],
    }
    second = "spring" if first == "beam" else "beam"
    y = []
    for i in range(steps):
        before = {name: k.get(name) for k, name, _, _ in signals[first]}
        for name in (first, second):
            (beam if name == "beam" else spring).step(i * pair.size, pair.size)
            for k, output, other, port in signals[name]:
                other.set(port, before[output] if delayed and name == first else k.get(output))
        y.append(spring.get("displacement"))
    return y


def warnings(pair: Pair) -> list[str]:
    return [message for k in (pair.beam, pair.spring) for status, _, message in k.messages if status == 1]


@pytest.mark.parametrize(
    "wrong", ["tip_displacement", "tip_velocity_forecast", "reaction", "spring only", "other steps"]
)
def test_a_wrong_connection_is_told_once_with_the_remedy(beam: Any, spring: Any, wrong: str) -> None:
    size = 1e-3
    pair = Pair(beam, spring, size)
    pair.connected = [n for n in BY_NAME if n != wrong]
    if wrong == "reaction":
        pair.exchange = lambda: [pair.spring.set(n, pair.beam.get(n)) for n in BY_NAME]  # type: ignore[method-assign]
    ahead = beam.running(**BEAM, **pair.ahead)
    responses = {name: ahead.get(name) for name in ("tip_response", "tip_response_2")}
    if wrong == "spring only":
        pair.ahead = {"communication_step": 0.0}
    if wrong == "other steps":
        pair.ahead = {"communication_step": 2 * size}
        responses = {}
    pair.start(communication_step=size, **responses)
    pair.run(0.1)
    warning = warnings(pair)[-1]
    assert len(warnings(pair)) == (2 if wrong == "spring only" else 1)  # then no forecast arrives at the start, too
    assert "the tip was not where it was foreseen" in warning
    assert "Connect tip_displacement and tip_velocity_forecast" in warning
    assert pair.spring.integer("warnings") >= 10


def test_a_right_pair_counts_no_warnings(beam: Any, spring: Any) -> None:
    pair = Pair(beam, spring, 1e-3).start()
    pair.run(0.1)
    assert [k.integer("warnings") for k in (pair.beam, pair.spring)] == [0, 0]


@pytest.mark.parametrize("size", [1e-3, 1e-4])
def test_responses_that_are_swapped_are_told(beam: Any, spring: Any, size: float) -> None:
    ahead = beam.running(**BEAM, communication_step=size)
    r1, r2 = ahead.get("tip_response", "tip_response_2")
    pair = Pair(beam, spring, size).start(tip_response=r2, tip_response_2=r1)
    pair.run(0.05)
    (warning,) = warnings(pair)
    assert "tip_response and tip_response_2 are swapped" in warning


@pytest.mark.parametrize("ahead", [True, False])
def test_a_tip_that_arrives_where_there_is_no_law_is_told(beam: Any, spring: Any, ahead: bool) -> None:
    pair = Pair(beam, spring, 1e-3, look_ahead=ahead).start(contact_law=1)
    pair.run(0.02)
    (warning,) = warnings(pair)
    assert "contact_law = 1: there is no contact" in warning
    assert pair.spring.integer("warnings") == 20


def test_nothing_passed_on_before_the_first_step_is_told(beam: Any, spring: Any) -> None:
    for known in (True, False):  # start values of the spring's inputs
        pair = Pair(beam, spring, 1e-3)
        pair.start() if known else pair.start(tip_velocity_forecast=0.0)
        for k, names in ((pair.spring, BY_NAME), (pair.beam, ["tip_force"])):
            for name in names:
                k.set(name, 0.0)
        pair.run(0.02)
        (warning,) = warnings(pair)
        assert "nothing was passed on before the first step" in warning
        assert pair.spring.integer("warnings") == 1


def test_the_first_force_does_not_depend_on_what_was_seen_before(spring: Any) -> None:
    forces = []
    for seen in ([0.0], [0.02, 0.0]):
        k = spring.running(contact_law=2, communication_step=1e-3, tip_response=1e-6, displacement=0.01)
        for u in seen:
            k.set("tip_displacement", u)
        forces.append(k.get("reaction"))
    assert forces[0] == pytest.approx(1e-2, rel=1e-3)  # λ δ³, λ = 1e4
    assert forces[0] == pytest.approx(forces[1], rel=1e-12)


def test_responses_of_another_step_are_told(beam: Any, spring: Any) -> None:
    other = beam.running(**BEAM, communication_step=2e-3)
    pair = Pair(beam, spring, 1e-3).start(**{n: other.get(n) for n in ("tip_response", "tip_response_2")})
    pair.run(0.1)
    (warning,) = warnings(pair)
    assert "tip_response and tip_response_2 to the beam's" in warning


@pytest.mark.parametrize("size", [1e-3, 1e-4])
@pytest.mark.parametrize("first", ["beam", "spring"])
def test_a_tool_that_passes_values_on_one_after_the_other_is_told(
    beam: Any, spring: Any, first: str, size: float
) -> None:
    pair = Pair(beam, spring, size).start()
    gauss_seidel(pair, first)
    (warning,) = warnings(pair)
    assert "for both FMUs alike (Jacobi)" in warning


@pytest.mark.parametrize("first", ["beam", "spring"])
def test_a_delay_of_one_step_mends_what_passes_within_a_step(beam: Any, spring: Any, first: str) -> None:
    pair, right = (Pair(beam, spring, 1e-3).start() for _ in range(2))
    assert gauss_seidel(pair, first, delayed=True) == list(right.run(0.1)[1])
    assert pair.spring.integer("warnings") == 0


def test_a_beam_that_looks_ahead_alone_is_told(beam: Any, spring: Any) -> None:
    pair = Pair(beam, spring, 1e-4).start(communication_step=0.0)
    pair.run(0.05)
    (warning,) = warnings(pair)
    assert "communication_step = 0" in warning
    assert "Set communication_step, tip_response and tip_response_2" in warning


@pytest.mark.parametrize("slope", [-1.0, 0.0])
@pytest.mark.parametrize(
    "load", [lambda t: 0.0, lambda t: -300.0 * (t > 0.05), lambda t: -3.0 * np.sin(40 * t)], ids=["none", "jump", "sin"]
)
def test_a_right_pair_is_not_warned_of_its_loads(beam: Any, spring: Any, load: Any, slope: float) -> None:
    for ahead in (True, False):
        pair = Pair(beam, spring, 1e-3 if ahead else 1e-4, look_ahead=ahead).start(initial_velocity_slope=slope)
        for i in range(100):
            pair.beam.set("distributed_load", load(i * pair.size))
            pair.run(pair.time + pair.size)
        assert warnings(pair) == []


def test_reaction_follows_the_tip_without_a_step(spring: Any) -> None:
    k = spring.running(contact_law=2, **LAW)
    assert k.get("reaction") == 0.0
    k.set("tip_displacement", -4e-4)
    assert k.get("reaction") == pytest.approx(1e6 * 4e-4**1.5, rel=1e-14)
    assert k.get("contact_energy") == pytest.approx(1e6 * 4e-4**2.5 / 2.5, rel=1e-14)
    k.set("tip_displacement", 1e-4)
    assert k.get("reaction") == 0.0


def test_where_the_tip_was_left_belongs_to_the_state(spring: Any) -> None:
    """After a step the tip is where its derivative took it: also restored, and after a step that was refused."""
    k = spring.running(contact_law=2, displacement=0.0, tip_displacement=-1e-3, **LAW)
    assert k.derive("tip_displacement", 1, -0.5) == k.derive("tip_displacement", 2, 30.0) == 0
    k.set("tip_velocity", 0.2)
    k.step(0.0, 1e-3)

    def seen() -> list[float]:
        return [k.get("reaction"), k.derivative("reaction")[1], k.get("contact_energy"), k.derivative("velocity")[1]]

    there, token = seen(), k.state()
    y, velocity = k.get("displacement", "velocity")
    depth, rate = y + 1e-3 + 0.5e-3 - 15e-6, velocity + 0.5 - 0.03
    assert there[0] == pytest.approx(1e6 * depth**1.5, rel=1e-12)
    assert there[1] == pytest.approx(1.5e6 * depth**0.5 * rate, rel=1e-12)
    k.set("tip_displacement", -3e-3)
    assert k.get("reaction") > 2.0 * there[0]
    k.restore(token)
    assert seen() == there
    k.set("tip_velocity", 0.3)  # of the tip where it is
    assert [seen()[0], k.derivative("reaction")[1]] == [there[0], pytest.approx(1.5e6 * depth**0.5 * (velocity - 0.3))]
    k.restore(token)
    k.set("contact_force", 1.0)  # something else
    assert seen() == there
    k.set("impulse", 1e300)
    assert k.try_step(1e-3, 1e-3) == 2
    assert seen() == there


def hunt_crossley(chi: float, speed: float, end: float) -> np.ndarray:
    """y, velocity and what was dissipated of a mass of 1 kg at 0 under a tip at ``speed t``, by scipy."""

    def slope(t: float, state: np.ndarray) -> list[float]:
        depth, rate = state[0] - speed * t, state[1] - speed
        elastic = LAW["compliance_stiffness"] * max(depth, 0.0) ** LAW["compliance_exponent"]
        force = elastic * max(0.0, 1.0 + chi * rate)
        return [state[1], -3.0 * state[0] - force, (force - elastic) * rate]

    return solve_ivp(slope, (0.0, end), np.zeros(3), "DOP853", rtol=1e-13, atol=1e-18).y[:, -1]


@pytest.mark.parametrize("chi", [0.0, 0.3, 4.0])
def test_damped_law_inside_follows_an_independent_integration(spring: Any, chi: float) -> None:
    k = spring.running(contact_law=2, linear_stiffness=3.0, compliance_damping=chi, **LAW)
    size, speed = 1e-3, -0.5
    for i in range(20):
        k.set("tip_displacement", i * size * speed)
        k.set("tip_velocity", speed)
        k.step(i * size, size)
    y, velocity, dissipated = hunt_crossley(chi, speed, 20 * size)
    assert k.get("displacement") == pytest.approx(y, rel=1e-9)
    assert k.get("velocity") == pytest.approx(velocity, rel=1e-8)
    assert k.get("dissipated_energy") == pytest.approx(dissipated, rel=1e-7, abs=1e-18)
    # At the tip as it is set next.
    k.set("tip_displacement", y - 1e-3)
    k.set("tip_velocity", 0.0)
    assert k.get("reaction") == pytest.approx(1e6 * 1e-3**1.5 * max(0.0, 1.0 + chi * velocity), rel=1e-6)
    k.set("tip_velocity", 1e3)  # away, faster than 1/chi
    assert k.get("reaction") == (0.0 if chi else pytest.approx(1e6 * 1e-3**1.5, rel=1e-6))


def test_damped_pair_loses_what_it_says_at_any_step_and_the_same_at_small_ones(beam: Any, spring: Any) -> None:
    lost = []
    for size in (5e-4, 2.5e-4, 1.25e-4):
        pair = Pair(beam, spring, size).start(compliance_damping=0.5, compliance_stiffness=1e4, restitution=0.9)
        energy = pair.run(0.1)[2]
        assert energy[2:] == pytest.approx(energy[2], abs=2e-12)
        lost.append(pair.spring.get("dissipated_energy"))
    assert lost[0] > 1e-3
    assert abs(lost[2] - lost[1]) < 0.5 * abs(lost[1] - lost[0])


def test_looking_ahead_belongs_to_the_state(beam: Any, spring: Any) -> None:
    pair = Pair(beam, spring, 1e-3).start()
    pair.run(5e-3)
    blobs = [k.serialized() for k in (pair.beam, pair.spring)]
    first = pair.run(0.1)
    outputs = [k.outputs() for k in (pair.beam, pair.spring)]
    fresh = Pair(beam, spring, 1e-3)
    for again in (fresh, pair):  # in new instances, and back in the old
        for k, blob in zip((again.beam, again.spring), blobs, strict=True):
            k.restore(k.deserialized(blob))
        again.time = 5e-3
        assert np.array_equal(again.run(0.1)[1:], first[1:])
        assert [k.outputs() for k in (again.beam, again.spring)] == outputs


def test_ssp_says_what_the_scene_and_the_beam_say(fmu_folder: Path, beam: Any) -> None:
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
    settings = {n.split(".")[1]: float(v) for n, v in values.items() if n.startswith("beam.")}
    k = beam.running(**settings)
    for name in ("tip_response", "tip_response_2", "tip_velocity_forecast"):
        assert float(values[f"spring.{name}"]) == pytest.approx(k.get(name), rel=1e-12)
    assert values["spring.communication_step"] == values["beam.communication_step"]


def test_ssp_in_fmpy(fmu_folder: Path, reference: np.ndarray, capfd: pytest.CaptureFixture[str]) -> None:
    path = str(fmu_folder / "spring_beam.ssp")
    size = 1e-3
    result = simulate_ssp(
        path, stop_time=0.4 - size / 2, step_size=size, parameter_set=read_ssv(path, "resources/soft.ssv")
    )
    # FMPy passes nothing on before its first step, which the tip makes without a force (energy + 7.5 %).
    assert len(result) == 400
    assert "nothing was passed on before the first step" in "".join(capfd.readouterr())
    assert np.abs(result["spring.displacement"] - reference).max() < 2e-4
