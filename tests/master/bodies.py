"""Pure-Python test doubles of the two bodies, exact to rounding for a contact force quadratic in time.

A beam has the modes of `springbeam.monolithic`; the steps share nothing with it nor with the FMUs, so that the coupling
is tested by itself:

* `ModalBody`: a linear body in its modes, each stepped by its exact response to a polynomial;
* `DuffingBody`: m ÿ + α ẏ + k1 y + k2 y³ = −C + N + f_s by Taylor series of order 22.
"""

from contextlib import contextmanager
from functools import cache, partial, reduce
from typing import NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyint, polymul, polyval

from springbeam.bodies.elements import EndLoaded
from springbeam.bodies.factory import load_bodies
from springbeam.bodies.force import shifted, work_on
from springbeam.bodies.protocol import NO_FORCE, Body, Energies, Force, Motion
from springbeam.contact.interface import Interface
from springbeam.coupling.protocol import Step
from springbeam.monolithic.semi_discrete import modal_beam
from springbeam.results.recording import MemoryRecorder
from springbeam.run.master import Master
from springbeam.run.outcome import RunStopped
from springbeam.run.setup import set_up
from springbeam.run.stepping import Pair
from springbeam.run.summary import summary
from springbeam.scene import Beam
from springbeam.scene.statics import tip_reach
from springbeam.studies.predict import impulse_integrals


class Double(Body):
    """Counts its steps; `CHANGES` names the attributes that a step changes."""

    CHANGES = ("_integrals", "_dissipated", "_work", "_acting")

    def __init__(self):
        self._integrals = (0.0, 0.0)
        self._dissipated = self._work = 0.0
        self._acting = None  #: at the end of the last step, on the modes or the mass [N]
        self.steps_made = 0

    def mark(self):
        self._marked = {name: getattr(self, name) for name in self.CHANGES}

    def rewind(self):
        vars(self).update(self._marked)


class ModalBody(Double):
    """ä + α ω² ȧ + ω² a = b C + f per mode, w = bᵀa; F = +C.

    Parameters
    ----------
    omega, b, f : (r,) arrays
        Frequencies [rad/s], end shape [kg^-1/2], load.
    a, v : (r,) arrays
        Initial state.
    sampler : (21, r) array or None
        a → shape.
    """

    CHANGES = (*Double.CHANGES, "a", "v")

    def __init__(self, omega, b, a, v, f=0.0, alpha=0.0, sampler=None):
        super().__init__()
        self.omega = np.asarray(omega, float)
        self.b = np.asarray(b, float)
        self.a = np.array(a, float)
        self.v = np.array(v, float)
        self.f = np.broadcast_to(np.asarray(f, float), self.omega.shape)
        self._damping = alpha * self.omega**2
        self._sampler = sampler
        self._responses = cache(partial(impulse_integrals, self.omega**2, self._damping))
        self.mass = 1.0 / float(self.b @ self.b)

    def advance(self, time, size, contact, foundation=NO_FORCE):
        self.steps_made += 1
        a = self.a
        v = self.v
        S = self._responses(size)
        f = np.outer(contact, self.b)
        f[0] += self.f
        stored = sum(self.energies()[:2])

        def integral(k):
            """Return the k-fold one of a."""
            return (S[k] + self._damping * S[k + 1]) * a + S[k + 1] * v + (f * S[k + 2 : k + 5]).sum(axis=0)

        self.a, i1, i2 = map(integral, range(3))
        self.v = S[0] * v - self.omega**2 * S[1] * a + (f * S[1:4]).sum(axis=0)
        self._integrals = (float(self.b @ i1), float(self.b @ i2))
        self._acting = f[0] + size * (f[1] + 0.5 * size * f[2])
        if (
            self._damping.any()
        ):  # the work of all forces, by parts as `springbeam.bodies.force.work_on`, that is not kept
            once = i1 - a * size
            twice = i2 - a * (0.5 * size * size)
            work = float(self._acting @ (self.a - a) - f[1] @ once - f[2] @ (size * once - twice))
            self._dissipated += work - (sum(self.energies()[:2]) - stored)
        return self.motion()

    def stiffness(self, displacement):
        return 1.0 / float(np.sum((self.b / self.omega) ** 2))

    def decay(self, time, size, speed):
        return float(self.b**2 @ self._damping) / float(self.b @ self.b)

    def acceleration(self):
        return float(self.b @ (self._acting - self._damping * self.v - self.omega**2 * self.a))

    def motion(self):
        return Motion(float(self.b @ self.a), float(self.b @ self.v), *self._integrals)

    def energies(self):
        stretch = self.omega * self.a
        kinetic = 0.5 * float(self.v @ self.v)
        return Energies(kinetic, 0.5 * float(stretch @ stretch), self._dissipated, -float(self.f @ self.a))

    def apply_impulse(self, impulse):
        self.v = self.v + self.b * impulse

    def shape(self):
        return np.append(self._sampler @ self.a, np.zeros(2 * len(self._sampler)))  # it has no moments


