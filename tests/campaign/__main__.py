"""Run random scenes of usual kinds in several settings and judge each run:  ./build.sh campaign [--seed S]…

Each scene is kept in the results when its runs are judged, and the same command goes on with what is missing. Runs that
are wrong and do not warn are written there as scenes. With --write the table goes into docs/measured.md, that of
accuracies alone into a block of its own.
"""

import argparse
import os
import sys
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is imported: its threads spin in anybody's time
sys.path.append(str(Path(__file__).parents[2] / "docs"))

from campaign import SETTINGS, Campaign, is_silent
from pages import write_section

from springbeam.studies.study import Records


def report(record):
    print(*(f"{run['kind']:.5}{'!' if is_silent(run) else ''}" for run in record.values()), flush=True)


def main():
    parser = argparse.ArgumentParser(prog="./build.sh campaign", description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1, help="other seeds draw other scenes")
    parser.add_argument("--scenes", type=int, default=20, help="how many of them")
    parser.add_argument("--setting", action="append", choices=list(SETTINGS), help="only runs with it; repeatable")
    parser.add_argument("--workers", type=int, default=0, help="processes; 0: this one")
    parser.add_argument("--out", type=Path, default=Path("results/campaign"))
    parser.add_argument("--write", action="store_true", help="write the table into docs/measured.md")
    options = parser.parse_args()
    campaign = Campaign(seed=options.seed, samples=options.scenes, names=options.setting or tuple(SETTINGS))
    with Records(campaign, options.out) as records:
        found = campaign.findings(campaign.computed(records, options.workers, report=report))
    found.written(options.out, pictures=False)
    print(*found.shown, sep="\n")
    if options.write:
        section = "accuracies" if all(name.startswith("accuracy") for name in campaign.names) else "campaign"
        write_section("measured.md", section, found.shown[: -len(found.texts) - 1])


if __name__ == "__main__":
    main()
