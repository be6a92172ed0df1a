"""Gathers the normal equations of one unit against a frame, by blocks of 8 x 8 pixels.

A block is what a codec quantises at once, so errors are alike within; and what a processor's cache
holds, so pixels are sampled first and summed after, many at a time.
"""

import math
from typing import NamedTuple

import numpy as np

from pipeline.runtime import inlined
from sim.core import Floats, Image, Singles

UNKNOWNS = 7  # ux, uy, theta; gain, offset, slope in x, slope in y
SIZE = 8
_PIXELS = SIZE * SIZE
_LANES = 16
"""Numbers that a processor adds at once, or a multiple."""
_FEW = [4.0 * ((column + 2 * row) % 4 == 0) for row in range(SIZE) for column in range(SIZE)]
_COUNT = np.array([[0.0] * _PIXELS, _FEW, [1.0] * _PIXELS], np.float32)
"""How many pixels one stands for, by the kind of its cell and its place in the block."""


class FramePixels(NamedTuple):
    """Holds a frame, and the place in the specimen's plane of each of its pixels.

    Attributes:
        image: (rows, columns) brightness.
        plane: (rows, columns, 2) mm.
    """

    image: Singles
    plane: Singles


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
    matrix: Floats
    scores: Floats
    sums: Floats


def workspace(blocks: int) -> FitBuffers:
    """Allocates room for units of at most so many blocks."""
    return FitBuffers(
        np.zeros((UNKNOWNS, _PIXELS), np.float32),
        np.zeros(_PIXELS, np.float32),
        np.zeros(_PIXELS, np.float32),
        np.zeros(_PIXELS, np.float32),
        np.zeros(_PIXELS, np.float32),
        np.zeros(_PIXELS, np.float32),
        np.zeros((UNKNOWNS, UNKNOWNS)),
        np.zeros((blocks, UNKNOWNS)),
        np.zeros(5),
    )


@inlined
def _place(
    scene: FramePixels, look: TemplateArrays, state: Floats, top: int, left: int, room: FitBuffers
) -> None:
    """Fills x, y with where a block's pixels are on the unit, in steps of the template's nodes."""
    plane, x, y = scene.plane, room.x, room.y
    per_step = np.float32(1 / look.step)
    for row in range(SIZE):
        late = top + row - look.row
        turn = state[2] + late * look.drift_turn
        cos, sin = np.float32(math.cos(turn)) * per_step, np.float32(math.sin(turn)) * per_step
        x_at = np.float32(look.x + state[0] + late * look.drift_x)
        y_at = np.float32(look.y + state[1] + late * look.drift_y)
        for column in range(SIZE):
            vx = plane[top + row, left + column, 0] - x_at
            vy = plane[top + row, left + column, 1] - y_at
            k = SIZE * row + column
            x[k] = cos * vx + sin * vy
            y[k] = cos * vy - sin * vx


@inlined
def _sample(scene: FramePixels, look: TemplateArrays, top: int, left: int, room: FitBuffers) -> int:
    """Reads the template where pixels are to be compared; returns their number.

    Fills weight, residual with the frame's brightness, and rows 0, 1, 3 with slopes and value of
    the template: mixed of those that the four nodes about a pixel extrapolate to halfway, which is
    exact for parabolas. There are pixels without weight up to the next multiple of `_LANES`.
    """
    nodes, kind, rows, x, y = look.nodes, look.kind, room.rows, room.x, room.y
    size = kind.shape[0]
    middle, most = np.float32((size - 1) // 2), np.float32(size - 1)
    one, half, next_ = np.float32(1), np.float32(0.5), np.uint32(1)
    n = 0
    for k in range(_PIXELS):
        u, v = x[k] + middle, y[k] + middle
        if not (u >= 0 and v >= 0 and u < most and v < most):
            continue
        iu, iv = np.uint32(u), np.uint32(v)
        stands = _COUNT[kind[iv, iu], k]
        if stands == 0:
            continue
        ju, jv = iu + next_, iv + next_
        fu, fv = u - np.float32(iu), v - np.float32(iv)
        gu, gv = one - fu, one - fv
        wa, wb, wc, wd = gu * gv, fu * gv, gu * fv, fu * fv
        au, bu, cu, du = nodes[iv, iu, 1], nodes[iv, ju, 1], nodes[jv, iu, 1], nodes[jv, ju, 1]
        av, bv, cv, dv = nodes[iv, iu, 2], nodes[iv, ju, 2], nodes[jv, iu, 2], nodes[jv, ju, 2]
        flat = wa * nodes[iv, iu, 0] + wb * nodes[iv, ju, 0]
        flat += wc * nodes[jv, iu, 0] + wd * nodes[jv, ju, 0]
        bow_u = fu * gu * (gv * (au - bu) + fv * (cu - du))
        bow_v = fv * gv * (gu * (av - cv) + fu * (bv - dv))
        here = wa * nodes[iv, iu, 3] + wb * nodes[iv, ju, 3]
        rows[0, n] = wa * au + wb * bu + wc * cu + wd * du
        rows[1, n] = wa * av + wb * bv + wc * cv + wd * dv
        rows[3, n] = flat + half * (bow_u + bow_v)
        here += wc * nodes[jv, iu, 3] + wd * nodes[jv, ju, 3]
        room.weight[n] = stands * here
        room.residual[n] = scene.image[top + (k >> 3), left + (k & 7)]
        x[n], y[n] = x[k], y[k]
        n += 1
    whole = -(-n // _LANES) * _LANES
    for k in range(n, whole):
        room.weight[k] = room.residual[k] = rows[0, k] = rows[1, k] = rows[3, k] = 0
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
        rows[5, k] = x * per_half
        rows[6, k] = y * per_half
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
    middle = scene.plane[top + SIZE // 2, left + SIZE // 2]
    return math.hypot(middle[0] - look.x - state[0], middle[1] - look.y - state[1]) < look.reach


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
            pixels = _sample(scene, look, top, left, room)
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
