"""Classifies the cells of a template's nodes: pixels are compared in some, and what is read there.

Where the template is flat, a pixel tells of the brightness alone: one of four is enough.
"""

from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pipeline.runtime import compiled, inlined
from sim.core import Floats, Image, Singles

EMPTY, FLAT, STEEP = np.uint8(0), np.uint8(1), np.uint8(2)
_STEEP = 0.04
"""Change from node to node in a cell that tells of the place, in contrasts of the unit."""

NodeSpans: TypeAlias = NDArray[np.int32]


class TemplateCells(NamedTuple):
    """Cells between the nodes of templates; that of a node reaches to the next ones.

    Attributes:
        kind: (units, rows, columns) EMPTY, FLAT or STEEP.
        span: (units, rows, 2) first node of the row that a cell with weight needs, and the last
            one's follower.
    """

    kind: Image
    span: NodeSpans


def classify_templates(brightness: Singles, weight: Singles, contrast: Floats) -> TemplateCells:
    """Classifies the cells of templates (units, rows, columns)."""
    made = TemplateCells(
        np.empty(weight.shape, np.uint8), np.empty((*weight.shape[:2], 2), np.int32)
    )
    for unit in range(len(weight)):
        classify(brightness[unit], weight[unit], contrast[unit], made.kind[unit], made.span[unit])
    return made


@compiled
def classify(
    brightness: Singles, weight: Singles, contrast: float, kind: Image, span: NodeSpans
) -> None:
    """Fills kind (rows, columns) and span (rows, 2) of one template; cells at the rim are empty.

    Args:
        brightness: (rows, columns) of the nodes.
        weight: (rows, columns) of the nodes.
        contrast: standard deviation of the brightness.
        kind: filled.
        span: filled.
    """
    size = weight.shape[0]
    least = np.float32(_STEEP * contrast)
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
                kind[row, k] = STEEP if max(across, along) > least else FLAT
                first, last = min(first, k), k + 2
        if last > 0:
            for line in (row, row + 1):
                span[line, 0] = min(first, span[line, 0]) if span[line, 1] > 0 else first
                span[line, 1] = max(last, span[line, 1])


@inlined
def unfold(brightness: Singles, weight: Singles, span: NodeSpans, nodes: Singles) -> None:
    """Fills nodes (rows, columns, 4) in the spans: brightness, its slopes in x and y, and weight.

    The slopes are differences of fourth order, per node. One unit's nodes at a time fit a
    processor's cache, which all units' do not; beyond the spans they stay as they are.
    """
    near, far = np.float32(8 / 12), np.float32(1 / 12)
    for row in range(2, brightness.shape[0] - 2):
        for k in range(span[row, 0], span[row, 1]):
            nodes[row, k, 0] = brightness[row, k]
            nodes[row, k, 1] = near * (brightness[row, k + 1] - brightness[row, k - 1]) - far * (
                brightness[row, k + 2] - brightness[row, k - 2]
            )
            nodes[row, k, 2] = near * (brightness[row + 1, k] - brightness[row - 1, k]) - far * (
                brightness[row + 2, k] - brightness[row - 2, k]
            )
            nodes[row, k, 3] = weight[row, k]
