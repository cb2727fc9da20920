"""Random scenes: a range is a table of axes, a cell has a value for each, and `scene_dict` is the scene of a cell.

Values are relative to the beam and to the motion, so that a range says what kind of scene it has: the cell's stiffness,
length, density and speed give the units. `EXTREME` has all that a scene may ask for, `USUAL` what a bench may have. A
Latin hypercube covers a range; a slice of the extreme one takes two parameters from end to end, the others at rest.
The same seed gives the same cells.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf, pi, sqrt
from typing import Any

from ...scene import Beam
from ...scene.frequencies import slowest_frequency
from ...scene.laws import LAWS
from ...scene.statics import tip_compliance, tip_inertia
from ..design import RIGID, SOFT, Axis, design

#: Radians of the spring's own motion in one macro step, and in a cell: IDA takes some hundred steps for each.
_MOST_PHASE_PER_STEP, _MOST_PHASE = 30.0, 1000.0
#: law, scheme, degree: all that a scene may ask for.
COUPLINGS = (
    *(("transmission", *scheme) for scheme in RIGID),
    *(("compliance", *scheme) for scheme in SOFT),
    *(("tie", *scheme) for scheme in RIGID),
    *(("link", *scheme) for scheme in SOFT),
)

#: What a parameter is where a range does not have it, and in slices: nearly the scene ``soft``, coarser. The *reach*
#: [m] is how far both bodies go at the tip's speed when each is as stiff as its linear part.
AT_REST: dict[str, Any] = {
    "coupling": ("transmission", "energy", 0),
    "bodies": "both",  # or "beam", "spring"
    "stiffness": 100.0,  # √(EI·KAG)/L [N]
    "length": 1.0,  # [m]
    "density": 1.0,  # [kg/m]
    "speed": 1.0,  # of the tip, or of a spring alone [m/s]
    "shear_ratio": 1.0,  # KAG L²/EI
    "gyration": 1.0,  # √(I/A)/L
    "macro_step": 0.01,  # by the fastest of the bodies' own slowest motions [rad]
    "steps": 200,
    "mass": 1.0,  # of the spring over that of the beam
    "k1": 0.04,  # over the stiffness of the tip
    "k2_kind": "softening",  # or "hardening", "linear"
    "k2": 0.1,  # of a hardening spring, k2·reach²/k1
    "escape": 6.7,  # the hilltop of a softening spring, in reaches
    "depth": 0.08,  # of a soft contact, in reaches
    "exponent": 1.5,
    "contact_damping": 0.0,  # χ·speed; of a link over √((m + m_tip)(k1 + k_tip))
    "alpha_b": 0.0,  # α_b ω₁/2
    "alpha_s": 0.0,  # α_s/√(m k1)
    "stop_depth": 0.12,  # Ψ − φ in reaches; 0: no stop; a beam alone is on its stop
    "restitution": 1.0,
    "elasticity": "given",  # or "plastic", "elastic", whatever the restitution
    "equilibrium": 0.0,  # Ψ in reaches
    "clearance": 0.0,  # of the tip above the spring at the start, in reaches
    "approach": "undeformed",
    "distributed_load": 0.0,  # these three over the force that moves their body by a reach
    "tip_load": 0.0,
    "external_force": 0.0,
    "direction": 1.0,  # of the loads
    "fidelity": "dynamic",
    "n_elements": 20,
    "element_degree": 1,
    "n_modes": 0,
    "integrator": "modal",
    "reduced_integration": False,
}

#: A share of the cells has none of what may be 0.
EXTREME = (
    Axis("coupling", COUPLINGS),
    Axis("bodies", (*("both",) * 6, "beam", "spring")),
    Axis("stiffness", (), 1.0, 3.6e10, log=True),
    Axis("speed", (), 1e-6, 1000.0, log=True),
    Axis("shear_ratio", (), 1e-6, 1e6, log=True),
    Axis("macro_step", (), 1e-6, 1000.0, log=True),
    Axis("steps", (), 100, 400, log=True),
    Axis("mass", (), 1e-6, 1e6, log=True),
    Axis("k1", (), 1e-8, 1e6, log=True),
    Axis("k2_kind", ("hardening", "hardening", "softening", "linear")),
    Axis("k2", (), 1e-6, 1e4, log=True),
    Axis("escape", (), 0.3, 30.0, log=True),
    Axis("depth", (), 1e-6, 10.0, log=True),
    Axis("exponent", (), 1.0, 5.0),
    Axis("contact_damping", (), 0.001, 1000.0, log=True, zero=0.5),
    Axis("alpha_b", (), 1e-9, 10.0, log=True, zero=0.4),
    Axis("alpha_s", (), 1e-6, 100.0, log=True, zero=0.4),
    Axis("stop_depth", (), 1e-9, 1.0, log=True, zero=0.2),
    Axis("restitution", (), 0.0, 1.0),
    Axis("elasticity", ("given", "plastic", "elastic")),
    Axis("equilibrium", (), -1.0, 1.0),
    Axis("clearance", (), 1e-9, 1.0, log=True, zero=0.6),
    Axis("approach", ("undeformed", "elastic")),
    Axis("distributed_load", (), 0.001, 10.0, log=True, zero=0.6),
    Axis("external_force", (), 0.001, 10.0, log=True, zero=0.6),
    Axis("direction", (-1.0, 1.0)),
    Axis("fidelity", (*("dynamic",) * 4, "quasi_static")),
    Axis("n_elements", (1, 2, 5, 10, 20, 50)),
    Axis("element_degree", (1, 1, 1, 2, 5, 12)),
    Axis("n_modes", (0, 0, 1, 4)),
    Axis("integrator", (*("modal",) * 3, "midpoint")),
    Axis("reduced_integration", (False, True)),
)
#: A macro step is a hundredth of the shortest one of the bodies' own periods: what a user might take.
USUAL = (
    Axis("coupling", tuple((law, *RIGID[2]) for law in (*("transmission",) * 4, *("compliance",) * 2, "tie", "link"))),
    Axis("bodies", (*("both",) * 8, "beam", "spring")),
    Axis("stiffness", (), 10.0, 1e8, log=True),
    Axis("length", (), 0.2, 2.0, log=True),
    Axis("density", (), 0.1, 100.0, log=True),
    Axis("speed", (), 0.1, 3.0, log=True),
    Axis("shear_ratio", (), 30.0, 1500.0, log=True),
    Axis("gyration", (), 0.014, 0.1, log=True),
    Axis("macro_step", (2.0 * pi / 100.0,)),
    Axis("steps", (), 40, 400, log=True),
    Axis("mass", (), 0.01, 1.0, log=True),
    Axis("k1", (), 0.2, 20.0, log=True),
    Axis("k2_kind", (*("hardening",) * 4, "linear")),
    Axis("k2", (), 0.05, 2.0, log=True),
    Axis("depth", (), 0.02, 0.2, log=True),
    Axis("exponent", (1.0, 1.5, 2.0, 3.0)),
    Axis("contact_damping", (), 0.01, 1.0, log=True, zero=0.5),
    Axis("alpha_b", (), 1e-4, 0.03, log=True, zero=0.6),
    Axis("alpha_s", (), 0.01, 0.3, log=True, zero=0.5),
    Axis("stop_depth", (), 0.1, 0.8, log=True, zero=0.65),
    Axis("restitution", (), 0.2, 0.95),
    Axis("elasticity", ("given", "elastic")),
    Axis("clearance", (), 0.05, 0.5, log=True, zero=0.7),
    Axis("approach", ("elastic",)),
    Axis("distributed_load", (), 0.1, 0.5, log=True, zero=0.7),
    Axis("tip_load", (), 0.1, 0.5, log=True, zero=0.8),
    Axis("external_force", (), 0.1, 0.5, log=True, zero=0.7),
    Axis("direction", (-1.0, 1.0)),
    Axis("n_elements", tuple(range(5, 31))),
    Axis("n_modes", (*(0,) * 4, 2, 4, 8)),
    Axis("reduced_integration", (True,)),
)

#: Two axes over their ranges by the name of the slice, and what else is not at rest.
SLICES: dict[str, tuple[str, str, dict[str, Any]]] = {
    "energy 0": ("macro_step", "k1", {}),
    "energy 2": ("macro_step", "k1", {"coupling": ("transmission", "energy", 2)}),
    "energy 2, mass": ("macro_step", "mass", {"coupling": ("transmission", "energy", 2)}),
    "jacobi 0": ("macro_step", "depth", {"coupling": ("compliance", "jacobi", 0)}),
    "compliance energy": ("macro_step", "depth", {"coupling": ("compliance", "energy", 0)}),
    "compliance energy 2": ("macro_step", "depth", {"coupling": ("compliance", "energy", 2)}),
    "damped compliance energy 2": ("contact_damping", "depth", {"coupling": ("compliance", "energy", 2)}),
    "link energy 1": ("macro_step", "depth", {"coupling": ("link", "energy", 1)}),
    "tie energy 2": ("macro_step", "mass", {"coupling": ("tie", "energy", 2)}),
    "compliance exponents": ("exponent", "depth", {"coupling": ("compliance", "energy", 0)}),
    "hardening": ("k2", "k1", {"k2_kind": "hardening", "coupling": ("transmission", "energy", 1)}),
    "shear": ("shear_ratio", "alpha_b", {"coupling": ("transmission", "energy", 1)}),
    "stop": ("stop_depth", "restitution", {"coupling": ("transmission", "energy", 2), "alpha_s": 0.1}),
    "quasi-static": ("macro_step", "k1", {"fidelity": "quasi_static", "external_force": 1.0}),
}


def drawn(axes: Sequence[Axis], count: int, seed: int) -> list[dict[str, Any]]:
    """Return a Latin hypercube of ``count`` cells over a range."""
    names = [axis.name for axis in axes]
    found = design(axes, count, seed, "latin_hypercube") if count else []
    return [{**AT_REST, **dict(zip(names, values, strict=True))} for values in found]


def slice_cells(resolution: int) -> list[dict[str, Any]]:
    """Return ``resolution``² cells of each of `SLICES`, both ends of the ranges included; ``slice`` names it."""
    grids = {axis.name: axis.grid(resolution) for axis in EXTREME if axis.low != axis.high} if resolution else {}
    return [
        {**AT_REST, **fixed, "slice": name, across: x, up: y}
        for name, (across, up, fixed) in SLICES.items()
        for x in grids.get(across, ())
        for y in grids.get(up, ())
    ]


def scene_dict(cell: dict[str, Any]) -> dict[str, Any]:
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
    scene: dict[str, Any] = {
        "coupling": {"scheme": scheme, "degree": degree, "macro_step": H},
        "time": {"t_end": steps * H + (0.0 if elastic or not with_beam else clearance / speed)},
        "contact": {"law": law},
    }
    if law == "compliance":
        q = cell["exponent"]
        stiffness = (tip_stiffness + k1) * reach / (cell["depth"] * reach) ** q
        scene["contact"] |= {"stiffness": stiffness, "exponent": q, "damping": damping / speed}
    if law == "link":
        resistance = damping * sqrt((mass + tip_mass) * (k1 + tip_stiffness))
        scene["contact"] |= {"stiffness": (tip_stiffness + k1) / cell["depth"], "damping": resistance}
    if with_beam:
        scene["beam"] = {
            **beam.model_dump(exclude_unset=True),
            "alpha_b": 2.0 * cell["alpha_b"] / slowest_frequency(beam),
            "integrator": cell["integrator"] if degree == 0 else "modal",  # the midpoint rule sees the mean of a force
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


def _beam(cell: dict[str, Any]) -> Beam:
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


def _spring_frequency(mass: float, k1: float, k2: float, psi: float, energy: float, load: float) -> float:
    """Return an upper estimate [rad/s], at the deflection that takes all the energy and bears the loads."""
    linear = sqrt(2.0 * energy / k1) + 2.0 * load / k1
    cubic = (4.0 * energy / k2) ** 0.25 + 2.0 * (load / k2) ** (1.0 / 3.0) if k2 > 0.0 else inf
    y = psi + min(linear, cubic)
    return sqrt((k1 + 3.0 * k2 * y**2) / mass)
