"""Judge a run: classify it by its records, and compare it with the event-driven reference."""

from contextlib import suppress
from functools import cached_property

import numpy as np

from springbeam.bodies.protocol import FmuError
from springbeam.monolithic import event_driven
from springbeam.results.distance import distance
from springbeam.run.accuracy import pick
from springbeam.run.companion import check
from springbeam.run.ledger import EXACT, bounds
from springbeam.run.outcome import RunStopped
from springbeam.run.peaks import PEAK_DOUBTED
from springbeam.run.runner import Simulation
from springbeam.scene import SceneError, with_changes
from springbeam.scene.plausibility import warnings_of
from springbeam.studies.comparison import initial_speed

#: Classes of runs (bounds: `ledger.EXACT`, `ledger.bounds`), in the order of pictures and tables; the last must stay
#: empty.
MEANINGS = {
    "conserved": "is done; the energy is constant to 10⁻⁸ of the largest so far, without losses",
    "dissipative": "is done; energy plus losses is constant to 10⁻⁸",
    "approximate": "is done; the energy changed by more, but within the bound of its scheme or with a warning",
    "refused": "was rejected before the start",
    "stopped": "ended early, with the cause",
    "garbage": "is anything else: it is wrong, or its energy has changed, without a warning; numbers are not finite, "
    "bodies overlap or tear, damping returns energy, or it crashed",
}
CLASSES = tuple(MEANINGS)
#: A run without an accuracy is wrong if an end is further from the reference than this share of its largest change:
#: what `springbeam.run.companion` is to warn of.
WRONG = 0.01
#: Relative change of the initial velocity that shows the conditioning, as large as the errors that are judged; and the
#: largest amplification of it in the motion or in a time.
CHANGE, WELL_CONDITIONED = 1e-3, 30.0
#: Number of times at which a run is compared, and the limit of the processor time of each reference [s].
TIMES, PATIENCE = 200, 30.0
#: Of a record: parts of the `distance` from the reference.
ERRORS = ("error_motion", "error_times", "error_impulses")
#: A run is cut after so many accepted steps, and so many for each macro step: a contact that opens and closes in each.
_MOST_STEPS, _MOST_PER_MACRO_STEP = 100, 4.0
#: Largest overlap or gap of joined bodies over their motion, or the coupling's tolerance if that is larger.
_OVERLAP = 1e-9
#: Largest relative change of the energy by an exact coupling, unless tolerances are looser: a rounded gap costs energy
#: if the force of a step is very large.
_GUARANTEED = 1e-6
#: Rounding of a sum of energies, of the largest so far.
_SLACK = 1e-10


class Reference:
    """The event-driven solution of a scene, and the conditioning of the scene; each is computed when needed.

    The conditioning is that of the solution itself, not of runs: a run that misses an event would excuse itself.
    """

    def __init__(self, scene):
        self.scene = scene
        times = np.linspace(scene.contact_time or 0.0, scene.time.t_end, TIMES)
        self._options = {"sample_times": times, "time_limit": PATIENCE}

    @cached_property
    def run(self):
        """The solution; ``None`` if there is none within `PATIENCE`."""
        try:
            return event_driven.integrate(self.scene, **self._options)
        except (SceneError, ValueError, event_driven.ReferenceFailure):
            return None

    @cached_property
    def condition(self):
        """Ratio of the change of the motion or of a time to the relative change of the initial velocity.

        It is infinite where the change ends the solution.
        """
        assert self.run is not None
        found = 0.0
        try:
            for moved in perturbed(self.scene, CHANGE, **self._options):
                apart = distance(moved, self.run, 2.0 * self.scene.coupling.H)
                found = max(found, apart.motion / CHANGE, apart.times / CHANGE)
        except (ValueError, event_driven.ReferenceFailure):
            return np.inf
        return found


