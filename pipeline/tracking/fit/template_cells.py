"""Classifies the cells of a template's nodes: pixels are compared in some, and what is read there.

Where the template is flat, a pixel tells of the brightness alone: one of four is enough.
"""

from typing import NamedTuple

import numpy as np

from pipeline.runtime import compiled
from sim.core import Floats, Image, Ints, Singles

EMPTY, FLAT, STEEP = np.uint8(0), np.uint8(1), np.uint8(2)


class TemplateCells(NamedTuple):
    """Cells between the nodes of templates; that of a node reaches to the next ones.

    Attributes:
        kind: (units, rows, columns) EMPTY, FLAT or STEEP.
        span: (units, rows, 2) first node of the row that a cell with weight, or one beside it,
            needs, and the last one's follower.
    """

    kind: Image
    span: Ints


def classify_templates(
    brightness: Singles, weight: Singles, contrast: Floats, noise: float = 0.0
) -> TemplateCells:
    """Classifies the cells of templates (units, rows, columns); see `classify`."""
    made = TemplateCells(
        np.empty(weight.shape, np.uint8), np.empty((*weight.shape[:2], 2), np.int64)
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
    span: Ints,
    n_span: int = 0,
) -> None:
    """Fills kind (rows, columns) and span (rows, 2) of one template; cells at the rim are empty.

    Args:
        brightness: (rows, columns) of the nodes, as many of both.
        weight: (rows, columns) of the nodes.
        contrast: standard deviation of the brightness.
        noise: of the brightness.
        kind: filled.
        span: filled.
        n_span: number of rows.
    """


@compiled
def unfold(
    brightness: Singles, weight: Singles, span: Ints, nodes: Singles, n_span: int = 0
) -> None:
    """Fills nodes (4 rows columns,) in the spans: brightness, its slopes in x and y, and weight.

    The slopes are differences of fourth order, per node. Beyond the spans, which are filled up to
    what a processor does at once, the nodes stay as they are.
    """
