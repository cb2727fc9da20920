"""Vectors and matrices of one to three unknowns as lists of floats: numpy's overhead would be most of a step's time."""

from __future__ import annotations

from collections.abc import Iterable
from math import isfinite
from operator import mul, sub

import numpy as np

Vector = list[float]
Matrix = list[list[float]]


def times(A: Matrix, x: Vector) -> Vector:
    """Return A x."""
    return [sum(map(mul, row, x)) for row in A]


def transposed(rows: Iterable[Iterable[float]]) -> Matrix:
    return [list(column) for column in zip(*rows, strict=True)]


def less(A: Matrix, B: Matrix) -> Matrix:
    """Return A − B."""
    return [list(map(sub, *rows)) for rows in zip(A, B, strict=True)]


def inverse(A: Matrix) -> Matrix:
    """Return A⁻¹ of one to three unknowns by its minors, in a tenth of numpy's time.

    Raises numpy.linalg.LinAlgError if there is none.
    """
    if len(A) == 1:
        ((a,),) = A
        minors = [[1.0]]
        determinant = a
    elif len(A) == 2:
        (a, b), (c, d) = A
        minors = [[d, -b], [-c, a]]
        determinant = a * d - b * c
    else:
        first, second, third = A
        columns = [_cross(second, third), _cross(third, first), _cross(first, second)]
        minors = transposed(columns)
        determinant = sum(map(mul, first, columns[0]))
    if determinant == 0.0 or not isfinite(determinant):
        raise np.linalg.LinAlgError
    return [[minor / determinant for minor in row] for row in minors]


def _cross(a: Vector, b: Vector) -> Vector:
    """Return a × b."""
    x, y, z = a
    u, v, w = b
    return [y * w - z * v, z * u - x * w, x * v - y * u]


def broyden(descent: Matrix, step: Vector, residual: Vector) -> Matrix:
    """Return Broyden's rank-one update of D = −J⁻¹, J the Jacobian, after ``step``, which was to leave no residual.

    D + d (sᵀD) / (sᵀ(s − d)) with d = D r: Broyden (1965), in the form of Sherman and Morrison.
    """
    d = times(descent, residual)
    denominator = sum(s * (s - x) for s, x in zip(step, d, strict=True))
    if denominator == 0.0:
        return descent
    row = [sum(map(mul, step, column)) / denominator for column in zip(*descent, strict=True)]
    return [[x + y * z for x, z in zip(line, row, strict=True)] for line, y in zip(descent, d, strict=True)]
