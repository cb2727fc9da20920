"""The FMUs through their C API, by ctypes alone: statuses and messages are seen as an importer sees them."""

import ctypes as ct
import math
import shutil

import fmpy
import pytest

OK, WARNING, DISCARD, ERROR = 0, 1, 2, 3
CO_SIMULATION = 1

Logger = ct.CFUNCTYPE(None, ct.c_void_p, ct.c_char_p, ct.c_int, ct.c_char_p, ct.c_char_p)


class Callbacks(ct.Structure):
    _fields_ = [
        ("logger", Logger),
        ("allocate", ct.c_void_p),
        ("free", ct.c_void_p),
        ("finished", ct.c_void_p),
        ("environment", ct.c_void_p),
    ]


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


class Fmu:
    """A loaded FMU: description, library, and what the tests need to know of it."""

    def __init__(self, path, folder):
        self.path, self.folder, self.name = path, folder, path.stem
        fmpy.extract(str(path), unzipdir=str(folder))
        self.description = fmpy.read_model_description(str(path))
        identifier = self.description.coSimulation.modelIdentifier
        self.binary = folder / "binaries" / "linux64" / f"{identifier}.so"
        self.library = ct.CDLL(str(self.binary))
        self.library.fmi2Instantiate.restype = ct.c_void_p
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.outputs = [name for name in self.named("output") if self.variables[name].type == "Real"]
        self.instances = []
        self.parameters = MOVING[self.name]
        self.force, self.impulse, self.displacement, self.velocity = ENDS[self.name]

    def named(self, causality):
        """The variables of a causality."""
        return [name for name, v in self.variables.items() if v.causality == causality]

    def references(self, *names):
        """The value references, as C takes them."""
        return (ct.c_uint * len(names))(*[self.variables[name].valueReference for name in names])

    def instance(self, **options):
        made = Instance(self, **options)
        self.instances.append(made)
        return made

    def running(self, **values):
        """An instance that was started, see `Instance.enter`."""
        return self.instance().start(**values)

    def moving(self, **values):
        """One in which something happens."""
        return self.running(**{**self.parameters, **values})


