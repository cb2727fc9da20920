"""``springbeam predict`` and ``springbeam stability``."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

from rich.table import Table
from rich.text import Text

from ..scene import load_scene
from .common import JsonOption, SceneArgument, SettingsOption, bad_input_reported, console_for, print_json

if TYPE_CHECKING:
    from ..stability.predict import Prediction


def predict(
    scene: SceneArgument,
    settings: SettingsOption = None,
    as_json: JsonOption = False,
) -> None:
    """Say before a scene runs where its coupling is stable, whether the motion is resolved, which scheme fits.

    Example: springbeam predict soft --set coupling.macro_step=4e-3
    """
    from ..stability.predict import predict as prediction_of

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
        console.print(_schemes_table(prediction))
    for note in prediction.notes:
        console.print(Text(f"note      {note}"))
    if prediction.advised is not None:
        scheme, degree = prediction.advised
        console.print(Text(f"advised   coupling.scheme = {scheme!r}, degree = {degree}"))


def _lines(p: Prediction) -> list[tuple[str, str]]:
    lines = [("H", f"{p.macro_step:g} s")]
    if p.omega_1 is not None and p.omega_max is not None:
        lines.append(("beam", f"ω₁H = {p.omega_1 * p.macro_step:.3g}, ω_max H = {p.omega_max * p.macro_step:.3g}; "
                              f"{p.resolved_modes} of {p.modes} modes resolved (ωH ≤ 1)"))  # fmt: skip
        lines.append(("", f"tip mass {p.tip_mass:.3g} kg, impedance Z = {p.impedance:.3g} N·s/m"))
    if p.spring_frequency is not None:
        lines.append(("spring", f"ωH = {p.spring_frequency * p.macro_step:.3g} at its stiffest"))
    if p.contact_frequency is not None:
        lines.append(("contact", f"ωH = {p.contact_frequency * p.macro_step:.3g} at its stiffest"))
    if p.displacement_gain is not None:
        verdict = "diverges" if p.displacement_gain > 1.0 else "converges"
        gain = f"of displacement against force: gain 2m/(ZH) = {p.displacement_gain:.3g}, {verdict}"
        lines.append(("exchange", gain))
    return lines


def _schemes_table(p: Prediction) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("scheme", no_wrap=True)
    table.add_column("degree", justify="right", no_wrap=True)
    for name in ("spectral radius − 1", "critical H [s]"):
        table.add_column(Text(name), justify="right", no_wrap=True)
    table.add_column("", no_wrap=True)
    for s in p.schemes:
        excess = s.spectral_radius - 1.0
        table.add_row(
            s.scheme,
            str(s.degree),
            "0" if abs(excess) < 1e-11 else f"{excess:.1e}",
            "none" if s.critical_step is None else f"{s.critical_step:.3g}",
            "unstable" if excess > p.threshold else "",
        )
    return table
