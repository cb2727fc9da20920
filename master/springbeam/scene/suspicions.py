"""Warnings about scenes that can be run: probable mistakes, and keys without effect."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from .laws import LAW
from .linearised import beam_energy, spring_energy, well_depth
from .messages import Rule, texts_of, texts_of_loads
from .scene import TABLES, Scene
from .statics import initial_kinetic_energy, locking, tip_compliance, tip_inertia

#: E/G: 2 to 3 of isotropic solids, up to some 100 of laminates.
_YOUNG_OVER_SHEAR = (0.5, 200.0)
#: Length over radius of gyration: below it beam theory fails, above it the beam is a thread.
_SLENDERNESS = (3.0, 3e4)
#: Range of the lowest frequency [Hz] of macroscopic beams.
_FREQUENCIES = (1e-2, 1e7)
#: Mass of the beam over that of the spring, or vice versa.
_MASS_RATIO = (1e-6, 1e6)
#: Speed of the tip over that of sound in the beam, about its largest strain: no solid stays elastic beyond.
_MOST_STRAIN = 0.05


def suspicions(scene: Scene) -> list[str]:
    """Return warnings about values that can be run but are probably mistakes, or have no effect."""
    return [
        *implausible(scene),
        *texts_of(scene, (*SUSPICIOUS, *EFFECTS)),
        *texts_of_loads(scene, SUSPICIOUS_LOADS),
    ]


def implausible(scene: Scene) -> Iterator[str]:
    """Yield improbable values of our beam, as lines ``[table] key = value: reason, and probable value``.

    A beam with area = 1 or density = 1 is taken to be dimensionless, without warnings.
    """
    beam = scene.beam
    return texts_of(scene, IMPLAUSIBLE if beam is not None and 1.0 not in (beam.area, beam.density) else ())


# -- improbable values ----------------------------------------------------------------------------------------------


def _beyond(value: float, bounds: tuple[float, float]) -> bool:
    return not bounds[0] <= value <= bounds[1]


def _material(key: str, unit: str, bounds: tuple[float, float], known: str, other: str, factor: float) -> Rule:
    """Return the rule for a property that no solid has; ``factor`` is that of the probable unit."""

    def meant(scene: Scene) -> Mapping[str, str]:
        value = factor * getattr(scene.beam, key)
        return {"meant": "" if _beyond(value, bounds) else f"; in {other} it would be {value:.3g} {unit}"}

    text = f"{{beam.{key}}}: in {unit}, no solid has it ({known}){{meant}}"
    return Rule(lambda s: _beyond(getattr(s.beam, key), bounds), text, meant)


def _of_beam(scene: Scene) -> dict[str, Any]:
    """Return properties of our beam, for the texts of rules."""
    beam = scene.beam
    spring = scene.spring
    assert beam is not None
    mass = beam.density * beam.area * beam.length
    slenderness = beam.length / math.sqrt(beam.second_moment_of_area / beam.area)
    milli = f"; in mm it would be {1e-3 * beam.length:g} m long, of {1e-9 * mass:.3g} kg"
    return {
        "ratio": beam.young_modulus / beam.shear_modulus,
        "slenderness": slenderness,
        "looks": "thicker than long" if slenderness < _SLENDERNESS[0] else "a thread",
        # Rayleigh's quotient for the static shape of a tip force: within 2 % if slender, 10 % if not.
        "frequency": 0.5 / math.pi / math.sqrt(tip_compliance(beam) * tip_inertia(beam)),
        "mass": mass,
        "masses": 1.0 if spring is None else mass / spring.mass,
        "milli": milli if beam.length >= 10.0 else "",
        "speed": (speed := abs(beam.initial_velocity_slope) * beam.length),
        "sound": (sound := math.sqrt(beam.young_modulus / beam.density)),
        "strain": speed / sound,
    }


#: Rules for improbable values of our beam.
IMPLAUSIBLE = (
    _material(
        "young_modulus", "Pa", (1e4, 2e12), "rubber about 1e6, aluminium 7e10, steel 2.1e11", "GPa", 1e9
    ),  # from gels to diamond
    _material("density", "kg/m³", (10.0, 25e3), "aluminium 2700, steel 7850", "g/cm³", 1e3),  # foam to heavy metals
    Rule(
        lambda s: s.beam.poisson_ratio is None and _beyond(_of_beam(s)["ratio"], _YOUNG_OVER_SHEAR),
        "{beam.shear_modulus}: young_modulus is {ratio:.3g} times as large; for an isotropic solid it is 2 to 3 times, "
        "and poisson_ratio gives it",
        _of_beam,
    ),
    Rule(
        lambda s: _beyond(_of_beam(s)["slenderness"], _SLENDERNESS),
        "{beam.length}: with this section the beam is {looks} (length over radius of gyration {slenderness:.2g}); is a "
        "length in mm?",
        _of_beam,
    ),
    Rule(
        lambda s: s.beam.fidelity == "dynamic" and _beyond(_of_beam(s)["frequency"], _FREQUENCIES),
        "[beam]: its lowest frequency is {frequency:.2g} Hz; check length, section, density and young_modulus",
        _of_beam,
    ),
    Rule(
        lambda s: _beyond(_of_beam(s)["masses"], _MASS_RATIO),
        "{beam.length}: the beam has {mass:.3g} kg, with {spring.mass}{milli}; lengths are in m",
        _of_beam,
    ),
    Rule(
        lambda s: _of_beam(s)["strain"] > _MOST_STRAIN,
        "[beam] the tip starts with {speed:.3g} m/s, {strain:.2g} times the speed of sound in the beam ({sound:.3g} "
        "m/s): bending would strain it as much, which no solid does elastically",
        _of_beam,
    ),
)


# -- probable mistakes ----------------------------------------------------------------------------------------------


def _well(scene: Scene) -> dict[str, Any]:
    """Return the energy at the start and the depth of a softening spring's well, for the texts of rules."""
    assert scene.spring is not None
    depth = well_depth(scene)
    return {
        "energy": spring_energy(scene.spring) + (0.0 if scene.massless else beam_energy(scene)),
        "depth": depth,
        "well": f"well is {depth:.3g} J deep" if depth > -math.inf else "well is gone under external_force",
    }


