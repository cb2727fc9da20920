"""The FMUs by FMPy's slaves: statuses and messages are seen as an importer sees them."""

import ctypes as ct
import math
import shutil
from copy import copy

import fmpy
import pytest
from fmpy import fmi2, fmi3
from fmpy.fmi1 import FMICallException

OK = 0
WARNING = 1
DISCARD = 2
ERROR = 3

#: The inputs of force and impulse, the motion of the end.
ENDS = {
    "beam": ("tip_force", "tip_impulse", "tip_displacement", "tip_velocity"),
    "spring": ("contact_force", "impulse", "displacement", "velocity"),
}
#: Parameters that make something happen.
HILL = {"linear_stiffness": 3.0, "cubic_stiffness": -0.2}
SOFT = {"young_modulus": 100.0, "shear_modulus": 100.0}
MOVING = {
    "beam": {**SOFT, "n_elements": 12, "alpha_b": 1e-3, "initial_velocity_slope": -1.0},
    "spring": {**HILL, "damping": 0.1, "displacement": 0.5, "velocity": -1.0},
}
#: What FMI 2.0 calls functions of FMI 3.0; tests know all by their names in FMI 3.0, without the prefix.
IN_FMI2 = {"FMUState": "FMUstate", "Deserialize": "DeSerialize", "Float64": "Real", "Int32": "Integer"}
IN_FMI2 |= {"GetOutputDerivatives": "GetRealOutputDerivatives"}


class Fmu:
    """A loaded FMU: description, library, and what the tests need to know of it."""

    def __init__(self, path, folder):
        self.path = path
        self.folder = folder
        fmpy.extract(str(path), unzipdir=str(folder))
        self.description = fmpy.read_model_description(str(path))
        self.version = self.description.fmiVersion
        #: Of the twins: "beam" or "spring".
        self.name = self.description.coSimulation.modelIdentifier
        platform = "linux64" if self.version == "2.0" else "x86_64-linux"
        self.binary = folder / "binaries" / platform / f"{self.name}.so"
        given = {"guid": self.description.guid, "modelIdentifier": self.name, "unzipDirectory": str(folder)}
        self.slave = {"2.0": fmi2.FMU2Slave, "3.0": fmi3.FMU3Slave}[self.version](**given)
        self.variables = {v.name: v for v in self.description.modelVariables}
        #: But for `warnings`, which counts what was refused and is no part of the state.
        self.outputs = [name for name in self.named("output") if name != "warnings"]
        self.instances = []
        self.parameters = MOVING[self.name]
        self.force, self.impulse, self.displacement, self.velocity = ENDS[self.name]

    def spelt(self, function):
        """Return what this version calls a function."""
        if self.version == "3.0":
            return f"fmi3{function}"
        for name, before in IN_FMI2.items():
            function = function.replace(name, before)
        return f"fmi2{function}"

    def named(self, causality):
        """The variables of a causality, but for the derivatives that are inputs in FMI 3.0."""
        return [n for n, v in self.variables.items() if v.causality == causality and not n.startswith("der(")]

    def numbers(self, *names):
        """The value references."""
        return [self.variables[name].valueReference for name in names]

    def references(self, *names):
        """The value references, as C takes them."""
        return (ct.c_uint * len(names))(*self.numbers(*names))

    def instance(self, **options):
        made = {"2.0": Instance, "3.0": Instance3}[self.version](self, **options)
        self.instances.append(made)
        return made

    def running(self, **values):
        """An instance that was started, see `Instance.enter`."""
        return self.instance().start(**values)

    def moving(self, **values):
        """One in which something happens."""
        return self.running(**{**self.parameters, **values})


