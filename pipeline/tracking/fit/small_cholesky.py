"""Small symmetric positive definite systems, in loops that call them for every unit."""

from __future__ import annotations

import math

from pipeline.runtime import inlined
from sim.core import Floats


@inlined
def _factor(matrix: Floats, factor: Floats) -> bool:
    """Cholesky factor from the lower triangle; False if it is singular."""
    for i in range(len(matrix)):
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= factor[i, k] * factor[j, k]
            if i != j:
                factor[i, j] = total / factor[j, j]
            elif total > 1e-10 * matrix[i, i]:
                factor[i, i] = math.sqrt(total)
            else:
                return False
    return True


@inlined
def invert(matrix: Floats, factor: Floats, inverse: Floats) -> bool:
    """Fills the inverse of a symmetric positive definite matrix; False if it is singular.

    Args:
        matrix: (n, n); its lower triangle is read.
        factor: (n, n) room for the Cholesky factor.
        inverse: (n, n) filled.
    """
    size = len(matrix)
    if not _factor(matrix, factor):
        return False
    for column in range(size):
        for i in range(size):
            total = 1.0 if i == column else 0.0
            for k in range(i):
                total -= factor[i, k] * inverse[k, column]
            inverse[i, column] = total / factor[i, i]
        for i in range(size - 1, -1, -1):
            total = inverse[i, column]
            for k in range(i + 1, size):
                total -= factor[k, i] * inverse[k, column]
            inverse[i, column] = total / factor[i, i]
    return True
