"""What a good user of scipy would write for `soft`: its modal equations of motion, handed to `solve_ivp` with events.

The state is (x, ẋ), x the coordinates of the beam's modes and of the spring's top, so that a right-hand side is a few
products of vectors. What an event does to the state is the reference's (`HybridState`), so that both solve one problem;
its time is not counted.
"""

from statistics import median
from time import perf_counter

import numpy as np
from scipy.integrate import solve_ivp

from springbeam.monolithic.event_driven import initial
from springbeam.monolithic.hybrid_system import HybridSystem
from springbeam.monolithic.transitions import HybridState
from springbeam.results.distance import motion

#: The method that is the cheapest here, and its relative tolerances.
METHOD = "DOP853"
TOLERANCES = (1e-1, 1e-2, 1e-4, 1e-6, 1e-8, 1e-10)


def solved(s, rtol, atol, times):
    """Return y and the tip [m] of a `HybridSystem` at ascending ``times`` [s], and the seconds of ``solve_ivp``.

    Its law is rigid; nothing is damped, and no load varies.
    """
    seconds = 0.0
    state = HybridState(s, *initial(s, 0.0))
    found = np.empty((len(times), s.n))
    found[times <= state.time] = state.X[s.A]
    state.start()
    while state.time < times[-1]:
        watched = state.watched()
        inside = np.flatnonzero(times > state.time)
        rhs = right_hand_side(s, state.phase)
        events = [event_of(s, state.phase, watch, state.X) for watch in watched]
        span = (state.time, times[-1])
        began = perf_counter()
        run = solve_ivp(
            rhs, span, state.X[: 2 * s.n], METHOD, rtol=rtol, atol=atol, events=events, t_eval=times[inside]
        )
        seconds += perf_counter() - began
        found[inside[: len(run.t)]] = run.y[: s.n].T
        happened = next((k for k, at in enumerate(run.t_events) if len(at)), None)
        state.time = times[-1]
        if happened is not None:
            state.time = float(run.t_events[happened][-1])
            state.X[: 2 * s.n], state.X[s.T] = run.y_events[happened][-1], state.time
            state.happen(watched[happened])
    return {"u_tip": found @ s.tip, "y": found @ s.top}, seconds


def right_hand_side(s, phase):
    """Return f of Ẋ = f(t, X) in a phase of contact."""
    held = s.held(phase)
    hardening = s.spring.cubic_stiffness / s.spring.mass**2

    def rhs(_, X):
        x = X[: s.n]
        p = s.load - s.omega2 * x
        p[-1] -= hardening * x[-1] ** 3
        p -= (held.rows @ p) @ held.along
        return np.concatenate((X[s.n :], p))

    return rhs


def event_of(s, phase, watch, start):
    """Return the function of an event, with the marks that ``solve_ivp`` looks for.

    One that starts at zero, as after its own event, counts from where it first exceeds rounding, either way.
    """
    state = np.zeros(s.size)

    def other(_, X):
        state[: 2 * s.n] = X
        return float(watch.function(s.motion(phase, state)))

    quick = {
        "meet": lambda _, X: s.between @ X[s.A],
        "stop": lambda _, X: s.top @ X[s.A] - s.stop.position,
        "release": lambda _, X: s.law.equilibrium - s.top @ X[s.A],
        "retie": lambda _, X: s.top @ X[s.A] - s.law.equilibrium,
    }
    function = quick.get(watch.name, other)
    noise = s.noise(watch.unit, start)
    counts = function(0.0, start[: 2 * s.n]) > noise

    def rising(time, X):
        nonlocal counts
        value = function(time, X)
        counts = counts or value > noise
        return value if counts or value < -noise else noise

    found = function if counts else rising
    found.terminal = True
    found.direction = -1.0
    return found


def rows(scene, exact, times, repeats=3):
    """Yield what `springbeam.studies.tradeoff` records of its own configurations: error and median time [s] of each.

    ``exact`` has rows at ``times`` [s].
    """
    system = HybridSystem(scene)
    reach = max(float(np.abs(exact[k]).max()) for k in ("u_tip", "y"))
    for rtol in TOLERANCES:
        runs = [solved(system, rtol, 1e-3 * rtol * reach, times) for _ in range(repeats)]
        yield {
            "family": METHOD,
            "setting": f"rtol {rtol:.0e}",
            "status": "done",
            "cost_wall_time": median(seconds for _, seconds in runs),
            "error_motion": motion(runs[0][0], exact.columns),
        }
