"""Warnings about scenes that can be run: probable mistakes, and keys without effect.

``[table.key]`` in a text stands for the key with its value (`springbeam.scene.messages.filled`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from .energies import beam_energy, spring_energy, well_depth
from .laws import LAW
from .loads import Load
from .messages import filled
from .scene import TABLES, Scene
from .statics import initial_kinetic_energy, locking, tip_compliance, tip_inertia
from .tables import Beam, Spring

#: E/G: 2 to 3 of isotropic solids, up to some 100 of laminates.
_YOUNG_OVER_SHEAR = (0.5, 200.0)
#: Length over radius of gyration: below it beam theory fails, above it the beam is a thread.
_SLENDERNESS = (3.0, 3e4)
#: Range of the lowest frequency [Hz] of macroscopic beams.
_FREQUENCIES = (1e-2, 1e7)
#: A run that sees fewer periods of the beam has its lengths in mm, if it would see more then.
_SEEN = 0.1
#: Mass of the beam over that of the spring, or vice versa.
_MASS_RATIO = (1e-6, 1e6)
#: Speed of the tip over that of sound in the beam, about its largest strain: no solid stays elastic beyond.
_MOST_STRAIN = 0.05
#: Properties of solids, from gels to diamond and from foam to heavy metals: key, unit, range, examples, and the
#: probable unit with its factor.
_MATERIALS = (
    ("young_modulus", "Pa", (1e4, 2e12), "rubber about 1e6, aluminium 7e10, steel 2.1e11", "GPa", 1e9),
    ("density", "kg/m³", (10.0, 25e3), "aluminium 2700, steel 7850", "g/cm³", 1e3),
)


def warnings_of(scene: Scene) -> list[str]:
    """Return warnings about values that can be run but are probably mistakes, or have no effect."""
    warnings = [*implausible(scene)]
    warnings += [filled(scene, text) for subject in (_spring, _beam, _without_effect) for text in subject(scene)]
    for number, load in enumerate(scene.loads):
        warnings += [filled(scene, text, number) for text in _load(scene, load)]
    return warnings


def implausible(scene: Scene) -> Iterator[str]:
    """Yield improbable values of our beam, as lines ``[table] key = value: reason, and probable value``.

    A beam with area = 1 or density = 1 is taken to be dimensionless, without warnings.
    """
    beam = scene.beam
    if beam is not None and 1.0 not in (beam.area, beam.density):
        for text in _improbable(beam, scene.spring, scene.time.t_end):
            yield filled(scene, text)


# -- improbable values ----------------------------------------------------------------------------------------------


def _beyond(value: float, bounds: tuple[float, float]) -> bool:
    return not bounds[0] <= value <= bounds[1]


def _improbable(beam: Beam, spring: Spring | None, end: float) -> Iterator[str]:
    for key, unit, bounds, known, other, factor in _MATERIALS:
        if _beyond(getattr(beam, key), bounds):
            meant = factor * getattr(beam, key)
            rather = "" if _beyond(meant, bounds) else f"; in {other} it would be {meant:.3g} {unit}"
            yield f"[beam.{key}]: in {unit}, no solid has it ({known}){rather}"
    ratio = beam.young_modulus / beam.shear_modulus
    if beam.poisson_ratio is None and _beyond(ratio, _YOUNG_OVER_SHEAR):
        yield (
            f"[beam.shear_modulus]: young_modulus is {ratio:.3g} times as large; for an isotropic solid it is 2 to 3 "
            "times, and poisson_ratio gives it"
        )
    slenderness = beam.length / math.sqrt(beam.second_moment_of_area / beam.area)
    if _beyond(slenderness, _SLENDERNESS):
        looks = "thicker than long" if slenderness < _SLENDERNESS[0] else "a thread"
        yield (
            f"[beam.length]: with this section the beam is {looks} (length over radius of gyration {slenderness:.2g}); "
            "is a length in mm?"
        )
    # Rayleigh's quotient for the static shape of a tip force: within 2 % if slender, 10 % if not.
    frequency = 0.5 / math.pi / math.sqrt(tip_compliance(beam) * tip_inertia(beam))
    if beam.fidelity == "dynamic" and _beyond(frequency, _FREQUENCIES):
        yield f"[beam]: its lowest frequency is {frequency:.2g} Hz; check length, section, density and young_modulus"
    elif beam.fidelity == "dynamic" and beam.length >= 1.0 and frequency * end < _SEEN < 1e3 * frequency * end:
        yield (
            f"[beam.length]: its lowest frequency is {frequency:.2g} Hz, of which the run sees {frequency * end:.2g} "
            f"periods; with all lengths in mm it would be {1e-3 * beam.length:g} m long and vibrate at "
            f"{1e3 * frequency:.3g} Hz"
        )
    mass = beam.density * beam.area * beam.length
    if spring is not None and _beyond(mass / spring.mass, _MASS_RATIO):
        milli = f"; in mm it would be {1e-3 * beam.length:g} m long, of {1e-9 * mass:.3g} kg"
        yield (
            f"[beam.length]: the beam has {mass:.3g} kg, with [spring.mass]{milli if beam.length >= 10.0 else ''}; "
            "lengths are in m"
        )
    speed = abs(beam.initial_velocity_slope) * beam.length
    sound = math.sqrt(beam.young_modulus / beam.density)
    if speed / sound > _MOST_STRAIN:
        yield (
            f"[beam] the tip starts with {speed:.3g} m/s, {speed / sound:.2g} times the speed of sound in the beam "
            f"({sound:.3g} m/s): bending would strain it as much, which no solid does elastically"
        )


# -- probable mistakes ----------------------------------------------------------------------------------------------


def _spring(scene: Scene) -> Iterator[str]:
    spring = scene.spring
    if spring is None:
        return
    arrives = scene.contact_time or 0.0
    pull = -spring.force(spring.equilibrium)
    if 0.0 < arrives <= scene.time.t_end and abs(pull) > 1e-9 * abs(spring.external_force):
        yield (
            f"[spring.equilibrium]: {pull:.3g} N act on it there, and the top is held until the tip arrives at "
            f't = {arrives:.3g} s; [beam] approach = "elastic" lets it move'
        )
    if spring.softens and not scene.static:
        depth = well_depth(scene)
        energy = spring_energy(spring) + (0.0 if scene.massless else beam_energy(scene))
        well = f"well is {depth:.3g} J deep" if depth > -math.inf else "well is gone under external_force"
        if energy > depth:
            yield (
                f"[spring.cubic_stiffness]: the motion starts with {energy:.3g} J, the softening spring's {well}; the "
                "run stops if it escapes"
            )


def _beam(scene: Scene) -> Iterator[str]:
    beam = scene.beam
    if beam is None:
        return
    if (factor := locking(beam)) > 1.05:
        yield (
            f"[beam.n_elements]: full integration locks, the beam is {factor:.3g} times too stiff; use "
            "reduced_integration = true, element_degree = 3, or more elements"
        )
    if scene.spring is None or not scene.massless:
        return
    share = tip_inertia(beam) / scene.spring.mass  # which a quasi-static beam neglects
    if share > 0.05 and scene.contact.rigid:
        yield (
            f"[beam.fidelity]: neglects an inertia that at the tip is {share:.2g} of the spring's mass; the joined "
            f"motion is about {math.sqrt(1.0 + share) - 1.0:.0%} too fast"
        )
    if beam.approach == "undeformed" and beam.initial_velocity_slope != 0.0:
        yield (
            f"[beam.fidelity]: the beam arrives without its kinetic energy, {initial_kinetic_energy(beam):.3g} J; the "
            "result lacks its impact and the vibration that follows"
        )


def _load(scene: Scene, load: Load) -> Iterator[str]:
    """Yield the warnings about one ``load``; ``[load.key]`` in a text is a key of it."""
    if load.is_finer_than(scene.coupling.macro_step):
        yield (
            "[load.file]: its lines are closer than a quarter of [coupling.macro_step], so steps do not end on them "
            "and "
            'errors fall slowly with the step; take a smaller macro_step, or interpolation = "cubic"'
        )
    if load.notes:
        yield f"[load.file]: {'; '.join(load.notes)}"
    if load.begins >= scene.time.t_end:
        yield "[load.start]: plays no part here; the run ends at [time.t_end]"


# -- keys without effect --------------------------------------------------------------------------------------------


def _dynamic(scene: Scene) -> bool:
    return scene.beam is not None and not scene.massless


def _has_elements(scene: Scene) -> bool:
    return _dynamic(scene) or (scene.beam is not None and scene.beam.tip_load_coefficient != 0.0)


def _has_modes(scene: Scene) -> bool:
    return scene.beam is not None and not scene.massless and scene.beam.integrator == "modal"


def _is_coupled(scene: Scene) -> bool:
    return scene.coupled


def _has_window(scene: Scene) -> bool:
    return scene.soft_law is None and scene.upper is not None and (scene.coupled or scene.stop is not None)


_IN_DYNAMICS = 'it counts with fidelity = "dynamic"'
_JOINS = "it counts between two bodies, or a beam and a stop"
#: Keys, when they have an effect, and that in words. Loads reject such keys; here a warning suffices, so that ``--set``
#: can change a key that removes the effect of another.
EFFECTS: tuple[tuple[tuple[str, ...], Callable[[Scene], bool], str], ...] = (
    (
        ("beam.element_degree", "beam.reduced_integration", "beam.mass_matrix", "beam.integrator"),
        _dynamic,
        _IN_DYNAMICS,
    ),
    (("beam.n_elements",), _has_elements, f"{_IN_DYNAMICS}, or for a tip_load_coefficient"),
    (("beam.n_modes",), _has_modes, f'{_IN_DYNAMICS} and integrator = "modal", the midpoint rule keeps all modes'),
    (("contact.stiffness", "contact.exponent", "contact.damping"), _is_coupled, _JOINS),
    (
        ("contact.force_window",),
        _has_window,
        "it counts where a contact is rigid",
    ),
)


def _without_effect(scene: Scene) -> Iterator[str]:
    if not scene.coupled and scene.contact.law != LAW.default:
        yield f"[contact.law]: plays no part here; {_JOINS}"
    for places, counts, where in EFFECTS:
        for place in () if counts(scene) else places:
            table, key = place.split(".")
            content = scene.under(table)
            fields = type(content).model_fields if isinstance(content, TABLES[table]) else {}
            if key in fields and getattr(content, key) != fields[key].default:
                yield f"[{place}]: plays no part here; {where}"
