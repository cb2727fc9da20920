"""The couplings that studies run: scheme and degree, of rigid and of soft laws."""

from __future__ import annotations

_ENERGY = (("energy", 0), ("energy", 1), ("energy", 2))
RIGID = (*_ENERGY, ("hermite", 1), ("hermite", 2))
SOFT = (*_ENERGY, ("jacobi", 0), ("jacobi", 1), ("gauss_seidel", 0), ("gauss_seidel", 1))
