"""The FMUs through their C API, by ctypes alone: statuses and messages are seen as an importer sees them."""

import ctypes as ct
import math
import shutil

import fmpy
import pytest

OK, WARNING, DISCARD, ERROR = 0, 1, 2, 3
CO_SIMULATION = 1

Logger = ct.CFUNCTYPE(None, ct.c_void_p, ct.c_char_p, ct.c_int, ct.c_char_p, ct.c_char_p)
Logger3 = ct.CFUNCTYPE(None, ct.c_void_p, ct.c_int, ct.c_char_p, ct.c_char_p)


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
#: What FMI 2.0 calls functions of FMI 3.0; tests know all by their names in FMI 3.0, without the prefix.
IN_FMI2 = {"FMUState": "FMUstate", "Deserialize": "DeSerialize", "Float64": "Real", "Int32": "Integer"}
IN_FMI2 |= {"GetOutputDerivatives": "GetRealOutputDerivatives"}


class Fmu:
    """A loaded FMU: description, library, and what the tests need to know of it."""

    def __init__(self, path, folder):
        self.path, self.folder = path, folder
        fmpy.extract(str(path), unzipdir=str(folder))
        self.description = fmpy.read_model_description(str(path))
        self.version = self.description.fmiVersion
        #: Of the twins: "beam" or "spring".
        self.name = self.description.coSimulation.modelIdentifier
        platform = "linux64" if self.version == "2.0" else "x86_64-linux"
        self.binary = folder / "binaries" / platform / f"{self.name}.so"
        self.library = ct.CDLL(str(self.binary))
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.outputs = [name for name in self.named("output") if self.variables[name].type in ("Real", "Float64")]
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

    def function(self, name):
        return getattr(self.library, self.spelt(name))

    def named(self, causality):
        """The variables of a causality, but for the derivatives that are inputs in FMI 3.0."""
        return [n for n, v in self.variables.items() if v.causality == causality and not n.startswith("der(")]

    def references(self, *names):
        """The value references, as C takes them."""
        return (ct.c_uint * len(names))(*[self.variables[name].valueReference for name in names])

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
    """One instance of FMI 2.0; keeps the messages it sends."""

    def __init__(
        self,
        fmu,
        name=b"test",
        guid=None,
        resources=None,
        callbacks=True,
        logging=False,
        **options,
    ):
        self.fmu = fmu
        self.messages = []
        identity = fmu.description.guid.encode() if guid is None else guid
        self.component = ct.c_void_p(self._instantiate(name, identity, resources, callbacks, logging, **options))

    def _instantiate(
        self,
        name,
        identity,
        resources,
        callbacks,
        logging,
        kind=CO_SIMULATION,
    ):
        self._logger = Logger(self._log)
        struct = Callbacks(self._logger, None, None, None, None)
        pointer = ct.byref(struct) if callbacks else None
        instantiate = self.fmu.library.fmi2Instantiate
        instantiate.restype = ct.c_void_p
        made = instantiate(name, kind, identity, resources, pointer, 0, int(logging))
        # The FMU must have copied the struct.
        ct.memset(ct.byref(struct), 0xFF, ct.sizeof(struct))
        return made

    def _log(self, environment, name, status, category, message):
        self.messages.append((status, category.decode(), message.decode()))

    BOOLEAN = ct.c_int

    def counted(self, n):
        """Return what follows an array of ``n`` values: FMI 3.0 asks for their number."""
        return ()

    @property
    def message(self):
        """The last one."""
        return self.messages[-1][2] if self.messages else ""

    def call(self, function, *arguments):
        return int(self.fmu.function(function)(self.component, *arguments))

    def access(self, function, references, n, values):
        """Get or set values of ``n`` variables."""
        return self.call(function, references, ct.c_size_t(n), values, *self.counted(n))

    def free(self):
        if self.component:
            self.fmu.function("FreeInstance")(self.component)
            self.component = ct.c_void_p()

    def _experiment(self, start, stop, tolerance):
        known = tolerance is not None, ct.c_double(tolerance or 0.0)
        end = stop is not None, ct.c_double(stop or 0.0)
        return [*known, ct.c_double(start), *end]

    def try_enter(self, start=0.0, stop=None, tolerance=None):
        """Say when the run starts and ends, and enter initialization mode."""
        status = self.setup(start, stop, tolerance)
        return status if status != OK else self.call("EnterInitializationMode")

    def setup(self, start=0.0, stop=None, tolerance=None):
        return self.call("SetupExperiment", *self._experiment(start, stop, tolerance))

    def enter(self, start_time=0.0, stop_time=None, tolerance=None, **values):
        """Enter initialization mode, with values of parameters and inputs."""
        for name, value in values.items():
            self.set(name, value)
        assert self.try_enter(start_time, stop_time, tolerance) == OK, self.message
        return self

    def start(self, **values):
        """Enter initialization mode and leave it."""
        self.enter(**values)
        assert self.call("ExitInitializationMode") == OK, self.message
        return self

    def try_set(self, name, value):
        variable = self.fmu.variables[name]
        reference = self.fmu.references(name)
        if variable.type in ("Real", "Float64"):
            return self.access("SetFloat64", reference, 1, (ct.c_double * 1)(value))
        if variable.type == "Boolean":
            return self.access("SetBoolean", reference, 1, (self.BOOLEAN * 1)(int(value)))
        return self.access("SetInt32", reference, 1, (ct.c_int * 1)(int(value)))

    def set(self, name, value):
        assert self.try_set(name, value) == OK, self.message

    def get(self, *names):
        """Real values: one, or a list."""
        values = (ct.c_double * len(names))(*[math.nan] * len(names))
        assert self.access("GetFloat64", self.fmu.references(*names), len(names), values) == OK, self.message
        return values[0] if len(names) == 1 else list(values)

    def integer(self, name):
        value = (ct.c_int * 1)()
        assert self.access("GetInt32", self.fmu.references(name), 1, value) == OK, self.message
        return int(value[0])

    def outputs(self):
        """The Real ones."""
        return list(self.get(*self.fmu.outputs))

    def derive(self, name, order, value):
        """Set an input's derivative."""
        reference = self.fmu.references(name)
        return self.call("SetRealInputDerivatives", reference, 1, (ct.c_int * 1)(order), (ct.c_double * 1)(value))

    def derivative(self, name, order=1):
        reference, value = self.fmu.references(name), (ct.c_double * 1)(math.nan)
        arguments = (reference, ct.c_size_t(1), (ct.c_int * 1)(order), value, *self.counted(1))
        return self.call("GetOutputDerivatives", *arguments), value[0]

    def partials(self, outputs, name):
        """Return the status, and the derivatives of the outputs by an input or, before the start, by a parameter."""
        n, values = len(outputs), (ct.c_double * len(outputs))(*[math.nan] * len(outputs))
        unknown, known, one = self.fmu.references(*outputs), self.fmu.references(name), (ct.c_double * 1)(1.0)
        arguments = (unknown, ct.c_size_t(n), known, ct.c_size_t(1), one, *self.counted(1), values, *self.counted(n))
        return self.call("GetDirectionalDerivative", *arguments), list(values)

    def try_step(self, time, size):
        return self.call("DoStep", ct.c_double(time), ct.c_double(size), 0)

    def reached(self):
        """How far the last step came."""
        reached = ct.c_double()
        assert self.call("GetRealStatus", 2, ct.byref(reached)) == OK
        return reached.value

    def step(self, time, size):
        assert self.try_step(time, size) == OK, self.message

    def state(self):
        token = ct.c_void_p()
        assert self.call("GetFMUState", ct.byref(token)) == OK, self.message
        return token

    def restore(self, token):
        assert self.call("SetFMUState", token) == OK, self.message

    def serialized(self):
        token, size = self.state(), ct.c_size_t()
        assert self.call("SerializedFMUStateSize", token, ct.byref(size)) == OK
        buffer = ct.create_string_buffer(size.value)
        assert self.call("SerializeFMUState", token, buffer, size) == OK
        assert self.call("FreeFMUState", ct.byref(token)) == OK
        return buffer.raw

    def try_deserialize(self, blob):
        token = ct.c_void_p(0xDEADBEEF)  # an output only (FMI 2.0.4): JavaFMI passes what is not initialised
        status = self.call("DeserializeFMUState", blob, ct.c_size_t(len(blob)), ct.byref(token))
        return status, token

    def deserialized(self, blob):
        status, token = self.try_deserialize(blob)
        assert status == OK, self.message
        return token


