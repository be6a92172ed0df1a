"""Classifies the cells of a template's nodes: pixels are compared in some, and what is read there.

Where the template is flat, a pixel tells of the brightness alone: one of four is enough.
"""

from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pipeline.runtime import compiled, uncounted
from sim.core import Floats, Image, Singles

EMPTY, FLAT, STEEP = np.uint8(0), np.uint8(1), np.uint8(2)
_STEEP, _NOISY, _MEAN_NOISY = 0.04, 3.0, 1.5
"""Change from node to node in a cell that tells of the place, at least: in contrasts of the unit;
in standard deviations of the template's noise; and in these, if it is the mean of four changes."""
_LANES = 8
"""Nodes that a processor unfolds at once: what is left of a row costs as much for each."""

NodeSpans: TypeAlias = NDArray[np.int32]


class TemplateCells(NamedTuple):
    """Cells between the nodes of templates; that of a node reaches to the next ones.

    Attributes:
        kind: (units, rows, columns) EMPTY, FLAT or STEEP.
        span: (units, rows, 2) first node of the row that a cell with weight, or one beside it,
            needs, and the last one's follower.
    """

    kind: Image
    span: NodeSpans


def classify_templates(
    brightness: Singles, weight: Singles, contrast: Floats, noise: float = 0.0
) -> TemplateCells:
    """Classifies the cells of templates (units, rows, columns); see `classify`."""
    made = TemplateCells(
        np.empty(weight.shape, np.uint8), np.empty((*weight.shape[:2], 2), np.int32)
    )
    for unit in range(len(weight)):
        looks = brightness[unit], weight[unit], contrast[unit], noise
        classify(*looks, made.kind[unit], made.span[unit])
    return made


@compiled
def classify(
    brightness: Singles,
    weight: Singles,
    contrast: float,
    noise: float,
    kind: Image,
    span: NodeSpans,
) -> None:
    """Fills kind (rows, columns) and span (rows, 2) of one template; cells at the rim are empty.

    Args:
        brightness: (rows, columns) of the nodes.
        weight: (rows, columns) of the nodes.
        contrast: standard deviation of the brightness.
        noise: of the brightness.
        kind: filled.
        span: filled.
    """
    size = weight.shape[0]
    least = np.float32(max(_STEEP * contrast, _NOISY * noise))
    least_sum = np.float32(4 * max(_STEEP * contrast, _MEAN_NOISY * noise))
    kind[:] = EMPTY
    span[:] = 0
    for row in range(2, size - 3):
        first, last = size, 0
        for k in range(2, size - 3):
            a, b = brightness[row, k], brightness[row, k + 1]
            c, d = brightness[row + 1, k], brightness[row + 1, k + 1]
            upper, lower = (
                weight[row, k] + weight[row, k + 1],
                weight[row + 1, k] + weight[row + 1, k + 1],
            )
            if upper + lower > 0:
                across = max(abs(b - a), abs(d - c))
                along = max(abs(c - a), abs(d - b))
                across_all = along_all = np.float32(0)
                for j in range(-1, 3):
                    across_all += brightness[row + j, k + 1] - brightness[row + j, k]
                    along_all += brightness[row + 1, k + j] - brightness[row, k + j]
                steep = max(across, along) > least
                steep |= max(abs(across_all), abs(along_all)) > least_sum
                kind[row, k] = STEEP if steep else FLAT
                first, last = min(first, max(k - 1, 2)), min(k + 3, size - 2)
        if last > 0:
            for line in range(max(row - 1, 2), min(row + 3, size - 2)):
                span[line, 0] = min(first, span[line, 0]) if span[line, 1] > 0 else first
                span[line, 1] = max(last, span[line, 1])


@uncounted
def unfold(brightness: Singles, weight: Singles, span: NodeSpans, nodes: Singles) -> None:
    """Fills nodes (4 rows columns,) in the spans: brightness, its slopes in x and y, and weight.

    The slopes are differences of fourth order, per node. One unit's nodes at a time fit a
    processor's cache, which all units' do not. Beyond the spans, which are filled up to what a
    processor does at once, they stay as they are.
    """
    near, far, size = np.float32(8 / 12), np.float32(1 / 12), brightness.shape[1]
    faces, masks = brightness.reshape(-1), weight.reshape(-1)
    for row in range(2, size - 2):
        begin, count = span[row, 0], span[row, 1] - span[row, 0]
        if count <= 0:
            continue
        count, first = min(-(-count // _LANES) * _LANES, size - 2 - begin), size * row + begin
        at, mask, out = faces[first:], masks[first:], nodes[4 * first :]
        left, right = faces[first - 1 :], faces[first + 1 :]
        farther_left, farther_right = faces[first - 2 :], faces[first + 2 :]
        low, high = faces[first - size :], faces[first + size :]
        lowest, highest = faces[first - 2 * size :], faces[first + 2 * size :]
        for k in range(count):
            x, farther_x = right[k] - left[k], farther_right[k] - farther_left[k]
            y, farther_y = high[k] - low[k], highest[k] - lowest[k]
            out[4 * k] = at[k]
            out[4 * k + 1] = near * x - far * farther_x
            out[4 * k + 2] = near * y - far * farther_y
            out[4 * k + 3] = mask[k]