def beam_body(beam, slope=None):
    """The scene's beam. ``slope`` replaces initial_deflection_slope."""
    m = modal_beam(beam)
    a = (beam.initial_deflection_slope if slope is None else slope) * m.slope_shape
    body = ModalBody(m.omega, m.tip, a, beam.initial_velocity_slope * m.slope_shape, m.load, beam.alpha_b, m.sampler)
    body.reach = tip_reach(beam)
    return body


def unit_beam(n, stiffness=100.0, slope=-1.0):
    """An undamped unit beam of ``n`` elements, EI = KAG = ``stiffness``, moving as u̇ = slope·x."""
    return beam_body(
        Beam.with_ones(n_elements=n, young_modulus=stiffness, shear_modulus=stiffness, initial_velocity_slope=slope)
    )


_ORDER = 22


class DuffingBody(Double, EndLoaded):
    """m ÿ + α ẏ + k1 y + k2 y³ = −C + N + f_s by Taylor series in steps short enough for rounding."""

    CHANGES = (*Double.CHANGES, "y", "z")

    def __init__(self, mass=1.0, k1=3.0, k2=-0.2, y=0.0, z=0.0, damping=0.0, external=0.0):
        super().__init__()
        self.mass = mass
        self.k1 = k1
        self.k2 = k2
        self.damping = damping
        self.external = external
        self.y = float(y)
        self.z = float(z)

    def advance(self, time, size, contact, foundation=NO_FORCE):
        self.steps_made += 1
        force = tuple(n - p + f for n, p, f in zip(foundation, contact, self._on_end, strict=True))
        start = self.motion()
        i1 = i2 = done = 0.0
        while done < size:
            y = self._series(*shifted(force, done))
            left = size - done
            h = self._reach(y, left)
            if left - h < 1e-12 * size:
                h = left
            done = size if h == left else done + h
            z = [k * c for k, c in enumerate(y)][1:]
            once = [0.0, *(c / (k + 1) for k, c in enumerate(y))]
            twice = [0.0, *(c / (k + 1) for k, c in enumerate(once))]
            if self.damping != 0.0:
                self._dissipated += self.damping * float(polyval(h, polyint(polymul(z, z))))
            i2 += h * i1 + _value(twice, h)
            i1 += _value(once, h)
            self.y = _value(y, h)
            self.z = _value(z, h)
        self._integrals = (i1, i2)
        self._acting = shifted(force, size)[0]
        self._work += work_on(self._on_end, start, self.motion(), size)
        return self.motion()

    def _series(self, f0, f1, f2):
        y = [self.y, self.z]
        z = [self.z]
        squares = []
        for k, f in enumerate((f0 + self.external, f1, 0.5 * f2, *[0.0] * (_ORDER - 4))):
            f -= self.damping * z[k] + self.k1 * y[k]
            if self.k2 != 0.0:
                squares.append(sum(y[i] * y[k - i] for i in range(k + 1)))
                f -= self.k2 * sum(squares[i] * y[k - i] for i in range(k + 1))
            z.append(f / (self.mass * (k + 1)))
            y.append(z[-1] / (k + 2))
        return y

    @staticmethod
    def _reach(y, size):
        """The step over which the last coefficients are rounding of the largest term."""
        h = size
        for _ in range(200):
            terms = [abs(c) * h**k for k, c in enumerate(y)]
            if _ORDER * max(terms[-1], terms[-2]) <= 1e-18 * max(terms[1:]) or max(terms) == 0.0:
                return h
            h *= 0.75
        raise AssertionError(f"no step: {y}")

    def acceleration(self):
        elastic = self.k1 * self.y + self.k2 * self.y**3
        return (self._acting + self.external - self.damping * self.z - elastic) / self.mass

    def motion(self):
        return Motion(self.y, self.z, *self._integrals)

    def energies(self):
        y = self.y
        z = self.z
        return Energies(
            0.5 * self.mass * z * z,
            0.5 * self.k1 * y * y + 0.25 * self.k2 * y**4,
            self._dissipated,
            -self.external * y - self._work,
        )

    def apply_impulse(self, impulse):
        self.z += impulse / self.mass

    def stiffness(self, displacement):
        return self.k1 + 3.0 * self.k2 * displacement**2

    def holding_force(self, displacement, velocity):
        y = displacement
        return self.k1 * y + self.k2 * y**3 - self.external + self.damping * velocity


