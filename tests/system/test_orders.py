"""The order of each scheme, from both sides."""

import bodies
import numpy as np
import pytest
from scenes import soft

#: Length of a smooth phase: the tip comes down on the spring at its start, and stays with it [s].
T = 0.064
TIE = {"law": "tie"}
LINK = {"law": "link", "stiffness": 1e3, "damping": 1.0}
COMPLIANCE = {"law": "compliance", "stiffness": 1e6, "exponent": 3.0}
SCHEMES = [
    # The law, scheme and degree, the order, and a number of steps whose errors are above rounding and asymptotic.
    (TIE, "energy", 0, 4, 64),
    (TIE, "energy", 1, 4, 32),
    (TIE, "energy", 2, 8, 8),
    (LINK, "energy", 0, 2, 32),
    (LINK, "energy", 1, 4, 16),
    (LINK, "energy", 2, 6, 16),
    (COMPLIANCE, "energy", 0, 2, 64),
    (COMPLIANCE, "energy", 1, 4, 32),
    (COMPLIANCE, "energy", 2, 6, 16),
    (COMPLIANCE, "jacobi", 0, 1, 256),
    (COMPLIANCE, "jacobi", 1, 2, 256),
    (COMPLIANCE, "gauss_seidel", 0, 1, 256),
    (COMPLIANCE, "gauss_seidel", 1, 2, 256),
]


def halfway(contact, scheme, degree, count):
    """Return motions at T/2, and the force of a soft law, by ``count`` steps of bodies that are exact to rounding."""
    coupling = {"scheme": scheme, "degree": degree, "macro_step": T / count}
    run = bodies.simulate(
        soft(3, stop=None, time={"t_end": T}, contact=contact, spring={"damping": 0.5}, coupling=coupling)
    )
    row = np.abs(run.time - 0.5 * T).argmin()
    forces = () if run.scene.contact.rigid else ("contact_force",)
    return np.array([run[name][row] for name in ("u_tip", "y", "v_tip", "z", *forces)])


@pytest.mark.parametrize(("contact", "scheme", "degree", "order", "count"), SCHEMES)
def test_order(contact, scheme, degree, order, count):
    """Beside degree 2 in 256 steps. The force of a tie is that of `crosscheck --orders` (test_crosscheck.py)."""
    exact = halfway(contact, "energy", 2, 256)
    coarse, fine = (np.abs(halfway(contact, scheme, degree, n) - exact) for n in (count, 2 * count))
    assert np.log2(coarse / fine) == pytest.approx(np.full(len(exact), order), abs=0.25)