def perturbed(scene, share, **options):
    """Yield the reference of ``scene`` from initial velocities changed by ``share`` of them; ``options`` of its run.

    First the beam's; then that of a spring, decreased and increased, if it may have any: a spring that the tip meets a
    little above Ψ may be met a little below it, where another phase follows.
    """
    change = share * initial_speed(scene)
    yield event_driven.integrate(scene, velocity_perturbation=change, **options)
    if scene.spring is not None and scene.beam is not None:
        start = scene.spring.initial_velocity
        speed = change * scene.beam.length
        for velocity in (start - speed, start + speed):
            with suppress(SceneError):  # a spring that is held until the tip arrives
                pushed = with_changes(scene, spring={"initial_velocity": velocity})
                yield event_driven.integrate(pushed, **options)


def judge(scene, reference=None):
    """Run ``scene`` and return how the run ended: `ended`. Parameters and comparison as of `judged`."""
    cause = ""
    try:
        if scene.accuracy is not None:
            return judged(pick(scene).judged_run(), reference=reference)
        simulation = Simulation(scene)
    except (SceneError, FmuError) as error:
        return ended("refused", str(error))
    except RunStopped as stopped:
        return ended("stopped", str(stopped))
    most = _MOST_STEPS + int(_MOST_PER_MACRO_STEP * scene.duration / scene.coupling.H)
    with simulation:
        try:
            if all(simulation.step() for _ in range(most)):
                cause = f"cut after {most} steps, {_MOST_PER_MACRO_STEP:g} to each macro step"
            found = simulation.run  # where the last steps are checked
        except RunStopped as stopped:
            cause, found = stopped.cause, simulation.run
    if "traceback" in found.summary:  # an error that nobody foresaw
        return ended("garbage", f"crashed: {cause}")
    return judged(found if cause else check(found).judged_run(), cause, reference)


def ended(kind, reason=""):
    """Return the record of a run that ended as one of `CLASSES`.

    ``reason``: the cause of refused, stopped, garbage, or the warnings of approximate. ``warns``: the run is not
    resolved, or has a warning that its computation gave. ``residual``: the largest energy residual over the largest
    energy until then; ``overlap`` of bodies, or the gap of joined ones, over the largest motion. For compared runs,
    unless an ill-conditioned scene explains their errors: `ERRORS`, and ``factor``, the error of the motion over
    `WRONG`, or the largest over the accuracy of the scene. ``H``: the macro step [s].
    """
    measured = dict.fromkeys(("residual", "overlap", *ERRORS, "factor", "H"))
    counts = dict.fromkeys(("macro_steps", "events", "do_steps"), 0)
    return {"kind": kind, "reason": " ".join(reason.split()), **measured, "warns": False, **counts}


def judged(run, cause="", reference=None):
    """Return the class of a run that is done, or has stopped for ``cause``, from its records, and its errors.

    A run that warns is compared only with a given reference.
    """
    picked = run.summary.get("accuracy", {})
    calls = run.do_steps + picked.get("pilot_steps", 0)
    counts = {"macro_steps": run.summary["macro_steps"], "events": run.summary["events"], "do_steps": calls}
    if len(run.time) == 0:
        return ended("stopped", cause) | counts
    # The scale is the largest energy so far [J], as in `springbeam.run.ledger.errors`.
    stored = {name: np.abs(run[name]) for name in ("e_beam", "e_spring", "e_contact") if name in run.columns}
    if run.scene.spring is not None:
        stored["e_spring"] = np.maximum(stored["e_spring"], 0.5 * run.scene.spring.mass * run.z**2)
    mechanical = sum(stored.values())
    scale, overlap = np.maximum.accumulate(np.maximum(mechanical, abs(run.e_total[0]))), _overlap(run)
    relative = np.divide(run.energy_residual, scale, out=np.zeros_like(scale), where=scale > 0.0)
    measured = {"residual": float(np.abs(relative).max()), "overlap": overlap, "warns": warns(run)}
    measured["H"] = run.scene.coupling.H
    found = ended(*_class(run, cause, relative, scale, overlap)) | counts | measured
    if found["kind"] in ("stopped", "garbage") or (found["warns"] and reference is None):
        return found
    errors = _errors(run, reference or Reference(run.scene), found["warns"])
    if errors and errors["factor"] > 1.0 and not found["warns"]:
        off = max(errors[name] for name in ERRORS)
        found |= {"kind": "garbage", "reason": f"does not warn, and differs by up to {off:.1e} from the reference"}
    return found | errors


