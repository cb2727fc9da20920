"""A scene in a few lines of words and numbers, for the head of its report."""

from __future__ import annotations

from collections.abc import Iterator

from ...scene import Scene
from ...scene.automatic import with_scheme_chosen
from ...scene.partners import kind_of
from ...scene.statics import bending_stiffness, shear_stiffness


def described(scene: Scene) -> Iterator[tuple[str, str]]:
    """Return what each part of the scene is, in the order of the drawing from above."""
    beam, spring, stop, contact = scene.beam, scene.spring, scene.stop, scene.contact
    if beam is not None:
        mesh = "no inertia" if beam.fidelity == "quasi_static" else f"{beam.n_elements} elements"
        if beam.fidelity == "dynamic" and beam.n_modes:
            mesh += f", {beam.n_modes} modes"
        mass = beam.density * beam.area * beam.length
        stiffness = f"EI = {bending_stiffness(beam):.4g} N·m², KAG = {shear_stiffness(beam):.4g} N"
        yield "beam", f"length {beam.length:.4g} m, mass {mass:.4g} kg, stiffness {stiffness}; {mesh}"
    if spring is not None:
        cubic = f", cubic stiffness {spring.cubic_stiffness:.4g} N/m³" if spring.cubic_stiffness else ""
        stiffness = f"stiffness {spring.linear_stiffness:.4g} N/m{cubic}"
        yield "spring", f"mass {spring.mass:.4g} kg, {stiffness}, its top at rest at Ψ = {spring.equilibrium:.4g} m"
    for table, partner in scene.partners.items():
        yield table, f"another body in its place: {kind_of(partner).replace('_', ' ')}"
    if scene.coupled:
        values = {key: getattr(contact, key) for key in contact.facts.takes if key != "impact"}
        numbers = [f"{key} {value:.4g}" for key, value in values.items() if key != "damping" or value > 0.0]
        yield "contact", f"{contact.law}: {', '.join([contact.facts.words, *numbers])}"
    if stop is not None:
        rebound = "elastic" if scene.elastic_stop else f"restitution {stop.restitution:.4g}"
        yield "foundation", f"at φ = {stop.position:.4g} m, {rebound}"
    for i, load in enumerate(scene.loads):
        what = f"{load.signal.replace('_', '-')} on the {load.on}, {load.peak:.4g} {load.unit}"
        yield f"load_{i}", what + (f", {load.frequency:.4g} Hz" if load.frequency else "")
    H = scene.coupling.macro_step
    length = "macro steps that follow from tolerances" if H is None else f"macro step {H:.4g} s"
    ran, picked = with_scheme_chosen(scene)
    scheme = f"{ran.coupling.scheme} of degree {ran.coupling.degree}" + ("" if picked is None else ", picked by auto")
    yield "steps", f"{scheme}, {length}, to {scene.time.t_end:.4g} s"
