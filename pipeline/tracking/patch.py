"""Rigid-patch image correlation: Gauss-Newton on the pose of each unit in the specimen's plane.

The raw pixels of a frame are compared with the template of a unit, seen through the camera: no
frame is interpolated, so its noise is not either. Four photometric unknowns (gain, offset and its
slopes) go along with the three of the pose; weights of Geman and McClure take care of what does not
belong to the unit.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pipeline.tracking.arrays import Floats, Image, Mask, Singles, compiled
from pipeline.tracking.spline import TAPS, weights

N = 7  # ux, uy, theta; gain, offset, slope in x, slope in y
POSE = 3
_LONGEST = 3.0  # px in one step
_STILL = 0.02  # px, of a step after which there is none
BLOCK = 3  # blocks of 2**3 pixels, in which errors of a codec are alike


class Templates(NamedTuple):
    """What the units look like in their own frames, and where they rest.

    Attributes:
        coefs: (units, rows, columns) spline coefficients of the brightness, y up.
        weight: (units, rows, columns) weight of each node, zero outside the unit.
        half: the grids reach from -half to half, mm.
        step: distance of the nodes, mm.
        centre: (units, 2) place at rest, mm.
        contrast: (units,) standard deviation of the brightness within the weight.
        reach: (units,) largest radius of the weight, mm.
    """

    coefs: Singles
    weight: Singles
    half: float
    step: float
    centre: Floats
    contrast: Floats
    reach: Floats


class Fits(NamedTuple):
    """Poses found in a frame.

    Attributes:
        pose: (units, 3) displacement in mm and rotation in rad.
        photometry: (units, 4) gain, offset and its slopes over `half`.
        curvature: (units, 3, 3) covariance of the pose for residuals of standard deviation one.
        scatter: (units, 3, 3) covariance from the scores of blocks of pixels, which may be
            correlated within.
        noise: (units,) weighted standard deviation of the residuals.
        share: (units,) part of the information that robust weights and the image's edge left.
        blocks: (units,) number of blocks.
        last: (units,) length of the last step, px.
        information: (units,) sum of the squared gradients of the template, weighted.
    """

    pose: Floats
    photometry: Floats
    curvature: Floats
    scatter: Floats
    noise: Floats
    share: Floats
    blocks: Floats
    last: Floats
    information: Floats


@compiled
def _factor(matrix: Floats, size: int, factor: Floats) -> bool:
    """Cholesky factor of the leading part, from its lower triangle; False if it is singular."""
    for i in range(size):
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


@compiled
def _solve(matrix: Floats, size: int, inverse: Floats) -> bool:
    """Inverse of the leading symmetric positive definite part; False if it is singular."""
    factor = np.zeros((N, N))
    if not _factor(matrix, size, factor):
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


@compiled
def _pass(
    image: Image,
    plane: Singles,
    coefs: Singles,
    weight: Singles,
    geometry: Floats,
    state: Floats,
    box: Floats,
    stride: int,
    scale: float,
    matrix: Floats,
    scores: Floats,
    sums: Floats,
) -> None:
    """Normal equations of one unit at a state (pose and photometry), scores by blocks of pixels."""
    half, step, cx, cy = geometry[0], geometry[1], geometry[2], geometry[3]
    nodes = coefs.shape[0]
    cos, sin = math.cos(state[2]), math.sin(state[2])
    gain, offset, slope_x, slope_y = state[3], state[4], state[5], state[6]
    top, bottom, left, right = int(box[0]), int(box[1]), int(box[2]), int(box[3])
    columns = ((right - left) >> BLOCK) + 1
    wx, wy, sx, sy = np.empty(TAPS), np.empty(TAPS), np.empty(TAPS), np.empty(TAPS)
    row_of = np.empty(N)
    matrix[:] = 0.0
    scores[:] = 0.0
    sums[:] = 0.0
    per_step, per_half, tight = 1 / step, 1 / half, 1 / (scale * scale)
    for row in range(top, bottom):
        for column in range(left + (row % stride), right, stride):
            vx = plane[row, column, 0] - cx - state[0]
            vy = plane[row, column, 1] - cy - state[1]
            x, y = cos * vx + sin * vy, cos * vy - sin * vx
            u, v = (x + half) * per_step, (y + half) * per_step
            if not (u >= 1 and v >= 1 and u < nodes - 2 and v < nodes - 2):
                continue
            iu, iv = int(u), int(v)
            fu, fv = u - iu, v - iv
            here = (1 - fv) * ((1 - fu) * weight[iv, iu] + fu * weight[iv, iu + 1]) + fv * (
                (1 - fu) * weight[iv + 1, iu] + fu * weight[iv + 1, iu + 1]
            )
            if here <= 0.0:
                continue
            weights(fu, wx, sx)
            weights(fv, wy, sy)
            value, along_x, along_y = 0.0, 0.0, 0.0
            for a in range(TAPS):
                line, slope = 0.0, 0.0
                for b in range(TAPS):
                    knot = coefs[iv - 1 + a, iu - 1 + b]
                    line += wx[b] * knot
                    slope += sx[b] * knot
                value += wy[a] * line
                along_x += wy[a] * slope
                along_y += sy[a] * line
            x_half, y_half = x * per_half, y * per_half
            along_x *= gain * per_step
            along_y *= gain * per_step
            row_of[0] = -cos * along_x + sin * along_y
            row_of[1] = -sin * along_x - cos * along_y
            row_of[2] = along_x * y - along_y * x
            row_of[3] = value
            row_of[4] = 1.0
            row_of[5] = x_half
            row_of[6] = y_half
            residual = (
                image[row, column] - gain * value - offset - slope_x * x_half - slope_y * y_half
            )
            steep = row_of[0] * row_of[0] + row_of[1] * row_of[1]
            sums[0] += here * steep
            closeness = 1 / (1 + residual * residual * tight)
            robust = here * closeness * closeness
            sums[1] += robust * steep
            sums[2] += robust
            sums[3] += robust * residual * residual
            sums[4] += here
            block = ((row - top) >> BLOCK) * columns + ((column - left) >> BLOCK)
            for i in range(N):
                scaled = robust * row_of[i]
                scores[block, i] += scaled * residual
                for j in range(i + 1):
                    matrix[i, j] += scaled * row_of[j]


@compiled
def _box(plane: Singles, middle: Floats, radius: float, box: Floats) -> None:
    """Rows and columns around a pixel, within the image, on the grid of blocks."""
    rows, columns = plane.shape[0], plane.shape[1]
    size = 1 << BLOCK
    box[0] = max(0, math.floor((middle[1] - radius) / size) * size)
    box[1] = min(rows, math.ceil(middle[1] + radius) + 1)
    box[2] = max(0, math.floor((middle[0] - radius) / size) * size)
    box[3] = min(columns, math.ceil(middle[0] + radius) + 1)


@compiled
def _blocks(box: Floats) -> int:
    return ((int(box[1] - box[0]) >> BLOCK) + 1) * ((int(box[3] - box[2]) >> BLOCK) + 1)


@compiled
def _step(inverse: Floats, scores: Floats, first: int, step: Floats) -> None:
    """The Gauss-Newton step of the unknowns from ``first`` on, zero for the others."""
    step[:] = 0.0
    for j in range(first, N):
        total = 0.0
        for block in range(scores.shape[0]):
            total += scores[block, j]
        for i in range(first, N):
            step[i] += inverse[i, j] * total


@compiled
def _hold_pose(matrix: Floats) -> None:
    """Takes the pose out of the normal equations."""
    for i in range(POSE):
        matrix[i, :] = 0.0
        matrix[:, i] = 0.0
        matrix[i, i] = 1.0


@compiled
def _descend(
    image: Image,
    plane: Singles,
    coefs: Singles,
    weight: Singles,
    geometry: Floats,
    state: Floats,
    box: Floats,
    limits: Floats,
    matrix: Floats,
    inverse: Floats,
    scores: Floats,
    sums: Floats,
) -> float:
    """Improves the state of one unit; the length of the last step in px, negative if it failed."""
    contrast, px, radius, floor, tight = limits[0], limits[1], limits[2], limits[3], limits[4]
    blind, most = tight == 0.0, int(limits[5])
    step = np.empty(N)
    moved = -1.0
    least = floor * contrast * abs(state[3])
    scale = 1e6 if blind else max(contrast * abs(state[3]), tight)
    for turn in range(0 if blind else 1, most + 1):
        stride = 4 if turn == 0 else (2 if turn == 1 and blind else 1)
        _pass(
            image, plane, coefs, weight, geometry, state, box, stride, scale, matrix, scores, sums
        )
        if turn == 0:
            _hold_pose(matrix)
        if not (sums[2] > 20 / stride and _solve(matrix, N, inverse)):
            return -1.0
        _step(inverse, scores, POSE if turn == 0 else 0, step)
        moved = max(math.hypot(step[0], step[1]) * px, abs(step[2]) * radius)
        shorten = min(1.0, _LONGEST / max(moved, 1e-9))
        for i in range(N):
            state[i] += step[i] * shorten
        spread = math.sqrt(sums[3] / sums[2])
        before = scale
        if turn == 0:
            least = floor * contrast * abs(state[3])
            scale = max(contrast * abs(state[3]), least)
        else:
            scale = min(scale, max(4.0 * spread, least)) if blind else max(0.5 * scale, tight)
        if turn > 0 and stride == 1 and moved < _STILL and scale > 0.7 * before:
            break
    return moved


@compiled
def _summarise(
    state: Floats,
    inverse: Floats,
    scores: Floats,
    sums: Floats,
    full: float,
    moved: float,
    out: Floats,
) -> None:
    """Writes a unit's row as `unpack` reads it."""
    out[:] = 0.0
    out[:N] = state
    occupied = 0
    part = np.empty(POSE)
    for block in range(scores.shape[0]):
        if scores[block, 4] == 0.0 and scores[block, 3] == 0.0:
            continue
        occupied += 1
        for i in range(POSE):
            part[i] = 0.0
            for j in range(N):
                part[i] += inverse[i, j] * scores[block, j]
        for i in range(POSE):
            for j in range(POSE):
                out[N + 9 + 3 * i + j] += part[i] * part[j]
    for i in range(POSE):
        for j in range(POSE):
            out[N + 3 * i + j] = inverse[i, j]
    gain = state[3] * state[3]
    out[N + 18] = math.sqrt(sums[3] / sums[2])
    out[N + 19] = sums[1] / max(full * gain, sums[0])
    out[N + 20] = occupied
    out[N + 21] = moved
    out[N + 22] = sums[0] / gain


