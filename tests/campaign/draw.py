"""Random scenes: a range of ``ranges.toml`` has axes, a cell has a value for each, `scene_dict` is the scene of a cell.

Values are relative to the beam and to the motion, so that a range describes a kind of scene: the cell's stiffness,
length, density and speed give the units. `EXTREME` covers all possible scenes, `USUAL` common ones, `KINDS` those of
kinds.py. A Latin hypercube covers a range; a slice of the extreme one varies two parameters over their ranges, with the
others at rest. The same seed gives the same cells.
"""

from math import inf, sqrt
from pathlib import Path

from springbeam.scene import Beam
from springbeam.scene.files import tables_of
from springbeam.scene.frequencies import slowest_frequency
from springbeam.scene.laws import LAWS
from springbeam.scene.statics import tip_compliance, tip_inertia
from springbeam.studies.design import RIGID, SOFT, Axis, design

#: Radians of the spring's own motion in one macro step, and in a cell: IDA takes some hundred steps for each.
_MOST_PHASE_PER_STEP, _MOST_PHASE = 30.0, 1000.0
#: law, scheme, degree: all possible couplings.
COUPLINGS = (
    *(("transmission", *scheme) for scheme in RIGID),
    *(("unilateral", *scheme) for scheme in RIGID),
    *(("compliance", *scheme) for scheme in SOFT),
    *(("kelvin_voigt", *scheme) for scheme in RIGID),
    *(("tie", *scheme) for scheme in RIGID),
    *(("link", *scheme) for scheme in SOFT),
)


def _axes(range_):
    return tuple(Axis(name, **{key: _tuples(value) for key, value in axis.items()}) for name, axis in range_.items())


def _tuples(value):
    """Return ``value`` with tuples for lists, which can be members of a set."""
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


_RANGES = tables_of(Path(__file__).with_name("ranges.toml"))
#: Values of parameters that a range does not have, and in slices.
AT_REST = {name: _tuples(value) for name, value in _RANGES["at_rest"].items()}
EXTREME = (Axis("coupling", COUPLINGS), *_axes(_RANGES["extreme"]))
USUAL = _axes(_RANGES["usual"])
KINDS = _axes(_RANGES["kinds"])
#: Two axes over their ranges by the name of the slice, and other values that are not at rest.
SLICES = {
    name: (*fixed.pop("axes"), {key: _tuples(value) for key, value in fixed.items()})
    for name, fixed in _RANGES["slices"].items()
}


def drawn(axes, count, seed):
    """Return a Latin hypercube of ``count`` cells over a range."""
    names = [axis.name for axis in axes]
    found = design(axes, count, seed, "latin_hypercube") if count else []
    return [{**AT_REST, **dict(zip(names, values, strict=True))} for values in found]


def slice_cells(resolution):
    """Return ``resolution``² cells of each of `SLICES`, both ends of the ranges included; ``slice`` names it."""
    grids = {axis.name: axis.grid(resolution) for axis in EXTREME if axis.low != axis.high} if resolution else {}
    return [
        {**AT_REST, **fixed, "slice": name, across: x, up: y}
        for name, (across, up, fixed) in SLICES.items()
        for x in grids.get(across, ())
        for y in grids.get(up, ())
    ]


