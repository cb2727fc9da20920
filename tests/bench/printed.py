"""Algorithm 1 as printed, from first contact on each of its linear systems handed to `scipy.sparse.linalg.spsolve`.

`springbeam.monolithic.algorithm1` gets the same numbers from one solution a step with factors made once, because (62)
is nonlinear at the tip alone.
"""

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from springbeam.monolithic import algorithm1


def simulate(scene):
    """Run Algorithm 1 as printed; arguments are the defaults of `springbeam.monolithic.algorithm1.simulate`."""
    return _AsPrinted(scene, "equation", 1e-12).run()


class _AsPrinted(algorithm1._Algorithm):
    def __init__(self, *arguments):
        super().__init__(*arguments)
        last = self.A.shape[0] - 1
        self.inner, self.column = self.A[:-1, :-1], self.A[:-1, [-1]].toarray().ravel()
        self.at_tip = sp.csc_array(([1.0], ([last], [last])), shape=self.A.shape)

    def _tip(self, q, v, stiffness):
        h, x = self.h, q.copy()
        known = self._right_side(q, v)
        before = self._compliance(q[-1], stiffness)[0]

        def equation(w):
            """Newton's step on all unknowns, told by that of the tip."""
            x[-1] = w
            force, slope = self._compliance(w, stiffness)
            residual = self.A @ x - known
            residual[-1] -= h**2 * (force + before)
            change = spla.spsolve(self.A - h**2 * slope * self.at_tip, residual)
            x[:-1] -= change[:-1]
            return float(change[-1]), 1.0

        return self._newton(equation, float(q[-1]), "beam"), known

    def _beam(self, known, u):
        x = np.append(spla.spsolve(self.inner, known[:-1] - self.column * u), u)
        return x, float((self.A @ x - known)[-1] / (2.0 * self.h**2))
