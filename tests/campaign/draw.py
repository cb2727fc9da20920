"""Random scenes of all kinds, by a seed and a number."""

from math import pi, sqrt

import numpy as np

from springbeam.scene import Beam, scene_from_dict
from springbeam.scene.resolution import slowest_frequency
from springbeam.scene.statics import tip_compliance, tip_inertia

#: Macro steps of the shortest one of the periods: what a user might take.
STEPS = 100
KINDS = (
    "pair",
    "damped pair",
    "pair of few modes",
    "pair with stop",
    "beam on stop",
    "compliance",
    "damped compliance",
    "tie",
    "link",
    "spring",
)


def drawn(seed, number):
    """Draw scene ``number`` of ``seed``. Motions are as large as the tip's speed and the lowest frequency make them.

    Its macro step is a hundredth of the shortest one of the bodies' own periods.
    """
    random, kind = np.random.default_rng([seed, number]), KINDS[number % len(KINDS)]

    def between(low, high):
        """Draw a number, evenly over the decades."""
        return float(f"{np.exp(random.uniform(np.log(low), np.log(high))):.4g}")

    def some(probability, value):
        return value if random.random() < probability else 0.0

    def signed(value):
        return value if random.random() < 0.5 else -value

    restitution = 1.0 if random.random() < 0.5 else between(0.2, 0.95)
    if kind == "spring":
        mass, stiffness, reach = between(0.01, 10.0), between(1.0, 1e4), between(1e-3, 0.5)
        omega = sqrt(stiffness / mass)
        tables = {
            "time": {"t_end": between(1.0, 5.0) * 2.0 * pi / omega},
            "spring": {
                "mass": mass, "linear_stiffness": stiffness, "equilibrium": reach,
                "cubic_stiffness": stiffness * between(0.05, 2.0) / reach**2,
                "damping": some(0.5, between(0.01, 0.3) * mass * omega),
                "external_force": some(0.5, signed(between(0.1, 0.5) * stiffness * reach)),
            },
            "coupling": {"macro_step": 2.0 * pi / omega / STEPS},
        }  # fmt: skip
        if random.random() < 0.5:
            tables["stop"] = {"position": -between(0.1, 0.8) * reach, "restitution": restitution}
        return scene_from_dict(tables)

    length, speed = between(0.2, 2.0), between(0.1, 3.0)
    thickness = length / between(3.0, 20.0)
    young, elements = between(1e5, 2e11), int(random.integers(5, 31))
    form = {
        "density": between(900.0, 8000.0), "area": thickness**2, "second_moment_of_area": thickness**4 / 12.0,
        "young_modulus": young, "shear_modulus": young / 2.6, "shear_coefficient": 5.0 / 6.0, "length": length,
        "n_elements": elements, "initial_velocity_slope": -speed / length, "reduced_integration": True,
    }  # fmt: skip
    beam = Beam(**form)
    omega, stiffness = slowest_frequency(beam), 1.0 / tip_compliance(beam)
    reach = speed / omega  # of the tip, m
    if kind == "damped pair" or random.random() < 0.3:
        form["alpha_b"] = 2.0 * between(1e-4, 3e-2) / omega
    if kind == "pair of few modes":
        form["n_modes"] = int(random.integers(2, 9))
    form["distributed_load"] = some(0.3, signed(between(0.1, 0.5) * stiffness * reach / length))
    form["tip_load_coefficient"] = some(0.2, signed(between(0.1, 0.5) * stiffness * reach * elements / length))
    if random.random() < 0.3:
        form["initial_deflection_slope"], form["approach"] = between(0.05, 0.5) * reach / length, "elastic"
    tables = {"time": {"t_end": between(0.3, 2.0) * 2.0 * pi / omega}, "beam": form}
    if kind == "beam on stop":
        tables["stop"] = {"position": 0.0, "restitution": restitution}
        tables["coupling"] = {"macro_step": 2.0 * pi / omega / STEPS}
        return scene_from_dict(tables)
    mass, k1 = between(0.05, 5.0) * tip_inertia(beam), between(0.2, 20.0) * stiffness
    reach = speed * sqrt((mass + tip_inertia(beam)) / (k1 + stiffness))
    tables["spring"] = {
        "mass": mass, "linear_stiffness": k1, "cubic_stiffness": k1 * between(0.05, 2.0) / reach**2,
        "damping": some(0.5, between(0.01, 0.3) * sqrt(mass * k1)),
        "external_force": some(0.3, signed(between(0.1, 0.5) * k1 * reach)),
    }  # fmt: skip
    if kind == "pair with stop" or random.random() < 0.2:
        tables["stop"] = {"position": -between(0.1, 0.8) * reach, "restitution": restitution}
    if "compliance" in kind:
        exponent, depth = float(random.choice([1.0, 1.5, 2.0, 3.0])), between(0.02, 0.2) * reach
        tables["contact"] = {
            "law": "compliance", "exponent": exponent, "stiffness": (k1 + stiffness) * reach / depth**exponent,
        }  # fmt: skip
        if "damped" in kind:
            tables["contact"]["damping"] = between(0.1, 1.0) / speed
    if kind == "tie":
        tables["contact"] = {"law": "tie"}
        form["initial_deflection_slope"] = 0.0
    if kind == "link":
        tables["contact"] = {
            "law": "link", "stiffness": (k1 + stiffness) * between(1.0, 100.0),
            "damping": some(0.5, between(0.01, 0.3) * sqrt(mass * (k1 + stiffness))),
        }  # fmt: skip
    tables["coupling"] = {"macro_step": 2.0 * pi / max(omega, sqrt(k1 / mass)) / STEPS}
    return scene_from_dict(tables)
