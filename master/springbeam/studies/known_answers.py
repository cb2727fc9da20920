"""Compare our FMUs with exact solutions; `springbeam doctor` shows the errors.

* The beam, of 10 linear elements with EI = KAG = L = 1, comes to rest under a tip force of 1 N. Each element locks:
  the deflection is (1/3EI + 1/KAG)/(1 + KAG h²/12EI), h = L/10. Kelvin-Voigt damping makes the slowest motion decay
  by e^(−100) in one step of 200 s.
* The undamped spring ÿ + k₁ y + k₂ y³ = 0 from rest at A, k₁ = 150, k₂ = 67, is back after the period 4K(μ)/ω, with
  ω² = k₁ + k₂A², μ = k₂A²/2ω², and K the complete elliptic integral.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import closing
from dataclasses import dataclass
from math import pi, sqrt
from sys import float_info

from scipy.special import ellipk

from ..bodies.archive import own_fmu
from ..bodies.fmu import Fmu, Value
from ..bodies.port import Port


@dataclass(frozen=True)
class Question:
    """One doStep of an FMU with an output that is known exactly."""

    words: str
    parameters: Mapping[str, Value]
    input: str
    given: float  #: [N], constant over the step
    output: str
    size: float  #: of the step [s]
    exact: float  #: [m]
    bound: float  #: largest error of the method [m]

    def ask(self, name: str, version: str) -> float:
        """Return the error [m] of our FMU ``name``. Raises FmuError, or StepRefused."""
        with closing(Fmu(name, own_fmu(name, version), self.parameters, 0.0)) as fmu:
            port = Port(fmu, (self.input,), (), (self.output,), repeats=False)
            (answer,) = port.step((0.0, self.size, self.given, 0.0, 0.0))
        return answer - self.exact


def _beam() -> Question:
    elements = 10
    ones = ("density", "area", "second_moment_of_area", "young_modulus", "shear_modulus", "shear_coefficient", "length")
    exact = (1.0 / 3.0 + 1.0) / (1.0 + 1.0 / (12.0 * elements**2))
    parameters: dict[str, Value] = dict.fromkeys(ones, 1.0)
    parameters |= {"n_elements": elements, "alpha_b": 1.0, "initial_velocity_slope": 0.0}
    rounding = (2 * elements) ** 2 * float_info.epsilon * exact  # of an eigenproblem of 2n unknowns
    words = "tip at rest under 1 N"
    return Question(words, parameters, "tip_force", 1.0, "tip_displacement", 200.0, exact, rounding)


def _spring() -> Question:
    linear = 150.0
    cubic = 67.0
    amplitude = 0.5
    tolerance = 1e-10
    square = linear + cubic * amplitude**2
    period = 4.0 * float(ellipk(cubic * amplitude**2 / (2.0 * square))) / sqrt(square)
    parameters: dict[str, Value] = {
        "mass": 1.0,
        "damping": 0.0,
        "linear_stiffness": linear,
        "cubic_stiffness": cubic,
        "displacement": amplitude,
        "relative_tolerance": tolerance,
        "absolute_tolerance": 1e-2 * tolerance,
    }
    # IDA takes some ε^(−1/6) steps a radian at order 5, each with an error ε.
    bound = 2.0 * pi * tolerance ** (5.0 / 6.0) * amplitude
    words = "Duffing, after a period"
    return Question(words, parameters, "contact_force", 0.0, "displacement", period, amplitude, bound)


#: By name of an FMU.
QUESTIONS = {"beam": _beam(), "spring": _spring()}
