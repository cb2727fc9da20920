"""Compare the FMUs with exact solutions: ``springbeam verify``.

Every function of `SECTIONS` computes one exact solution from its formula, has ``beam.fmu`` and ``spring.fmu`` (alone,
or in a scene) compute the same, and yields the comparison, a `Check` at a time. A bound follows from what the method
leaves out, the discretisation's leading error, the solver's tolerance or rounding, and says which; none is fitted.
A new exact solution is a function in one of the modules beside this one, and a line in `SECTIONS`; ``table`` prints
them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from ...bodies.protocol import StepRefused
from ...run.outcome import RunStopped
from .beam import beam_energy, frequencies, mesh_convergence, static_deflection
from .check import Check
from .coupling import added_mass, energy_scheme, two_masses
from .impact import bar_impact
from .laws import compliant_impact, hunt_crossley, linked_masses, tied_masses
from .loads import moving_base, pulse, resonance, slow_ramp
from .spring import duffing, escape

#: Title and exact solution, in the order of the table.
SECTIONS: tuple[tuple[str, Callable[[], Iterator[Check]]], ...] = (
    ("Beam: static deflection of the tip, locking", static_deflection),
    ("Beam: clamped–free frequencies", frequencies),
    ("Beam: convergence of the mesh", mesh_convergence),
    ("Beam: energy of a step under a constant force", beam_energy),
    ("Spring: Duffing (k1, k2, A), from rest", duffing),
    ("Spring: escape of a softening spring", escape),
    ("Impact: elastic bar on a rigid stop", bar_impact),
    ("Coupling: two masses, held exchange, ρ ≈ 1 + cπ²H²", two_masses),
    ("Coupling: gain of the tie by displacement exchange", added_mass),
    ("Coupling: energy scheme, tied, undamped", energy_scheme),
    ("Loads: a damped beam driven at its tip, amplitude and phase", resonance),
    ("Loads: half-sine pulse on an oscillator", pulse),
    ("Loads: static limit of a slow ramp, EI = KAG = L = 1", slow_ramp),
    ("Loads: a moving base and the equivalent loads", moving_base),
    ("Law: free masses on normal compliance λ p^q", compliant_impact),
    ("Law: Hunt & Crossley, χ = 0.5 s/m", hunt_crossley),
    ("Law: two masses on a link", linked_masses),
    ("Law: two masses tied", tied_masses),
)


def verify() -> Iterator[tuple[str, list[Check]]]:
    """Yield each section's title and checks as they are computed; one that cannot be computed is a failed check.

    Raises
    ------
    FmuError
        If an FMU cannot be found, loaded or initialised.
    """
    for title, section in SECTIONS:
        try:
            yield title, list(section())
        except (StepRefused, RunStopped) as error:
            yield title, [Check("not computed", None, None, 0.0, str(error))]
