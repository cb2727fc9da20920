"""Keys that a scene gives without any effect: one table says where each of them counts.

A key that keeps its default is not looked at. ``[[loads]]`` refuses such keys itself; here they are told, so that a key
can be changed with ``--set`` although another one then counts no more.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

from .laws import laws_that
from .messages import at
from .scene import Scene, table_of
from .tables import ORDINARY_SCHEMES


class Effect(NamedTuple):
    """Where some keys count."""

    keys: tuple[str, ...]  #: ``"table.key"``
    counts: Callable[[Scene], bool]
    where: str


def _of_law(key: str) -> Effect:
    """Return where ``key`` of ``[contact]`` counts, or a column shows it."""
    return Effect(
        (f"contact.{key}",),
        lambda scene: scene.coupled and scene.contact.facts.has(key) and (scene.joins or scene.contact.soft),
        f"it counts between two bodies with law = {laws_that(lambda law: law.has(key))}",
    )


def _dynamic(scene: Scene) -> bool:
    return scene.beam is not None and not scene.massless


def _integrator(scene: Scene) -> str | None:
    """Return the integrator of our beam, ``None`` if nothing is integrated."""
    return scene.beam.integrator if scene.beam is not None and not scene.massless else None


def effects() -> tuple[Effect, ...]:
    """Return where the keys count that do not always."""
    mesh = ("element_degree", "reduced_integration", "mass_matrix")
    return (
        Effect(tuple(f"beam.{key}" for key in mesh), _dynamic, 'it counts with fidelity = "dynamic"'),
        Effect(
            ("beam.n_elements",),
            lambda scene: _dynamic(scene) or (scene.beam is not None and scene.beam.tip_load_coefficient != 0.0),
            'it counts with fidelity = "dynamic", or for a tip_load_coefficient',
        ),
        Effect(
            ("beam.integrator",),
            lambda scene: _dynamic(scene) and not scene.contact.algorithm,
            'it counts with fidelity = "dynamic"; Algorithm 1 is the midpoint rule',
        ),
        Effect(
            ("beam.n_modes",),
            lambda scene: _integrator(scene) == "modal" and not scene.contact.algorithm,
            'it counts with fidelity = "dynamic" and integrator = "modal", other integrators keep all modes',
        ),
        Effect(
            ("beam.rho_inf",),
            lambda scene: _integrator(scene) == "generalized_alpha",
            'it counts with fidelity = "dynamic" and integrator = "generalized_alpha"',
        ),
        Effect(
            ("stop.restitution",),
            lambda scene: not scene.contact.algorithm,
            "Algorithm 1 has no loss on the foundation",
        ),
        Effect(("contact.law",), lambda scene: scene.coupled, "it counts between two bodies, or a beam and a stop"),
        *map(_of_law, ("impact", "stiffness", "exponent")),
        Effect(
            ("contact.force_window",),
            lambda scene: (
                not scene.contact.algorithm and (scene.coupled or (scene.upper is not None and scene.stop is not None))
            ),
            "it counts where the run tells a peak contact force",
        ),
        Effect(
            ("coupling.scheme", "coupling.degree", "coupling.tolerance"),
            lambda scene: not scene.contact.algorithm,
            "Algorithm 1 is a scheme of its own",
        ),
        Effect(
            ("coupling.tolerance",),
            lambda scene: scene.coupling.scheme not in ORDINARY_SCHEMES,
            "it counts with schemes that solve for the force of a step",
        ),
        Effect(
            ("coupling.feedback_tolerance",),
            lambda scene: scene.coupling.feedback != "two_way",
            'it counts with feedback = "beam_drives" or "spring_drives"',
        ),
    )


def without_effect(scene: Scene) -> Iterator[str]:
    """Yield what has no effect, as lines ``[table] key = value: plays no part here; where it counts``."""
    given = scene.flat()
    told = set()
    for effect in effects():
        for place in effect.keys:
            table, _, key = place.rpartition(".")
            model = table_of(table)
            assert model is not None
            if place not in given or place in told or type(scene.under(table)) is not model:
                continue
            if given[place] != model.model_fields[key].default and not effect.counts(scene):
                told.add(place)
                yield f"{at(scene, place)}: plays no part here; {effect.where}"
    for number, load in enumerate(scene.loads):
        if load.begins >= scene.time.t_end:
            yield f"[loads.{number}] start = {load.start:g}: plays no part here; the run ends at {scene.time.t_end:g} s"
