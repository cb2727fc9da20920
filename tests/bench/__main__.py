"""Measures, and writes the table into docs/performance.md: ./build.sh bench [--quick] [GROUP]…

The rows of groups that are not named stay as they are in the page.
"""

import argparse
import os
import platform
import re
import sys
from pathlib import Path

# Before numpy is imported. Its threads spin while they have nothing to do, in processor time that is anybody's.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import command_line
import fmus
import master
import sweeps
from measure import Effort

sys.path.append(str(Path(__file__).parents[2] / "docs"))
from pages import table, write_section

GROUPS = {
    "cli": command_line.commands,
    "beam": fmus.beam,
    "spring": fmus.spring,
    "master": master.master,
    "paper": master.paper,
    "sweep": sweeps.throughput,
}
PAGE = "performance.md"
HEAD = ("what", "goal", "measured: median (smallest – largest)", "beside it")


def cells(row):
    met = {True: ", met", False: ", **missed**", None: ""}[row.met]
    return row.what, f"{row.goal}{met}", row.measured, row.against


def machine():
    model = re.search(r"^model name\s*:\s*(.*)$", Path("/proc/cpuinfo").read_text(), re.M)
    return f"{model[1] if model else platform.processor()}, {os.cpu_count()} cores, Python {platform.python_version()}"


def main():
    parser = argparse.ArgumentParser(prog="./build.sh bench", description="Measure, and write docs/performance.md.")
    parser.add_argument("group", nargs="*", help=f"what to measure: {', '.join(GROUPS)}; default all")
    parser.add_argument("--quick", action="store_true", help="only see that everything runs; nothing is written")
    parser.add_argument("--rounds", type=int, default=Effort.rounds, help="how often each pair is timed")
    options = parser.parse_args()
    if unknown := set(options.group) - set(GROUPS):
        parser.error(f"{', '.join(sorted(unknown))}: not one of {', '.join(GROUPS)}")
    effort = Effort(2, quick=True) if options.quick else Effort(options.rounds)
    for name in options.group or GROUPS:
        rows = []
        for row in GROUPS[name](effort):
            print(
                f"{row.what}\n    goal {row.goal or '–'}; measured {row.measured}; met {row.met}\n    {row.against}",
                flush=True,
            )
            rows.append(cells(row))
        if not effort.quick:
            write_section(PAGE, name, table(HEAD, rows))
            write_section(PAGE, "machine", [machine()])


if __name__ == "__main__":
    main()
