"""Beam and spring with nothing but their connections, as tools that only connect ports run them.

Scene `soft` with the compliance law, λ = 1e6, p = 1.5: the contact oscillates faster than steps of 1 ms (ωH ≈ 2).
"""

import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssv
from lxml import etree
from scenes import table

import springbeam

LAW = {"compliance_stiffness": 1e6, "compliance_exponent": 1.5}
E0 = 1 / 6  # ρAs²/6 + ρIs²/6·0: kinetic energy of u_t = −x, the rotation being at rest
BEAM = {"young_modulus": 100.0, "shear_modulus": 100.0, "n_elements": 50, "initial_velocity_slope": -1.0}
SPRING = {"linear_stiffness": 3.0, "cubic_stiffness": -0.2, "contact_law": 2, "stop_enabled": True}
SPRING |= {"stop_position": -0.015, **LAW}
#: Connected by name; `reaction` goes to `tip_force`. Without the last two the spring does not predict the tip.
BY_NAME = ["tip_displacement", "tip_velocity", "tip_velocity_forecast", "tip_response", "tip_response_2"]

WRONG = table("contract/values.toml")["wrong"]
STORED = ["kinetic_energy", "potential_energy", "contact_energy"]


class Pair:
    """Both FMUs and their connections. `late`: all outputs are read before inputs are set."""

    def __init__(self, beam, spring, size, look_ahead=True, late=True):
        self.size = size
        self.late = late
        self.time = 0.0
        self.beam = beam.instance()
        self.spring = spring.instance()
        self.connected = {name: name for name in BY_NAME[: 5 if look_ahead else 3]}
        self.returns = True  # whether `reaction` is connected

    def start(self, passes=2, **parameters):
        """Parameters of the beam are in `BEAM` or unknown to the spring."""
        of_beam = {n: v for n, v in parameters.items() if n not in self.spring.fmu.variables}
        of_spring = {n: v for n, v in parameters.items() if n not in of_beam}
        self.beam.enter(**{**BEAM, **of_beam})
        self.spring.enter(**{**SPRING, **of_spring})
        for _ in range(passes):
            self.exchange()
        for k in (self.beam, self.spring):
            assert k.call("ExitInitializationMode") == 0
        return self

    def exchange(self, of_beam=True, of_spring=True):
        force = self.spring.get("reaction")
        for name, source in self.connected.items() if of_beam else ():
            self.spring.set(name, self.beam.get(source))
        if of_spring and self.returns:
            self.beam.set("tip_force", force if self.late else self.spring.get("reaction"))

    def energy(self):
        names = ["kinetic_energy", "strain_energy", "dissipated_energy", "load_potential"]
        total = sum(self.beam.get(*names))
        return float(total + sum(self.spring.get(*STORED, "dissipated_energy", "impact_loss")))

    def step(self):
        for k in (self.beam, self.spring):
            k.step(self.time, self.size)
        self.time += self.size

    def run(self, end):
        """Rows (time, y, total energy), from the next step on."""
        rows = []
        while self.time < end - self.size / 2:
            self.step()
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
    # The same forces, but for the first: its tip is interpolated between now and two steps ahead; and of the shorter
    # step nobody knows before it is made, so its force is that for 1 ms.
    assert differences[0] < 4e-5
    assert differences[1] < 6e-5


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
        {"contact_law": 3, "contact_damping": 5.0},
    ],
    ids=str,
)
def test_pair_that_looks_ahead_conserves_energy(beam, spring, body, stiffness):
    for size in (1e-3, 4e-3):
        pair = Pair(beam, spring, size).start(compliance_stiffness=stiffness, **body)
        before = pair.energy()
        _, y, energy = pair.run(0.2)
        energy += -body.get("external_force", 0.0) * y
        assert energy == pytest.approx(before, abs=2e-12)  # IDA's 1e-12, of 1/6 J
        assert warnings(pair) == []


@pytest.mark.parametrize(
    "sizes",
    [[1e-3], [3e-4], [1.7e-2], [1e-3, 5e-4], [5e-4, 1e-3], [1e-3, 1.7e-2], [1.7e-2, 1e-3]],
    ids=str,
)
def test_wired_the_pair_keeps_its_energy_at_any_step_size(beam, spring, sizes):
    """From the first step on, also in contact when the size changes; what the contact then owes it pays back."""
    for change in (0.02, 0.051, 0.2):
        pair = Pair(beam, spring, sizes[0]).start()
        energies = [pair.run(change)[2]]
        owed = pair.spring.get("contact_energy")
        pair.size = sizes[-1]
        energies.append(pair.run(0.4)[2])
        assert np.concatenate(energies) == pytest.approx(E0, abs=1e-13)
        assert warnings(pair) == []
        # Of a size that nobody foresaw, 1e-3 before the first step: a part of the energy is left with the bodies.
        longest = max(b / a for a, b in zip([1e-3, *sizes], sizes, strict=False))
        owed = min(owed, pair.spring.get("contact_energy"))
        assert owed > -1e-12 if longest == 1.0 else owed > -(0.03 if longest < 3.0 else 0.3) * E0


