"""Warnings about scenes that can be run but probably contain a mistake."""

from __future__ import annotations

import math

from .estimates import implausible
from .scene import Scene
from .statics import locking, shear_stiffness, tip_inertia
from .well import spring_energy, well_depth


def _beam_energy(scene: Scene) -> float:
    """Return the energy of the beam as it arrives [J]: of motion and of a straight slope's shear, without its loads."""
    if (beam := scene.beam) is None or beam.fidelity == "quasi_static":
        return 0.0
    target, slope = scene.tip_target, beam.initial_deflection_slope
    if beam.approach == "undeformed" and target is not None:
        slope = target[1] / beam.length
    kinetic = beam.density * beam.area * beam.length**3 * beam.initial_velocity_slope**2 / 6.0
    return kinetic + 0.5 * shear_stiffness(beam) * beam.length * slope**2


def suspicions(scene: Scene) -> list[str]:
    """Return warnings about values that can be run but are probably mistaken."""
    H = scene.coupling.macro_step
    found = [
        f"[loads.{number}] file: its lines are closer than a quarter of [coupling] macro_step = {H:g} s, so steps do "
        'not end on them and errors fall slowly with the step; take a smaller macro_step, or interpolation = "cubic"'
        for number, load in enumerate(scene.loads)
        if load.is_finer_than(H)
    ]
    found += implausible(scene)
    beam, spring = scene.beam, scene.spring
    if spring is not None and spring.cubic_stiffness < 0.0:
        energy, depth = spring_energy(spring) + _beam_energy(scene), well_depth(scene)
        if energy > depth:
            deep = f"well is {depth:.3g} J deep" if depth > -math.inf else "well is gone under external_force"
            found.append(
                f"[spring] cubic_stiffness = {spring.cubic_stiffness}: the motion starts with {energy:.3g} J, the "
                f"softening spring's {deep}; the run stops if it escapes"
            )
    if beam is not None and (factor := locking(beam)) > 1.05:
        found.append(
            f"[beam] n_elements = {beam.n_elements}: full integration locks, the beam is {factor:.3g} times too "
            "stiff; use reduced_integration = true, element_degree = 3, or more elements"
        )
    if beam is not None and beam.fidelity == "quasi_static" and scene.spring is not None:
        share = tip_inertia(beam) / scene.spring.mass
        if share > 0.05 and scene.contact.rigid:
            found.append(
                f'[beam] fidelity = "quasi_static": neglects an inertia that at the tip is {share:.2g} of the '
                f"spring's mass; the joined motion is about {math.sqrt(1.0 + share) - 1.0:.0%} too fast"
            )
        if beam.approach == "undeformed" and beam.initial_velocity_slope != 0.0:
            energy = beam.density * beam.area * beam.length**3 * beam.initial_velocity_slope**2 / 6.0
            found.append(
                f'[beam] fidelity = "quasi_static": the beam arrives without its kinetic energy, {energy:.3g} J; the '
                "result lacks its impact and the vibration that follows"
            )
    return found
