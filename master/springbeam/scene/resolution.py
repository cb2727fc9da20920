"""Judge whether the macro step resolves the motion, and name a remedy.

``docs/coupling.md``, "Is the motion resolved?", has the definition; the constants are its limits. Frequencies are those
of the beam, not of its mesh, which cost little; `springbeam.studies.stability.predict` has those of the mesh.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import pi, sqrt
from typing import Any, NamedTuple

from .frequencies import (
    fastest_frequency,
    impact_frequency,
    joined_frequency,
    lasting_frequency,
    shear_frequency,
    slowest_frequency,
)
from .linearised import bent_energy, spring_frequency
from .messages import Rule, texts_of
from .scene import Scene
from .statics import initial_kinetic_energy
from .tables import Beam

#: Largest angle [rad] that the slowest oscillation may turn in a macro step: 2π steps a period.
TURN = 1.0
#: By degree d of the force: a step that turns spring and massless beam by x rad makes them lag by the share
#: x^(2d + 2) over this, like a Gauss collocation of d + 1 stages (for d = 0 the midpoint rule).
COLLOCATION = (12.0, 720.0, 100800.0)
#: Largest lag of all steps together [rad]. Positions have errors of up to 0.75 of it, about 1 %.
LAG = 0.015
#: Largest distance of an end from its position under the contact law, as a share of its motion, by degree of the force:
#: a soft law, a tie. The estimate leaves out force errors of the fastest waves and effects of separations.
MISPLACED = (0.006, 0.002, 0.001)
MISPLACED_TIED = (0.0025, 0.002, 0.001)
#: Largest displacement of an end by the part of measured loads that the steps leave out, as a share of its motion;
#: known to a factor of 3.
LEFT_OUT = 0.01
#: Largest error of an end between the rows, as a share of its motion (`springbeam.results.dense.between_rows`): where
#: waves turn by more than 2π in a step, up to half of the error.
BETWEEN_ROWS = 0.005
#: Largest lag of waves at the end of the run by the midpoint rule [rad]: of the fastest ones that an impact excites;
#: without an impact, of a few times the beam's lowest frequency, or of a load, which move the tip more.
WAVE_LAG = 1.0
SMOOTH_LAG = 0.01
SMOOTH_WAVES = 5.0
#: Energy of a start that is bent enough to count, over that of its velocity.
BENT = 1e-4
#: Periods of the fastest wave of the mesh that a window must hold for the mean of a rigid force to be settled to 5 %.
SETTLED = 2.5
#: Share of the slowest period over which the contact force is averaged.
WINDOW = 0.02
_HIGHER = ", a higher coupling.degree allows longer ones"


class _Seen(NamedTuple):
    """Measures of the resolution of a run: parameters of `not_resolved`."""

    misplaced: float
    left_out: float
    between_rows: float
    H: float | None
    oscillations: Sequence[tuple[str, float, str]]


def not_resolved(
    scene: Scene,
    misplaced: float = 0.0,
    *,
    left_out: float = 0.0,
    between_rows: float = 0.0,
    H: float | None = None,
    oscillations: Sequence[tuple[str, float, str]] | None = None,
) -> str | None:
    """Return in words why the run did not resolve its motion, and a remedy; ``None`` if it did.

    Parameters
    ----------
    scene
        The scene as run.
    misplaced
        Distance of an end from its position under the contact law, relative to its displacement.
    left_out
        Displacement of an end by the part of tables that the steps leave out, relative to its displacement.
    between_rows
        Distance of an end from its curve between the rows, relative to its displacement.
    H
        Steps of one length that make waves lag like those of the run [s]; needed if these follow from tolerances.
    oscillations
        As of `slow_oscillations`, which is the default.
    """
    slow = slow_oscillations(scene) if oscillations is None else oscillations
    causes = _OF_ALL_STEPS if scene.coupling.adaptive else (*_OF_EQUAL_STEPS, *_OF_ALL_STEPS)
    return next(texts_of(scene, causes, _Seen(misplaced, left_out, between_rows, H, slow)), None)


def lateness(scene: Scene, turn: float) -> float:
    """Return the relative lag of a contact that turns by ``turn`` [rad] in a step."""
    degree = _force_degree(scene)
    return turn ** (2 * degree + 2) / COLLOCATION[degree]


def _force_degree(scene: Scene) -> int:
    """Return the degree of the contact force; 0 for exchanges, which are no more accurate."""
    return 0 if scene.coupling.exchanges else scene.degree


def _too_fast(scene: Scene, seen: _Seen) -> dict[str, Any]:
    """Return the oscillation that turns too far in a macro step, nothing if all are slower."""
    H = scene.coupling.H
    found = (
        {"name": name, "turn": omega * H, "size": _rounded_down(TURN / omega), "otherwise": otherwise}
        for name, omega, otherwise in seen.oscillations
        if omega * H > TURN
    )
    return next(found, {})


def _law_missed(scene: Scene, seen: _Seen) -> dict[str, Any]:
    """Return the effect of the difference between the forces of the steps and the contact law, nothing if it is small.

    With unresolved waves ``misplaced`` decreases only with the square of H, and unevenly; so the step that is named is
    half of what the square gives.
    """
    limits = MISPLACED_TIED if scene.contact.rigid else MISPLACED
    coupling = scene.coupling
    excess = seen.misplaced / limits[_force_degree(scene)]
    if excess <= 1.0:
        return {}
    raises = not coupling.exchanges and scene.degree < 2
    raises &= scene.beam is None or scene.beam.integrator == "modal"
    remedy = _shorter(scene, 2.0 * sqrt(excess)) + (_HIGHER if raises and not coupling.adaptive else "")
    far = f"about {100.0 * seen.misplaced:.2g} %" if seen.misplaced <= 1.0 else "more than all"
    return {"far": far, "remedy": remedy}


def _lags(scene: Scene, seen: _Seen) -> dict[str, Any]:
    """Return the lag of spring and massless beam together, nothing if it is small."""
    omega = joined_frequency(scene)
    degree = _force_degree(scene)
    H = scene.coupling.H
    lag = omega * scene.duration * lateness(scene, omega * H)
    return (
        {}
        if lag <= LAG or not scene.massless
        else {
            "turn": omega * H,
            "lag": lag,
            "size": _rounded_down(H / (lag / LAG) ** (0.5 / (degree + 1))),
            "higher": _HIGHER if degree < 2 else "",
        }
    )


def _struck(scene: Scene) -> Beam | None:
    """Return our beam if it has inertia and there is a body that its tip can meet."""
    meets = scene.lower is not None or scene.stop is not None
    return scene.beam if meets and not scene.massless else None


def _waves_lag(scene: Scene, seen: _Seen) -> dict[str, Any]:
    """Return the lag of waves of the beam by the midpoint rule, nothing if it is small.

    Neither a mismatch of velocities nor the energy shows it. A beam that starts bent to a straight line springs back
    from its clamp like after an impact.
    """
    beam = scene.beam
    if beam is None or scene.massless or beam.integrator == "modal":
        return {}
    H = seen.H or scene.coupling.H
    waves = "the fastest waves of an impact or a bent start"
    omega = impact_frequency(beam)
    limit = WAVE_LAG
    bent = not scene.static and bent_energy(scene, beam) > BENT * initial_kinetic_energy(beam)
    if not (bent or (scene.contact.rigid and _struck(scene))):
        omega = max(SMOOTH_WAVES * slowest_frequency(beam), *(load.rate for load in scene.loads), 0.0)
        waves = f"waves of {omega:.3g} rad/s"
        omega = min(omega, lasting_frequency(beam))
        limit = SMOOTH_LAG
    lag = scene.duration / H * (omega * H) ** 3 / 12.0
    return {"waves": waves, "lag": lag, "size": _rounded_down(H * sqrt(limit / lag))} if lag > limit else {}


def window_of(scene: Scene, omega: float) -> float:
    """Return the share `WINDOW` of a period at ``omega`` [rad/s], or of the run if nothing oscillates [s]."""
    return WINDOW * (2.0 * pi / omega if omega > 0.0 else scene.time.t_end)


def peak_force_doubt(scene: Scene) -> str | None:
    """Return why the peak contact force of the run is unreliable, and the remedy; ``None`` if it is reliable.

    At a rigid impact the force at an instant grows with the mesh. Its mean over a window converges if the window is
    longer than `SETTLED` periods of the fastest wave kept (``docs/choose.md`` has the numbers).
    """
    return next(texts_of(scene, (_MESH_DECIDES,)), None)


def _settling(scene: Scene) -> dict[str, float]:
    """Return the window of the peak force and one in which it converges, nothing if the mesh has no effect."""
    beam = _struck(scene)
    if beam is None or not scene.contact.rigid:
        return {}
    window = scene.contact.force_window or window_of(scene, slowest_frequency(beam))
    needed = SETTLED * 2.0 * pi / min(shear_frequency(beam), fastest_frequency(beam))
    return {"window": window, "longer": 1.05 * needed} if window < needed else {}


def slow_oscillations(scene: Scene) -> list[tuple[str, float, str]]:
    """Return (name, frequency [rad/s], other remedy) of each of our bodies and of each load that oscillates."""
    found = []
    beam = scene.beam
    spring = scene.spring
    if beam is not None and beam.fidelity == "dynamic":
        omega = slowest_frequency(beam)
        found.append(("beam", omega, 0.5 * beam.alpha_b * omega))
    if spring is not None and (omega := spring_frequency(scene)) > 0.0:
        found.append(("spring", omega, 0.5 * spring.damping / (spring.mass * omega)))
    return oscillating(scene, found)


def oscillating(scene: Scene, bodies: Iterable[tuple[str, float, float]]) -> list[tuple[str, float, str]]:
    """Return `slow_oscillations` of ``bodies``, each (table, frequency [rad/s], damping ratio), if not overdamped."""
    found = []
    for table, omega, ratio in bodies:
        if omega > 0.0 and ratio < 1.0:
            own = scene.beam if table == "beam" else scene.spring
            static = own is scene.beam is not None and scene.spring is not None and scene.contact.rigid
            name = table if own is not None else f"body in [{table}]"
            found.append((name, omega, ', beam.fidelity = "quasi_static" leaves it out' if static else ""))
    found += [(f"load loads.{i}", load.rate, "") for i, load in enumerate(scene.loads) if load.rate > 0.0]
    return found


def _shorter(scene: Scene, times: float) -> str:
    """Return a remedy that makes steps ``times`` as short."""
    if scene.coupling.adaptive:
        return "smaller tolerances resolve it"
    return f"coupling.macro_step <= {_rounded_down(scene.coupling.H / times)} resolves it"


def _rounded_down(size: float) -> str:
    """Return ``size`` [s] in two digits, rounded down."""
    return f"{0.95 * size:.1e} s"


# -- messages -------------------------------------------------------------------------------------------------------

#: Faults of steps of one length; the first that holds is reported.
_OF_EQUAL_STEPS = (
    Rule(
        _too_fast,
        "not resolved: the slowest oscillation of the {name} turns {turn:.3g} rad in a macro step. Velocities, forces "
        "and times of events are samples of a faster motion; coupling.macro_step <= {size} resolves it{otherwise}",
    ),
    Rule(
        _lags,
        "not resolved: tip and lower end together turn {turn:.3g} rad in a macro step, and lag by {lag:.2g} rad at the "
        "end; coupling.macro_step <= {size} resolves it{higher}",
    ),
)
#: Faults of all steps, also of those that follow from tolerances, which are judged by their accumulated effect.
_OF_ALL_STEPS = (
    Rule(
        _waves_lag,
        "not resolved: the midpoint rule lets {waves} lag by {lag:.2g} rad at the end; "
        "coupling.macro_step <= {size} resolves them, beam.alpha_b > 0 lets them die out, and "
        'beam.integrator = "modal" is exact',
    ),
    Rule(  # loads whose frequencies the scene does not give
        lambda s, seen: seen.left_out > LEFT_OUT,
        "not resolved: the part of the tables of loads that the steps leave out moves an end by {far:.2g} % of its "
        "motion, since a mode of it turns far in a step; {remedy}",
        lambda s, seen: {
            "far": 100.0 * seen.left_out,
            "remedy": _shorter(s, (seen.left_out / LEFT_OUT) ** (1.0 / 3.0)),
        },
    ),
    Rule(
        _law_missed,
        "not resolved: the forces of the steps differ from the contact law, which moves an end by {far} of its motion. "
        "Velocities, forces and times of contact are samples of a faster motion; {remedy}",
    ),
    Rule(  # rows that are right; it falls no slower than with H where twice as many steps follow what turned by π
        lambda s, seen: seen.between_rows > BETWEEN_ROWS,
        "not resolved: between the rows an end may have an error of {far:.2g} % of its motion, since it oscillates "
        "within a step; {remedy}",
        lambda s, seen: {
            "far": 100.0 * seen.between_rows,
            "remedy": _shorter(s, 2.0 * seen.between_rows / BETWEEN_ROWS),
        },
    ),
)
_MESH_DECIDES = Rule(
    _settling,
    "the peak contact force, a mean over {window:.2g} s, depends on the mesh: {contact.law} is rigid. "
    "contact.force_window >= {longer:.2g} s, more elements or more modes remove this",
)
