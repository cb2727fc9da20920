"""Judge whether the steps of a run resolve its motion, and say which steps would.

``docs/coupling.md``, "Is the motion resolved?", says when a run is *not resolved*; the constants are its limits. The
setup, the bodies and the records answer; a body that is not known says so (`springbeam.run.observed.unknown`).
"""

from __future__ import annotations

from math import pi, sqrt

import numpy as np

from ..motion.paths import Path
from .stepping import Pair

#: Largest distance of an end from its position under the contact law, as a share of its motion, by degree of the force:
#: a soft law, a tie. The estimate leaves out the fastest waves and events that are missed.
MISPLACED = (0.006, 0.004, 0.0005)
MISPLACED_TIED = (0.0025, 0.002, 0.001)
#: Largest error of an end between the rows, as a share of its motion (`springbeam.results.dense.inside`): where
#: waves turn by more than 2π in a step, up to half of the error.
BETWEEN_ROWS = 0.005
#: Largest lag of waves at the end of the run by a body's own integrator [rad]: of the fastest ones that an impact
#: excites; without an impact, of slower ones, which move the tip more.
WAVE_LAG = 1.0
SMOOTH_LAG = 0.01
#: Energy of a start that is bent enough to count, over that of its velocity.
BENT = 1e-4
#: Periods of the fastest wave of the mesh that a window must hold for the mean of a rigid force to be settled to 5 %.
SETTLED = 2.5
#: Share of the slowest period over which the contact force is averaged.
WINDOW = 0.02
#: Largest error of the peak of a soft contact force, relative to it.
PEAK_FORCE = 0.05
#: How every warning of a peak force begins.
PEAK_DOUBTED = "the peak contact force "
#: How every warning of a run that is not resolved begins, and what that of its forces has.
NOT_RESOLVED = "not resolved"
LAW_MISSED = "the forces of the steps differ from the contact law"
#: Places inside a step at which a path is compared with an oscillation.
_PLACES = np.linspace(0.0, 1.0, 65)


def why_not_resolved(pair: Pair, steps: np.ndarray, misplaced: float, between: float) -> str | None:
    """Return in words why a run did not resolve its motion, and which steps would; ``None`` if it did.

    Parameters
    ----------
    pair, steps
        The bodies and the records of the run.
    misplaced
        Distance of an end from its position under the contact law, relative to its motion.
    between
        Distance of an end from its curve between the rows, relative to its motion.
    """
    if not len(steps):
        return None
    aliased = [curve_error(omega * (pair.setup.macro_step or 0.0)) for omega in _oscillations(pair, steps)]
    between = max(between, *aliased, 0.0)
    if late := _late_waves(pair, steps):
        return late
    limits = MISPLACED if pair.law is not None else MISPLACED_TIED
    degree = 0 if pair.setup.exchanges else pair.setup.degree
    excess = misplaced / limits[degree]
    if excess > 1.0:
        # Waves that the steps do not follow let it fall with the square of H only, and unevenly: half of that is named.
        far = f"about {100.0 * misplaced:.2g} %" if misplaced <= 1.0 else "more than all"
        loads = " and the loads" if pair.loads.any else ""
        return (
            f"{NOT_RESOLVED}: {LAW_MISSED}{loads}, which moves an end by {far} of its motion. "
            "Velocities, forces and times of contact are samples of a faster motion; "
            f"{_shorter(pair, 2.0 * sqrt(excess))}{_higher(pair)}"
        )
    if between > BETWEEN_ROWS:
        # It falls no slower than with H where twice as many steps follow what turned by π.
        return (
            f"{NOT_RESOLVED}: between the rows an end may have an error of {100.0 * between:.2g} % of its motion, "
            f"since it oscillates within a step; {_shorter(pair, 2.0 * between / BETWEEN_ROWS)}"
        )
    return None


def _oscillations(pair: Pair, steps: np.ndarray) -> list[float]:
    """Return the slowest frequency of each body that oscillates, where it has been stiffest [rad/s]."""
    found = []
    for body, column in ((pair.upper, "u_tip_after"), (pair.lower, "y_after")):
        omega, ratio = body.oscillation(steps[column]) or (0.0, 0.0)
        if ratio < 1.0:
            found.append(omega)
    return found