def test_a_size_that_changes_is_followed_from_the_step_after(beam, spring):
    """Both FMUs then are what they would be if all steps had had that size."""
    names = ["tip_response", "tip_response_2"]
    expected = {}
    for size in (1e-3, 3e-4):
        k = beam.running(**BEAM)
        k.step(0.0, size)
        expected[size] = k.get(*names)
    k = beam.running(**BEAM)
    assert k.get(*names) == expected[1e-3]  # until then that of DefaultExperiment
    k.step(0.0, 3e-4)
    assert k.get(*names) == expected[3e-4]
    saved = k.serialized()
    k.step(3e-4, 1e-3)
    assert k.get(*names) == expected[1e-3]
    k.restore(k.deserialized(saved))
    assert k.get(*names) == expected[3e-4]
    k.step(3e-4, 3e-14)  # nothing is learnt from what rounding leaves
    assert k.get(*names) == expected[3e-4]


@pytest.mark.parametrize("size", [1e-3, 1e-6])
def test_four_lines_are_warned_of_where_the_steps_do_not_resolve_the_contact(beam, spring, size):
    pair = Pair(beam, spring, size, look_ahead=False).start()
    energy = pair.run(20.0 * size if size > 1e-4 else 2e-3)[2]
    if size < 1e-4:
        assert energy == pytest.approx(E0, rel=1e-3)
        assert warnings(pair) == []
        return
    assert energy[-1] > 2.0 * E0
    (warning,) = warnings(pair)
    assert "Connect tip_response and tip_response_2" in warning
    # What is then advised does: of the energy less than 1 % is gained.
    advised = float(warning.split()[-2])
    assert advised == pytest.approx(5e-6)
    again = Pair(beam, spring, advised, look_ahead=False).start()
    assert again.run(0.02)[2][-1] == pytest.approx(E0, rel=1e-2)


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
    pair.beam.enter(**BEAM)
    pair.spring.enter(**SPRING, displacement=1e-3)
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


def warnings(pair):
    return [message for k in (pair.beam, pair.spring) for status, _, message in k.messages if status == 1]


@pytest.mark.parametrize("what", WRONG)
def test_a_wrong_connection_is_warned_of_once(beam, spring, what):
    """One message says what is wrong; the output `warnings` counts the steps that show it."""
    case = WRONG[what]
    pair = Pair(beam, spring, 1e-3)
    pair.connected |= case.get("instead", {})
    for name in case.get("without", []):
        pair.connected.pop(name, None)
    pair.returns = "reaction" not in case.get("without", [])
    pair.start(**case.get("spring", {}))
    pair.run(0.1)
    (warning,) = warnings(pair)
    assert all(text in warning for text in case["said"])
    assert case.get("least", 1) <= pair.spring.get("warnings") <= case.get("most", 100)


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
def test_a_tool_that_does_not_pass_the_first_force_is_warned(beam, spring, load, body):
    """The spring has a message before its first step, so a force; the beam makes that step without it.

    The third step finds that out, and the energy is again what it was. The contact begins with the run or later: then
    nothing is missed, nor warned of.
    """
    size = 1e-3
    for begun, start in ((True, 0.0), (False, -3.5 * size)):  # the tip falls at 1 m/s
        pair = Pair(beam, spring, size)
        pair.returns = False
        pair.start(distributed_load=load, **body, displacement=start, unloaded=start)
        before = pair.energy()
        assert begun == (pair.spring.get("reaction") > 0.0)
        pair.returns = True
        assert pair.run(10.0 * size)[2][3:] == pytest.approx(before, abs=1e-13)
        assert pair.spring.get("warnings") == begun
        assert [text.count("no values were exchanged before the first step") for text in warnings(pair)] == [1] * begun


