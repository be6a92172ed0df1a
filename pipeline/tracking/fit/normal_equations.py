"""Gathers the normal equations of one unit against a frame, by blocks of 8 x 8 pixels.

A block is what a codec quantises at once, so errors are alike within; and what a processor's cache
holds, so pixels are sampled first and summed after, many at a time.
"""

import math
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from pipeline.runtime import inlined
from pipeline.tracking.fit.template_cells import STEEP
from sim.core import Floats, Image, Singles

UNKNOWNS = 7  # ux, uy, theta; gain, offset, slope in x, slope in y
SIZE = 8
_MIDDLE = 0.5 * (SIZE - 1)
_PIXELS = SIZE * SIZE
_ONE, _TWO, _ROW, _LAST = np.array([1, 2, 3, SIZE - 1], np.uint64)
"""Indices without a sign, which count from the start alone, cost less."""
_LANES = 8
"""Numbers that a processor adds at once, or a multiple."""
_FEW = [(column + 2 * row) % 4 == 0 for row in range(SIZE) for column in range(SIZE)]
_COMPARED = np.array([[False] * _PIXELS, _FEW, [True] * _PIXELS], np.uint8)
"""Selects the pixels that are compared, by the kind of its cell and its place in the block."""


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
    """Holds the template of one unit: nodes as `unfold` makes them, cells, place at rest.

    Blocks whose middle is farther than ``reach`` (mm) from its own hold nothing of it. From row to
    row of the frame the unit moves by its drift, which is zero in the row of its middle.
    """

    nodes: Singles
    kind: Image
    half: float
    step: float
    x: float
    y: float
    reach: float
    row: float
    drift_x: float
    drift_y: float
    drift_turn: float


class FitBuffers(NamedTuple):
    """Arrays that the sums are made in.

    Attributes:
        rows: (7, 64) derivatives of the brightness after the unknowns, of a block's pixels.
        residual: (64,) brightness less the template's.
        weight: (64,) of the template, then with the robust one.
        weighted: (64,) a row with its weights.
        x, y: (64,) places on the unit.
        chosen: (64,) pixels that are compared.
        node: (64,) the first of the four about a pixel.
        across, along: (64,) place among these.
        mixed: (64, 4) what they tell.
        matrix: (7, 7) normal matrix, lower triangle.
        scores: (blocks, 7) right-hand sides by blocks.
        sums: (5,) information, the same with robust weights and with their loss's curvature;
            robust weights, the same with squared residuals.
    """

    rows: Singles
    residual: Singles
    weight: Singles
    weighted: Singles
    x: Singles
    y: Singles
    chosen: Indices
    node: Indices
    across: Singles
    along: Singles
    mixed: Singles
    matrix: Floats
    scores: Floats
    sums: Floats


def workspace(blocks: int) -> FitBuffers:
    """Allocates room for units of at most so many blocks."""

    def line() -> Singles:
        return np.zeros(_PIXELS, np.float32)

    return FitBuffers(
        np.zeros((UNKNOWNS, _PIXELS), np.float32),
        line(),
        line(),
        line(),
        line(),
        line(),
        np.zeros(_PIXELS, np.int32),
        np.zeros(_PIXELS, np.int32),
        line(),
        line(),
        np.zeros((_PIXELS, 4), np.float32),
        np.zeros((UNKNOWNS, UNKNOWNS)),
        np.zeros((blocks, UNKNOWNS)),
        np.zeros(5),
    )


