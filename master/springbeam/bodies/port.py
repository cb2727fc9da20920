"""The port through which a run uses an FMU: the calls of a step, without their meaning, in SI units."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from math import isfinite
from operator import mul
from struct import Struct
from typing import NoReturn

from .fmu import Fmu
from .functions import DISCARD, OK, WARNING, Failure
from .protocol import BodyFailed, FmuError, StepRefused

#: Requests of an FMU for FMI 3.0 after a step that are not supported.
_ASKED = {
    Failure.ENDS: "fmi3DoStep requests the end of the simulation (terminateSimulation)",
    Failure.EARLY: "fmi3DoStep returned early, which it was not allowed to (earlyReturn)",
    Failure.EVENT: "fmi3DoStep requests event mode, which is not used (eventHandlingNeeded)",
}


#: Reads variables of an FMU.
Reading = Callable[[], tuple[float, ...]]
#: What it means that a call for the state fails.
CANNOT = {"get_state": "cannot save the state", "set_state": "cannot restore the state"}


class Port:
    """The calls of a run to an FMU, without their meaning.

    Parameters
    ----------
    inputs, impulse, outputs
        Names of variables. A step sets the inputs and the impulse, if the FMU takes one, which acts at its start; it
        returns the outputs.
    slopes
        Highest derivative of the inputs that a step sets; those that are all 0 only ``always``.
    repeats
        Whether the state can be saved and restored.
    units
        Those of variables that are not in SI units. All that a port takes and returns is.
    """

    def __init__(
        self,
        fmu: Fmu,
        inputs: tuple[str, ...],
        impulse: tuple[str, ...],
        outputs: tuple[str, ...],
        slopes: int = 2,
        always: bool = False,
        repeats: bool = True,
        units: Mapping[str, float] | None = None,
    ) -> None:
        self.path = fmu.path
        self._fmu = fmu
        units = units or {}
        self._inputs = (*inputs, *impulse)
        self._outputs = outputs
        fmu.reading(self._inputs)  # a wrong reference is found before the run
        self._read = fmu.reading(outputs)
        self._units = [units.get(name, 1.0) for name in outputs]
        self._advance, self._given, reported = fmu.advancing(inputs, impulse, slopes, outputs, always, units)
        self._write = partial(Struct(f"{len(self._given)}d").pack_into, self._given, 0)
        self._reported = partial(Struct(f"{len(reported)}d").unpack, reported)
        #: Save the state, and return to it; both return their status.
        self.get_state, self.set_state = fmu.of_state() if repeats else (lambda: OK, self._refuse_to_repeat)
        if repeats:
            self._before_trial, self._after_trial = fmu.of_state(of_trial=True)

    def read(self) -> tuple[float, ...]:
        """Return the outputs. Raises StepRefused if one is not finite."""
        return self._finite(tuple(map(mul, self._read(), self._units)))

    def _finite(self, reported: tuple[float, ...]) -> tuple[float, ...]:
        if not all(map(isfinite, reported)):
            values = ", ".join(f"{name} = {value}" for name, value in zip(self._outputs, reported, strict=True))
            raise StepRefused(f"not finite: {values} of {self.path.name}")
        return reported

    def step(self, given: Sequence[float]) -> tuple[float, ...]:
        """Step under ``given``: time [s], size [s], inputs, impulse, derivatives; return the outputs."""
        self._write(*given)
        if code := self._advance():
            self._stop(*divmod(code, 16))
        return self._reported()

    def trial(self, given: Sequence[float], read: Reading | None = None) -> tuple[float, ...]:
        """Step under ``given``, return the outputs or the result of ``read``, and undo the step."""
        if (status := self._before_trial()) > WARNING:
            raise self.failed(status, CANNOT["get_state"])
        try:
            reported = self.step(given)
            return reported if read is None else read()
        finally:
            if (status := self._after_trial()) > WARNING:
                raise self.failed(status, CANNOT["set_state"])

    def _stop(self, failure: int, status: int) -> NoReturn:
        """Raise the error of a step that was not made."""
        time, _, *inputs = self._given
        failed = {
            Failure.SET: f"cannot set {', '.join(self._inputs)}",
            Failure.SET_DERIVATIVES: "cannot set input derivatives",
            Failure.GET: f"cannot read {', '.join(self._outputs)}",
        }
        if failure in failed:
            raise self._fmu.failed(status, failed[Failure(failure)])
        if failure == Failure.INPUTS_NOT_FINITE:
            raise StepRefused(f"{self.path.name}: the force it should step under is not finite: {inputs}")
        if failure == Failure.OUTPUTS_NOT_FINITE:
            self._finite(self._reported())
        self._fmu.refuse(max(status, DISCARD), time, _ASKED.get(Failure(failure), ""))

    def failed(self, status: int, what: str) -> FmuError:
        """Return the error of a call that returned ``status``."""
        return self._fmu.failed(status, what)

    def _refuse_to_repeat(self) -> NoReturn:
        raise BodyFailed(f"{self.path}: a step had to be repeated, and its state cannot be restored")

    def close(self) -> bool:
        """Free the FMU; return whether this process may instantiate it again."""
        self._fmu.close()
        return not self._fmu.says.canBeInstantiatedOnlyOncePerProcess
