"""Holds a frame by blocks of 8 x 8 pixels, in which units are compared with it."""

from typing import NamedTuple

from sim.core import Floats, Singles

SIZE = 8


class FramePixels(NamedTuple):
    """Holds a frame, and the places in the specimen's plane of its blocks' pixels.

    Attributes:
        image: (rows, columns) brightness.
        columns: number of them.
        blocks: (rows, columns, 3, 2) place of a block's middle, change by column and by row, mm;
            of all whole blocks.
    """

    image: Singles
    columns: int
    blocks: Floats