class Instance:
    """One instance of FMI 2.0; keeps the messages it sends. A call that fails raises, unless its status is returned."""

    def __init__(self, fmu, name=b"test", guid=None, resources=None, callbacks=True, logging=False, **options):
        self.fmu = fmu
        self.slave = copy(fmu.slave)
        self.messages = []
        self.identity = (name, fmu.description.guid.encode() if guid is None else guid, resources)
        self.make(callbacks, logging, **options)

    def make(self, callbacks=True, logging=False, kind=fmi2.fmi2CoSimulation):
        self.logger = fmi2.fmi2CallbackLoggerTYPE(lambda _environment, _name, *message: self.log(*message))
        struct = fmi2.fmi2CallbackFunctions(self.logger)
        (name, guid, resources), pointer = self.identity, ct.byref(struct) if callbacks else None
        self.slave.component = self.slave.fmi2Instantiate(name, kind, guid, resources, pointer, False, logging)
        # The FMU must have copied the struct.
        ct.memset(ct.byref(struct), 0xFF, ct.sizeof(struct))

    def log(self, status, category, message):
        self.messages.append((status, category.decode(), message.decode()))

    def counted(self, n):
        """Return what follows an array of ``n`` values: FMI 3.0 asks for their number."""
        return ()

    @property
    def message(self):
        """The last one."""
        return self.messages[-1][2] if self.messages else ""

    def status(self, call, *arguments):
        """Return the status of a call, instead of an error."""
        try:
            call(*arguments)
        except FMICallException as failed:
            return failed.status
        return OK

    def call(self, function, *arguments):
        """Return the status of a function of C."""
        return self.status(getattr(self.slave, self.fmu.spelt(function)), self.slave.component, *arguments)

    def access(self, function, references, n, values):
        """Get or set values of ``n`` variables."""
        return self.call(function, references, n, values, *self.counted(n))

    def free(self):
        if self.slave.component:
            getattr(self.slave, self.fmu.spelt("FreeInstance"))(self.slave.component)
            self.slave.component = None

    def initialise(self, *experiment):
        """Say when the run starts and ends, and enter initialization mode."""
        self.slave.setupExperiment(*experiment)
        self.slave.enterInitializationMode()

    def try_enter(self, start=0.0, stop=None, tolerance=None):
        """Return the status; rows of the table of bad calls name it."""
        return self.status(self.initialise, tolerance, start, stop)

    def enter(self, start_time=0.0, stop_time=None, tolerance=None, **values):
        """Enter initialization mode, with values of parameters and inputs."""
        for name, value in values.items():
            self.set(name, value)
        self.initialise(tolerance, start_time, stop_time)
        return self

    def start(self, **values):
        """Enter initialization mode and leave it."""
        self.enter(**values).slave.exitInitializationMode()
        return self

    def set(self, name, value):
        variable = self.fmu.variables[name]
        given = value if variable.type in ("Real", "Float64") else int(value)
        getattr(self.slave, f"set{variable.type}")([variable.valueReference], [given])

    def try_set(self, name, value):
        return self.status(self.set, name, value)

    def values(self, names):
        """Return real values by their names."""
        return dict(zip(names, self.slave.getReal(self.fmu.numbers(*names)), strict=True))

    def get(self, *names):
        """Real values: one, or a list."""
        found = self.values(names)
        return found[names[0]] if len(names) == 1 else [found[name] for name in names]

    def outputs(self):
        """The Real ones."""
        return list(self.get(*self.fmu.outputs))

    def derive(self, name, order, value):
        """Set an input's derivative."""
        self.slave.setRealInputDerivatives(self.fmu.numbers(name), [order], [value])

    def derive_at_once(self, name, first, second):
        """Set both derivatives of an input in one call."""
        self.slave.setRealInputDerivatives(self.fmu.numbers(name, name), [1, 2], [first, second])

    def derivative(self, name, order=1):
        derivatives = {"2.0": "getRealOutputDerivatives", "3.0": "getOutputDerivatives"}[self.fmu.version]
        return getattr(self.slave, derivatives)(self.fmu.numbers(name), [order])[0]

    def partials(self, outputs, *names, seed=(1.0,)):
        """Return the derivatives of the outputs by inputs or, before the start, by parameters."""
        return self.slave.getDirectionalDerivative(self.fmu.numbers(*outputs), self.fmu.numbers(*names), seed)

    def try_step(self, time, size):
        return self.call("DoStep", time, size, False)

    def reached(self):
        """How far the last step came."""
        return self.slave.getRealStatus(fmi2.fmi2LastSuccessfulTime)

    def ends(self):
        """Whether the FMU asks to end the simulation, as no step can follow."""
        return bool(self.slave.getBooleanStatus(fmi2.fmi2Terminated))

    def step(self, time, size):
        assert self.try_step(time, size) == OK, self.message

    def state(self):
        return self.slave.getFMUState()

    def restore(self, token):
        self.slave.setFMUState(token)

    def serialized(self):
        token = self.state()
        blob = self.slave.serializeFMUState(token)
        self.slave.freeFMUState(token)
        return blob

    def deserialized(self, blob):
        # The token is an output only (FMI 2.0.4): JavaFMI passes what is not initialised.
        return self.slave.deserializeFMUState(blob, ct.c_void_p(0xDEADBEEF))


