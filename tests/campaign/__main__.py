"""Run random scenes and judge each run:  ./build.sh campaign [--seed S]…

Scenes of usual kinds run in several settings; with --extreme, scenes from the whole range of parameters run once; with
--kinds, a mass on a spring runs above bodies of every kind. Each scene is kept in the results when its runs are judged,
and the same command goes on with what is missing. Runs that are wrong and do not warn are written there as scenes. With
--write the tables go into docs/measured.md, that of accuracies alone into a block of its own.
"""

import argparse
import os
import sys
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is imported: its threads spin in anybody's time
sys.path.append(str(Path(__file__).parents[2] / "docs"))
sys.path.append(str(Path(__file__).parents[1] / "system"))

from campaign import SETTINGS, Campaign, is_silent
from grid import Grid
from kinds import Kinds
from pages import write_section

from springbeam.studies.study import Records


def report(record):
    runs = [record] if "kind" in record else record.values()
    print(*(f"{run['kind']:.5}{'!' if is_silent(run) else ''}" for run in runs), flush=True)


def main():
    parser = argparse.ArgumentParser(prog="./build.sh campaign", description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1, help="other seeds draw other scenes")
    parser.add_argument("--scenes", type=int, default=20, help="how many of them")
    parser.add_argument("--setting", action="append", choices=list(SETTINGS), help="only runs with it; repeatable")
    parser.add_argument("--extreme", action="store_true", help="scenes from the whole range, and slices through it")
    parser.add_argument("--kinds", action="store_true", help="bodies of every kind below a mass on a spring")
    parser.add_argument("--resolution", type=int, default=0, help="values of each parameter of a slice; 0: no slices")
    parser.add_argument("--workers", type=int, default=0, help="processes; 0: this one")
    parser.add_argument("--out", type=Path, help="directory of the results; default: results/campaign or …/extreme")
    parser.add_argument("--write", action="store_true", help="write the tables into docs/measured.md")
    options = parser.parse_args()
    study = Campaign(seed=options.seed, samples=options.scenes, names=options.setting or tuple(SETTINGS))
    section = "accuracies" if all(name.startswith("accuracy") for name in study.names) else "campaign"
    if options.extreme:
        study = Grid(seed=options.seed, samples=options.scenes, resolution=options.resolution)
        section = "extremes"
    if options.kinds:
        study = Kinds(seed=options.seed, samples=options.scenes)
        section = "kinds"
    out = options.out or Path("results") / study.kind
    with Records(study, out) as records:
        found = study.findings(study.computed(records, options.workers, report=report))
    found.written(out, pictures=False)
    print(*found.shown, sep="\n")
    if options.write:
        write_section("measured.md", section, found.shown[: -len(found.texts) - 1])
    return found.code


if __name__ == "__main__":
    sys.exit(main())
