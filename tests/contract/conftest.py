"""The FMUs through their C API, by ctypes alone: statuses and messages are seen as an importer sees them."""

from __future__ import annotations

import ctypes as ct
import math
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import fmpy
import pytest
from fmpy.model_description import ModelDescription

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


class Fmu:
    """A loaded FMU: description and library."""

    def __init__(self, path: Path, folder: Path) -> None:
        self.path, self.folder = path, folder
        fmpy.extract(str(path), unzipdir=str(folder))
        self.description: ModelDescription = fmpy.read_model_description(str(path))
        self.identifier = self.description.coSimulation.modelIdentifier
        self.binary = folder / "binaries" / "linux64" / f"{self.identifier}.so"
        self.library = ct.CDLL(str(self.binary))
        self.library.fmi2Instantiate.restype = ct.c_void_p
        self.variables = {v.name: v for v in self.description.modelVariables}
        self.instances: list[Instance] = []

    def instance(self, **options: Any) -> Instance:
        made = Instance(self, **options)
        self.instances.append(made)
        return made

    def running(self, start_time: float = 0.0, **values: float) -> Instance:
        """An instance that has left initialization mode, with the given parameters and inputs."""
        made = self.instance()
        assert made.setup(start=start_time) == OK
        for name, value in values.items():
            made.set(name, value)
        assert made.call("fmi2EnterInitializationMode") == OK
        assert made.call("fmi2ExitInitializationMode") == OK
        return made

    @property
    def outputs(self) -> list[str]:
        return [v.name for v in self.description.modelVariables if v.causality == "output"]


class Instance:
    """One instance; keeps the messages it sends."""

    def __init__(
        self,
        fmu: Fmu,
        name: bytes | None = b"test",
        kind: int = CO_SIMULATION,
        guid: bytes | None = None,
        resources: bytes | None = None,
        callbacks: bool = True,
        logging: bool = False,
    ) -> None:
        self.fmu = fmu
        self.messages: list[tuple[int, str, str]] = []
        self._logger = Logger(self._log)
        struct = Callbacks(self._logger, None, None, None, None)
        pointer = ct.byref(struct) if callbacks else None
        identity = fmu.description.guid.encode() if guid is None else guid
        self.component = ct.c_void_p(
            fmu.library.fmi2Instantiate(name, kind, identity, resources, pointer, 0, int(logging))
        )
        # The FMU must have copied the struct.
        ct.memset(ct.byref(struct), 0xFF, ct.sizeof(struct))

    def _log(self, environment: Any, name: bytes, status: int, category: bytes, message: bytes) -> None:
        self.messages.append((status, category.decode(), message.decode()))

    @property
    def message(self) -> str:
        """The last one."""
        return self.messages[-1][2] if self.messages else ""

    def call(self, function: str, *arguments: Any) -> int:
        return int(getattr(self.fmu.library, function)(self.component, *arguments))

    def free(self) -> None:
        if self.component:
            self.fmu.library.fmi2FreeInstance(self.component)
            self.component = ct.c_void_p()

    def setup(self, start: float = 0.0, stop: float | None = None, tolerance: float | None = None) -> int:
        return self.call(
            "fmi2SetupExperiment",
            int(tolerance is not None),
            ct.c_double(tolerance or 0.0),
            ct.c_double(start),
            int(stop is not None),
            ct.c_double(stop or 0.0),
        )

    def initialize(self) -> None:
        assert self.call("fmi2EnterInitializationMode") == OK, self.message
        assert self.call("fmi2ExitInitializationMode") == OK, self.message

    def try_set(self, name: str, value: float) -> int:
        variable = self.fmu.variables[name]
        reference = (ct.c_uint * 1)(variable.valueReference)
        if variable.type == "Real":
            return self.call("fmi2SetReal", reference, 1, (ct.c_double * 1)(value))
        function = "fmi2SetBoolean" if variable.type == "Boolean" else "fmi2SetInteger"
        return self.call(function, reference, 1, (ct.c_int * 1)(int(value)))

    def set(self, name: str, value: float) -> None:
        assert self.try_set(name, value) == OK, self.message

    def get(self, *names: str) -> Any:
        """Real values: one, or a list."""
        references = (ct.c_uint * len(names))(*[self.fmu.variables[n].valueReference for n in names])
        values = (ct.c_double * len(names))(*[math.nan] * len(names))
        assert self.call("fmi2GetReal", references, len(names), values) == OK, self.message
        return values[0] if len(names) == 1 else list(values)

    def outputs(self) -> list[float]:
        return list(self.get(*self.fmu.outputs))

    def derive(self, name: str, order: int, value: float) -> int:
        """Set an input's derivative."""
        reference = (ct.c_uint * 1)(self.fmu.variables[name].valueReference)
        return self.call("fmi2SetRealInputDerivatives", reference, 1, (ct.c_int * 1)(order), (ct.c_double * 1)(value))

    def derivative(self, name: str, order: int = 1) -> tuple[int, float]:
        reference = (ct.c_uint * 1)(self.fmu.variables[name].valueReference)
        value = (ct.c_double * 1)(math.nan)
        return self.call("fmi2GetRealOutputDerivatives", reference, 1, (ct.c_int * 1)(order), value), value[0]

    def try_step(self, time: float, size: float) -> int:
        return self.call("fmi2DoStep", ct.c_double(time), ct.c_double(size), 0)

    def step(self, time: float, size: float) -> None:
        assert self.try_step(time, size) == OK, self.message

    def state(self) -> ct.c_void_p:
        token = ct.c_void_p()
        assert self.call("fmi2GetFMUstate", ct.byref(token)) == OK, self.message
        return token

    def restore(self, token: ct.c_void_p) -> None:
        assert self.call("fmi2SetFMUstate", token) == OK, self.message

    def serialized(self) -> bytes:
        token, size = self.state(), ct.c_size_t()
        assert self.call("fmi2SerializedFMUstateSize", token, ct.byref(size)) == OK
        buffer = ct.create_string_buffer(size.value)
        assert self.call("fmi2SerializeFMUstate", token, buffer, size) == OK
        assert self.call("fmi2FreeFMUstate", ct.byref(token)) == OK
        return buffer.raw

    def try_deserialize(self, blob: bytes) -> tuple[int, ct.c_void_p]:
        token = ct.c_void_p()
        status = self.call("fmi2DeSerializeFMUstate", blob, ct.c_size_t(len(blob)), ct.byref(token))
        return status, token


