"""The campaign of bodies of every kind below a mass on a spring.

Elements, bodies of the caller and FMUs of others have no event-driven reference: that of all runs of a scene has our
own spring, in steps of H/16.
"""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import ClassVar

import numpy as np
import oscillator
from campaign import HEAD, Campaign, row
from draw import KINDS, drawn
from judge import WRONG, ended
from pages import table

from springbeam import RunStopped, SpringDamper, simulate, with_changes
from springbeam.results.distance import distance
from springbeam.run.companion import LONGER
from springbeam.scene import scene_from_dict
from springbeam.studies.tables import Findings

OWN = "our own"
OF_THE_CALLER = "the caller's"
#: Keys that a scene leaves out for an FMU without abilities.
LACKS = ("velocity", "integral", "integral_2")


def below(cell, fmu):
    """Return the tables of the lower body of a cell by its kind: the same oscillator."""
    mass = cell["mass"]
    k = cell["k"]
    of_others = {**oscillator.ALL, "fmu": fmu, "force_sign": -1, "parameters": {"m": mass, "k": k, "c": 0.0}}
    own = {"mass": mass, "linear_stiffness": k}
    return {
        OWN: own,
        "an element": {"element": "spring_damper", "mass": mass, "stiffness": k},
        OF_THE_CALLER: own,
        "an FMU of others": of_others,
        "an FMU without abilities": {name: value for name, value in of_others.items() if name not in LACKS},
    }


def scene_of(cell, lower):
    """Return the scene of a cell, in steps of a share of its shortest period."""
    rigid = cell["law"] == "tie"
    upper = {"mass": cell["upper_mass"], "stiffness": cell["upper_k"], "damping": cell["damping"]}
    squares = [upper["stiffness"] / upper["mass"], cell["k"] / cell["mass"]]
    joint = 0.0 if rigid else cell["stiffness"] * (1.0 / upper["mass"] + 1.0 / cell["mass"])
    H = 2.0 * np.pi / np.sqrt(max(*squares, joint)) / cell["steps_per_period"]
    contact = {"law": cell["law"]} | ({} if rigid else {"stiffness": cell["stiffness"]})
    if cell["law"] == "compliance":
        contact["exponent"] = cell["exponent"]
    start = {"displacement": 0.0 if rigid else 0.01, "velocity": -cell["speed"]}
    return scene_from_dict(
        {
            "time": {"t_end": float(min(2.0 * np.pi / np.sqrt(min(squares)), 400.0 * H))},
            "beam": {"element": "spring_damper", **upper, **start},
            "spring": lower,
            "contact": contact,
            "coupling": {"macro_step": float(H)},
        }
    )


def judged(scene, fine, **bodies):
    """Return the record of a run, as of `judge.ended`; one that is not judged warns."""
    try:
        run = simulate(scene, **bodies)
    except RunStopped as stopped:
        return ended("stopped", str(stopped))
    factor = distance(run, fine, LONGER * scene.coupling.H).motion / WRONG
    return ended("done") | {"factor": factor, "warns": not run.summary["resolved"], "do_steps": run.do_steps}


class Kinds(Campaign):
    """Scenes of the range `KINDS`. A case is a scene; its record has a run for each kind of body below."""

    kind: ClassVar[str] = "kinds"
    parallel: ClassVar[bool] = False
    names: tuple[str, ...] = tuple(below(dict.fromkeys(("mass", "k"), 1.0), ""))

    def cases(self):
        return {f"{self.seed}-{number}": cell for number, cell in enumerate(drawn(KINDS, self.samples, self.seed))}

    def record(self, case):
        with TemporaryDirectory() as folder:
            lower = below(case, str(oscillator.made(Path(folder) / "oscillator.fmu")))
            own = scene_of(case, lower[OWN])
            fine = simulate(with_changes(own, coupling={"macro_step": own.coupling.H / 16.0}), check=False)
            of_the_caller = {"lower": SpringDamper(case["mass"], case["k"])}
            return {
                kind: judged(scene_of(case, tables), fine, **(of_the_caller if kind == OF_THE_CALLER else {}))
                for kind, tables in lower.items()
            }

    def findings(self, records):
        rows = [row(kind, [record[kind] for record in records.values()]) for kind in self.names]
        return Findings({}, [*table(("below", *HEAD[1:]), rows), ""])