@pytest.mark.parametrize("late", [True, False])
def test_a_tool_that_exchanges_nothing_before_the_first_step_keeps_the_energy_and_is_told(
    beam, spring, late, reference
):
    pair = Pair(beam, spring, 1e-3, late=late).start(passes=0)
    rows = pair.run(0.4)
    assert rows[2] == pytest.approx(E0, abs=1e-13)
    assert ["no values were exchanged before the first step" in text for text in warnings(pair)] == [True]
    # The tip goes on at 1 m/s for two steps, in which the contact would have taken most of that.
    assert np.abs(at_milliseconds(rows) - reference).max() < 3e-4


def test_start_values_replace_a_first_exchange(beam, spring):
    """A tool that exchanges nothing before its first step, but takes start values of inputs."""
    pair = Pair(beam, spring, 1e-3).start()
    values = dict(zip(BY_NAME, pair.beam.get(*BY_NAME), strict=True))
    force = pair.spring.get("reaction")
    other = Pair(beam, spring, 1e-3).start(passes=0, tip_force=force, **values)
    assert np.array_equal(other.run(0.1), pair.run(0.1))
    assert warnings(other) == []


#: A light top on a coarse beam, in steps that are long beside the waves in it.
LIGHT = {"mass": 0.01, "linear_stiffness": 1.0, "compliance_stiffness": 100.0, "compliance_exponent": 1.0}


@pytest.mark.parametrize("version", ["2.0"])
@pytest.mark.parametrize("size", [0.1, 0.5])
@pytest.mark.parametrize("slope", [-1.0, -0.1, 0.3])
def test_a_right_pair_is_not_warned_of_a_first_step_that_was_a_guess(beam, spring, size, slope):
    pair = Pair(beam, spring, size).start(n_elements=4, initial_velocity_slope=slope, **LIGHT)
    pair.run(20.0 * size)
    assert warnings(pair) == []


CONNECTIONS = {("beam", name, "spring", name) for name in BY_NAME} | {("spring", "reaction", "beam", "tip_force")}


def test_the_system_file_says_what_the_scene_and_the_fmus_say(fmu_folder, beam, spring):
    scene = springbeam.load_scene("soft")
    with zipfile.ZipFile(fmu_folder / f"spring_{beam.path.stem}.ssp") as archive:
        values = etree.fromstring(archive.read("resources/soft.ssv"))
        structure = etree.fromstring(archive.read("SystemStructure.ssd"))
        for fmu in (beam, spring):
            assert archive.read(f"resources/{fmu.path.name}") == fmu.path.read_bytes()
    parameters = {p.get("name"): p[0].get("value") for p in values.iter("{*}Parameter")}
    for name in ("beam.young_modulus", "beam.n_elements", "beam.initial_velocity_slope", "spring.linear_stiffness"):
        body, key = name.split(".")
        assert float(parameters[name]) == getattr(getattr(scene, body), key)
    assert float(parameters["spring.stop_position"]) == scene.stop.position
    assert {tuple(c.attrib.values()) for c in structure.iter("{*}Connection")} == CONNECTIONS
    # OMSimulator imports no file without it.
    assert beam.version == "3.0" or structure.find(".//{*}FixedStepMaster") is not None


@pytest.mark.parametrize("version", ["3.0"])
def test_terminals_connect_the_pair_as_the_system_file_does(beam, spring):
    schema = etree.XMLSchema(etree.parse(Path(fmpy.__file__).parent / "schema/fmi3/fmi3TerminalsAndIcons.xsd"))
    members = []
    for fmu in (beam, spring):
        document = etree.parse(fmu.folder / "terminalsAndIcons" / "terminalsAndIcons.xml")
        schema.assertValid(document)
        found = document.iter("TerminalMemberVariable")
        members.append({member.get("memberName"): fmu.variables[member.get("variableName")] for member in found})
    upper, lower = members
    assert upper.keys() == lower.keys()
    plugged = set()
    for name, one in upper.items():
        ends = sorted([("beam", one), ("spring", lower[name])], key=lambda end: end[1].causality, reverse=True)
        assert [end.causality for _, end in ends] == ["output", "input"]
        plugged.add(tuple(text for body, end in ends for text in (body, end.name)))
    assert plugged == CONNECTIONS


def test_ssp_in_fmpy(fmu_folder, reference, capfd):
    path = str(fmu_folder / "spring_beam.ssp")
    size = 1e-3
    result = simulate_ssp(
        path, stop_time=0.4 - size / 2, step_size=size, parameter_set=read_ssv(path, "resources/soft.ssv")
    )
    # FMPy passes nothing on before its first step: the tip makes two without a force.
    assert len(result) == 400
    assert "no values were exchanged before the first step" in "".join(capfd.readouterr())
    assert np.abs(result["spring.displacement"] - reference).max() < 3e-4