@pytest.fixture
def folder(fmu_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Copies of the FMUs, to be spoilt; the master takes these."""
    for name in ("beam", "spring"):
        shutil.copy(fmu_folder / f"{name}.fmu", tmp_path)
    monkeypatch.setenv("SPRINGBEAM_FMUS", str(tmp_path))
    return tmp_path


@pytest.fixture(scope="session")
def loaded(fmu_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Fmu]:
    cache: dict[str, Fmu] = {}

    def load(name: str) -> Fmu:
        if name not in cache:
            cache[name] = Fmu(fmu_folder / f"{name}.fmu", tmp_path_factory.mktemp(name))
        return cache[name]

    return load


def _lend(fmu: Fmu) -> Iterator[Fmu]:
    yield fmu
    for instance in fmu.instances:
        instance.free()
    fmu.instances.clear()


@pytest.fixture
def beam(loaded: Callable[[str], Fmu]) -> Iterator[Fmu]:
    yield from _lend(loaded("beam"))


@pytest.fixture
def spring(loaded: Callable[[str], Fmu]) -> Iterator[Fmu]:
    yield from _lend(loaded("spring"))


#: Per FMU: parameters that make something happen, the force and the impulse input, the motion of the end.
CASES: dict[str, dict[str, Any]] = {
    "beam": {
        "parameters": {
            "young_modulus": 100.0,
            "shear_modulus": 100.0,
            "n_elements": 12,
            "alpha_b": 1e-3,
            "initial_velocity_slope": -1.0,
        },
        "force": "tip_force",
        "impulse": "tip_impulse",
        "displacement": "tip_displacement",
        "velocity": "tip_velocity",
    },
    "spring": {
        "parameters": {
            "linear_stiffness": 3.0,
            "cubic_stiffness": -0.2,
            "damping": 0.1,
            "displacement": 0.5,
            "velocity": -1.0,
        },
        "force": "contact_force",
        "impulse": "impulse",
        "displacement": "displacement",
        "velocity": "velocity",
    },
}


class Case:
    """An FMU with what the tests need to know of it."""

    def __init__(self, name: str, fmu: Fmu) -> None:
        self.name, self.fmu = name, fmu
        self.parameters: dict[str, float] = CASES[name]["parameters"]
        self.force: str = CASES[name]["force"]
        self.impulse: str = CASES[name]["impulse"]
        self.displacement: str = CASES[name]["displacement"]
        self.velocity: str = CASES[name]["velocity"]

    def running(self, start_time: float = 0.0, **values: float) -> Instance:
        return self.fmu.running(start_time, **{**self.parameters, **values})


@pytest.fixture(params=["beam", "spring"])
def case(request: pytest.FixtureRequest, loaded: Callable[[str], Fmu]) -> Iterator[Case]:
    name: str = request.param
    for fmu in _lend(loaded(name)):
        yield Case(name, fmu)
