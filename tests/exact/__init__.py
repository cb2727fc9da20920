"""Compare the FMUs with exact solutions (test_exact.py), and the references too (test_references.py).

Every `Section` computes one exact solution from its formula, has ``beam.fmu`` and ``spring.fmu`` (alone, or in a scene)
compute the same, and yields the comparison, a `Check` at a time. A bound follows from what the method leaves out, the
discretisation's leading error, the solver's tolerance or rounding, and says which; none is fitted.
A new exact solution is a function in one of the modules beside this one, made a `section`, and its name in `SECTIONS`.
"""

from __future__ import annotations

from .alone import duffing, static_deflection
from .coupled import bar_impact, energy_scheme, resonance, slow_ramp
from .laws import compliant_impact, hunt_crossley, kelvin_voigt, link, tie, unilateral

SECTIONS = (
    *(static_deflection, duffing, bar_impact, energy_scheme, resonance, slow_ramp),
    *(compliant_impact, hunt_crossley, kelvin_voigt, link, tie, unilateral),
)
