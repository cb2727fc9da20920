"""Measure critical macro steps, and compare them with those that the spectral radius predicts.

The FMUs are coupled by the solvers of a run, without events: the linear closed contact of
`springbeam.studies.stability.linear` is stepped until its growth shows. A closed contact of law `compliance` with
exponent 1 is a `link`, which also pulls: as that it is measured.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar

from ...bodies import force
from ...bodies.factory import load_bodies
from ...bodies.protocol import NO_FORCE
from ...contact.laws import law_of
from ...coupling import coupling_of
from ...coupling.protocol import Window
from ...monolithic.semi_discrete import modal_beam
from ...scene import Scene, load_scene, with_changes
from ..schemes import RIGID, SOFT
from ..study import Findings, Record, Study
from ..tables import table, write_csv
from .linear import spectral_radius
from .predict import THRESHOLD, critical_step, linear_pair

#: Growth of the energy at which the rate is told, and how many macro steps it may take to get there.
_GROWN, _MOST_STEPS = 1e10, 8000
#: Distances from a predicted critical H, of itself, at which stability and instability are sought. The first ones are
#: small: ``hermite`` is unstable in bands that can be 0.2 % wide.
_SOUGHT = (0.001, 0.003, 0.01, 0.03, 0.1)


def growth(scene: Scene) -> float:
    """Return the measured spectral radius of the scene's coupling: the factor by which amplitudes grow per macro step.

    The scene's pair without stop and events, tied or in closed contact (``contact.exponent`` must be 1), the spring
    without its cubic term and at its equilibrium, the tip on it. The rate is that of the second half of the steps up
    to `_GROWN`.
    """
    H, soft = scene.coupling.H, not scene.contact.rigid
    spring = {"cubic_stiffness": 0.0, "equilibrium": 0.0, "external_force": 0.0, "initial_velocity": 0.0}
    at_rest = {"distributed_load": 0.0, "initial_deflection_slope": 0.0, "initial_velocity_slope": 0.0}
    law = {"law": "link", "damping": 0.0} if scene.contact.facts.opens else {}
    linear = with_changes(scene, stop=None, spring=spring, beam={**at_rest, "approach": "elastic"}, contact=law)
    coupling, guess = coupling_of(linear, law_of(linear.contact)), NO_FORCE
    beam, top = load_bodies(linear, 0.0)
    assert beam is not None
    assert top is not None

    def energy() -> float:
        stored = sum(body.energies().kinetic + body.energies().potential for body in (beam, top))
        apart = top.motion().displacement - beam.motion().displacement
        return stored + (0.5 * linear.contact.stiffness * apart**2 if soft else 0.0)

    try:
        # Tied ends start with one velocity; in contact it is their relative motion that grows.
        reduced = 1.0 / (1.0 / beam.mass + 1.0 / top.mass)
        beam.apply_impulse(-reduced if soft else beam.mass)
        top.apply_impulse(reduced if soft else top.mass)
        energies = [energy()]
        while len(energies) <= _MOST_STEPS and energies[-1] < _GROWN * energies[0]:
            beam.mark()
            top.mark()
            window = Window(H * (len(energies) - 1), H, (beam.motion(), top.motion()))
            guess = force.shifted(coupling.solve(beam, top, window, guess), H)
            energies.append(energy())
    finally:
        beam.close()
        top.close()
    n = len(energies) - 1
    return float((energies[n] / energies[n // 2]) ** (0.5 / (n - n // 2)))


def measured_critical_step(scene: Scene, near: float) -> float | None:
    """Return the H [s] near ``near`` at which `growth` passes 1 + `THRESHOLD`, to 0.2 % of itself.

    ``None`` if it does not within 10 % of ``near``.
    """

    def unstable(H: float) -> bool:
        return growth(with_changes(scene, coupling={"macro_step": H})) > 1.0 + THRESHOLD

    low = next((H for x in _SOUGHT if not unstable(H := near * (1.0 - x))), None)
    high = next((H for x in _SOUGHT if unstable(H := near * (1.0 + x))), None)
    if low is None or high is None:
        return None
    while high > 1.002 * low:
        middle = math.sqrt(low * high)
        if unstable(middle):
            high = middle
        else:
            low = middle
    return math.sqrt(low * high)


@dataclass(frozen=True)
class Comparison:
    """A coupling's critical macro step, predicted and measured [s]; ``None``: stable at any step."""

    law: str
    scheme: str
    degree: int
    stiffness: float  #: λ [N/m] of `compliance`; 0 for the tie
    predicted: float | None
    measured: float | None
    #: Factor by which amplitudes grow per macro step at `LARGE_STEP`: spectral radius, and measured.
    radius: float
    growth: float

    @property
    def stable(self) -> bool:
        """Whether amplitudes do not grow at `LARGE_STEP`, measured."""
        return self.growth <= 1.0 + THRESHOLD

    @property
    def differ(self) -> float | None:
        """How much longer the measured critical macro step is, relatively."""
        return self.measured / self.predicted - 1.0 if self.predicted and self.measured else None

    @property
    def agrees(self) -> bool:
        """Whether prediction and measurement say the same."""
        if self.stable != (self.radius <= 1.0 + THRESHOLD):
            return False
        if self.predicted is None:
            return self.stable
        return self.differ is not None and abs(self.differ) <= _AGREEMENT

    def cells(self) -> tuple[str, ...]:
        """Return the row for a terminal."""
        predicted, measured = ("none" if step is None else f"{step:.4g}" for step in (self.predicted, self.measured))
        differ = "" if self.differ is None else f"{100.0 * self.differ:+.2f} %"
        return (
            f"{self.scheme} {self.degree}",
            f"{self.stiffness:g}" if self.law == "compliance" else "tie",
            predicted,
            "" if self.predicted is None else measured,
            differ,
            "stable" if self.stable else "unstable",
        )


