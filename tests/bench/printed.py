"""Algorithm 1 as printed, from first contact on each of its linear systems handed to `scipy.sparse.linalg.spsolve`.

`springbeam.paper.monolithic` gets the same numbers from one solution a step with factors made once, because (62)
is nonlinear at the tip alone.
"""

from functools import partial

import scipy.sparse as sp
import scipy.sparse.linalg as spla

from springbeam.paper import monolithic


def simulate(scene):
    """Run Algorithm 1 as printed; arguments are the defaults of `springbeam.paper.monolithic.algorithm_1`."""
    algorithm = _AsPrinted(scene)
    algorithm.run()
    return algorithm.trajectory()


class _AsPrinted(monolithic._Algorithm):
    def _set_step(self, h):
        super()._set_step(h)
        d = self.discrete
        alpha = self.beam.alpha_b
        self.A = (4.0 * d.M + (h**2 + 2.0 * alpha * h) * d.K).tocsc()
        last = self.A.shape[0] - 1
        self.at_tip = sp.csc_array(([1.0], ([last], [last])), shape=self.A.shape)
        self.solve = partial(spla.spsolve, self.A)

    def _newton(self, f, guess, solve):
        """Make Newton's steps of (62) on all unknowns, told by that of the tip."""
        if solve != "beam":
            return super()._newton(f, guess, solve)
        before = self.rows[-1]
        h = self.h
        M = self.discrete.M
        known = self.B @ before.q + 4.0 * h * (M @ before.v) + 2.0 * h**2 * self.load
        x = before.q.copy()
        at_start = self._compliance(before.q[-1], self.stiffness)[0]

        def equation(w):
            x[-1] = w
            force, slope = self._compliance(w, self.stiffness)
            residual = self.A @ x - known
            residual[-1] -= h**2 * (force + at_start)
            change = spla.spsolve(self.A - h**2 * slope * self.at_tip, residual)
            x[:-1] -= change[:-1]
            return float(change[-1]), 1.0

        return super()._newton(equation, guess, solve)