class Instance3(Instance):
    """One instance of FMI 3.0."""

    def make(self, callbacks=True, logging=False, events=False, early=False):
        self.logger = fmi3.fmi3LogMessageCallback(lambda _environment, *message: self.log(*message))
        self.event = ct.c_bool()
        self.end = ct.c_bool()
        self.early = ct.c_bool()
        self.last = ct.c_double()
        logger = self.logger if callbacks else fmi3.fmi3LogMessageCallback()
        unused = (None, 0, None, logger, fmi3.fmi3IntermediateUpdateCallback())
        options = (*self.identity, False, logging, events, early, *unused)
        self.slave.component = self.slave.fmi3InstantiateCoSimulation(*options)

    def counted(self, n):
        return (n,)

    def initialise(self, *experiment):
        self.slave.enterInitializationMode(*experiment)

    def values(self, names):
        """Return elements of arrays by index, too."""
        found = {}
        for array in {name if name in self.fmu.variables else name.split("[")[0] for name in names}:
            size = math.prod(self.fmu.variables[array].shape or ())
            values = self.slave.getFloat64(self.fmu.numbers(array), size)
            found |= {array: values[0]} | {f"{array}[{i}]": value for i, value in enumerate(values, 1)}
        return found

    def derive(self, name, order, value):
        self.set(f"der({name}{'' if order == 1 else f',{order}'})", value)

    def derive_at_once(self, name, first, second):
        self.slave.setFloat64(self.fmu.numbers(f"der({name})", f"der({name},2)"), [first, second])

    def try_step(self, time, size):
        self.last.value = math.nan  # it is told by steps that are discarded, too
        told = [ct.byref(value) for value in (self.event, self.end, self.early, self.last)]
        return self.call("DoStep", time, size, False, *told)

    def reached(self):
        return self.last.value

    def ends(self):
        return bool(self.end.value)


@pytest.fixture
def folder(fmu_folder, tmp_path, monkeypatch):
    """Copies of the FMUs, to be spoilt; the master takes these."""
    for name in ("beam", "spring"):
        shutil.copy(fmu_folder / f"{name}.fmu", tmp_path)
    monkeypatch.setenv("SPRINGBEAM_FMUS", str(tmp_path))
    return tmp_path


@pytest.fixture(scope="session")
def fmus(fmu_folder, tmp_path_factory):
    """Both FMUs by their names, in each version of FMI."""
    files = {"2.0": "", "3.0": "3"}
    return {
        version: {n: Fmu(fmu_folder / f"{n}{end}.fmu", tmp_path_factory.mktemp(n + end)) for n in ENDS}
        for version, end in files.items()
    }


@pytest.fixture(params=["2.0", "3.0"])
def version(request):
    """Each version of FMI in turn; a test that is about one of them is parametrised by that."""
    return str(request.param)


@pytest.fixture
def loaded(fmus, version):
    """Both FMUs; the instances that the test makes are freed after it."""
    yield fmus[version]
    for fmu in fmus[version].values():
        for instance in fmu.instances:
            instance.free()
        fmu.instances.clear()


@pytest.fixture
def beam(loaded):
    return loaded["beam"]


@pytest.fixture
def spring(loaded):
    return loaded["spring"]


@pytest.fixture(params=ENDS)
def case(request, loaded):
    """Each of them in turn."""
    return loaded[request.param]
