"""The tables and pictures of `master/springbeam/paper/README.md`:  .venv/bin/python docs/paper.py   (minutes)"""

from __future__ import annotations

from collections.abc import Callable

from pages import IMAGES, table, write_section  # beside this script

from springbeam import Trajectory, load_scene, simulate, with_changes
from springbeam.paper import beside
from springbeam.paper.figures import draw

PAGE = "../master/springbeam/paper/README.md"
TABLES: dict[str, Callable[[], beside.Rows]] = {
    "table-2": beside.table_2,
    "statements": beside.statements,
    "loads": beside.loads,
    "readings": beside.readings,
    "time-steps": beside.time_steps,
}


def treatments(number: int) -> dict[str, Trajectory]:
    """Return the four runs of a figure by name. The resolved one has a macro step below 1/ω of its fastest mode."""
    scene = load_scene(f"paper-fig{number}")
    resolved = with_changes(scene, time={"t_end": 0.5 + 4e-5}, coupling={"macro_step": 1.5e-8})
    return {
        "Algorithm 1, monolithic": beside.monolithic_run(number),
        "Algorithm 1, FMUs": beside.fmu_run(number),
        "transmission, aliased": simulate(scene),
        "transmission, resolved": simulate(resolved),
    }


def main() -> None:
    runs = {number: treatments(number) for number in beside.FIGURES}
    for number, named in runs.items():
        draw(number, named).savefig(IMAGES / f"paper-fig{number}.png", dpi=100)
    for name, (heads, rows) in {"treatments": beside.extremes(runs), **{k: f() for k, f in TABLES.items()}}.items():
        write_section(PAGE, name, table(heads, rows))


if __name__ == "__main__":
    main()
