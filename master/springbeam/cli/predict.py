"""``springbeam predict``."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from math import inf
from typing import TYPE_CHECKING

from rich.text import Text

from ..scene import load_scene
from .common import JsonOption, SceneArgument, SettingsOption, bad_input_reported, console_for, print_json

if TYPE_CHECKING:
    from ..studies.stability.predict import Prediction, SchemePrediction

#: A mesh that is so much too stiff is said to lock.
_LOCKS = 1.05


def predict(
    scene: SceneArgument,
    settings: SettingsOption = None,
    as_json: JsonOption = False,
) -> None:
    """Predict, without a run, frequencies, stable macro steps, whether the motion is resolved, and the best scheme.

    Example: springbeam predict soft --set coupling.macro_step=4e-3
    """
    from ..studies.stability.predict import predict as prediction_of
    from ..studies.tables import table

    with bad_input_reported():
        what = load_scene(scene, settings or ())
        prediction = prediction_of(what)
    if as_json:
        print_json(asdict(prediction))
    console = console_for(silent=as_json)
    console.print(Text(what.title or "(untitled scene)", style="bold"))
    for name, text in _lines(prediction):
        console.print(Text(f"{name:<10}{text}"))
    if prediction.schemes:
        names = ("scheme", "degree", "spectral radius − 1", "critical H [s]", "")
        console.print(table(names, [_scheme(s, prediction.threshold) for s in prediction.schemes], words=("",)))
    for note in prediction.notes:
        console.print(Text(f"note      {note}"))
    if prediction.auto is not None:
        scheme, degree, because = prediction.auto
        console.print(Text(f'fits      {scheme} {degree}, which coupling.scheme = "auto" takes: {because}'))


def _lines(p: Prediction) -> Iterator[tuple[str, str]]:
    """Yield what is predicted, a line a subject."""
    e, H = p.estimates, p.macro_step
    masses = {"beam": e.beam_mass, "spring": e.spring_mass}
    yield "mass", ", ".join(f"{name} {mass:.4g} kg" for name, mass in masses.items() if mass is not None)
    if e.frequency is not None and p.frequencies:
        found = ", ".join(f"{frequency:.4g}" for frequency in p.frequencies)
        yield "vibrates", f"at {found} Hz on this mesh; first without a mesh {e.frequency:.4g} Hz"
    locks = e.locking is not None and e.locking > _LOCKS
    yield "stiffness", ", ".join([
        *([] if e.tip_stiffness is None else [f"tip {e.tip_stiffness:.4g} N/m (static)"]),
        *([f"{e.locking:.3g} times that on this mesh, which locks"] if locks else []),
        *([] if e.spring_stiffness is None else [f"spring {e.spring_stiffness:.4g} N/m"]),
    ])  # fmt: skip
    if e.contact_time not in (None, inf) or e.contact_duration is not None:
        yield "contact", ", ".join([
            *([] if e.contact_time in (None, inf) else [f"first at t = {e.contact_time:.4g} s"]),
            *([] if e.contact_duration is None
              else [f"lasts about {e.contact_duration:.2g} s (half a period together)"]),
        ])  # fmt: skip
    yield "H", f"{H:g} s"
    if p.omega_1 is not None and p.omega_max is not None:
        beside = f", beside {p.static_shapes} static shapes" if p.static_shapes else ""
        yield "beam", (f"ω₁H = {p.omega_1 * H:.3g}, ω_max H = {p.omega_max * H:.3g}; "
                       f"{p.resolved_modes} of {p.modes} modes resolved (ωH ≤ 1){beside}")  # fmt: skip
        yield "", f"tip mass {p.tip_mass:.3g} kg, impedance Z = {p.impedance:.3g} N·s/m"
    for name, omega in (("spring", p.spring_frequency), ("contact", p.contact_frequency)):
        if omega is not None:
            yield name, f"ωH = {omega * H:.3g} at its stiffest"
    if p.displacement_gain is not None:
        verdict = "diverges" if p.displacement_gain > 1.0 else "converges"
        yield "exchange", f"of displacement against force: gain 2m/(ZH) = {p.displacement_gain:.3g}, {verdict}"


def _scheme(s: SchemePrediction, threshold: float) -> tuple[str, ...]:
    """Return the row of a scheme."""
    excess = s.spectral_radius - 1.0
    return (
        s.scheme,
        str(s.degree),
        "0" if abs(excess) < 1e-11 else f"{excess:.1e}",
        "none" if s.critical_step is None else f"{s.critical_step:.3g}",
        "unstable" if excess > threshold else "",
    )
