"""Bodies of a scene outside a run, and steps of a coupling between two of them."""

from contextlib import contextmanager
from typing import NamedTuple

from springbeam import PointMass
from springbeam.bodies.factory import load_bodies
from springbeam.bodies.force import shifted
from springbeam.bodies.protocol import NO_FORCE, Force, Motion
from springbeam.contact.interface import Interface
from springbeam.coupling.protocol import Step
from springbeam.run.setup import set_up
from springbeam.run.stepping import Pair


def interface_of(scene, tip_mass=0.01, mass=1.0, equilibrium=0.0):
    """What may meet in ``scene``, of ends with these masses."""
    setup = set_up(scene)
    ends = PointMass(1.0), PointMass(1.0)
    for end, of_end in zip(ends, (tip_mass, mass), strict=True):
        end.mass = of_end
    return Interface(*ends, setup.law, equilibrium, setup.floor, setup.restitution, not setup.lower)


@contextmanager
def bodies_of(scene):
    """The FMUs of a scene, as its run has them at the start."""
    made = load_bodies(scene, scene.contact_time or 0.0, scene.degree)[:2]
    try:
        yield made
    finally:
        for body in made:
            if body is not None:
                body.close()


@contextmanager
def pair_of(scene):
    """Those of `bodies_of` as a pair."""
    with bodies_of(scene) as made:
        yield Pair(set_up(scene), *made)


class Row(NamedTuple):
    """A coupled pair after a step."""

    upper: Motion
    lower: Motion
    force: Force  #: over the step
    energy: float  #: of both bodies, and what the coupling books [J]


def solve(coupling, size, upper, lower, guess=NO_FORCE, time=0.0):
    """Make a step from where the bodies are, and return its contact force."""
    for body in (upper, lower):
        body.mark()
    return coupling.solve(upper, lower, time, size, (upper.motion(), lower.motion()), guess).contact


def couple(coupling, size, steps, upper, lower):
    """Make ``steps`` steps; the first row is the start."""

    def row(contact):
        ends = (upper.motion(), lower.motion())
        in_law = coupling.energies(ends)
        return Row(*ends, contact, sum(upper.energies()) + sum(lower.energies()) + in_law.stored + in_law.dissipated)

    rows = [row(NO_FORCE)]
    for i in range(steps):
        guess = shifted(rows[-1].force, size)
        start = rows[-1][:2]
        contact = solve(coupling, size, upper, lower, guess, i * size)
        coupling.accept(Step(i * size, size, contact, NO_FORCE, start, (upper.motion(), lower.motion())))
        rows.append(row(contact))
    return rows
