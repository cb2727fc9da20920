"""Compare law `paper` through the FMUs with Algorithm 1 as one system."""

from __future__ import annotations

import numpy as np

from ...monolithic import algorithm1
from ...run.runner import simulate
from ...scene import Scene, with_changes
from .report import IDA_TOLERANCE, SAFETY, QuantityRow, Report


def crosscheck_paper(scene: Scene) -> Report:
    """Compare law `paper` with `algorithm1`, from which it differs by the spring's midpoint rule alone.

    With a = (ωh)² one midpoint step and the exact flow differ in the displacement by y a²/12 and h z a/12. Algorithm 1
    restarts the spring at every step, so this does not add up to a frequency shift; a stiffness 1/3 larger changes the
    step by y a/6 and h z a/12, at least as much, and running Algorithm 1 with it shows what IDA may change.
    """
    assert scene.spring is not None
    h, spring = scene.coupling.H, scene.spring
    reference = algorithm1.simulate(scene)
    ours = simulate(scene)
    factor = 4.0 / 3.0
    changed = {"linear_stiffness": factor * spring.linear_stiffness, "cubic_stiffness": factor * spring.cubic_stiffness}
    moved = algorithm1.simulate(with_changes(scene, spring=changed))
    n = min(len(reference), len(ours), len(moved))
    report = Report(scene, reference, ours, float(ours.time[n - 1]), 1.0)
    for name in ("u_tip", "y", "z", "v_tip", "contact_force", "e_beam", "e_spring"):
        q, exact = ours[name][:n], reference[name][:n]
        scale = float(np.abs(exact).max()) or 1.0
        steps = np.arange(1, n + 1)
        bound = SAFETY * np.maximum.accumulate(np.abs(moved[name][:n] - exact)) + IDA_TOLERANCE * steps * scale
        report.rows.append(QuantityRow.judged(name, ours.time[:n], np.abs(q - exact), bound))
    report.notes.append(
        f"bounds from Algorithm 1 with 4/3 of its stiffness: as much as the midpoint rule changes a step of {h:g} s"
    )
    return report
