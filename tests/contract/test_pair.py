"""Beam and spring with nothing but their connections, as tools that only connect ports run them.

Scene `soft` with the compliance law, λ = 1e6, p = 1.5: the contact oscillates faster than steps of 1 ms (ωH ≈ 2).
"""

import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path

import numpy as np
import pytest
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssv

import springbeam
from springbeam.scene.files import tomllib

LAW = {"compliance_stiffness": 1e6, "compliance_exponent": 1.5}
E0 = 1 / 6  # ρAs²/6 + ρIs²/6·0: kinetic energy of u_t = −x, the rotation being at rest
BEAM = {"young_modulus": 100.0, "shear_modulus": 100.0, "n_elements": 50, "initial_velocity_slope": -1.0}
SPRING = {"linear_stiffness": 3.0, "cubic_stiffness": -0.2, "contact_law": 2, "stop_enabled": True}
SPRING |= {"stop_position": -0.015, **LAW}
#: Connected by name, whether the pair looks ahead or not; `reaction` goes to `tip_force`.
BY_NAME = ["tip_displacement", "tip_velocity", "tip_velocity_forecast"]

WRONG = tomllib.loads(Path(__file__).with_name("values.toml").read_text(encoding="utf-8"))["wrong"]
STORED = ["kinetic_energy", "potential_energy", "contact_energy"]


class Pair:
    """Both FMUs and their connections. `late`: all outputs are read before inputs are set."""

    def __init__(self, beam, spring, size, look_ahead=True, late=True):
        self.size = size
        self.late = late
        self.time = 0.0
        self.beam = beam.instance()
        self.spring = spring.instance()
        self.ahead = {"communication_step": size} if look_ahead else {}
        self.connected = BY_NAME
        self.returns = True  # whether `reaction` is connected

    def start(self, **parameters):
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
            assert k.call("ExitInitializationMode") == 0
        return self

    def exchange(self, of_beam=True, of_spring=True):
        force = self.spring.get("reaction")
        for name in self.connected if of_beam else ():
            self.spring.set(name, self.beam.get(name))
        if of_spring and self.returns:
            self.beam.set("tip_force", force if self.late else self.spring.get("reaction"))

    def energy(self):
        names = ["kinetic_energy", "strain_energy", "dissipated_energy", "load_potential"]
        total = sum(self.beam.get(*names))
        return float(total + sum(self.spring.get(*STORED, "dissipated_energy", "impact_loss")))

    def run(self, end):
        """Rows (time, y, total energy), from the next step on."""
        rows = []
        while self.time < end - self.size / 2:
            for k in (self.beam, self.spring):
                k.step(self.time, self.size)
            self.time += self.size
            self.exchange()
            rows.append((self.time, self.spring.get("displacement"), self.energy()))
        return np.array(rows).T


def at_milliseconds(rows):
    return np.interp(np.arange(1, round(rows[0, -1] * 1e3) + 1) * 1e-3, rows[0], rows[1])


def test_pair_that_looks_ahead_agrees_with_the_master_at_the_same_step(beam, spring, reference, master_run):
    differences = []
    for size, of_master in master_run.items():
        y = at_milliseconds(Pair(beam, spring, size).start().run(0.4))
        differences.append(np.abs(y - of_master).max())
        # As good as the master: its own error is 2.3e-4 m at 1 ms, of a motion of 30 mm.
        assert np.abs(y - reference).max() < 1.1 * np.abs(of_master - reference).max()
    # Same forces but for the first step, whose tip is predicted with an error of order H³ (u_tt grows from 0).
    assert differences[0] < 4e-5
    assert differences[1] < differences[0] / 8


def test_pair_that_looks_ahead_does_not_depend_on_the_order_of_reading(beam, spring):
    runs = [Pair(beam, spring, 1e-3, late=late).start().run(0.1) for late in (True, False)]
    assert np.array_equal(*runs)


@pytest.mark.parametrize("version", ["2.0"])
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
def test_pair_that_looks_ahead_conserves_energy(beam, spring, body, stiffness):
    for size in (1e-3, 4e-3):
        _, y, energy = Pair(beam, spring, size).start(compliance_stiffness=stiffness, **body).run(0.2)
        energy += -body.get("external_force", 0.0) * y
        assert energy[2:] == pytest.approx(energy[2], abs=2e-12)  # IDA's 1e-12, of 1/6 J
        # The first step, predicted by the mean velocity over two.
        assert energy[2] == pytest.approx(E0, rel=1e-3 if size == 1e-3 else 1e-2)


def initial_inputs(case):
    """Return the inputs that each output may depend on at the start: all where the description has no list."""
    unknowns = {u.variable.name: u.dependencies for u in case.description.initialUnknowns}
    inputs = {name for name in case.named("input") if not name.startswith("der(")}
    return {o: inputs if names is None else inputs & {v.name for v in names} for o, names in unknowns.items()}


