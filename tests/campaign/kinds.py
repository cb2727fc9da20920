"""Judge runs of bodies of every kind in both places:  .venv/bin/python tests/campaign/kinds.py [--seed S] [--write]

The reference of a run is one in steps of H/16 at degree 2: elements, functions of the caller and FMUs of others have no
other. Scenes are drawn from the ranges below; the macro step is a share of the shortest period.
"""

import argparse
import os
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.append(str(Path(__file__).parents[1] / "system"))
sys.path.append(str(Path(__file__).parents[2] / "docs"))

import numpy as np
import oscillator
from pages import table, write_section

from springbeam import RunStopped, SpringDamper, simulate, with_changes
from springbeam.results.distance import distance
from springbeam.run.companion import LONGER
from springbeam.scene import scene_from_dict

#: An end is wrong if it is further from the reference than this share of its range, as in `judge`.
WRONG = 0.01
LAWS = ("compliance", "link", "tie")
#: What takes the place of the spring.
BELOW = ("our own", "an element", "the caller's", "an FMU of others", "an FMU without abilities")
#: Keys that a scene leaves out for an FMU without abilities.
LACKS = ("velocity", "integral", "integral_2")


def drawn(random, fmu):
    """Return the tables of a scene for each kind of lower body, and what is its period over the macro step."""
    m1, m2 = random.uniform(0.5, 3.0, 2)
    k1, k2 = 10.0 ** random.uniform(1.0, 4.0, 2)
    law = random.choice(LAWS)
    stiff = 10.0 ** random.uniform(4.0, 6.0)
    fastest = np.sqrt(max(k1 / m1, k2 / m2, (1.0 / m1 + 1.0 / m2) * (0.0 if law == "tie" else stiff)))
    share = random.choice([15.0, 50.0, 200.0])
    upper = {"element": "spring_damper", "mass": m1, "stiffness": k1, "damping": random.choice([0.0, 0.5])}
    upper |= {"displacement": 0.0 if law == "tie" else 0.01, "velocity": -random.uniform(0.3, 2.0)}
    contact = {"law": law} | ({} if law == "tie" else {"stiffness": stiff})
    if law == "compliance":
        contact["exponent"] = float(random.choice([1.0, 1.5]))
    names = {"fmu": fmu, "force_sign": -1, "parameters": {"m": m2, "k": k2, "c": 0.0}}
    fewer = {name: of for name, of in oscillator.ALL.items() if name not in LACKS}
    below = {
        "our own": {"mass": m2, "linear_stiffness": k2},
        "an element": {"element": "spring_damper", "mass": m2, "stiffness": k2},
        "the caller's": {"mass": m2, "linear_stiffness": k2},
        "an FMU of others": {**oscillator.ALL, **names},
        "an FMU without abilities": {**fewer, **names},
    }
    slowest = 2.0 * np.pi / np.sqrt(min(k1 / m1, k2 / m2))
    H = 2.0 * np.pi / fastest / share
    time = {"t_end": float(min(slowest, 400.0 * H))}
    base = {"time": time, "beam": upper, "contact": contact, "coupling": {"macro_step": float(H)}}
    return {kind: {**base, "spring": lower} for kind, lower in below.items()}, (m2, k2)


def judged(kind, tables, own):
    """Return whether a run is wrong and whether it says so, and the steps of its companion over its own."""

    def made(scene, **options):
        lower = {"lower": SpringDamper(*own)} if kind == "the caller's" else {}
        return simulate(scene, **lower, **options)

    scene = scene_from_dict(tables)
    try:
        run = made(scene)
        H = scene.coupling.H
        # The reference has our own body: all of them are the same oscillator.
        fine = {**tables, "spring": {"mass": own[0], "linear_stiffness": own[1]}}
        exact = simulate(with_changes(scene_from_dict(fine), coupling={"macro_step": H / 16.0}), check=False)
    except RunStopped:
        return None
    return distance(run, exact, LONGER * H).motion > WRONG, run.summary["resolved"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--scenes", type=int, default=30)
    parser.add_argument("--write", action="store_true", help="write the table into docs/measured.md")
    options = parser.parse_args()
    random = np.random.default_rng(options.seed)
    found = {kind: [] for kind in BELOW}
    with tempfile.TemporaryDirectory() as folder:
        fmu = str(oscillator.made(Path(folder) / "oscillator.fmu"))
        for _ in range(options.scenes):
            kinds, own = drawn(random, fmu)
            for kind, tables in kinds.items():
                found[kind].append(judged(kind, tables, own))
    rows = []
    for kind, runs in found.items():
        done = [run for run in runs if run is not None]
        counts = (
            len(done),
            sum(wrong and resolved is False for wrong, resolved in done),
            sum(wrong and resolved is not False for wrong, resolved in done),
            sum(not wrong and resolved is False for wrong, resolved in done),
            sum(resolved is None for _, resolved in done),
            len(runs) - len(done),
        )
        rows.append((kind, *map(str, counts)))
    head = ("below", "compared", "wrong, warned", "wrong, unwarned", "right, warned", "not judged", "stopped")
    shown = table(head, rows)
    print(*shown, sep="\n")
    if options.write:
        write_section("measured.md", "kinds", shown)


if __name__ == "__main__":
    main()