def _pull(scene: Scene) -> float:
    """Return the force on the spring's top at the start [N], 0 if it is negligible."""
    spring = scene.spring
    assert spring is not None
    pull = -spring.force(spring.equilibrium)
    return 0.0 if abs(pull) <= 1e-9 * abs(spring.external_force) else pull


def _share(scene: Scene) -> float:
    """Return the inertia at the tip that a quasi-static beam neglects, over the mass of our spring."""
    return tip_inertia(scene.beam) / scene.spring.mass if scene.massless and scene.beam and scene.spring else 0.0


SUSPICIOUS: tuple[Rule, ...] = (
    Rule(
        lambda s: s.spring and 0.0 < (s.contact_time or 0.0) <= s.time.t_end and _pull(s) != 0.0,
        "{spring.equilibrium}: {pull:.3g} N act on it there, and the top is held until the tip arrives at "
        't = {t_c:.3g} s; [beam] approach = "elastic" lets it move',
        lambda s: {"pull": _pull(s), "t_c": s.contact_time},
    ),
    Rule(
        lambda s: s.spring and s.spring.softens and not s.static and _well(s)["energy"] > _well(s)["depth"],
        "{spring.cubic_stiffness}: the motion starts with {energy:.3g} J, the softening spring's {well}; the run stops "
        "if it escapes",
        _well,
    ),
    Rule(
        lambda s: s.beam and locking(s.beam) > 1.05,
        "{beam.n_elements}: full integration locks, the beam is {factor:.3g} times too stiff; use "
        "reduced_integration = true, element_degree = 3, or more elements",
        lambda s: {"factor": locking(s.beam)},
    ),
    Rule(
        lambda s: _share(s) > 0.05 and s.contact.rigid,
        "{beam.fidelity}: neglects an inertia that at the tip is {share:.2g} of the spring's mass; the joined motion "
        "is about {faster:.0%} too fast",
        lambda s: {"share": _share(s), "faster": math.sqrt(1.0 + _share(s)) - 1.0},
    ),
    Rule(
        lambda s: s.massless and s.spring and s.beam.approach == "undeformed" and s.beam.initial_velocity_slope != 0.0,
        "{beam.fidelity}: the beam arrives without its kinetic energy, {energy:.3g} J; the result lacks its impact and "
        "the vibration that follows",
        lambda s: {"energy": initial_kinetic_energy(s.beam)},
    ),
)
SUSPICIOUS_LOADS = (
    Rule(
        lambda s, load: load.is_finer_than(s.coupling.macro_step),
        "{load.file}: its lines are closer than a quarter of {coupling.macro_step}, so steps do not end on them and "
        'errors fall slowly with the step; take a smaller macro_step, or interpolation = "cubic"',
    ),
    Rule(
        lambda s, load: bool(load.notes),
        "{load.file}: {notes}",
        lambda s, load: {"notes": "; ".join(load.notes)},
    ),
    Rule(
        lambda s, load: load.begins >= s.time.t_end,
        "{load.start}: plays no part here; the run ends at {time.t_end}",
    ),
)