def test_the_connections_at_the_start_are_a_loop_that_two_passes_solve(beam, spring):
    """A beam at rest under its forces follows `tip_force`, so tools that sort initial unknowns iterate over this loop.

    In a start as given the tip does not follow: the second pass changes nothing.
    """
    of_beam = initial_inputs(beam)
    of_spring = initial_inputs(spring)
    loop = {name for name in BY_NAME if "tip_force" in of_beam[name]}
    assert loop == {"tip_displacement", "tip_velocity_forecast"}
    assert loop < of_spring["reaction"]
    assert of_beam["tip_mass"] == set()

    pair = Pair(beam, spring, 1e-3)
    pair.beam.enter(**BEAM, **pair.ahead)
    names = ["tip_response", "tip_response_2"]
    responses = dict(zip(names, pair.beam.get(*names), strict=True))
    pair.spring.enter(**SPRING, **pair.ahead, **responses, displacement=1e-3)
    passes = []
    for _ in range(3):
        pair.exchange()
        passes.append((pair.spring.get("reaction"), *pair.beam.get(*BY_NAME)))
    assert passes[0] == passes[1] == passes[2]
    assert passes[0][0] > 1.0  # N: the top presses


def test_pair_with_the_law_integrated_under_the_extrapolated_tip_converges_at_first_order(beam, spring, reference):
    errors = []
    for size in (5e-5, 2e-5):
        rows = Pair(beam, spring, size, look_ahead=False, late=False).start().run(0.05)
        errors.append(abs(rows[1, -1] - reference[49]))
    assert errors[0] < 3e-4
    assert 1.5 < errors[0] / errors[1] < 5.0  # H ratio 2.5: first order


def test_a_step_that_was_tried_is_the_step_of_an_instance_that_has_tried_none(beam, spring):
    """Each step ends where the last trial of the step before has ended; another instance integrates it."""
    pair = Pair(beam, spring, 1e-3).start()
    touching = 0
    for _ in range(60):
        other = spring.running()
        other.restore(other.deserialized(pair.spring.serialized()))
        time = pair.time
        pair.run(time + pair.size)
        other.step(time, pair.size)
        for name in pair.connected:
            other.set(name, pair.beam.get(name))
        touching += other.get("reaction") > 0.0
        assert other.outputs() == pair.spring.outputs()
        other.free()
    assert touching > 10


def test_a_last_step_of_rounding_is_made_under_the_held_force(beam, spring):
    size = 1e-3
    pair = Pair(beam, spring, size).start()
    twin = Pair(beam, spring, size).start()
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


def warnings(pair):
    return [message for k in (pair.beam, pair.spring) for status, _, message in k.messages if status == 1]


@pytest.mark.parametrize("what", WRONG)
def test_a_wrong_connection_is_warned_of_once(beam, spring, what):
    """One message says what is wrong; the output `warnings` counts the steps that show it."""
    case = WRONG[what]
    pair = Pair(beam, spring, 1e-3)
    pair.connected = [name for name in BY_NAME if name != case.get("without")]
    pair.returns = case.get("without") != "reaction"
    pair.ahead = {"communication_step": case.get("steps_of_beam", 1e-3)}
    ahead = beam.running(**BEAM, communication_step=case.get("responses_of", 1e-3))
    responses = ahead.get("tip_response", "tip_response_2")
    names = case.get("responses_as", ["tip_response", "tip_response_2"])
    parameters = {"communication_step": 1e-3, **dict(zip(names, responses, strict=True)), **case.get("spring", {})}
    pair.start(**parameters)
    pair.run(0.1)
    (warning,) = warnings(pair)
    assert all(text in warning for text in case["said"])
    assert case.get("least", 1) <= pair.spring.get("warnings") <= case.get("most", 100)


def test_the_first_force_does_not_depend_on_what_was_seen_before(spring):
    forces = []
    for seen in ([0.0], [0.02, 0.0]):
        k = spring.running(contact_law=2, communication_step=1e-3, tip_response=1e-6, displacement=0.01)
        for u in seen:
            k.set("tip_displacement", u)
        forces.append(k.get("reaction"))
    assert forces[0] == pytest.approx(1e-2, rel=1e-3)  # λ δ³, λ = 1e4
    assert forces[0] == pytest.approx(forces[1], rel=1e-12)


@pytest.mark.parametrize("size", [1e-3, 1e-4])
@pytest.mark.parametrize("first", ["beam", "spring"])
def test_a_tool_that_steps_one_after_the_other_is_warned(beam, spring, first, size):
    pair = Pair(beam, spring, size).start()
    order = [pair.beam, pair.spring] if first == "beam" else [pair.spring, pair.beam]
    for i in range(8):
        for k in order:
            k.step(i * size, size)
            pair.exchange(of_beam=k is pair.beam, of_spring=k is pair.spring)
    (warning,) = warnings(pair)
    assert "for both FMUs alike (Jacobi)" in warning


