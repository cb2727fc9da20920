"""Over which time the force of a rigid contact is averaged before its peak is taken, and what the peak depends on."""

from __future__ import annotations

from math import inf, pi, sqrt

import numpy as np

from .stepping import Pair

#: Share of a period over which the contact force is averaged.
WINDOW = 0.02
#: Periods of the fastest wave of the mesh that a window must hold for the mean of a rigid force to be settled to 5 %.
SETTLED = 2.5
#: How every warning of a peak force begins.
PEAK_DOUBTED = "the peak contact force "


def force_window(pair: Pair, steps: np.ndarray, slowest: float) -> float:
    """Return over which time the contact force is averaged before its peak is taken [s].

    It is ``contact.force_window``, or `WINDOW` of a period: of our beam, by its ``slowest`` frequency [rad/s]; of
    another upper body; of both ends as one. Where none of these is known, or oscillates, it is that share of the run.
    """
    if pair.setup.force_window is not None:
        return pair.setup.force_window
    masses = [body.mass for body in pair.bodies]
    omega = slowest
    if omega == 0.0:
        known = [body.stiffness(steps[name]) for body, name in zip(pair.bodies, ("u_tip", "y"), strict=True)]
        upper, lower = (0.0 if k is None else float(np.max(k, initial=0.0)) for k in known)
        if upper > 0.0 and 0.0 < masses[0] < inf:
            omega = sqrt(upper / masses[0])
        elif 0.0 < sum(masses) < inf:
            omega = sqrt(max(upper + lower, 0.0) / sum(masses))
    return WINDOW * (2.0 * pi / omega if omega > 0.0 else pair.setup.end)


def depends_on_mesh(pair: Pair, window: float, fastest: float) -> str | None:
    """Return a warning that the peak of a rigid contact's force depends on the mesh, and the remedy; else ``None``.

    At a rigid impact the force at an instant grows with the mesh. Its mean over a ``window`` [s] settles where that is
    longer than `SETTLED` periods of the ``fastest`` wave kept [rad/s] (``docs/choose.md`` has the numbers).
    """
    meets = pair.setup.law is not None or pair.setup.floor is not None
    needed = SETTLED * 2.0 * pi / fastest if meets and fastest > 0.0 else 0.0
    if window >= needed:
        return None
    return (
        f"{PEAK_DOUBTED}depends on the mesh: it is a mean over {window:.2g} s, and the contact is rigid. "
        f"contact.force_window >= {1.05 * needed:.2g} s, more elements or more modes settle it"
    )