@compiled
def fit(
    image: Image,
    plane: Singles,
    coefs: Singles,
    weight: Singles,
    grid: Floats,
    centre: Floats,
    contrast: Floats,
    full: Floats,
    start: Floats,
    middle: Floats,
    radius: Floats,
    scale_px: Floats,
    chosen: Mask,
    most: int,
    floor: float,
    tight: Floats,
    out: Floats,
) -> None:
    """Fits all chosen units; fills out (units, 36) in the order of `unpack`.

    Args:
        image: (rows, columns) brightness.
        plane: (rows, columns, 2) place of each pixel in the specimen's plane, mm.
        coefs: (units, nodes, nodes) of the templates.
        weight: (units, nodes, nodes) of the templates.
        grid: (half, step) of the templates.
        centre: (units, 2) of the templates.
        contrast: (units,) of the templates.
        full: (units,) information of a unit that is seen whole, zero if unknown.
        start: (units, 7) pose and photometry to start from.
        middle: (units, 2) pixel at the middle of each unit as it starts.
        radius: (units,) of the patch, px.
        scale_px: (units,) px/mm.
        chosen: (units,) which to fit.
        most: largest number of full steps.
        floor: smallest scale of the robust weights, in contrasts.
        tight: (units,) scale of the robust weights in the end, whatever the residuals; zero to fit
            the photometry first and to let the residuals decide.
        out: filled.
    """
    matrix, inverse = np.empty((N, N)), np.zeros((N, N))
    geometry, box, sums = np.empty(4), np.empty(4), np.empty(5)
    limits, state = np.empty(6), np.empty(N)
    for unit in np.nonzero(chosen)[0]:
        out[unit] = np.nan
        _box(plane, middle[unit], radius[unit], box)
        if box[1] - box[0] < 4 or box[3] - box[2] < 4:
            continue
        scores = np.empty((_blocks(box), N))
        geometry[0], geometry[1] = grid[0], grid[1]
        geometry[2], geometry[3] = centre[unit, 0], centre[unit, 1]
        limits[0], limits[1], limits[2] = contrast[unit], scale_px[unit], radius[unit]
        limits[3], limits[4], limits[5] = floor, tight[unit], most
        state[:] = start[unit]
        moved = _descend(
            image,
            plane,
            coefs[unit],
            weight[unit],
            geometry,
            state,
            box,
            limits,
            matrix,
            inverse,
            scores,
            sums,
        )
        if moved >= 0.0:
            _summarise(state, inverse, scores, sums, full[unit], moved, out[unit])


WIDTH = N + 23


def unpack(out: Floats) -> Fits:
    """The columns of `fit`'s output by name."""
    return Fits(
        out[:, :POSE],
        out[:, POSE:N],
        out[:, N : N + 9].reshape(-1, 3, 3),
        out[:, N + 9 : N + 18].reshape(-1, 3, 3),
        out[:, N + 18],
        out[:, N + 19],
        out[:, N + 20],
        out[:, N + 21],
        out[:, N + 22],
    )
