"""Pure-Python test doubles of the two bodies, exact to rounding for a contact force quadratic in time.

A beam has the modes of `springbeam.monolithic`; the steps share nothing with it nor with the FMUs, so that the coupling
is tested by itself:

* `ModalBody`: a linear body in its modes, each stepped by its matrix exponential;
* `DuffingBody`: m ÿ + α ẏ + k1 y + k2 y³ = −C + N + f_s by Taylor series of order 22.
"""

from functools import reduce
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.polynomial.polynomial import polyint, polymul, polyval
from scipy.linalg import expm

from springbeam.bodies.factory import load_bodies
from springbeam.bodies.force import combined, shifted, work_on
from springbeam.bodies.protocol import NO_FORCE, BeamBody, Body, Energies, Force, Motion
from springbeam.coupling.protocol import Step
from springbeam.monolithic.semi_discrete import Loads, modal_beam
from springbeam.results.recording import MemoryRecorder
from springbeam.run.master import Master
from springbeam.run.outcome import RunStopped
from springbeam.scene import Beam


class Double(Body):
    """Counts its steps; `CHANGES` names the attributes that a step changes."""

    CHANGES = ("_integrals", "_dissipated", "_work")

    def __init__(self):
        self._integrals = (0.0, 0.0)
        self._dissipated = self._work = 0.0
        self.steps = 0

    def mark(self):
        self._marked = {name: getattr(self, name) for name in self.CHANGES}

    def rewind(self):
        vars(self).update(self._marked)


class ModalBody(Double, BeamBody):
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
        self.omega, self.b = np.asarray(omega, float), np.asarray(b, float)
        self.a, self.v = np.array(a, float), np.array(v, float)
        self.f = np.broadcast_to(np.asarray(f, float), self.omega.shape)
        self.alpha, self._sampler = alpha, sampler
        self.mass = 1.0 / float(self.b @ self.b)
        self._maps = {}
        self._load = np.zeros((3, len(self.omega)))
        self.patterns = []  #: what a unit of each load is in the modes

    def expect_loads(self, loads):
        assert len(loads) == len(self.patterns)

    def set_loads(self, forces):
        self._load = sum(np.outer(f, pattern) for f, pattern in zip(forces, self.patterns, strict=True))

    def advance(self, time, size, contact, foundation=NO_FORCE):
        self.steps += 1
        p = np.outer(contact, self.b) + self._load
        p[0] += self.f
        before, (f, df, ddf) = self.a, self._load
        i1, i2 = self._step(size, p)
        # By parts, as `springbeam.bodies.force.work_on`.
        once, twice = i1 - before * size, i2 - before * (0.5 * size * size)
        ends = f + size * (df + 0.5 * size * ddf)
        self._work += float(ends @ (self.a - before) - df @ once - ddf @ (size * once - twice))
        self._integrals = (float(self.b @ i1), float(self.b @ i2))
        return self.motion()

    def _step(self, h, p):
        """State per mode (ωa, ȧ, p, ṗ, p̈, ∫a, ∫∫a); dissipation by W(2h) = W(h) + E(h)ᵀW(h)E(h)."""
        if h not in self._maps:
            r = len(self.omega)
            A = np.zeros((r, 7, 7))
            A[:, 0, 1], A[:, 1, 0], A[:, 1, 1] = self.omega, -self.omega, -self.alpha * self.omega**2
            A[:, 1, 2] = A[:, 2, 3] = A[:, 3, 4] = 1.0
            A[:, 5, 0] = 1.0 / self.omega
            A[:, 6, 5] = 1.0
            doublings = max(0, int(np.ceil(np.log2(h * np.abs(A).sum(axis=2).max()))) - 1)
            small = h / 2**doublings
            E, W = expm(A * small), np.zeros((r, 7, 7))
            nodes, weights = np.polynomial.legendre.leggauss(12)
            for x, w in zip(nodes, weights, strict=True) if self.alpha else ():
                rate = expm(A * (0.5 * (x + 1.0) * small))[:, 1, :]
                W += 0.5 * w * small * rate[:, :, None] * rate[:, None, :]
            W *= self.alpha * self.omega[:, None, None] ** 2
            for _ in range(doublings):
                W = W + np.swapaxes(E, 1, 2) @ W @ E
                E = E @ E
            self._maps[h] = (E, W)
        E, W = self._maps[h]
        zero = np.zeros_like(self.a)
        x = np.stack([self.omega * self.a, self.v, *p, zero, zero], axis=1)
        self._dissipated += float(np.einsum("ri,rij,rj", x, W, x))
        x = np.einsum("rij,rj->ri", E, x)
        self.a, self.v = x[:, 0] / self.omega, x[:, 1]
        return x[:, 5], x[:, 6]

    def motion(self):
        return Motion(float(self.b @ self.a), float(self.b @ self.v), *self._integrals)

    def energies(self):
        stretch = self.omega * self.a
        load = -float(self.f @ self.a) - self._work
        return Energies(0.5 * float(self.v @ self.v), 0.5 * float(stretch @ stretch), self._dissipated, load)

    def apply_impulse(self, impulse):
        self.v = self.v + self.b * impulse

    def shape(self):
        return self._sampler @ self.a


