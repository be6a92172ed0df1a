"""Selects the pixels of a frame that a unit is compared in, by blocks of 8 x 8 pixels.

A block is what a codec quantises at once, so errors are alike within.
"""

import math
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pipeline.runtime import inlined, uncounted
from pipeline.tracking.fit.template_cells import STEEP
from sim.core import Floats, Image, Singles

SIZE = 8
LANES = 8
"""Numbers that a processor adds at once; the pixels of a block are filled up to a multiple."""
UNROLLED = 32
"""Numbers that a compiled sum takes at once; the pixels of a quarter are filled up likewise."""
_MIDDLE = 0.5 * (SIZE - 1)
_PIXELS = SIZE * SIZE
_ROW, _LAST, _BEYOND = np.array([3, SIZE - 1, _PIXELS], np.uint64)
"""Indices without a sign, which count from the start alone, cost less."""
_ROWS, _COLUMNS = np.indices((SIZE, SIZE)).reshape(2, -1).astype(np.float32) - np.float32(_MIDDLE)
_FEW = [(column + 2 * row) % 4 == 0 for row in range(SIZE) for column in range(SIZE)]
_COMPARED = np.array([[False] * _PIXELS, _FEW, [True] * _PIXELS], np.uint8)
"""Selects the pixels that are compared, by the kind of its cell and its place in the block."""
_NUMBERS = _COMPARED.sum(axis=1).astype(np.int32)
_ALIKE = np.argsort(1 - _COMPARED, axis=1, kind="stable").astype(np.int32)
"""Number of these in a block whose cells are all of a kind, and their places, which come first."""
_QUARTERS = np.array([0, 2, 1, 3])
"""Order in which blocks are listed, by column and row: some of the first tell of the whole."""

Indices: TypeAlias = NDArray[np.int32]


class FramePixels(NamedTuple):
    """Holds a frame, and the places in the specimen's plane of its blocks' pixels.

    Attributes:
        image: (rows, columns) brightness.
        blocks: (rows, columns, 3, 2) place of a block's middle, change by column and by row, mm.
    """

    image: Singles
    blocks: Floats


class TemplateArrays(NamedTuple):
    """Holds the template of one unit: kinds of its cells, rows of so many, and place at rest.

    Blocks whose middle is farther than ``reach`` (mm) from its own hold nothing of it. From row to
    row of the frame the unit moves by its drift, which is zero in the row of its middle.
    """

    kind: Image
    size: int
    half: float
    step: float
    x: float
    y: float
    reach: float
    row: float
    drift_x: float
    drift_y: float
    drift_turn: float


class PixelLists(NamedTuple):
    """Arrays of the pixels that are compared, block by block.

    Attributes:
        x, y: (pixels,) places on the unit as it was posed when they were selected, in nodes.
        brightness: (pixels,) of the frame.
        steep: (pixels,) one where the template tells of the place, zero where it is flat, minus
            one of what only fills up.
        ends: (blocks + 1,) where each block begins in the list, and the last ends, in `LANES`.
        pixels, blocks: (4,) numbers of both in the first quarters of the blocks.
        offset, node, chosen: places, nodes and selection of one block's pixels.
        patch: brightness of the blocks about the unit, row by row.
    """

    x: Singles
    y: Singles
    brightness: Singles
    steep: Singles
    ends: Indices
    pixels: Indices
    blocks: Indices
    offset: Singles
    node: Indices
    chosen: Indices
    patch: Singles


def pixel_lists(blocks: int) -> PixelLists:
    """Allocates lists for units of at most so many blocks."""
    quarters = len(_QUARTERS)
    x, y, brightness, steep = np.zeros((4, blocks * _PIXELS + quarters * UNROLLED), np.float32)
    ends, pixels, counts = (np.zeros(size, np.int32) for size in (blocks + 1, quarters, quarters))
    offset = np.zeros(2 * _PIXELS, np.float32)
    node, chosen = np.zeros((2, _PIXELS), np.int32)
    patch = np.zeros(blocks * _PIXELS, np.float32)
    return PixelLists(x, y, brightness, steep, ends, pixels, counts, offset, node, chosen, patch)


