"""The campaign: random scenes of usual kinds, each run in several settings and judged beside one reference."""

import statistics
from math import inf, sqrt
from typing import ClassVar

import tomli_w
from draw import USUAL, drawn, scene_dict
from judge import ERRORS, Reference, ended, judge
from pages import table

from springbeam import RunStopped, simulate
from springbeam.results.distance import distance
from springbeam.scene import SceneError, scene_from_dict, with_changes
from springbeam.studies.study import Study
from springbeam.studies.tables import Findings

#: What a scene is run with: an accuracy, or a degree and a share of its macro step.
SETTINGS = {
    "accuracy 1e-2": {"accuracy": 1e-2},
    "accuracy 1e-3": {"accuracy": 1e-3},
    "accuracy 1e-4": {"accuracy": 1e-4},
    "degree 0": {"degree": 0},
    "degree 1": {"degree": 1},
    "degree 2": {"degree": 2},
    "degree 0, H/4": {"degree": 0, "share": 0.25},
    "degree 2, H/4": {"degree": 2, "share": 0.25},
}
HEAD = (
    "",
    "compared",
    "wrong, warned",
    "wrong without a warning (by twice the bound)",
    "right, warned",
    "stopped, refused",
    "doSteps",
)
#: An accuracy is not asked to do with fewer steps.
FEWEST = 8.0
#: How many times as many steps the run has whose peak of a soft force is right.
FINER = 4.0


class Campaign(Study):
    """Scenes of the range `USUAL`. A case is a scene; its record has a run for each setting."""

    kind: ClassVar[str] = "campaign"
    parallel: ClassVar[bool] = True

    seed: int = 1
    samples: int = 20
    names: tuple[str, ...] = tuple(SETTINGS)

    def cases(self):
        return {f"{self.seed}-{number}": cell for number, cell in enumerate(drawn(USUAL, self.samples, self.seed))}

    def record(self, case):
        try:
            scene = scene_from_dict(scene_dict(dict(case)))
        except SceneError as error:
            return {name: ended("refused", str(error)) for name in self.names}
        reference = Reference(scene)
        return {name: judged(scene, name, reference) for name in self.names}

    def lost(self, cause):
        return {name: ended("stopped", cause) for name in self.names}

    def findings(self, records):
        """Return the table, what is silently wrong, and scenes of that."""
        cells = self.cases()
        runs = [
            {**run, "scene": scene, "setting": setting, "scene kind": kind_of(cells[scene])}
            for scene, record in records.items()
            for setting, run in record.items()
        ]
        silent = sorted(filter(is_silent, runs), key=lambda run: -run["factor"])
        shown = [f"{run['scene']} {run['setting']}: {run['factor']:.3g} times what it may be" for run in silent]
        texts = {
            f"{run['scene']}, {run['setting'].replace('/', ' over ')}.toml": found_scene(cells, run) for run in silent
        }
        return Findings({}, [*lines(runs), "", *shown], texts=texts)


def with_setting(scene, accuracy=None, degree=None, share=1.0):
    if accuracy is not None:
        return scene.model_copy(update={"accuracy": accuracy})
    return with_changes(scene, coupling={"degree": degree, "macro_step": share * scene.coupling.H})


def judged(scene, name, reference):
    """Judge a run with a setting; of an accuracy that is kept, say how many times fewer steps would do."""
    setting = SETTINGS[name]
    run = judge(with_setting(scene, **setting), reference)
    if "accuracy" in setting and run["factor"] is not None:
        run["steps_over_need"] = steps_over_need(scene, setting["accuracy"], run["H"], reference)
    return run


def steps_over_need(scene, accuracy, macro_step, reference):
    """Return by how much ``macro_step`` [s] can grow, in factors of √2, until a run is further off than ``accuracy``.

    The peak of a soft force is compared with that of a run in a quarter of ``macro_step``: the reference has none.
    """
    share = macro_step / scene.coupling.H
    allowed = scene.duration / FEWEST / macro_step
    fine = None if scene.contact.rigid else simulate(with_setting(scene, share=share / FINER))
    found = 1.0
    while found * sqrt(2.0) <= allowed:
        longer = with_setting(scene, share=found * sqrt(2.0) * share)
        run = judge(longer, reference)
        errors = [run[name] for name in ERRORS]
        if None in errors or max(errors) > accuracy or peak_error(longer, fine) > accuracy:
            break
        found *= sqrt(2.0)
    return found


def peak_error(scene, fine):
    """Return the error of the peak of a soft contact force beside that of a ``fine`` run; 0 without one."""
    if fine is None:
        return 0.0
    try:
        return distance(simulate(scene), fine, scene.coupling.H).force or 0.0
    except RunStopped:
        return inf


def kind_of(cell):
    """Return which bodies and law a cell has, in words."""
    if cell["bodies"] != "both":
        return f"{cell['bodies']} alone"
    return cell["coupling"][0] + (", stop" if cell["stop_depth"] else "")


def is_silent(run):
    return run["factor"] is not None and run["factor"] > 1.0 and not run["warns"]


def found_scene(cells, run):
    """Return a scene that runs wrong and does not warn, with its error in the first line."""
    scene = with_setting(scene_from_dict(scene_dict(cells[run["scene"]])), **SETTINGS[run["setting"]])
    text = tomli_w.dumps(scene.model_dump(exclude_unset=True, exclude_none=True))
    return f"# {run['setting']}: {run['factor']:.3g} times what it may be; {run['reason']}\n{text}"


def row(name, group):
    compared = [run for run in group if run["factor"] is not None]
    wrong = [run for run in compared if run["factor"] > 1.0]
    silent = [run for run in wrong if is_silent(run)]
    far = sum(run["factor"] > 2.0 for run in silent)
    needless = [run for run in compared if run["warns"] and run["factor"] <= 1.0]
    failed = [run for run in group if run["kind"] in ("stopped", "refused")]
    calls = f"{statistics.median(run['do_steps'] for run in compared):.0f}" if compared else "–"
    counts = (len(compared), len(wrong) - len(silent), f"{len(silent)} ({far})", len(needless), len(failed), calls)
    return [name, *map(str, counts)]


def lines(runs):
    """Return the table: a line for each setting, and for each kind of scene at fixed steps; and the steps' ratio."""
    fixed = [run for run in runs if "accuracy" not in run["setting"]]
    rows = [row(name, [run for run in runs if run["setting"] == name]) for name in SETTINGS]
    for kind in sorted({run["scene kind"] for run in fixed}):
        rows.append(row(f"{kind}, fixed steps", [run for run in fixed if run["scene kind"] == kind]))
    shown = table(HEAD, [cells for cells in rows if any(cell not in ("0", "0 (0)", "–") for cell in cells[1:])])
    for name in SETTINGS:
        ratios = [run["steps_over_need"] for run in runs if run["setting"] == name and "steps_over_need" in run]
        if ratios:
            median = statistics.median(ratios)
            shown += [
                "",
                f"{name} takes {median:.2g} times as many steps as would do (median), at most {max(ratios):.2g}.",
            ]
    return shown