# -- keys without effect --------------------------------------------------------------------------------------------


def _counts(
    places: str,
    counts: Callable[[Any], bool],
    where: str,
    numbers: Callable[[Scene], Mapping[str, Any]] = lambda s: {},
) -> list[Rule]:
    """Return rules for keys that are given, and not as their default, in scenes where they have no effect."""

    def rule(table: str, key: str) -> Rule:
        def idle(scene: Scene) -> bool:
            content = scene.under(table)
            return (
                isinstance(content, TABLES[table])
                and key in (fields := type(content).model_fields)
                and getattr(content, key) != fields[key].default
                and not counts(scene)
            )

        return Rule(idle, f"{{{table}.{key}}}: plays no part here; {where}", numbers)

    return [rule(*place.split(".")) for place in places.split()]


def _dynamic(scene: Scene) -> bool:
    return scene.beam is not None and not scene.massless


_JOINS = "it counts between two bodies, or a beam and a stop"
#: Conditions under which keys have an effect. Loads reject such keys; here a warning suffices, so that ``--set`` can
#: change a key that removes the effect of another.
EFFECTS: tuple[Rule, ...] = (
    *_counts(
        "beam.element_degree beam.reduced_integration beam.mass_matrix",
        _dynamic,
        'it counts with fidelity = "dynamic"',
    ),
    *_counts(
        "beam.n_elements",
        lambda s: _dynamic(s) or (s.beam is not None and s.beam.tip_load_coefficient != 0.0),
        'it counts with fidelity = "dynamic", or for a tip_load_coefficient',
    ),
    *_counts(
        "beam.integrator",
        _dynamic,
        'it counts with fidelity = "dynamic"',
    ),
    *_counts(
        "beam.n_modes",
        lambda s: _dynamic(s) and s.beam.integrator == "modal",
        'it counts with fidelity = "dynamic" and integrator = "modal", the midpoint rule keeps all modes',
    ),
    Rule(lambda s: not s.coupled and s.contact.law != LAW.default, f"{{contact.law}}: plays no part here; {_JOINS}"),
    *_counts("contact.stiffness contact.exponent contact.damping", lambda s: s.coupled, _JOINS),
    *_counts(
        "contact.force_window",
        lambda s: s.coupled or (s.upper is not None and s.stop is not None),
        "it counts where the run has a peak contact force",
    ),
)