@inlined
def _place(
    scene: FramePixels, look: TemplateArrays, state: Floats, top: int, left: int, room: FitBuffers
) -> None:
    """Fills x, y with where a block's pixels are on the unit, in steps of the template's nodes."""
    block = scene.blocks[top // SIZE, left // SIZE]
    late = top + _MIDDLE - look.row
    turn = state[2] + late * look.drift_turn
    cos, sin = math.cos(turn) / look.step, math.sin(turn) / look.step
    vx = block[0, 0] - look.x - state[0] - late * look.drift_x
    vy = block[0, 1] - look.y - state[1] - late * look.drift_y
    down_x = block[2, 0] - look.drift_x + look.drift_turn * vy
    down_y = block[2, 1] - look.drift_y - look.drift_turn * vx
    ahead_x = np.float32(cos * block[1, 0] + sin * block[1, 1])
    ahead_y = np.float32(cos * block[1, 1] - sin * block[1, 0])
    for row in range(SIZE):
        x, y = room.x[SIZE * row : SIZE * (row + 1)], room.y[SIZE * row : SIZE * (row + 1)]
        below = row - _MIDDLE
        x_at, y_at = vx + below * down_x, vy + below * down_y
        start_x = np.float32(cos * x_at + sin * y_at) - np.float32(_MIDDLE) * ahead_x
        start_y = np.float32(cos * y_at - sin * x_at) - np.float32(_MIDDLE) * ahead_y
        for column in range(SIZE):
            x[column] = start_x + np.float32(column) * ahead_x
            y[column] = start_y + np.float32(column) * ahead_y


@inlined
def _select(look: TemplateArrays, room: FitBuffers) -> int:
    """Lists in chosen the pixels of a block that are to be compared; returns their number.

    Fills node, across and along of all; cells at the rim of a template are empty.
    """
    node, chosen, kind = room.node, room.chosen, look.kind.reshape(-1)
    size, zero = look.kind.shape[0], np.float32(0)
    middle, most = np.float32((size - 1) // 2), np.float32(size - 1)
    for k in range(_PIXELS):
        u = min(max(room.x[k] + middle, zero), most)
        v = min(max(room.y[k] + middle, zero), most)
        iu, iv = np.int32(u), np.int32(v)
        node[k] = iv * np.int32(size) + iu
        room.across[k], room.along[k] = u - np.float32(iu), v - np.float32(iv)
    n = 0
    for k in range(_PIXELS):
        chosen[n] = k
        n += _COMPARED[kind[np.uint32(node[k])], k]
    return n


@inlined
def _sample(
    scene: FramePixels, look: TemplateArrays, top: int, left: int, count: int, room: FitBuffers
) -> int:
    """Reads frame and template at the pixels that are compared; returns their number, filled up.

    Fills x, y, residual with the frame's brightness, weight, and rows 0, 1, 3 with slopes and value
    of the template: mixed of those that the four nodes about a pixel extrapolate to halfway, which
    is exact for parabolas. There are pixels without weight up to the next multiple of `_LANES`.
    """
    nodes, kind, mixed, rows = look.nodes.reshape(-1), look.kind.reshape(-1), room.mixed, room.rows
    one, half, four = np.float32(1), np.float32(0.5), np.uint64(4)
    line = four * np.uint64(look.nodes.shape[1])
    x, y, chosen = room.x, room.y, room.chosen
    for n in range(np.uint64(count)):
        k = np.uint64(chosen[n])
        room.residual[n] = scene.image[np.uint64(top) + (k >> _ROW), np.uint64(left) + (k & _LAST)]
        x[n], y[n] = x[k], y[k]  # k is n or beyond
        node = np.uint64(room.node[k])
        rows[2, n] = np.float32(kind[node] == STEEP)
        a = four * node
        c = a + line
        fu, fv = room.across[k], room.along[k]
        gu, gv = one - fu, one - fv
        wa, wb, wc, wd = gu * gv, fu * gv, gu * fv, fu * fv
        for i in range(four):
            b, d = a + i + four, c + i + four
            mixed[n, i] = wa * nodes[a + i] + wb * nodes[b] + wc * nodes[c + i] + wd * nodes[d]
        u, v = a + _ONE, a + _TWO
        bow_u = gv * (nodes[u] - nodes[u + four])
        bow_u += fv * (nodes[u + line] - nodes[u + line + four])
        bow_v = gu * (nodes[v] - nodes[v + line])
        bow_v += fu * (nodes[v + four] - nodes[v + line + four])
        rows[3, n] = half * (fu * gu * bow_u + fv * gv * bow_v)
    for n in range(count):
        rows[3, n] += mixed[n, 0]
        rows[0, n] = rows[2, n] * mixed[n, 1]
        rows[1, n] = rows[2, n] * mixed[n, 2]
        room.weight[n] = mixed[n, 3]
    whole = -(-count // _LANES) * _LANES
    for n in range(count, whole):
        room.weight[n] = room.residual[n] = rows[0, n] = rows[1, n] = rows[3, n] = 0
    return whole


@inlined
def _derive(look: TemplateArrays, state: Floats, pixels: int, room: FitBuffers) -> None:
    """Turns slopes and value of the template into derivatives and residual of the frame."""
    rows, residual = room.rows, room.residual
    cos, sin = np.float32(math.cos(state[2])), np.float32(math.sin(state[2]))
    step = np.float32(look.step)
    steepness, per_half = np.float32(state[3] / look.step), np.float32(look.step / look.half)
    gain, offset = np.float32(state[3]), np.float32(state[4])
    slope_x, slope_y = np.float32(state[5]), np.float32(state[6])
    for k in range(pixels):
        along_x, along_y = steepness * rows[0, k], steepness * rows[1, k]
        x, y = room.x[k], room.y[k]
        rows[0, k] = -cos * along_x + sin * along_y
        rows[1, k] = -sin * along_x - cos * along_y
        rows[2, k] = (along_x * y - along_y * x) * step
        rows[4, k] = 1
        lit = per_half * rows[3, k]
        rows[5, k] = x * lit
        rows[6, k] = y * lit
        model = gain * rows[3, k] + offset + slope_x * rows[5, k] + slope_y * rows[6, k]
        residual[k] -= model


@inlined
def _weigh(room: FitBuffers, tight: float, pixels: int) -> None:
    """Applies robust weights of Geman and McClure, and adds to the sums."""
    rows, residual, weight = room.rows, room.residual, room.weight
    full = left = curved = total = squares = np.float32(0)
    narrow = np.float32(tight)
    for k in range(pixels):
        here = weight[k]
        steep = rows[0, k] * rows[0, k] + rows[1, k] * rows[1, k]
        square = residual[k] * residual[k]
        closeness = np.float32(1) / (np.float32(1) + square * narrow)
        robust = here * closeness * closeness
        weight[k] = robust
        full += here * steep
        left += robust * steep
        curved += robust * steep * (np.float32(4) * closeness - np.float32(3))
        total += robust
        squares += robust * square
    room.sums[0] += full
    room.sums[1] += left
    room.sums[2] += curved
    room.sums[3] += total
    room.sums[4] += squares


@inlined
def _add(room: FitBuffers, scores: Floats, pixels: int) -> None:
    """Adds a block to the matrix and fills its scores."""
    rows, residual, weight, matrix = room.rows, room.residual, room.weight, room.matrix
    scaled = room.weighted
    for i in range(UNKNOWNS):
        score = np.float32(0)
        for k in range(pixels):
            scaled[k] = weight[k] * rows[i, k]
            score += scaled[k] * residual[k]
        scores[i] = score
        for j in range(i + 1):
            product = np.float32(0)
            for k in range(pixels):
                product += scaled[k] * rows[j, k]
            matrix[i, j] += product


@inlined
def _within(scene: FramePixels, look: TemplateArrays, state: Floats, top: int, left: int) -> bool:
    middle = scene.blocks[top // SIZE, left // SIZE, 0]
    x, y = middle[0] - look.x - state[0], middle[1] - look.y - state[1]
    return x * x + y * y < look.reach * look.reach


@inlined
def gather_equations(
    scene: FramePixels,
    look: TemplateArrays,
    state: Floats,
    box: Floats,
    every: int,
    tight: float,
    room: FitBuffers,
) -> int:
    """Fills matrix, scores and sums; returns the number of blocks.

    Args:
        scene: the frame.
        look: the unit.
        state: (7,) pose and photometry.
        box: top, bottom, left, right of the pixels to look at, the first of each on a block.
        every: one of so many blocks is taken.
        tight: one over the squared scale of the robust weights.
        room: filled.
    """
    room.matrix[:] = 0.0
    room.sums[:] = 0.0
    count = 0
    for top in range(int(box[0]), int(box[1]), SIZE):
        for left in range(int(box[2]), int(box[3]), SIZE):
            if every > 1 and (top // SIZE + left // SIZE) % every:
                continue
            if not _within(scene, look, state, top, left):
                continue
            _place(scene, look, state, top, left, room)
            pixels = _sample(scene, look, top, left, _select(look, room), room)
            if pixels > 0:
                _derive(look, state, pixels, room)
                _weigh(room, tight, pixels)
                _add(room, room.scores[count], pixels)
                count += 1
    return count


@inlined
def _factor(matrix: Floats, factor: Floats) -> bool:
    """Factors by Cholesky from the lower triangle; returns False if it is singular."""
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