class Upper(DuffingBody):
    """A mass above: C lifts it."""

    def advance(self, time, size, contact, foundation=NO_FORCE):
        return super().advance(time, size, tuple(-c for c in contact), foundation)


def _value(coefficients, h):
    """Faster than numpy for a few coefficients."""
    return reduce(lambda total, c: total * h + c, reversed(coefficients))


def interface_of(scene, tip_mass=0.01, mass=1.0, equilibrium=0.0):
    """What may meet in ``scene``, of ends with these masses."""
    setup = set_up(scene)
    upper = Upper()
    lower = DuffingBody()
    upper.mass = tip_mass
    lower.mass = mass
    alone = not setup.lower
    return Interface(upper, lower, setup.law, equilibrium, setup.floor, setup.restitution, alone)


@contextmanager
def pair_of(scene):
    """The FMUs of a scene, as its run has them at the start."""
    made = load_bodies(scene, scene.contact_time or 0.0, scene.degree)[:2]
    try:
        yield Pair(set_up(scene), *made)
    finally:
        for body in made:
            if body is not None:
                body.close()


def bodies(scene):
    """The scene's bodies at `first_contact`; a beam without inertia is that of the package, which is exact."""
    beam = spring = None
    if scene.massless:
        beam, *_ = load_bodies(scene.model_copy(update={"lower": None}), scene.contact_time or 0.0, scene.degree)
    elif scene.beam is not None:
        target = scene.tip_target
        kinematic = scene.beam.approach == "undeformed" and target is not None
        beam = beam_body(scene.beam, target.value / scene.beam.length if kinematic else None)
    if (p := scene.spring) is not None:
        start = (p.equilibrium, p.initial_velocity)
        spring = DuffingBody(p.mass, p.linear_stiffness, p.cubic_stiffness, *start, p.damping, p.external_force)
    return beam, spring


def simulate(scene, wrap=lambda beam, spring: (beam, spring)):
    """The master's run with the doubles (``wrap`` may replace them), which must not stop."""
    trajectory, stopped = stopping(scene, wrap)
    assert stopped is None
    return trajectory


def stopping(scene, wrap=lambda beam, spring: (beam, spring)):
    """The run of `simulate`, and what stopped it."""
    beam, spring = wrap(*bodies(scene))
    recorder = MemoryRecorder(scene)
    setup = set_up(scene)
    master = Master(setup, beam, spring, recorder)
    stopped = None
    try:
        while not master.done:
            master.step()
    except RunStopped as error:
        stopped = error
    recorder.finish(summary(master, recorder))
    trajectory = recorder.trajectory()
    return trajectory, stopped


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
