"""Warnings about scenes that can be run but probably contain a mistake."""

from __future__ import annotations

import math
from collections.abc import Iterator

from .effects import without_effect
from .linearised import beam_energy, spring_energy, well_depth
from .scene import Scene
from .statics import initial_kinetic_energy, locking, tip_compliance, tip_inertia

#: What beams are made of: from foam to the heaviest metals [kg/m³], from gels to diamond [Pa].
_DENSITIES, _MODULI = (10.0, 25e3), (1e4, 2e12)
#: E/G: 2 to 3 of isotropic solids, up to some 100 of laminates.
_YOUNG_OVER_SHEAR = (0.5, 200.0)
#: Length over radius of gyration: below, no beam theory holds; above, it is a thread.
_SLENDERNESS = (3.0, 3e4)
#: Lowest frequency [Hz] of anything that a macroscopic beam is.
_FREQUENCIES = (1e-2, 1e7)
#: Mass of the beam over that of the spring, or the other way round.
_MASS_RATIO = 1e6
#: Speed of the tip over that of sound in the beam, about its largest strain: no solid stays elastic beyond.
_MOST_STRAIN = 0.05


def suspicions(scene: Scene) -> list[str]:
    """Return warnings about values that can be run but are probably mistaken."""
    H = scene.coupling.macro_step
    found = [
        f"[loads.{number}] file: its lines are closer than a quarter of [coupling] macro_step = {H:g} s, so steps do "
        'not end on them and errors fall slowly with the step; take a smaller macro_step, or interpolation = "cubic"'
        for number, load in enumerate(scene.loads)
        if load.is_finer_than(H)
    ]
    found += without_effect(scene)
    found += implausible(scene)
    found += held_apart(scene)
    beam, spring = scene.beam, scene.spring
    if spring is not None and spring.cubic_stiffness < 0.0 and not scene.static:
        arriving = 0.0 if scene.massless else beam_energy(scene)
        energy, depth = spring_energy(spring) + arriving, well_depth(scene)
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
            found.append(
                '[beam] fidelity = "quasi_static": the beam arrives without its kinetic energy, '
                f"{initial_kinetic_energy(beam):.3g} J; the result lacks its impact and the vibration that follows"
            )
    return found


def held_apart(scene: Scene) -> Iterator[str]:
    """Yield that the spring is held until an undeformed tip arrives, where it would move by itself."""
    spring, t_c = scene.spring, scene.contact_time
    if spring is None or not t_c or t_c > scene.time.t_end:
        return
    psi = spring.equilibrium
    pull = spring.linear_stiffness * psi + spring.cubic_stiffness * psi**3
    if not math.isclose(pull, spring.external_force, rel_tol=1e-9):
        yield (
            f"[spring] equilibrium = {psi:g}: {spring.external_force - pull:.3g} N act on it there, and the "
            f'top is held until the tip arrives at t = {t_c:.3g} s; [beam] approach = "elastic" lets it move'
        )


def implausible(scene: Scene) -> Iterator[str]:
    """Yield what can hardly be meant of our beam, as lines ``[table] key = value: why, and what may be meant``.

    A beam with area = 1 is taken to be in units of its own: nothing is said about it.
    """
    beam = scene.beam
    if beam is None or 1.0 in (beam.area, beam.density):
        return
    E, rho = beam.young_modulus, beam.density
    for key, value, (low, high), unit, known, (other, factor) in (
        ("young_modulus", E, _MODULI, "Pa", "rubber about 1e6, aluminium 7e10, steel 2.1e11", ("GPa", 1e9)),
        ("density", rho, _DENSITIES, "kg/m³", "aluminium 2700, steel 7850", ("g/cm³", 1e3)),
    ):
        if not low <= value <= high:
            meant = f"; in {other} it would be {value * factor:.3g} {unit}" if low <= value * factor <= high else ""
            yield f"[beam] {key} = {value:g}: in {unit}, no solid has it ({known}){meant}"
    ratio = E / beam.shear_modulus
    if beam.poisson_ratio is None and not _YOUNG_OVER_SHEAR[0] <= ratio <= _YOUNG_OVER_SHEAR[1]:
        yield (
            f"[beam] shear_modulus = {beam.shear_modulus:g}: young_modulus is {ratio:.3g} times as large; for an "
            "isotropic solid it is 2 to 3 times, and poisson_ratio gives it"
        )
    slenderness = beam.length / math.sqrt(beam.second_moment_of_area / beam.area)
    if not _SLENDERNESS[0] <= slenderness <= _SLENDERNESS[1]:
        looks = "thicker than long" if slenderness < _SLENDERNESS[0] else "a thread"
        yield (
            f"[beam] length = {beam.length:g}: with this section the beam is {looks} (length over radius of gyration "
            f"{slenderness:.2g}); is a length in mm?"
        )
    # Rayleigh's quotient for the static shape of a tip force: within 2 % if slender, 10 % if not.
    period = 2.0 * math.pi * math.sqrt(tip_compliance(beam) * tip_inertia(beam))
    if beam.fidelity == "dynamic" and not _FREQUENCIES[0] <= (frequency := 1.0 / period) <= _FREQUENCIES[1]:
        yield f"[beam]: its lowest frequency is {frequency:.2g} Hz; check length, section, density and young_modulus"
    mass, spring = beam.density * beam.area * beam.length, scene.spring
    if spring is not None and not 1.0 / _MASS_RATIO <= mass / spring.mass <= _MASS_RATIO:
        long = f"a beam {beam.length:g} m long of {mass:.3g} kg beside a spring's mass of {spring.mass:.3g} kg"
        milli = beam.length >= 10.0 and f"; in mm it would be {1e-3 * beam.length:g} m long, of {1e-9 * mass:.3g} kg"
        yield f"[beam] length = {beam.length:g}: {long}{milli or ''}; lengths are in m"
    speed = abs(beam.initial_velocity_slope) * beam.length
    sound = math.sqrt(E / rho)
    if speed > _MOST_STRAIN * sound:
        yield (
            f"[beam] the tip starts with {speed:.3g} m/s, {speed / sound:.2g} times the speed of sound in the beam "
            f"({sound:.3g} m/s): bending would strain it as much, which no solid does elastically"
        )
