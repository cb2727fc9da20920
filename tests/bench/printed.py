"""Algorithm 1 as printed, from first contact on each of its linear systems handed to `scipy.sparse.linalg.spsolve`.

`springbeam.paper.monolithic` gets the same numbers from one solution a step with factors made once, because (62)
is nonlinear at the tip alone.
"""

from functools import partial

import scipy.sparse as sp
import scipy.sparse.linalg as spla

from springbeam.paper import monolithic
from springbeam.paper.algorithm import TOLERANCE, Algorithm


def algorithm_1(scene):
    """Run Algorithm 1 as printed; the defaults are those of `springbeam.paper.monolithic.algorithm_1`."""
    return Algorithm(scene, _AsPrinted(scene), "rest").run(float)


class _AsPrinted(monolithic.Meshed):
    def set_step(self, h):
        super().set_step(h)
        d = self.discrete
        self.A = (4.0 * d.M + (h**2 + 2.0 * self._beam.alpha_b * h) * d.K).tocsc()
        last = self.A.shape[0] - 1
        self.at_tip = sp.csc_array(([1.0], ([last], [last])), shape=self.A.shape)
        self._solve = partial(spla.spsolve, self.A)

    def predicted_tip(self, u_free, u, law):
        """Make Newton's steps of (62) on all unknowns."""
        square = self.h**2
        known = self.known()
        q = self._before[0].copy()
        at_start, _ = law.force(u)
        change = [1.0]
        while abs(change[-1]) > TOLERANCE:
            force, slope = law.force(q[-1])
            residual = self.A @ q - known
            residual[-1] -= square * (force + at_start)
            change = spla.spsolve(self.A - square * slope * self.at_tip, residual)
            q -= change
        return float(q[-1])
