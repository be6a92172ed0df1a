"""Cubic B-splines on regular grids: coefficients, values and gradients (Unser, 1999)."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import spline_filter

from pipeline.runtime import compiled, inlined
from sim.core import Floats, Singles

TAPS = 4


def spline_coefficients(values: Floats) -> Singles:
    """Coefficients of the cubic spline through an image or grid (rows, columns)."""
    return np.asarray(spline_filter(values, order=3, mode="mirror", output=np.float64), np.float32)


@inlined
def spline_weights(offset: float, value: Floats, slope: Floats) -> None:
    """Fills the four basis values and slopes at ``offset`` in [0, 1) behind the second knot."""
    rest = 1.0 - offset
    square, rest_square = offset * offset, rest * rest
    value[0] = rest_square * rest / 6
    value[1] = 2 / 3 - 0.5 * square * (2 - offset)
    value[2] = 2 / 3 - 0.5 * rest_square * (2 - rest)
    value[3] = square * offset / 6
    slope[0] = -0.5 * rest_square
    slope[1] = 1.5 * square - 2 * offset
    slope[2] = 2 * rest - 1.5 * rest_square
    slope[3] = 0.5 * square


@compiled
def sample_spline(coefs: Singles, x: Floats, y: Floats, out: Floats) -> None:
    """Values at points (column ``x``, row ``y``); NaN where the four by four knots do not fit."""
    rows, columns = coefs.shape
    wx, wy, slope = np.empty(TAPS), np.empty(TAPS), np.empty(TAPS)
    for k in range(x.size):
        column, row = int(np.floor(x[k])), int(np.floor(y[k]))
        if column < 1 or row < 1 or column > columns - 3 or row > rows - 3:
            out[k] = np.nan
            continue
        spline_weights(x[k] - column, wx, slope)
        spline_weights(y[k] - row, wy, slope)
        total = 0.0
        for a in range(TAPS):
            line = 0.0
            for b in range(TAPS):
                line += wx[b] * coefs[row - 1 + a, column - 1 + b]
            total += wy[a] * line
        out[k] = total