@inlined
def _place(
    scene: FramePixels, look: TemplateArrays, pose: Floats, top: int, left: int, out: Singles
) -> None:
    """Fills x, then y, with where a block's pixels are on the unit, in nodes."""
    block = scene.blocks[top // SIZE, left // SIZE]
    late = top + _MIDDLE - look.row
    turn = pose[2] + late * look.drift_turn
    cos, sin = math.cos(turn) / look.step, math.sin(turn) / look.step
    vx = block[0, 0] - look.x - pose[0] - late * look.drift_x
    vy = block[0, 1] - look.y - pose[1] - late * look.drift_y
    down_x = block[2, 0] - look.drift_x + look.drift_turn * vy
    down_y = block[2, 1] - look.drift_y - look.drift_turn * vx
    x, y = np.float32(cos * vx + sin * vy), np.float32(cos * vy - sin * vx)
    ahead_x = np.float32(cos * block[1, 0] + sin * block[1, 1])
    ahead_y = np.float32(cos * block[1, 1] - sin * block[1, 0])
    below_x = np.float32(cos * down_x + sin * down_y)
    below_y = np.float32(cos * down_y - sin * down_x)
    for k in range(_PIXELS):
        out[k] = x + _COLUMNS[k] * ahead_x + _ROWS[k] * below_x
        out[_PIXELS + k] = y + _COLUMNS[k] * ahead_y + _ROWS[k] * below_y


@inlined
def _choose(look: TemplateArrays, lists: PixelLists) -> int:
    """Lists in chosen the pixels of a block that are to be compared; returns their number.

    Fills node of all; cells at the rim of a template are empty.
    """
    offset, node, chosen, kind = lists.offset, lists.node, lists.chosen, look.kind
    size, zero = look.size, np.float32(0)
    middle, most = np.float32((size - 1) // 2), np.float32(size - 1)
    for k in range(_PIXELS):
        u = min(max(offset[k] + middle, zero), most)
        v = min(max(offset[_PIXELS + k] + middle, zero), most)
        node[k] = np.int32(v) * np.int32(size) + np.int32(u)
    least = most_kind = kind[np.uint32(node[0])]
    for k in range(1, _PIXELS):
        least = min(least, kind[np.uint32(node[k])])
        most_kind = max(most_kind, kind[np.uint32(node[k])])
    if least == most_kind:
        for j in range(_NUMBERS[least]):
            chosen[j] = _ALIKE[least, j]
        return int(_NUMBERS[least])
    n = 0
    for k in range(_PIXELS):
        chosen[n] = k
        n += _COMPARED[kind[np.uint32(node[k])], k]
    return n


@inlined
def _fill(lists: PixelLists, first: int, end: int) -> None:
    for n in range(first, end):
        lists.x[n] = lists.y[n] = lists.brightness[n] = np.float32(0)
        lists.steep[n] = np.float32(-1)


@inlined
def cut_out(scene: FramePixels, box: Floats, lists: PixelLists) -> None:
    """Copies the patch in the box, in the order in which it lies in the memory."""
    top, left = int(box[0]), int(box[2])
    wide = -(-(int(box[3]) - left) // SIZE) * SIZE
    for row in range(-(-(int(box[1]) - top) // SIZE) * SIZE):
        seen, patch = scene.image[top + row, left:], lists.patch[wide * row :]
        for column in range(wide):
            patch[column] = seen[column]


@inlined
def _list(
    look: TemplateArrays, first: int, wide: int, count: int, n: int, lists: PixelLists
) -> None:
    """Appends pixels of a block, whose first stands there in the patch, to the lists' n."""
    kind, offset, patch = look.kind, lists.offset, lists.patch
    corner, line = np.uint64(first), np.uint64(wide)
    x, y, brightness, steep = lists.x[n:], lists.y[n:], lists.brightness[n:], lists.steep[n:]
    for j in range(count):
        k = np.uint64(lists.chosen[j])
        x[j], y[j] = offset[k], offset[k + _BEYOND]
        brightness[j] = patch[corner + line * (k >> _ROW) + (k & _LAST)]
        # a comparison would become a branch, which goes either way at every edge
        steep[j] = np.float32(kind[np.uint32(lists.node[k])] // STEEP)


@inlined
def _within(scene: FramePixels, look: TemplateArrays, pose: Floats, top: int, left: int) -> bool:
    middle = scene.blocks[top // SIZE, left // SIZE, 0]
    x, y = middle[0] - look.x - pose[0], middle[1] - look.y - pose[1]
    return x * x + y * y < look.reach * look.reach


@uncounted
def select_pixels(
    scene: FramePixels, look: TemplateArrays, pose: Floats, box: Floats, lists: PixelLists
) -> None:
    """Fills the lists with blocks of a first, a second and the other two quarters.

    Args:
        scene: the frame.
        look: the unit.
        pose: (3,) of the unit.
        box: top, bottom, left, right of the pixels to look at, the first of each on a block.
        lists: with the patch; filled.
    """
    n = blocks = 0
    wide = -(-(int(box[3]) - int(box[2])) // SIZE) * SIZE
    lists.ends[0] = 0
    for part in range(len(_QUARTERS)):
        for top in range(int(box[0]), int(box[1]), SIZE):
            row = top // SIZE
            start = int(box[2]) + SIZE * ((_QUARTERS[part] - row - int(box[2]) // SIZE) % 4)
            for left in range(start, int(box[3]), 4 * SIZE):
                if not _within(scene, look, pose, top, left):
                    continue
                _place(scene, look, pose, top, left, lists.offset)
                count = _choose(look, lists)
                if count > 0:
                    _list(
                        look, wide * (top - int(box[0])) + left - int(box[2]), wide, count, n, lists
                    )
                    whole = n + -(-count // LANES) * LANES
                    _fill(lists, n + count, whole)
                    n, blocks = whole, blocks + 1
                    lists.ends[blocks] = n // LANES
        whole = -(-n // UNROLLED) * UNROLLED
        _fill(lists, n, whole)
        n, lists.ends[blocks] = whole, whole // LANES
        lists.pixels[part], lists.blocks[part] = n, blocks
