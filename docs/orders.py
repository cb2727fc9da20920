"""Errors in the macro step on `soft`, before any event and through three:  .venv/bin/python docs/orders.py   (a minute)

Writes three tables and the picture of docs/measured.md, "Orders", and a table of docs/coupling.md, "One velocity and
one force".
"""

from __future__ import annotations

from itertools import pairwise

import matplotlib.pyplot as plt
import numpy as np
from pages import IMAGES, shrink, table, write_section  # beside this script

from springbeam import load_scene, simulate, with_changes
from springbeam.bodies.force import value
from springbeam.monolithic import event_driven
from springbeam.results.records import FORCE_COLUMNS

DEGREES = (0, 1, 2)
STEPS = (2e-3, 1e-3, 5e-4, 2.5e-4, 1.25e-4)
#: Ends of the phases are events; so far from them rows of all runs are of the same phase [s].
PHASES = {
    "tied, before any event": (0.0, 0.0712),
    "tied, after foundation impact": (0.0712, 0.1444),
    "free flight": (0.1444, 0.2750),
    "touch after second meeting": (0.2750, 0.3190),
}
APART = 5e-3
#: Degrees and macro steps [s] of the errors of joined ends, and the macro step of what they are compared with.
JOINED, FINE = ((0, 1e-3), (0, 2.5e-4), (2, 4e-3), (2, 1e-3), (2, 5e-4)), 2.5e-5
#: Below are rounding and the tolerance of IDA: of y [m], of v_tip [m/s].
ROUNDING = 1e-13, 1e-10


def measured() -> dict[int, np.ndarray]:
    """Return the largest errors of y [m] and v_tip [m/s], shape (steps, phases, 2)."""
    soft = with_changes(load_scene("soft"), time={"t_end": 0.32})
    errors: dict[int, np.ndarray] = {}
    for degree in DEGREES:
        found = []
        for H in STEPS:
            run = simulate(with_changes(soft, coupling={"degree": degree, "macro_step": H}))
            reference = event_driven.integrate(soft, sample_times=run.time)
            at = np.searchsorted(reference.time, run.time)
            off = np.abs([run.y - reference.y[at], run.v_tip - reference.v_tip[at]])
            inside = [(run.time > a + APART) & (run.time < b - APART) for a, b in PHASES.values()]
            found.append([off[:, rows].max(axis=1) for rows in inside])
        errors[degree] = np.array(found)
    return errors


def orders(errors: np.ndarray) -> str:
    """Return the orders of y and v_tip from their errors in columns: means over halvings from 1 ms, above rounding."""
    means = []
    for column, least in zip(errors[1:].T, ROUNDING, strict=True):
        seen = [float(np.log2(a / b)) for a, b in pairwise(column) if b > least]
        means.append(f"{np.mean(seen):.1f}" if seen else "rounding")
    return ", ".join(means)


def rows(errors: dict[int, np.ndarray]) -> list[list[str]]:
    """Return orders, phase by phase."""
    return [[str(degree), *(orders(values[:, k]) for k in range(len(PHASES)))] for degree, values in errors.items()]


def late() -> list[list[str]]:
    """Return errors of the times of the first three events after the start [s], and energy residuals."""
    soft = with_changes(load_scene("soft"), time={"t_end": 0.28})
    exact = event_driven.integrate(soft)
    found = []
    for degree in DEGREES:
        for H in (1e-3, 2.5e-4):
            run = simulate(with_changes(soft, coupling={"degree": degree, "macro_step": H}))
            pairs = zip(run.events[1:4], exact.events[1:4], strict=True)
            times = [f"{abs(ours.time - theirs.time):.0e}" for ours, theirs in pairs]
            found.append([str(degree), f"{H:g}", *times, f"{run.summary['max_energy_residual']:.0e}"])
    return found


def each() -> list[list[str]]:
    """Return each event of `soft` with its time at H/16 and the errors of its time by degree [s]."""
    soft = load_scene("soft")
    H = soft.coupling.H
    fine = simulate(with_changes(soft, coupling={"degree": 2, "macro_step": H / 16.0})).events
    found = [
        [str(number), event.kind.value.replace("_", " "), f"{event.time:.6f}"] for number, event in enumerate(fine)
    ]
    for degree in DEGREES:
        run = simulate(with_changes(soft, coupling={"degree": degree}))
        assert [event.kind for event in run.events] == [event.kind for event in fine]
        for row, event, exact in zip(found, run.events, fine, strict=True):
            row.append(f"{abs(event.time - exact.time):.0e}")
    return found[1:]


def joined() -> list[list[str]]:
    """Return rms errors at the rows from 5 ms to the foundation: velocities [m/s], then forces [N]."""
    soft = with_changes(load_scene("soft"), time={"t_end": PHASES["tied, before any event"][1]})
    fine = simulate(with_changes(soft, coupling={"degree": 2, "macro_step": FINE}))
    found = []
    for degree, H in JOINED:
        run = simulate(with_changes(soft, coupling={"degree": degree, "macro_step": H}))
        rows = (run.time > APART) & (run.time < soft.time.t_end - FINE)
        steps, exact = run.steps[rows], fine.at(run.time[rows])
        force = value([steps[name] for name in FORCE_COLUMNS], steps["size"])
        of_ends = steps["v_tip"], run.v_tip[rows], force, run.contact_force[rows]
        beside = exact.v_tip, exact.v_tip, exact.contact_force, exact.contact_force
        off = [np.sqrt(np.mean((a - b) ** 2)) for a, b in zip(of_ends, beside, strict=True)]
        found.append([f"{degree}, {H:g}", *(f"{error:.0e}" for error in off)])
    return found


def picture(errors: dict[int, np.ndarray]) -> None:
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.8), sharey=True, layout="constrained")
    for ax, phase in zip(axes, ("tied, before any event", "touch after second meeting"), strict=True):
        k = list(PHASES).index(phase)
        for (degree, values), marker in zip(errors.items(), "os^", strict=True):
            ax.loglog(STEPS, values[:, k, 0], marker=marker, label=f"degree {degree}")
        ax.set(title=phase, xlabel="macro step H [ms]")
        ax.set_xticks(STEPS, [f"{1e3 * H:g}" for H in STEPS])
        ax.minorticks_off()
        ax.grid(visible=True, alpha=0.3)
    axes[0].set_ylabel("largest error of y [m]")
    axes[0].legend()
    figure.savefig(IMAGES / "orders.png", dpi=110)
    plt.close(figure)
    shrink(IMAGES / "orders.png")


def main() -> None:
    errors = measured()
    picture(errors)
    head = ["degree", *(f"{phase}: y, v" for phase in PHASES)]
    write_section("measured.md", "orders", table(head, rows(errors)))
    head = ["degree", "H [s]", "foundation impact [s]", "release [s]", "second meeting [s]", "energy residual"]
    write_section("measured.md", "events", table(head, late()))
    head = ["", "event", "time [s]", *(f"degree {degree} [s]" for degree in DEGREES)]
    write_section("measured.md", "changes", table(head, each()))
    head = ["degree, H [s]", "v_tip alone [m/s]", "common velocity", "end of the polynomial [N]", "multiplier"]
    write_section("coupling.md", "joined", table(head, joined()))


if __name__ == "__main__":
    main()