class Instance3(Instance):
    """One instance of FMI 3.0."""

    BOOLEAN = ct.c_bool

    def _instantiate(
        self,
        name,
        identity,
        resources,
        callbacks,
        logging,
        events=False,
        early=False,
    ):
        self._logger = Logger3(self._log3)
        self.event, self.end, self.early = ct.c_bool(), ct.c_bool(), ct.c_bool()
        self.last = ct.c_double()
        instantiate = self.fmu.library.fmi3InstantiateCoSimulation
        instantiate.restype = ct.c_void_p
        logger = self._logger if callbacks else None
        return instantiate(
            *(name, identity, resources, False, logging, events, early, None, ct.c_size_t(0), None, logger, None)
        )

    def _log3(self, environment, status, category, message):
        self.messages.append((status, category.decode(), message.decode()))

    def counted(self, n):
        return (ct.c_size_t(n),)

    def try_enter(self, start=0.0, stop=None, tolerance=None):
        return self.call("EnterInitializationMode", *self._experiment(start, stop, tolerance))

    def get(self, *names):
        """Real values, elements of arrays by index: one, or a list."""
        found = {}
        for array in {name if name in self.fmu.variables else name.split("[")[0] for name in names}:
            n = math.prod(self.fmu.variables[array].shape or ())
            values, size, one = (ct.c_double * n)(*[math.nan] * n), ct.c_size_t(n), ct.c_size_t(1)
            assert self.call("GetFloat64", self.fmu.references(array), one, values, size) == OK, self.message
            found |= {array: values[0]} | {f"{array}[{i}]": value for i, value in enumerate(values, 1)}
        return found[names[0]] if len(names) == 1 else [found[name] for name in names]

    def derive(self, name, order, value):
        return self.try_set(f"der({name}{'' if order == 1 else f',{order}'})", value)

    def try_step(self, time, size):
        told = [ct.byref(value) for value in (self.event, self.end, self.early, self.last)]
        return self.call("DoStep", ct.c_double(time), ct.c_double(size), False, *told)

    def reached(self):
        return self.last.value


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
