"""Measures, and writes the table into docs/performance.md: ./build.sh bench [--quick] [GROUP]…

Groups are `rows.GROUPS`; the rows of groups that are not named stay as they are in the page.
"""

from __future__ import annotations

import argparse
import os
import platform
import re
from pathlib import Path

# Before numpy is imported. Its threads spin while they have nothing to do, in processor time that is anybody's.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from rows import GROUPS, Effort, Row

PAGE = Path(__file__).parents[2] / "docs" / "performance.md"
HEAD = "| | what | goal | measured: median (smallest – largest) | met | beside it |\n|---|---|---|---|---|---|\n"


def section(text: str, name: str, content: str) -> str:
    """``text`` with ``content`` between the marks of ``name``."""
    begin, end = f"<!-- {name} -->\n", f"<!-- end {name} -->"
    if begin not in text or end not in text:
        raise SystemExit(f"{PAGE}: no place for {name}")
    before, rest = text.split(begin, 1)
    return before + begin + content + end + rest.split(end, 1)[1]


def line(row: Row) -> str:
    met = {True: "yes", False: "**no**", None: "–"}[row.met]
    return f"| {row.group} | {row.what} | {row.goal or '–'} | {row.measured} | {met} | {row.against} |\n"


def machine() -> str:
    model = re.search(r"^model name\s*:\s*(.*)$", Path("/proc/cpuinfo").read_text(), re.M)
    return f"{model[1] if model else platform.processor()}, {os.cpu_count()} cores, Python {platform.python_version()}"


def main() -> None:
    parser = argparse.ArgumentParser(prog="./build.sh bench", description="Measure, and write docs/performance.md.")
    parser.add_argument("group", nargs="*", help=f"what to measure: {', '.join(GROUPS)}; default all")
    parser.add_argument("--quick", action="store_true", help="only see that everything runs; nothing is written")
    parser.add_argument("--rounds", type=int, default=Effort.rounds, help="how often each pair is timed")
    options = parser.parse_args()
    if unknown := set(options.group) - set(GROUPS):
        parser.error(f"{', '.join(sorted(unknown))}: not one of {', '.join(GROUPS)}")
    effort = Effort(2, quick=True) if options.quick else Effort(options.rounds)
    for name in options.group or GROUPS:
        content = ""
        for row in GROUPS[name](effort):
            print(
                f"{row.group} {row.what}\n    goal {row.goal or '–'}; measured {row.measured}; met {row.met}"
                f"\n    {row.against}",
                flush=True,
            )
            content += line(row)
        if not effort.quick:
            text = section(PAGE.read_text(encoding="utf-8"), name, HEAD + content)
            PAGE.write_text(section(text, "machine", f"{machine()}\n"), encoding="utf-8")


if __name__ == "__main__":
    main()