def scene_dict(cell):
    """Return the scene of a cell, as `springbeam.scene.scene_from_dict` takes it."""
    law, scheme, degree = cell["coupling"]
    with_beam = cell["bodies"] != "spring"
    with_spring = cell["bodies"] != "beam"
    beam = _beam(cell)
    tip_stiffness = 1.0 / tip_compliance(beam)
    tip_mass = tip_inertia(beam)
    mass = cell["mass"] * cell["density"] * beam.length
    k1 = cell["k1"] * tip_stiffness
    speed = cell["speed"]
    reach = speed * sqrt((with_beam * tip_mass + with_spring * mass) / (with_beam * tip_stiffness + with_spring * k1))
    psi = cell["equilibrium"] * reach
    clearance = 0.0 if LAWS[law].lasting else cell["clearance"] * reach
    hardening = {"hardening": cell["k2"], "softening": -1.0 / cell["escape"] ** 2, "linear": 0.0}[cell["k2_kind"]]
    k2 = hardening * k1 / reach**2
    external_force = cell["direction"] * cell["external_force"] * k1 * reach
    distributed_load = cell["direction"] * cell["distributed_load"] * tip_stiffness * reach / beam.length
    fastest = max(with_beam * slowest_frequency(beam), with_spring * sqrt(k1 / mass))
    H = cell["macro_step"] / fastest
    steps = int(cell["steps"])
    elastic = cell["approach"] == "elastic"
    if with_spring:
        energy = 0.5 * mass * speed**2
        if with_beam:
            # Of the shear of u = s x, θ = 0: at the start, or where the undeformed beam first touches.
            slope = (psi + elastic * clearance) / beam.length
            energy = cell["density"] * beam.length * speed**2 / 6.0 + 0.5 * beam.shear_modulus * beam.length * slope**2
        load = abs(external_force) + abs(distributed_load) * beam.length
        omega = _spring_frequency(mass, k1, max(k2, 0.0), abs(psi), energy, load)
        H = min(H, _MOST_PHASE_PER_STEP / omega)
        steps = max(10, min(steps, int(_MOST_PHASE / (omega * H))))
    if elastic:
        clearance = min(clearance, 0.1 * speed * steps * H)  # else most would never meet
    damping = cell["contact_damping"]
    scene = {
        "coupling": {"scheme": scheme, "degree": degree, "macro_step": H},
        "time": {"t_end": steps * H + (0.0 if elastic or not with_beam else clearance / speed)},
        "contact": {"law": law},
    }
    resistance = damping * sqrt((mass + tip_mass) * (k1 + tip_stiffness))
    if law in ("compliance", "kelvin_voigt"):
        q = cell["exponent"]
        stiffness = (tip_stiffness + k1) * reach / (cell["depth"] * reach) ** q
        of_law = damping / speed if law == "compliance" else resistance
        scene["contact"] |= {"stiffness": stiffness, "exponent": q, "damping": of_law}
    if law == "link":
        scene["contact"] |= {"stiffness": (tip_stiffness + k1) / cell["depth"], "damping": resistance}
    if with_beam:
        scene["beam"] = {
            **beam.model_dump(exclude_unset=True),
            "alpha_b": 2.0 * cell["alpha_b"] / slowest_frequency(beam),
            "integrator": cell["integrator"] if degree == 0 else "modal",  # the midpoint rule uses the mean of a force
            "fidelity": cell["fidelity"],
            "distributed_load": distributed_load,
            "tip_load_coefficient": cell["direction"]
            * (cell["tip_load"] * tip_stiffness * reach * beam.n_elements / beam.length),
            "initial_deflection_slope": (psi + clearance) / beam.length,
            "initial_velocity_slope": -speed / beam.length,
            "approach": cell["approach"],
        }
    if with_spring:
        scene["spring"] = {
            "mass": mass,
            "damping": cell["alpha_s"] * sqrt(mass * k1),
            "linear_stiffness": k1,
            "cubic_stiffness": k2,
            "equilibrium": psi,
            "external_force": external_force,
            "initial_velocity": 0.0 if with_beam else -speed,
        }
    if cell["stop_depth"] > 0.0 or not with_spring:
        restitution = {"given": cell["restitution"], "plastic": 0.0, "elastic": 1.0}[cell["elasticity"]]
        position = psi - with_spring * cell["stop_depth"] * reach
        scene["stop"] = {"position": position, "restitution": restitution}
    return scene


def _beam(cell):
    """Return the beam of a cell, of a section of 1 m²."""
    length = cell["length"]
    root = sqrt(cell["shear_ratio"])
    inertia = (cell["gyration"] * length) ** 2
    degree = cell["element_degree"]
    n = max(1, cell["n_elements"] // degree)
    return Beam(
        density=cell["density"],
        length=length,
        area=1.0,
        second_moment_of_area=inertia,
        young_modulus=cell["stiffness"] / root * length**2 / inertia,
        shear_modulus=cell["stiffness"] * root,
        shear_coefficient=1.0,
        n_elements=n,
        element_degree=degree,
        n_modes=min(cell["n_modes"], 2 * n * degree),
        reduced_integration=cell["reduced_integration"],
    )


def _spring_frequency(mass, k1, k2, psi, energy, load):
    """Return an upper estimate [rad/s], at the static deflection under the loads plus that of all the energy."""
    linear = sqrt(2.0 * energy / k1) + 2.0 * load / k1
    cubic = (4.0 * energy / k2) ** 0.25 + 2.0 * (load / k2) ** (1.0 / 3.0) if k2 > 0.0 else inf
    y = psi + min(linear, cubic)
    return sqrt((k1 + 3.0 * k2 * y**2) / mass)
