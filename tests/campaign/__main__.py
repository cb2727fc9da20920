"""Run random scenes of all kinds and judge each run by the event-driven reference:  ./build.sh campaign [--seed S]…

Every verdict is a line of the results file as soon as it is known, and a scene that is there is not run again. With
--write the table goes into docs/measured.md.
"""

import argparse
import json
import os
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from functools import partial
from multiprocessing import get_context
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is imported: its threads spin in anybody's time

import numpy as np
from draw import KINDS
from judge import WAYS, Verdict, judge

sys.path.append(str(Path(__file__).parents[2] / "docs"))
from pages import table, write_section

HEAD = ("", "judged", "wrong, warned", "wrong, unwarned (twice as far)", "right, warned", "stopped, refused", "doSteps")


def read(path):
    if not path.exists():
        return []
    return [Verdict(**json.loads(line)) for line in path.read_text(encoding="utf-8").splitlines()]


def row(name, group):
    judged = [v for v in group if v.judged]
    wrong = [v for v in judged if v.factor > 1.0]
    silent = [v for v in wrong if v.silent]
    failed = [v for v in group if v.outcome in ("stopped", "refused")]
    calls = f"{np.median([v.calls for v in judged]):.0f}" if judged else "–"
    counts = [len(wrong) - len(silent), f"{len(silent)} ({sum(v.factor > 2.0 for v in silent)})"]
    return [name, *map(str, (len(judged), *counts, sum(v.told for v in judged) - counts[0], len(failed))), calls]


def lines(verdicts):
    """Return the table: a line for each way, and for each kind of scene at fixed steps."""
    fixed = [v for v in verdicts if "accuracy" not in v.way]
    rows = [row(way, [v for v in verdicts if v.way == way]) for way in WAYS]
    rows += [row(f"{kind}, fixed steps", [v for v in fixed if v.kind == kind]) for kind in KINDS]
    return table(HEAD, [cells for cells in rows if any(cell not in ("0", "0 (0)", "–") for cell in cells[1:])])


def worst(verdicts):
    silent = sorted((v for v in verdicts if v.silent), key=lambda v: -v.factor)
    return [
        f"{v.seed}/{v.number} {v.kind}, {v.way}: {v.factor:.1f} times (motion {v.motion:.1e}, times {v.time:.1e}, "
        f"impulses {v.impulse:.1e}), condition {v.condition:.1f}"
        for v in silent
    ]


def main():
    parser = argparse.ArgumentParser(prog="./build.sh campaign", description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1, help="other seeds draw other scenes")
    parser.add_argument("--scenes", type=int, default=20, help="how many of them")
    parser.add_argument("--kind", choices=KINDS, help="only scenes of this kind")
    parser.add_argument("--way", action="append", choices=list(WAYS), help="only runs of this way; repeatable")
    parser.add_argument("--processes", type=int, default=1)
    parser.add_argument("--results", type=Path, default=Path("results/campaign.jsonl"))
    parser.add_argument("--write", action="store_true", help="write the table into docs/measured.md")
    options = parser.parse_args()
    known = {(v.seed, v.number, v.way) for v in read(options.results)}
    todo = []
    for number in range(options.scenes):
        ways = [w for w in options.way or WAYS if (options.seed, number, w) not in known]
        if ways and options.kind in (None, KINDS[number % len(KINDS)]):
            todo.append((number, ways))
    options.results.parent.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(options.processes, get_context("spawn")) as pool, options.results.open("a") as file:
        for done, found in enumerate(pool.map(partial(judge, options.seed), *zip(*todo, strict=True)), 1):
            file.writelines(json.dumps(asdict(v)) + "\n" for v in found)
            file.flush()
            print(f"{done}/{len(todo)}", *worst(found), sep="\n  ", flush=True)
    verdicts = read(options.results)
    print(*lines(verdicts), "", *worst(verdicts), sep="\n")
    if options.write:
        write_section("measured.md", "campaign", lines(verdicts))


if __name__ == "__main__":
    main()