def curve_error(turn: float) -> float:
    """Return by which share of its amplitude the curve of a step misses an oscillation that turns by ``turn`` [rad].

    That is at its worst phase; of one that turns by whole periods the rows show nothing.
    """
    if turn == 0.0:
        return 0.0
    exact = np.exp(1j * turn * _PLACES)
    rate = 1j * turn
    mean = (np.exp(rate) - 1.0) / rate
    twice = (mean - 1.0) / rate
    path = Path.through((1.0, rate), (exact[-1], rate * exact[-1]), 1.0, (mean, twice))  # type: ignore[arg-type]
    return float(np.abs(path.at(_PLACES) - exact).max())  # type: ignore[arg-type]


def _late_waves(pair: Pair, steps: np.ndarray) -> str | None:
    """Return in words by how much a body's own integrator makes its waves lag, ``None`` if it follows them.

    Neither the ends nor the energy show it. A beam that starts bent to a straight line springs back from its clamp as
    from an impact.
    """
    setup = pair.setup
    size = steps["size"]
    bent = not setup.at_rest and steps["beam_potential"][0] > BENT * steps["beam_kinetic"][0]
    excited = bool(bent) or (pair.law is None and (setup.law is not None or setup.floor is not None))
    omega = pair.upper.late_waves(max((load.rate for load in setup.loads), default=0.0), excited=excited)
    lag = omega**3 * float((size**3).sum()) / 12.0
    limit = WAVE_LAG if excited else SMOOTH_LAG
    if lag <= limit:
        return None
    H = sqrt(float((size**3).sum() / size.sum()))
    return (
        f"{NOT_RESOLVED}: the midpoint rule lets waves of {omega:.3g} rad/s lag by {lag:.2g} rad at the end; "
        f"coupling.macro_step <= {_rounded_down(H * sqrt(limit / lag))} resolves them, beam.alpha_b > 0 lets them die "
        'out, and beam.integrator = "modal" is exact'
    )


def _shorter(pair: Pair, times: float) -> str:
    """Return what makes steps ``times`` as short."""
    H = pair.setup.macro_step
    if H is None:
        return "smaller tolerances resolve it"
    return f"coupling.macro_step <= {_rounded_down(H / times)} resolves it"


def _higher(pair: Pair) -> str:
    """Return that a higher degree allows longer steps, where the bodies follow one."""
    setup = pair.setup
    able = [body.can() for body in pair.bodies]
    allowed = min(min(body.slopes, body.integrals) for body in able)
    if setup.exchanges or setup.macro_step is None or setup.degree >= allowed:
        return ""
    return ", a higher coupling.degree allows longer ones"


def _rounded_down(size: float) -> str:
    """Return ``size`` [s] in two digits, rounded down."""
    return f"{0.95 * size:.1e} s"


# -- the peak contact force --------------------------------------------------------------------------------------------


def window_of(pair: Pair, omega: float) -> float:
    """Return `WINDOW` of a period at ``omega`` [rad/s], of the run where nothing oscillates [s]."""
    return WINDOW * (2.0 * pi / omega if omega > 0.0 else pair.setup.end)


def peak_force_doubt(pair: Pair, window: float, error: float) -> str | None:
    """Return why the peak contact force, a mean over ``window`` [s], is unreliable, and the remedy; else ``None``.

    Under a soft law it is, if its relative ``error`` as of `springbeam.run.errors.peak` is larger than `PEAK_FORCE`.
    At a rigid impact the force at an instant grows with the mesh. Its mean over a window settles where the window is
    longer than `SETTLED` periods of the fastest wave kept (``docs/choose.md`` has the numbers).
    """
    if error > PEAK_FORCE:
        return (
            f"{PEAK_DOUBTED}may be wrong by about {100.0 * error:.2g} %: the law's along the path of the ends differs "
            f"from that of the steps; {_shorter(pair, sqrt(error / PEAK_FORCE))}{_higher(pair)}"
        )
    meets = pair.setup.law is not None or pair.setup.floor is not None
    ringing = pair.upper.ringing if pair.law is None and meets else 0.0
    needed = SETTLED * 2.0 * pi / ringing if ringing > 0.0 else 0.0
    if window >= needed:
        return None
    return (
        f"{PEAK_DOUBTED}depends on the mesh: it is a mean over {window:.2g} s, and the contact is rigid. "
        f"contact.force_window >= {1.05 * needed:.2g} s, more elements or more modes settle it"
    )