def warns(run):
    """Return whether ``run`` is not resolved, or has a warning that its computation gave."""
    others = set(run.summary["warnings"]).difference(warnings_of(run.scene))
    return not run.summary["resolved"] or any(not text.startswith(PEAK_DOUBTED) for text in others)


def _errors(run, reference, warned):
    """Return the errors of ``run``; none without a reference, or if an ill-conditioned scene explains them."""
    exact = reference.run
    if exact is None:
        return {}
    asked = run.summary.get("accuracy", {}).get("asked")
    window = 2.0 * run.scene.coupling.H if asked is None else asked * run.scene.duration
    found = distance(run, exact, window)
    of_all = max(found.motion, found.times, found.impulses)
    factor = found.motion / WRONG if asked is None else of_all / asked
    if factor > 1.0 and not warned and reference.condition > WELL_CONDITIONED:
        return {}
    return dict(zip(ERRORS, found, strict=False)) | {"factor": factor}


def _class(run, cause, relative, scale, overlap):
    """Return the class of a run and why, by its relative residuals, the scale of its energy and its overlap."""
    scene = run.scene
    residual = float(np.abs(relative).max())
    keeps = not scene.coupling.exchanges
    tolerance = max(scene.coupling.tolerance, 0.0 if scene.spring is None else scene.spring.relative_tolerance)
    allowed, _ = bounds(tolerance, exchanges=not keeps)
    if keeps and residual > max(_GUARANTEED, allowed):
        return "garbage", f"energy residual {residual:.1e} of a coupling that changes none; {cause}"
    if cause:
        return "stopped", cause
    if faults := list(_faults(run, overlap, scale)):
        return "garbage", "; ".join(faults)
    if residual <= EXACT:
        lost = run.e_dissipated[-1] + run.e_impact_loss[-1]
        return "dissipative" if lost > EXACT * scale[-1] else "conserved", ""
    said = [text for text in run.summary["warnings"] if "energy" in text]
    if said or residual <= allowed:
        return "approximate", "; ".join(said)
    return "garbage", f"energy residual {residual:.1e} without a warning"


def _faults(run, overlap, scale):
    """Yield faults that no scene explains."""
    for name, values in run.columns.items():
        if name != "phase" and not np.all(np.isfinite(values)):
            yield f"{name} is not finite"
    lost = {"damping": run.e_dissipated, "impacts": run.e_impact_loss}
    for what, energy in lost.items():
        change = np.diff(energy)
        if np.any(change < -_SLACK * scale[1:]):
            yield f"energy lost by {what} returns: {change.min() / scale[-1]:.1e} of the largest"
    if overlap > max(_OVERLAP, run.scene.coupling.tolerance):
        yield f"the bodies overlap or part by {overlap:.1e} of their motion"


def _overlap(run):
    """Return the largest inadmissible overlap of bodies, over the largest deflection or motion in a step."""
    scene, overlaps = run.scene, [0.0]
    positions = [run[name] for name in ("u_tip", "y") if name in run.columns]
    if run.shapes is not None and len(run.shapes[0]):
        positions.append(run.shapes[1])  # the tip is as exact as the largest deflection, however little it moves
    speeds = [run[name] for name in ("v_tip", "z") if name in run.columns]
    motion, moved = (max(float(np.abs(values).max()) for values in several) for several in (positions, speeds))
    motion += scene.coupling.H * moved
    if scene.contact.rigid and scene.coupled:
        joined, free = np.isin(run.phase, ("tied", "touch")), run.phase == "free"
        overlaps += [np.abs(run.gap[joined]).max(initial=0.0), np.max(-run.gap[free], initial=0.0)]
    if scene.stop is not None and not scene.elastic_stop:
        overlaps.append(np.max(scene.stop.position - (run.y if "y" in run.columns else run.u_tip)))
    return float(max(overlaps)) / motion if motion > 0.0 else 0.0