#: λ [N/m] at which ordinary exchanges are compared, and a macro step at which they are not stable [s].
STIFFNESSES, LARGE_STEP = (1e4, 1e8), 0.004
#: Predicted and measured critical macro steps agree if they differ by less than this, relatively.
_AGREEMENT = 0.05
#: Search for the narrow bands of ``hermite``.
_FINE = 1.005


class Critical(Study):
    """Every scheme on the scene ``soft``, with linear spring and contact."""

    kind: ClassVar[str] = "critical"
    files: ClassVar[tuple[str, ...]] = ("critical.csv",)
    parallel: ClassVar[bool] = True

    def cases(self) -> dict[str, tuple[str, float, str, int]]:
        """Return law, λ [N/m], scheme and degree."""
        ends = [*(("compliance", value) for value in STIFFNESSES), ("transmission", 0.0)]
        return {
            f"{law}, {stiffness:g} N/m, {scheme} {degree}": (law, stiffness, scheme, degree)
            for law, stiffness in ends
            for scheme, degree in (SOFT if stiffness else RIGID)
        }

    def record(self, case: Sequence[Any]) -> Record:
        """Compare one coupling."""
        law, stiffness, scheme, degree = case
        return asdict(comparison(linear_scene(law, stiffness, scheme, degree, 4 if self.quick else 10)))

    def findings(self, records: Mapping[str, Record]) -> Findings:
        """Judge whether predicted and measured agree."""
        couplings = [Comparison(**record) for record in records.values()]
        agree = all(c.agrees for c in couplings)
        names = ("coupling", "λ [N/m]", "predicted [s]", "measured [s]", "differ by", f"at {LARGE_STEP:g} s")
        shown = table(names, [c.cells() for c in couplings], "critical macro steps")
        listed = [{**asdict(c), "stable": c.stable} for c in couplings]
        return Findings({"agree": agree, "couplings": listed}, [shown], agree)

    def write(self, records: Mapping[str, Record], directory: Path, *, pictures: bool) -> list[Path]:
        """Write a row per coupling."""
        return [write_csv(directory / "critical.csv", list(records.values()))]


def linear_scene(law: str, stiffness: float, scheme: str, degree: int, n_elements: int) -> Scene:
    """Return `soft` without a stop, with linear spring and contact, λ in N/m, at `LARGE_STEP`."""
    return with_changes(
        load_scene("soft"),
        stop=None,
        beam={"n_elements": n_elements},
        spring={"cubic_stiffness": 0.0},
        contact={"law": law, "stiffness": stiffness or 1.0, "exponent": 1.0},
        coupling={"scheme": scheme, "degree": degree, "macro_step": LARGE_STEP},
    )


def comparison(scene: Scene) -> Comparison:
    """Compare ``scene`` with its linearised pair."""
    assert scene.beam is not None
    pair = linear_pair(scene, modal_beam(scene.beam))
    assert pair is not None
    coupling, law = scene.coupling, scene.contact.law
    scheme, degree = coupling.scheme, coupling.degree
    predicted = critical_step(pair, scheme, degree, factor=_FINE if scheme == "hermite" else None)
    measured = None if predicted is None else measured_critical_step(scene, predicted)
    return Comparison(
        law, scheme, degree, pair.stiffness, predicted, measured,
        spectral_radius(pair, scheme, degree, coupling.H), growth(scene),
    )  # fmt: skip
