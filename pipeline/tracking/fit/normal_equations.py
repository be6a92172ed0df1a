"""Gathers the normal equations of one unit against a frame.

Pixels are taken by windows that a processor's cache holds, in loops over arrays that lie at fixed
distances from each other: only then compilers know that what one loop writes is not what it reads.
The equations are those of the slopes in the unit's own frame, its brightness, the light and its
slopes; `transform` makes them those of the unknowns.
"""

import math
from typing import NamedTuple

import numpy as np

from pipeline.runtime import inlined, uncounted
from pipeline.tracking.fit.compared_pixels import LANES, Indices, PixelLists, TemplateArrays
from pipeline.tracking.fit.node_mixing import mix_nodes
from sim.core import Floats, Image, Singles

UNKNOWNS = 7  # ux, uy, theta; gain, offset, slope in x, slope in y
_WINDOW = 512
_APART = _WINDOW + 16  # not a power of two, whose multiples share a place in the cache
_SLOPE_X, _SLOPE_Y, _TURN, _FACE, _ONE, _X, _Y, *_OTHERS = (_APART * k for k in range(18))
"""Arrays of a window: derivatives in the order of the unknowns, and others."""
_ACROSS, _ALONG, _MIXED, _MIXED_X, _MIXED_Y, _WEIGHT, _RIGHT, _LOWER, _RESIDUAL, _ROOM, _END = (
    _OTHERS
)
_STRIDE = np.uint64(_APART)


class FitBuffers(NamedTuple):
    """Arrays that a fit is made in; compiled loops allocate none.

    Attributes:
        nodes, kind: (4 n n,) nodes of the template of one unit; (n n,) kinds of its cells.
        window: arrays of the pixels of a window, one after the other.
        node: (window,) first number of the first of the four nodes about a pixel.
        pairs, fours: sums of neighbours in a window.
        lanes: (7, pixels / `LANES`) weighted residuals times derivatives, by `LANES` of pixels.
        matrix, factor, inverse, scatter: (7, 7) normal matrix, its Cholesky factor, its inverse,
            sum of the blocks' scores times themselves.
        score, step, part: (7,) right-hand side, Gauss-Newton step, score of a block.
        sums: (5,) information, the same with robust weights and with their loss's curvature;
            robust weights, the same with squared residuals.
        state, at: (7,) pose and photometry, and before the last step.
        selected, moved: (3,) pose in which the pixels were selected, and how it has moved since, in
            the unit's own frame as it was then, in nodes and rad.
        box: (4,) rows and columns.
    """

    nodes: Singles
    kind: Image
    window: Singles
    node: Indices
    pairs: Singles
    fours: Singles
    lanes: Singles
    matrix: Floats
    factor: Floats
    inverse: Floats
    scatter: Floats
    score: Floats
    step: Floats
    part: Floats
    sums: Floats
    state: Floats
    at: Floats
    selected: Floats
    moved: Floats
    box: Floats


