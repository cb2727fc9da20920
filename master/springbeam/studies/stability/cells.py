"""The extreme scenes of the grid: a Latin hypercube over all parameters at once, and slices through two of them.

The hypercube is seeded, stratified and in log space. A slice takes two parameters over their whole ranges, the others
at rest. Every cell is a scene of its own; the same seed gives the same cells.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ...scene import Beam
from ...scene.laws import LAWS
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

#: What varies, over its range; a share of the cells has none of what may be 0.
PARAMETERS = (
    Axis("coupling", COUPLINGS),
    Axis("stiffness", (), 1.0, 3.6e10, log=True),  # √(EI·KAG)
    Axis("shear_ratio", (), 1e-6, 1e6, log=True),  # KAG/EI
    Axis("macro_step", (), 1e-6, 0.1, log=True),
    Axis("mass", (), 1e-6, 1e6, log=True),
    Axis("k1", (), 0.01, 1e6, log=True),
    Axis("k2_kind", ("hardening", "hardening", "softening", "linear")),
    Axis("k2", (), 0.01, 1e8, log=True),
    # The hilltop of the softening spring over the deflection that takes the beam's energy.
    Axis("escape", (), 0.3, 30.0, log=True),
    Axis("contact_stiffness", (), 1.0, 1e12, log=True),
    Axis("exponent", (), 1.0, 5.0),
    Axis("contact_damping", (), 0.001, 1000.0, log=True, zero=0.5),
    Axis("alpha_b", (), 1e-9, 1.0, log=True, zero=0.4),
    Axis("alpha_s", (), 0.001, 1000.0, log=True, zero=0.4),
    Axis("speed", (), 1e-6, 1000.0, log=True),
    Axis("restitution", (), 0.0, 1.0),
    Axis("elasticity", ("given", "plastic", "elastic")),
    Axis("stop_depth", (), 1e-12, 0.1, log=True, zero=0.2),  # Ψ − φ; 0: no stop
    Axis("equilibrium", (), -0.1, 0.1),
    Axis("clearance", (), 1e-9, 0.1, log=True, zero=0.6),  # tip above the spring at the start
    Axis("approach", ("undeformed", "elastic")),
    Axis("bodies", ("both", "both", "both", "both", "both", "both", "beam", "spring")),
    Axis("fidelity", ("dynamic", "dynamic", "dynamic", "dynamic", "quasi_static")),
    Axis("n_elements", (1, 2, 5, 10, 20, 50)),
    Axis("element_degree", (1, 1, 1, 2, 5, 12)),
    Axis("n_modes", (0, 0, 1, 4)),
    Axis("integrator", ("modal", "modal", "modal", "midpoint")),
    Axis("reduced_integration", (False, True)),
    Axis("distributed_load", (), 0.001, 1000.0, log=True, zero=0.6),
    Axis("external_force", (), 0.001, 1000.0, log=True, zero=0.6),
    Axis("steps", (), 100, 400, log=True),
)
#: Where slices leave it: the scene ``soft``, coarser.
AT_REST: dict[str, Any] = {
    "coupling": ("transmission", "energy", 0),
    "stiffness": 100.0,
    "shear_ratio": 1.0,
    "macro_step": 0.001,
    "mass": 1.0,
    "k1": 3.0,
    "k2_kind": "softening",
    "k2": 1.0,
    "escape": 6.7,
    "contact_stiffness": 10000.0,
    "exponent": 1.5,
    "contact_damping": 0.0,
    "alpha_b": 0.0,
    "alpha_s": 0.0,
    "speed": 1.0,
    "restitution": 1.0,
    "elasticity": "given",
    "stop_depth": 0.015,
    "equilibrium": 0.0,
    "clearance": 0.0,
    "approach": "undeformed",
    "bodies": "both",
    "fidelity": "dynamic",
    "n_elements": 20,
    "element_degree": 1,
    "n_modes": 0,
    "integrator": "modal",
    "reduced_integration": False,
    "distributed_load": 0.0,
    "external_force": 0.0,
    "steps": 200,
}
#: Axes of the keys of ``[contact]``; a law takes those that it has.
_CONTACT = {"stiffness": "contact_stiffness", "exponent": "exponent", "damping": "contact_damping"}


#: Of the axes that slices have; others are numbers.
UNITS = {
    "macro_step": "s", "stiffness": "N", "mass": "kg", "k2": "N/m³", "contact_stiffness": "N/mᵖ",
    "contact_damping": "s/m", "alpha_b": "s", "speed": "m/s", "stop_depth": "m",
}  # fmt: skip
#: Two axes over their ranges by the name of the slice, and what else is not at rest.
SLICES: dict[str, tuple[str, str, dict[str, Any]]] = {
    "energy 0": ("macro_step", "stiffness", {}),
    "energy 2": ("macro_step", "stiffness", {"coupling": ("transmission", "energy", 2)}),
    "energy 2, mass": ("macro_step", "mass", {"coupling": ("transmission", "energy", 2)}),
    "jacobi 0": ("macro_step", "contact_stiffness", {"coupling": ("compliance", "jacobi", 0)}),
    "compliance energy": ("macro_step", "contact_stiffness", {"coupling": ("compliance", "energy", 0)}),
    "compliance energy 2": ("macro_step", "contact_stiffness", {"coupling": ("compliance", "energy", 2)}),
    "damped compliance energy 2": (
        "contact_damping",
        "contact_stiffness",
        {"coupling": ("compliance", "energy", 2)},
    ),
    "link energy 1": ("macro_step", "contact_stiffness", {"coupling": ("link", "energy", 1)}),
    "tie energy 2": ("macro_step", "mass", {"coupling": ("tie", "energy", 2)}),
    "compliance exponents": ("exponent", "contact_stiffness", {"coupling": ("compliance", "energy", 0)}),
    "hardening": ("speed", "k2", {"k2_kind": "hardening", "coupling": ("transmission", "energy", 1)}),
    "shear": ("shear_ratio", "alpha_b", {"coupling": ("transmission", "energy", 1)}),
    "stop": ("stop_depth", "restitution", {"coupling": ("transmission", "energy", 2), "alpha_s": 0.1}),
    "quasi-static": ("macro_step", "stiffness", {"fidelity": "quasi_static", "external_force": 1.0}),
}


def sampled_cells(count: int, seed: int) -> list[dict[str, Any]]:
    """Return a Latin hypercube of ``count`` cells over all `PARAMETERS`."""
    found = design(PARAMETERS, count, seed, "latin_hypercube") if count else []
    return [{"slice": "", **dict(zip(AT_REST, values, strict=True))} for values in found]


def slice_cells(resolution: int) -> list[dict[str, Any]]:
    """Return ``resolution``² cells of each of `SLICES`, both ends of the ranges included."""
    grids = {axis.name: axis.grid(resolution) for axis in PARAMETERS if axis.low != axis.high} if resolution else {}
    return [
        {"slice": name, **AT_REST, **fixed, across: x, up: y}
        for name, (across, up, fixed) in SLICES.items()
        for x in grids.get(across, ())
        for y in grids.get(up, ())
    ]


def _spring_frequency(cell: dict[str, Any], k1: float, k2: float) -> float:
    """Return an upper estimate [rad/s], at the deflection that takes all the energy and bears the loads."""
    if cell["bodies"] == "spring":
        energy = 0.5 * cell["mass"] * cell["speed"] ** 2
    else:
        energy = cell["speed"] ** 2 / 6.0
        # Of the shear of u = s x, θ = 0: at the start, or where the undeformed beam first touches.
        slope = cell["equilibrium"] + (cell["clearance"] if cell["approach"] == "elastic" else 0.0)
        energy += 0.5 * cell["stiffness"] * np.sqrt(cell["shear_ratio"]) * slope**2
    load = cell["external_force"] + cell["distributed_load"]
    y = abs(cell["equilibrium"]) + min(np.sqrt(2.0 * energy / k1) + 2.0 * load / k1,
                                       (4.0 * energy / k2) ** 0.25 + 2.0 * (load / k2) ** (1.0 / 3.0))  # fmt: skip
    return float(np.sqrt((k1 + 3.0 * k2 * y * y) / cell["mass"]))


def scene_dict(cell: dict[str, Any]) -> dict[str, Any]:
    """Return the scene of a cell, as `springbeam.scene.scene_from_dict` takes it."""
    law, scheme, degree = cell["coupling"]
    H, speed, psi = cell["macro_step"], cell["speed"], cell["equilibrium"]
    steps = int(cell["steps"])
    k1 = cell["k1"]
    k2 = cell["k2"] if cell["k2_kind"] == "hardening" else 1e-30
    if cell["bodies"] != "beam":
        while (phase := _spring_frequency(cell, k1, k2) * H) > _MOST_PHASE_PER_STEP:
            k1, k2 = 0.5 * k1, 0.5 * k2
        steps = max(10, min(steps, int(_MOST_PHASE / phase)))
    restitution = {"given": cell["restitution"], "plastic": 0.0, "elastic": 1.0}[cell["elasticity"]]
    # The midpoint rule sees the mean of a force: degree 0 only.
    integrator = cell["integrator"] if degree == 0 else "modal"
    elastic = cell["approach"] == "elastic"
    clearance = cell["clearance"]
    if elastic:
        clearance = min(clearance, 0.1 * speed * steps * H)  # else most would never meet
    if LAWS[law].lasting:  # joined from the start, a tie by the impact
        clearance = 0.0
    # What takes the beam's kinetic energy v²/6.
    reach = abs(psi) + speed / np.sqrt(3.0 * k1)
    k2 = {"hardening": k2, "softening": -k1 / (cell["escape"] * reach) ** 2, "linear": 0.0}[cell["k2_kind"]]
    scene: dict[str, Any] = {
        "contact": {"law": law, **{key: cell[axis] for key, axis in _CONTACT.items() if key in LAWS[law].model_fields}},
        "coupling": {"scheme": scheme, "degree": degree, "macro_step": H},
        "time": {"t_end": steps * H + (0.0 if elastic or cell["bodies"] == "spring" else clearance / speed)},
    }
    if cell["bodies"] != "spring":
        root = float(np.sqrt(cell["shear_ratio"]))
        degree_of_elements = cell["element_degree"]
        n = max(1, cell["n_elements"] // degree_of_elements)
        scene["beam"] = {
            **Beam.ones(),
            "young_modulus": cell["stiffness"] / root,
            "shear_modulus": cell["stiffness"] * root,
            "alpha_b": cell["alpha_b"],
            "n_elements": n,
            "element_degree": degree_of_elements,
            "n_modes": min(cell["n_modes"], 2 * n * degree_of_elements),
            "reduced_integration": cell["reduced_integration"],
            "integrator": integrator,
            "distributed_load": -cell["distributed_load"],
            "initial_deflection_slope": psi + clearance,
            "initial_velocity_slope": -speed,
            "approach": cell["approach"],
            "fidelity": cell["fidelity"],
        }
    if cell["bodies"] != "beam":
        scene["spring"] = {
            "mass": cell["mass"],
            "damping": cell["alpha_s"],
            "linear_stiffness": k1,
            "cubic_stiffness": k2,
            "equilibrium": psi,
            "external_force": cell["external_force"],
            "initial_velocity": -speed if cell["bodies"] == "spring" else 0.0,
        }
    if cell["stop_depth"] > 0.0:
        height = psi if cell["bodies"] == "beam" else psi - cell["stop_depth"]
        scene["stop"] = {"position": height, "restitution": restitution}
    return scene
