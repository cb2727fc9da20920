"""What ordinary co-simulation masters do with the normal-compliance law: exchange values once per macro step.

C = λ p₊^q with p = y − u_tip is taken from the ends as they were exchanged; nothing is repeated, so nothing balances
the work of C on both bodies, and a contact too stiff for the macro step gains energy. Kept to be measured against.

* ``jacobi``: both bodies advance under the force of the step's start;
* ``gauss_seidel``: the beam advances first, the spring under the force that the beam's new tip position gives.

Degree 0 holds the force over the step, degree 1 continues it linearly: by Ċ = λ q p₊^{q−1} ṗ at the start, and for
the second body of ``gauss_seidel`` towards the force at the step's end with y continued by z.
"""

from __future__ import annotations

from ..bodies.protocol import Body, Force, Motion
from .compliance import compliance_force


class Exchange:
    """One exchange per step.

    Parameters
    ----------
    sequential
        ``gauss_seidel`` if true, else ``jacobi``.
    degree
        0 or 1: the force over a step, constant or linear.
    stiffness, exponent
        λ_nc [N/m^q] and q ≥ 1.
    """

    def __init__(self, sequential: bool, degree: int, stiffness: float, exponent: float) -> None:
        self._sequential, self._degree = sequential, degree
        self._stiffness, self._exponent = stiffness, exponent

    def solve(self, beam: Body, partner: Body, time: float, size: float, start: tuple[Motion, Motion]) -> Force:
        """Advance both bodies from their marks by ``size`` [s]; ``start`` are the ends (tip, lower end) there.

        Returns the force on the beam. Raises StepRefused.
        """
        tip, low = start
        p, rate = low.displacement - tip.displacement, low.velocity - tip.velocity
        force = (self._law(p), self._slope(p) * rate if self._degree else 0.0, 0.0)
        beam.rewind()
        tip = beam.advance(time, size, force)
        on_partner = force
        if self._sequential:
            moved = low.displacement + (size * low.velocity if self._degree else 0.0)
            end = self._law(moved - tip.displacement)
            on_partner = (force[0], (end - force[0]) / size, 0.0) if self._degree else (end, 0.0, 0.0)
        partner.rewind()
        partner.advance(time, size, on_partner)
        return force

    def _law(self, p: float) -> float:
        return compliance_force(p, self._stiffness, self._exponent)

    def _slope(self, p: float) -> float:
        return self._exponent * self._law(p) / p if p > 0.0 else 0.0