def fit_buffers(pixels: int, nodes: int) -> FitBuffers:
    """Allocates room for units of at most so many pixels, with so many nodes."""
    window = np.zeros(_END, np.float32)
    window[_ONE : _ONE + _WINDOW] = 1.0
    square, line = (UNKNOWNS, UNKNOWNS), UNKNOWNS
    return FitBuffers(
        nodes=np.zeros(4 * nodes, np.float32),
        kind=np.zeros(nodes, np.uint8),
        window=window,
        node=np.zeros(_WINDOW, np.int32),
        pairs=np.zeros(_WINDOW // 2, np.float32),
        fours=np.zeros(_WINDOW // 4, np.float32),
        lanes=np.zeros((UNKNOWNS, pixels // LANES + 1), np.float32),
        matrix=np.zeros(square),
        factor=np.zeros(square),
        inverse=np.zeros(square),
        scatter=np.zeros(square),
        score=np.zeros(line),
        step=np.zeros(line),
        part=np.zeros(line),
        sums=np.zeros(5),
        state=np.zeros(line),
        at=np.zeros(line),
        selected=np.zeros(3),
        moved=np.zeros(3),
        box=np.zeros(4),
    )


@inlined
def _sample(
    look: TemplateArrays, lists: PixelLists, first: int, count: int, room: FitBuffers
) -> None:
    """Reads the template at pixels of the lists, on a unit that has moved since they were made.

    The brightness is mixed of what the four nodes about a pixel extrapolate to halfway, which is
    exact for parabolas.
    """
    window, node, size, moved = room.window, room.node, look.size, room.moved
    line = np.uint64(4 * size)
    zero, one, half, four = np.float32(0), np.float32(1), np.float32(0.5), np.uint64(4)
    middle, most = np.float32((size - 1) // 2), np.float32(size - 2)
    cos, sin = np.float32(math.cos(moved[2])), np.float32(math.sin(moved[2]))
    shift_x, shift_y = np.float32(moved[0]), np.float32(moved[1])
    x, y, steep = lists.x[first:], lists.y[first:], lists.steep[first:]
    for n in range(count):
        from_x, from_y = x[n] - shift_x, y[n] - shift_y
        window[_X + n] = cos * from_x + sin * from_y
        window[_Y + n] = cos * from_y - sin * from_x
    for n in range(count):
        u = min(max(window[_X + n] + middle, zero), most)
        v = min(max(window[_Y + n] + middle, zero), most)
        iu, iv = np.int32(u), np.int32(v)
        node[n] = iv * np.int32(size) + iu
        window[_ACROSS + n], window[_ALONG + n] = u - np.float32(iu), v - np.float32(iv)
    for n in range(count):
        upper = four * np.uint64(np.uint32(node[n]))
        across, along = window[_ACROSS + n], window[_ALONG + n]
        both = across * along
        weights = (one - across - along + both, across - both, along - both, both)
        mix_nodes(room.nodes, upper, upper + line, weights, window, np.uint64(_MIXED + n), _STRIDE)
    for n in range(count):
        slope_x, slope_y = window[_MIXED_X + n], window[_MIXED_Y + n]
        bow_x = window[_ACROSS + n] * slope_x - window[_RIGHT + n]
        bow_y = window[_ALONG + n] * slope_y - window[_LOWER + n]
        window[_FACE + n] = window[_MIXED + n] + half * (bow_x + bow_y)
        told = max(steep[n], zero)
        window[_SLOPE_X + n], window[_SLOPE_Y + n] = told * slope_x, told * slope_y
        window[_WEIGHT + n] *= min(steep[n], zero) + one


@inlined
def _weigh(
    look: TemplateArrays,
    state: Floats,
    tight: float,
    brightness: Singles,
    count: int,
    room: FitBuffers,
) -> None:
    """Fills residuals, with robust weights of Geman and McClure, and adds to the sums.

    Places become the derivatives after the slopes of the light, which scales what it falls on.
    """
    window, per_half = room.window, np.float32(look.step / look.half)
    gain, offset = np.float32(state[3]), np.float32(state[4])
    slope_x, slope_y = np.float32(state[5]) * per_half, np.float32(state[6]) * per_half
    full = left = curved = total = squares = np.float32(0)
    one, narrow = np.float32(1), np.float32(tight)
    for n in range(count):
        x, y, weight = window[_X + n], window[_Y + n], window[_WEIGHT + n]
        along_x, along_y = window[_SLOPE_X + n], window[_SLOPE_Y + n]
        window[_TURN + n] = along_x * y - along_y * x
        face = window[_FACE + n]
        lit_x, lit_y = x * face, y * face
        window[_X + n], window[_Y + n] = lit_x, lit_y
        residual = brightness[n] - (gain * face + offset + slope_x * lit_x + slope_y * lit_y)
        steep, square = along_x * along_x + along_y * along_y, residual * residual
        closeness = one / (one + square * narrow)
        robust = weight * closeness * closeness
        window[_RESIDUAL + n], window[_WEIGHT + n] = residual * robust, robust
        full += weight * steep
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
def _add(count: int, room: FitBuffers) -> None:
    """Adds the weighted products of the derivatives to the lower triangle of the matrix."""
    window, matrix = room.window, room.matrix
    for i in range(UNKNOWNS):
        for n in range(count):
            window[_ROOM + n] = window[_WEIGHT + n] * window[_APART * i + n]
        for j in range(i + 1):
            product = np.float32(0)
            for n in range(count):
                product += window[_ROOM + n] * window[_APART * j + n]
            matrix[i, j] += product


@inlined
def _score(count: int, first: int, room: FitBuffers) -> None:
    """Fills lanes from the first on with sums of residuals times derivatives, and adds them up.

    Sums are made of two neighbours, three times over: compilers know how to do many at once.
    """
    window, two, four = room.window, room.pairs, room.fours
    for i in range(UNKNOWNS):
        lanes, total = room.lanes[i, first:], np.float32(0)
        for n in range(count // 2):
            even = window[_RESIDUAL + 2 * n] * window[_APART * i + 2 * n]
            two[n] = even + window[_RESIDUAL + 2 * n + 1] * window[_APART * i + 2 * n + 1]
        for n in range(count // 4):
            four[n] = two[2 * n] + two[2 * n + 1]
        for n in range(count // LANES):
            lanes[n] = four[2 * n] + four[2 * n + 1]
        for n in range(count // LANES):
            total += lanes[n]
        room.score[i] += total


@inlined
def _after_unknowns(look: TemplateArrays, state: Floats, vector: Floats) -> None:
    """Makes derivatives (7,) after the unknowns of those of the basis."""
    steepness, per_half = state[3] / look.step, look.step / look.half
    cos, sin = steepness * math.cos(state[2]), steepness * math.sin(state[2])
    x, y = vector[0], vector[1]
    vector[0], vector[1] = sin * y - cos * x, -sin * x - cos * y
    vector[2] *= state[3]
    vector[5] *= per_half
    vector[6] *= per_half


@inlined
def _products_after_unknowns(look: TemplateArrays, state: Floats, matrix: Floats) -> None:
    """Makes products (7, 7) of derivatives those of the unknowns; the lower triangle is read."""
    for i in range(UNKNOWNS):
        for j in range(i):
            matrix[j, i] = matrix[i, j]
    for i in range(UNKNOWNS):
        _after_unknowns(look, state, matrix[i])
    for i in range(UNKNOWNS):
        _after_unknowns(look, state, matrix[:, i])


@uncounted
def gather_equations(
    look: TemplateArrays, lists: PixelLists, pixels: int, tight: float, room: FitBuffers
) -> None:
    """Fills lanes, sums, matrix and score, these two of the unknowns.

    Args:
        look: the unit.
        lists: its pixels.
        pixels: number of them.
        tight: one over the squared scale of the robust weights.
        room: with the state, and how it has moved; filled.
    """
    room.matrix[:] = 0.0
    room.score[:] = 0.0
    room.sums[:] = 0.0
    for first in range(0, pixels, _WINDOW):
        count = min(_WINDOW, pixels - first)
        _sample(look, lists, first, count, room)
        _weigh(look, room.state, tight, lists.brightness[first:], count, room)
        _add(count, room)
        _score(count, first // LANES, room)
    _products_after_unknowns(look, room.state, room.matrix)
    _after_unknowns(look, room.state, room.score)
    for k in range(3):
        room.sums[k] *= (room.state[3] / look.step) ** 2


@uncounted
def gather_scatter(look: TemplateArrays, ends: Indices, blocks: int, room: FitBuffers) -> None:
    """Fills the scatter of blocks, which begin and end in the lanes where it says."""
    part, scatter = room.part, room.scatter
    scatter[:] = 0.0
    for block in range(blocks):
        part[:] = 0.0
        for lane in range(ends[block], ends[block + 1]):
            for i in range(UNKNOWNS):
                part[i] += room.lanes[i, lane]
        for i in range(UNKNOWNS):
            for j in range(i + 1):
                scatter[i, j] += part[i] * part[j]
    _products_after_unknowns(look, room.at, scatter)


@inlined
def _factor(matrix: Floats, factor: Floats) -> bool:
    """Factors by Cholesky from the lower triangle; returns False if it is singular.

    The factor's diagonal is inverted.
    """
    for i in range(len(matrix)):
        for j in range(i + 1):
            total = matrix[i, j]
            for k in range(j):
                total -= factor[i, k] * factor[j, k]
            if i != j:
                factor[i, j] = total * factor[j, j]
            elif total > 1e-10 * matrix[i, i]:
                factor[i, i] = 1 / math.sqrt(total)
            else:
                return False
    return True


@uncounted
def invert(matrix: Floats, factor: Floats, inverse: Floats) -> bool:
    """Fills the inverse of a symmetric positive definite matrix; False if it is singular.

    Args:
        matrix: (n, n); its lower triangle is read.
        factor: (n, n) room for the Cholesky factor L, and its inverse.
        inverse: (n, n) filled with L'^-1 L^-1.
    """
    size = len(matrix)
    if not _factor(matrix, factor):
        return False
    for column in range(size):
        for i in range(column + 1, size):
            total = factor[i, column] * factor[column, column]
            for k in range(column + 1, i):
                total += factor[i, k] * factor[k, column]
            factor[i, column] = -total * factor[i, i]
    for i in range(size):
        for j in range(i + 1):
            total = 0.0
            for k in range(i, size):
                total += factor[k, i] * factor[k, j]
            inverse[i, j] = inverse[j, i] = total
    return True
