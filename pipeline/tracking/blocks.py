"""Normal equations of one unit against a frame, gathered block by block of 8 x 8 pixels.

A block is what a codec quantises at once, so errors are alike within; and what a processor's cache
holds, so pixels are sampled first and summed after, many at a time.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pipeline.tracking.arrays import Floats, Singles, compiled

UNKNOWNS = 7  # ux, uy, theta; gain, offset, slope in x, slope in y
SIZE = 8
_PIXELS = SIZE * SIZE


class Scene(NamedTuple):
    """A frame, and the place in the specimen's plane of each of its pixels.

    Attributes:
        image: (rows, columns) brightness.
        plane: (rows, columns, 2) mm.
    """

    image: Singles
    plane: Singles


class Look(NamedTuple):
    """The template of one unit, as `unfold` makes its nodes, with its place at rest.

    Blocks whose middle is farther than ``reach`` (mm) from its own hold nothing of it.
    """

    nodes: Singles
    half: float
    step: float
    x: float
    y: float
    reach: float


class Room(NamedTuple):
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


@compiled
def unfold(brightness: Singles, weight: Singles, nodes: Singles) -> None:
    """Fills nodes (rows, columns, 4): brightness, its slopes per node in x and y, and weight.

    The slopes are differences of fourth order. One unit's nodes at a time fit a processor's cache,
    which all units' do not; two nodes along the rim stay as they are.
    """
    size = brightness.shape[0]
    near, far = np.float32(8 / 12), np.float32(1 / 12)
    for row in range(2, size - 2):
        for k in range(2, size - 2):
            nodes[row, k, 0] = brightness[row, k]
            nodes[row, k, 1] = near * (brightness[row, k + 1] - brightness[row, k - 1]) - far * (
                brightness[row, k + 2] - brightness[row, k - 2]
            )
            nodes[row, k, 2] = near * (brightness[row + 1, k] - brightness[row - 1, k]) - far * (
                brightness[row + 2, k] - brightness[row - 2, k]
            )
            nodes[row, k, 3] = weight[row, k]


def room(blocks: int) -> Room:
    """Room for units of at most so many blocks."""
    return Room(
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


@compiled
def _place(scene: Scene, look: Look, state: Floats, top: int, left: int, room: Room) -> None:
    """Fills x, y with where a block's pixels are on the unit, in steps of the template's nodes."""
    plane, x, y = scene.plane, room.x, room.y
    per_step = np.float32(1 / look.step)
    cos, sin = np.float32(math.cos(state[2])) * per_step, np.float32(math.sin(state[2])) * per_step
    x_at, y_at = np.float32(look.x + state[0]), np.float32(look.y + state[1])
    for row in range(SIZE):
        for column in range(SIZE):
            vx = plane[top + row, left + column, 0] - x_at
            vy = plane[top + row, left + column, 1] - y_at
            k = SIZE * row + column
            x[k] = cos * vx + sin * vy
            y[k] = cos * vy - sin * vx


@compiled
def _sample(look: Look, room: Room) -> bool:
    """Fills weight, and rows 0, 1, 3 with slopes and value of the template; False if all is zero.

    Along each direction values are Hermite's cubics, blended linearly in the other.
    """
    nodes, rows, weight = look.nodes, room.rows, room.weight
    size = nodes.shape[0]
    middle, most = np.float32((size - 1) // 2), np.float32(size - 1)
    seen = False
    one = np.float32(1)
    for k in range(_PIXELS):
        u, v = room.x[k] + middle, room.y[k] + middle
        weight[k] = 0
        if not (u >= 0 and v >= 0 and u < most and v < most):
            continue
        iu, iv = np.uint32(u), np.uint32(v)
        fu, fv = u - np.float32(iu), v - np.float32(iv)
        gu, gv = one - fu, one - fv
        wa, wb, wc, wd = gu * gv, fu * gv, gu * fv, fu * fv
        a, b = nodes[iv, iu], nodes[iv, iu + np.uint32(1)]
        c, d = nodes[iv + np.uint32(1), iu], nodes[iv + np.uint32(1), iu + np.uint32(1)]
        here = wa * a[3] + wb * b[3] + wc * c[3] + wd * d[3]
        rise_u = gv * (b[0] - a[0]) + fv * (d[0] - c[0])
        rise_v = gu * (c[0] - a[0]) + fu * (d[0] - b[0])
        first_u, last_u = gv * a[1] + fv * c[1] - rise_u, gv * b[1] + fv * d[1] - rise_u
        first_v, last_v = gu * a[2] + fu * b[2] - rise_v, gu * c[2] + fu * d[2] - rise_v
        bow_u, bow_v = gu * first_u - fu * last_u, gv * first_v - fv * last_v
        weight[k] = here
        rows[0, k] = rise_u + (gu - fu) * bow_u - fu * gu * (first_u + last_u)
        rows[1, k] = rise_v + (gv - fv) * bow_v - fv * gv * (first_v + last_v)
        linear = wa * a[0] + wb * b[0] + wc * c[0] + wd * d[0]
        rows[3, k] = linear + fu * gu * bow_u + fv * gv * bow_v
        seen |= here > 0
    return seen


@compiled
def _derive(scene: Scene, look: Look, state: Floats, top: int, left: int, room: Room) -> None:
    """Turns slopes and value of the template into derivatives and residual of the frame."""
    rows, residual, image = room.rows, room.residual, scene.image
    cos, sin = np.float32(math.cos(state[2])), np.float32(math.sin(state[2]))
    step = np.float32(look.step)
    steepness, per_half = np.float32(state[3] / look.step), np.float32(look.step / look.half)
    gain, offset = np.float32(state[3]), np.float32(state[4])
    slope_x, slope_y = np.float32(state[5]), np.float32(state[6])
    for row in range(SIZE):
        for column in range(SIZE):
            k = SIZE * row + column
            along_x, along_y = steepness * rows[0, k], steepness * rows[1, k]
            x, y = room.x[k], room.y[k]
            rows[0, k] = -cos * along_x + sin * along_y
            rows[1, k] = -sin * along_x - cos * along_y
            rows[2, k] = (along_x * y - along_y * x) * step
            rows[4, k] = 1
            rows[5, k] = x * per_half
            rows[6, k] = y * per_half
            model = gain * rows[3, k] + offset + slope_x * rows[5, k] + slope_y * rows[6, k]
            residual[k] = image[top + row, left + column] - model


@compiled
def _weigh(room: Room, tight: float) -> None:
    """Robust weights of Geman and McClure, and the sums."""
    rows, residual, weight = room.rows, room.residual, room.weight
    full = left = curved = total = squares = np.float32(0)
    narrow = np.float32(tight)
    for k in range(_PIXELS):
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


@compiled
def _add(room: Room, scores: Floats) -> None:
    """Adds a block to the matrix and fills its scores."""
    rows, residual, weight, matrix = room.rows, room.residual, room.weight, room.matrix
    scaled = room.weighted
    for i in range(UNKNOWNS):
        score = np.float32(0)
        for k in range(_PIXELS):
            scaled[k] = weight[k] * rows[i, k]
            score += scaled[k] * residual[k]
        scores[i] = score
        for j in range(i + 1):
            product = np.float32(0)
            for k in range(_PIXELS):
                product += scaled[k] * rows[j, k]
            matrix[i, j] += product


@compiled
def _within(scene: Scene, look: Look, state: Floats, top: int, left: int) -> bool:
    middle = scene.plane[top + SIZE // 2, left + SIZE // 2]
    return math.hypot(middle[0] - look.x - state[0], middle[1] - look.y - state[1]) < look.reach


@compiled
def gather(
    scene: Scene, look: Look, state: Floats, box: Floats, every: int, tight: float, room: Room
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
            if _sample(look, room):
                _derive(scene, look, state, top, left, room)
                _weigh(room, tight)
                _add(room, room.scores[count])
                count += 1
    return count