class Instance:
    """One instance; keeps the messages it sends."""

    def __init__(
        self,
        fmu,
        name=b"test",
        kind=CO_SIMULATION,
        guid=None,
        resources=None,
        callbacks=True,
        logging=False,
    ):
        self.fmu = fmu
        self.messages = []
        self._logger = Logger(self._log)
        struct = Callbacks(self._logger, None, None, None, None)
        pointer = ct.byref(struct) if callbacks else None
        identity = fmu.description.guid.encode() if guid is None else guid
        made = fmu.library.fmi2Instantiate(name, kind, identity, resources, pointer, 0, int(logging))
        self.component = ct.c_void_p(made)
        # The FMU must have copied the struct.
        ct.memset(ct.byref(struct), 0xFF, ct.sizeof(struct))

    def _log(self, environment, name, status, category, message):
        self.messages.append((status, category.decode(), message.decode()))

    @property
    def message(self):
        """The last one."""
        return self.messages[-1][2] if self.messages else ""

    def call(self, function, *arguments):
        return int(getattr(self.fmu.library, function)(self.component, *arguments))

    def free(self):
        if self.component:
            self.fmu.library.fmi2FreeInstance(self.component)
            self.component = ct.c_void_p()

    def setup(self, start=0.0, stop=None, tolerance=None):
        known = int(tolerance is not None), ct.c_double(tolerance or 0.0)
        end = int(stop is not None), ct.c_double(stop or 0.0)
        return self.call("fmi2SetupExperiment", *known, ct.c_double(start), *end)

    def enter(self, start_time=0.0, stop_time=None, tolerance=None, **values):
        """Enter initialization mode, with values of parameters and inputs."""
        assert self.setup(start_time, stop_time, tolerance) == OK, self.message
        for name, value in values.items():
            self.set(name, value)
        assert self.call("fmi2EnterInitializationMode") == OK, self.message
        return self

    def start(self, **values):
        """Enter initialization mode and leave it."""
        self.enter(**values)
        assert self.call("fmi2ExitInitializationMode") == OK, self.message
        return self

    def try_set(self, name, value):
        variable = self.fmu.variables[name]
        reference = self.fmu.references(name)
        if variable.type == "Real":
            return self.call("fmi2SetReal", reference, 1, (ct.c_double * 1)(value))
        function = "fmi2SetBoolean" if variable.type == "Boolean" else "fmi2SetInteger"
        return self.call(function, reference, 1, (ct.c_int * 1)(int(value)))

    def set(self, name, value):
        assert self.try_set(name, value) == OK, self.message

    def get(self, *names):
        """Real values: one, or a list."""
        values = (ct.c_double * len(names))(*[math.nan] * len(names))
        assert self.call("fmi2GetReal", self.fmu.references(*names), len(names), values) == OK, self.message
        return values[0] if len(names) == 1 else list(values)

    def integer(self, name):
        value = (ct.c_int * 1)()
        assert self.call("fmi2GetInteger", self.fmu.references(name), 1, value) == OK, self.message
        return int(value[0])

    def outputs(self):
        """The Real ones."""
        return list(self.get(*self.fmu.outputs))

    def derive(self, name, order, value):
        """Set an input's derivative."""
        reference = self.fmu.references(name)
        return self.call("fmi2SetRealInputDerivatives", reference, 1, (ct.c_int * 1)(order), (ct.c_double * 1)(value))

    def derivative(self, name, order=1):
        reference = self.fmu.references(name)
        value = (ct.c_double * 1)(math.nan)
        return self.call("fmi2GetRealOutputDerivatives", reference, 1, (ct.c_int * 1)(order), value), value[0]

    def partials(self, outputs, name):
        """Return the status, and the derivatives of the outputs by an input or, before the start, by a parameter."""
        values = (ct.c_double * len(outputs))(*[math.nan] * len(outputs))
        unknown, known, one = self.fmu.references(*outputs), self.fmu.references(name), (ct.c_double * 1)(1.0)
        arguments = (unknown, ct.c_size_t(len(outputs)), known, ct.c_size_t(1), one, values)
        return self.call("fmi2GetDirectionalDerivative", *arguments), list(values)

    def try_step(self, time, size):
        return self.call("fmi2DoStep", ct.c_double(time), ct.c_double(size), 0)

    def step(self, time, size):
        assert self.try_step(time, size) == OK, self.message

    def state(self):
        token = ct.c_void_p()
        assert self.call("fmi2GetFMUstate", ct.byref(token)) == OK, self.message
        return token

    def restore(self, token):
        assert self.call("fmi2SetFMUstate", token) == OK, self.message

    def serialized(self):
        token, size = self.state(), ct.c_size_t()
        assert self.call("fmi2SerializedFMUstateSize", token, ct.byref(size)) == OK
        buffer = ct.create_string_buffer(size.value)
        assert self.call("fmi2SerializeFMUstate", token, buffer, size) == OK
        assert self.call("fmi2FreeFMUstate", ct.byref(token)) == OK
        return buffer.raw

    def try_deserialize(self, blob):
        token = ct.c_void_p()
        status = self.call("fmi2DeSerializeFMUstate", blob, ct.c_size_t(len(blob)), ct.byref(token))
        return status, token

    def deserialized(self, blob):
        status, token = self.try_deserialize(blob)
        assert status == OK, self.message
        return token


@pytest.fixture
def folder(fmu_folder, tmp_path, monkeypatch):
    """Copies of the FMUs, to be spoilt; the master takes these."""
    for name in ("beam", "spring"):
        shutil.copy(fmu_folder / f"{name}.fmu", tmp_path)
    monkeypatch.setenv("SPRINGBEAM_FMUS", str(tmp_path))
    return tmp_path


@pytest.fixture(scope="session")
def fmus(fmu_folder, tmp_path_factory):
    return {name: Fmu(fmu_folder / f"{name}.fmu", tmp_path_factory.mktemp(name)) for name in ENDS}


@pytest.fixture
def loaded(fmus):
    """Both FMUs; the instances that the test makes are freed after it."""
    yield fmus
    for fmu in fmus.values():
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