@pytest.mark.parametrize("version", ["2.0"])
@pytest.mark.parametrize("load", [0.0, -5.0])
@pytest.mark.parametrize("body", [{}, {"compliance_exponent": 3.0, "compliance_stiffness": 1e10}], ids=str)
def test_a_tool_that_passes_start_values_but_forgets_the_first_exchange_is_warned(beam, spring, load, body):
    """Start values are those of the beam, so that the spring has a force; the beam makes its first step without it.

    From then on all is right. The contact begins with the run or later: then nothing is missed, nor warned of.
    """
    size = 1e-3
    for begun, start in ((True, 0.0), (False, -3.5 * size)):  # the tip falls at 1 m/s
        pair = Pair(beam, spring, size)
        pair.returns = False
        pair.start(distributed_load=load, **body, displacement=start, unloaded=start)
        assert begun == (pair.spring.get("reaction") > 0.0)
        pair.returns = True
        pair.run(10.0 * size)
        assert pair.spring.get("warnings") == begun
        assert [text.count("no values were exchanged before the first step") for text in warnings(pair)] == [1] * begun


@pytest.mark.parametrize("version", ["2.0"])
@pytest.mark.parametrize("slope", [-1.0, 0.0])
@pytest.mark.parametrize(
    "load", [lambda t: 0.0, lambda t: -300.0 * (t > 0.05), lambda t: -3.0 * np.sin(40 * t)], ids=["none", "jump", "sin"]
)
def test_a_right_pair_is_not_warned_of_its_loads(beam, spring, load, slope):
    for ahead in (True, False):
        pair = Pair(beam, spring, 1e-3 if ahead else 1e-4, look_ahead=ahead).start(initial_velocity_slope=slope)
        for i in range(100):
            pair.beam.set("distributed_load", load(i * pair.size))
            pair.run(pair.time + pair.size)
        assert warnings(pair) == []
        assert [k.get("warnings") for k in (pair.beam, pair.spring)] == [0, 0]


@pytest.mark.parametrize("version", ["2.0"])
@pytest.mark.parametrize("size", [1e-3, 1e-2, 0.1, 0.2])
@pytest.mark.parametrize("bend", [0.01, 1.0, -0.1])
def test_a_right_pair_is_not_warned_of_a_beam_that_turns_in_the_first_step(beam, spring, size, bend):
    """A bent beam is released: the mean velocity over two steps, which stands for that of the first, is far from it."""
    pair = Pair(beam, spring, size).start(initial_velocity_slope=0.0, initial_deflection_slope=bend)
    pair.exchange()  # again: the force follows the tip
    pair.run(20.0 * size)
    assert warnings(pair) == []


def test_ssp_says_what_the_scene_and_the_beam_say(fmu_folder, beam):
    scene = springbeam.load_scene("soft")
    with zipfile.ZipFile(fmu_folder / "spring_beam.ssp") as archive:
        root = ET.fromstring(archive.read("resources/soft.ssv"))
        for name in ("beam", "spring"):
            assert archive.read(f"resources/{name}.fmu") == (fmu_folder / f"{name}.fmu").read_bytes()
    parameters = {p.get("name"): p[0].get("value") for p in root.iter() if p.tag.endswith("}Parameter")}
    found = {name: float(value) for name, value in parameters.items() if value not in ("true", "false")}
    assert found["spring.stop_position"] == scene.stop.position
    for body, keys in {
        "beam": ("young_modulus", "shear_modulus", "n_elements", "initial_velocity_slope"),
        "spring": ("linear_stiffness", "cubic_stiffness"),
    }.items():
        assert [found[f"{body}.{key}"] for key in keys] == [getattr(getattr(scene, body), key) for key in keys]
    k = beam.running(**{name.split(".")[1]: value for name, value in found.items() if name.startswith("beam.")})
    for name in ("tip_response", "tip_response_2", "tip_velocity_forecast"):
        assert found[f"spring.{name}"] == pytest.approx(k.get(name), rel=1e-12)
    assert found["spring.communication_step"] == found["beam.communication_step"]


def test_ssp_in_fmpy(fmu_folder, reference, capfd):
    path = str(fmu_folder / "spring_beam.ssp")
    size = 1e-3
    result = simulate_ssp(
        path, stop_time=0.4 - size / 2, step_size=size, parameter_set=read_ssv(path, "resources/soft.ssv")
    )
    # FMPy passes nothing on before its first step, which the tip makes without a force (energy + 7.5 %).
    assert len(result) == 400
    assert "no values were exchanged before the first step" in "".join(capfd.readouterr())
    assert np.abs(result["spring.displacement"] - reference).max() < 2e-4
