"""Rules for scenes with bodies that are not our own: what only our own can do, and what makes no sense with others."""

from __future__ import annotations

from collections.abc import Iterator

from .partners import RigidWall, kind_of
from .scene import Scene


def partners_fit(scene: Scene) -> Iterator[str]:
    """Yield why ``scene`` cannot be run with its partners, as of `springbeam.scene.rules.impossible`."""
    contact, stop, lower, upper = scene.contact, scene.stop, scene.lower, scene.upper
    for table, body in scene.partners.items():
        kind = kind_of(body)
        name = f"[{table}] fmu" if kind == "fmu" else f'[{table}] element = "{kind}"'
        if contact.law == "paper":
            yield f'{name}: [contact] law = "paper" is Algorithm 1, which needs our own bodies; take another law'
        if scene.coupling.feedback != "two_way":
            yield (
                f'{name}: [coupling] feedback = "{scene.coupling.feedback}" bounds what it neglects for our own bodies '
                'only; use "two_way"'
            )
        if scene.beam is not None and scene.beam.fidelity == "quasi_static" and contact.law == "transmission":
            yield (
                f'{name}: [contact] law = "transmission" needs our own spring below [beam] fidelity = "quasi_static"; '
                'use law = "tie", or fidelity = "dynamic"'
            )
        end = "spring" if table == "spring" else "tip"
        for number, load in enumerate(scene.loads):
            on = f'[loads.{number}] on = "{load.on}"'
            if load.on == "beam" and table == "beam":
                yield f'{on}: acts along our own beam; on = "tip" acts on the end of another body in [beam]'
            elif load.on == "base" and kind == "fmu":
                yield f'{on}: which masses are in the FMU of [{table}] is not known; give a force, on = "{end}"'
            elif load.on == end and kind == "rigid_wall":
                yield f"{on}: {name} moves under no load; take the load out"
    target, clearance = scene.tip_target, scene.initial_clearance
    if scene.beam is None and target is not None and clearance is not None and clearance < 0.0:
        below = f"{-clearance:.6g} m below {target[0]} = {target[1]}"
        yield f"[beam] displacement: starts {below}; let it start there or above"
    if isinstance(upper, RigidWall) and (lower is None or isinstance(lower, RigidWall)):
        yield '[beam] element = "rigid_wall": nothing moves in this scene; give it a body in [spring]'
    elif isinstance(lower, RigidWall) and (upper is None or stop is not None):
        what = "nothing moves in this scene; give it a body in [beam]" if upper is None else "leave [stop] out"
        yield f'[spring] element = "rigid_wall": {what}'
    if stop is not None and lower is not None and scene.spring is None:
        top = scene.initial_top
        if top is not None and stop.position >= top:
            yield f"[stop] position = {stop.position}: the foundation must lie below [spring] displacement = {top}"