def beam_body(beam, slope=None):
    """The scene's beam. ``slope`` replaces initial_deflection_slope."""
    m = modal_beam(beam)
    a = (beam.initial_deflection_slope if slope is None else slope) * m.slope_shape
    return ModalBody(m.omega, m.tip, a, beam.initial_velocity_slope * m.slope_shape, m.load, beam.alpha_b, m.sampler)


def unit_beam(n, stiffness=100.0, slope=-1.0):
    """An undamped unit beam of ``n`` elements, EI = KAG = ``stiffness``, moving as u̇ = slope·x."""
    return beam_body(
        Beam.with_ones(n_elements=n, young_modulus=stiffness, shear_modulus=stiffness, initial_velocity_slope=slope)
    )


_ORDER = 22


class DuffingBody(Double):
    """m ÿ + α ẏ + k1 y + k2 y³ = −C + N + f_s by Taylor series in steps short enough for rounding."""

    CHANGES = (*Double.CHANGES, "y", "z")

    def __init__(self, mass=1.0, k1=3.0, k2=-0.2, y=0.0, z=0.0, damping=0.0, external=0.0):
        super().__init__()
        self.mass, self.k1, self.k2, self.damping, self.external = mass, k1, k2, damping, external
        self.y, self.z = float(y), float(z)
        self._load = NO_FORCE

    def expect_loads(self, loads):
        self._shares = [-self.mass if load.on == "base" else 1.0 for load in loads]

    def set_loads(self, forces):
        self._load = combined(self._shares, forces)

    def load_on_end(self):
        return self._load

    def advance(self, time, size, contact, foundation=NO_FORCE):
        self.steps += 1
        force = tuple(n - p + f for n, p, f in zip(foundation, contact, self._load, strict=True))
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
            self.y, self.z = _value(y, h), _value(z, h)
        self._integrals = (i1, i2)
        self._work += work_on(self._load, start, self.motion(), size)
        return self.motion()

    def _series(self, f0, f1, f2):
        y, z = [self.y, self.z], [self.z]
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

    def motion(self):
        return Motion(self.y, self.z, *self._integrals)

    def energies(self):
        y, z = self.y, self.z
        return Energies(
            0.5 * self.mass * z * z,
            0.5 * self.k1 * y * y + 0.25 * self.k2 * y**4,
            self._dissipated,
            -self.external * y - self._work,
        )

    def apply_impulse(self, impulse):
        self.z += impulse / self.mass

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


def bodies(scene):
    """The scene's bodies at `first_contact`; a beam without inertia is that of the package, which is exact."""
    beam = spring = None
    if scene.massless:
        beam, _ = load_bodies(scene.model_copy(update={"lower": None}), scene.contact_time or 0.0)
    elif scene.beam is not None:
        target = scene.tip_target
        kinematic = scene.beam.approach == "undeformed" and target is not None
        beam = beam_body(scene.beam, target.value / scene.beam.length if kinematic else None)
        patterns = Loads(scene, modal_beam(scene.beam)).patterns
        beam.patterns = [row for load, row in zip(scene.loads, patterns, strict=True) if load.on != "spring"]
    if (p := scene.spring) is not None:
        spring = DuffingBody(
            p.mass,
            p.linear_stiffness,
            p.cubic_stiffness,
            p.equilibrium,
            p.initial_velocity,
            p.damping,
            p.external_force,
        )
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
    master = Master(scene, (scene.contact_time or 0.0), beam, spring, recorder)
    stopped = None
    try:
        while not master.done:
            master.step()
    except RunStopped as error:
        stopped = error
    recorder.finish(master.summary())
    trajectory = recorder.trajectory()
    trajectory.summary["work"] = {
        name: body.steps for name, body in (("beam", beam), ("spring", spring)) if hasattr(body, "steps")
    }
    return trajectory, stopped


def orders(errors, sizes):
    """Observed orders between neighbouring step sizes."""
    pairs = zip(pairwise(errors), pairwise(sizes), strict=True)
    return [float(np.log(e0 / e1) / np.log(h0 / h1)) for (e0, e1), (h0, h1) in pairs]


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
        booked = coupling.booking(ends)
        return Row(*ends, contact, sum(upper.energies()) + sum(lower.energies()) + booked.stored + booked.dissipated)

    rows = [row(NO_FORCE)]
    for i in range(steps):
        guess, start = shifted(rows[-1].force, size), rows[-1][:2]
        contact = solve(coupling, size, upper, lower, guess, i * size)
        coupling.accept(Step(i * size, size, contact, NO_FORCE, start, (upper.motion(), lower.motion())))
        rows.append(row(contact))
    return rows
