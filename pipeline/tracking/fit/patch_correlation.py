"""Correlates rigid patches: Gauss-Newton on the pose of each unit in the specimen's plane.

The raw pixels of a frame are compared with the template of a unit, seen through the camera: no
frame is interpolated, so its noise is not either. Four photometric unknowns (gain, offset and its
slopes) go along with the three of the pose; weights of Geman and McClure take care of what does not
belong to the unit. Light scales what it falls on, so its slopes do too.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pipeline.runtime import inlined, uncounted
from pipeline.tracking.fit.compared_pixels import (
    SIZE,
    FramePixels,
    PixelLists,
    TemplateArrays,
    cut_out,
    select_pixels,
)
from pipeline.tracking.fit.normal_equations import (
    UNKNOWNS,
    FitBuffers,
    gather_equations,
    gather_scatter,
    invert,
)
from pipeline.tracking.fit.template_cells import TemplateCells, unfold
from sim.core import Floats, Mask, Singles

POSE = 3
TOLD = np.array([0, 1, 2, 5, 6])
"""Unknowns whose covariance is told: the pose, and the light's slopes, which look like shifts."""
_SQUARE = len(TOLD) ** 2
WIDTH = UNKNOWNS + 2 * _SQUARE + 5
_STRIDE = 1.4
_NEAR = 0.3  # px, of a step that leads to where the unit is
_LONGEST = 3.0  # px in one step
_STILL = 0.03  # px, of a step after which there is none
_LARGE = 24.0  # px, radius of units of which a quarter tells where they are, roughly
_FLOOR = 0.04
"""Smallest scale of the robust weights, in contrasts of the unit; or so many times the noise: """
_SCALE = 4.0
_UNKNOWN = 1e6
_ALL = 3
"""Place of all pixels in the lists, behind those of one, two and three quarters of the blocks."""
_FEWEST = 5.0
"""Weights of pixels that a quarter of the blocks needs at least."""


class Templates(NamedTuple):
    """Holds the looks of the units in their own frames, and where they rest."""

    brightness: Singles  # (units, rows, columns) at the nodes, y up
    weight: Singles  # (units, rows, columns) of the nodes, zero outside the unit and near the rim
    half: float  # the grids reach from -half to half, mm
    step: float  # distance of the nodes, mm
    centre: Floats  # (units, 2) place at rest, mm
    contrast: Floats  # (units,) standard deviation of the brightness within the weight
    reach: Floats  # (units,) largest radius of the weight, mm
    noise: float  # standard deviation of the brightness' noise
    cells: TemplateCells  # between the nodes


class FitStart(NamedTuple):
    """Holds where the fits of a frame start, and what is known before.

    Attributes:
        state: (units, 7) pose and photometry.
        middle: (units, 2) pixel at the middle of each unit.
        radius: (units,) of the patch, px.
        scale: (units,) px/mm.
        full: (units,) information of a unit that is seen whole, zero if unknown.
        noise: (units,) residuals to expect, over the gain; zero if unknown.
        tight: (units,) scale of the robust weights in the end, whatever the residuals; zero to fit
            the photometry first and to let the residuals decide.
        drift: (units, 3) change of the pose from row to row of the frame, by a rolling shutter.
    """

    state: Floats
    middle: Floats
    radius: Floats
    scale: Floats
    full: Floats
    noise: Floats
    tight: Floats
    drift: Floats


class FitTarget(NamedTuple):
    """Holds one unit of a `FitStart`, with its contrast and the largest number of full steps."""

    contrast: float
    scale: float
    radius: float
    noise: float
    tight: float
    most: int


class PoseFits(NamedTuple):
    """Holds poses found in a frame.

    Attributes:
        pose: (units, 3) displacement in mm and rotation in rad.
        photometry: (units, 4) gain, offset, and the gain's slopes over `half`.
        curvature: (units, 5, 5) covariance of the pose and of the light's slopes, for residuals of
            standard deviation one.
        scatter: (units, 5, 5) the same from the scores of blocks of pixels, which may be
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

    def copy(self) -> PoseFits:
        """Copies all arrays."""
        return PoseFits(*(values.copy() for values in self))

    def take(self, other: PoseFits, chosen: Mask) -> None:
        """Replaces the chosen units (units,) by those of another fit."""
        for values, new in zip(self, other, strict=True):
            values[chosen] = new[chosen]


@inlined
def _box(shape: tuple[int, int], middle: Floats, radius: float, box: Floats) -> None:
    """Rows and columns around a pixel, of whole blocks within the image."""
    box[0] = max(0, math.floor((middle[1] - radius) / SIZE) * SIZE)
    box[1] = min(shape[0] // SIZE * SIZE, math.ceil(middle[1] + radius) + 1)
    box[2] = max(0, math.floor((middle[0] - radius) / SIZE) * SIZE)
    box[3] = min(shape[1] // SIZE * SIZE, math.ceil(middle[0] + radius) + 1)


@inlined
def _solve(room: FitBuffers, first: int) -> None:
    """Fills the Gauss-Newton step of the unknowns from ``first`` on, zero for the others."""
    for i in range(UNKNOWNS):
        room.step[i] = 0.0
        for j in range(first, UNKNOWNS if i >= first else first):
            room.step[i] += room.inverse[i, j] * room.score[j]


@inlined
def _advance(room: FitBuffers, stride: float) -> None:
    """Goes on by the step, so many times as long."""
    for i in range(UNKNOWNS):
        room.at[i] = room.state[i]
        room.state[i] += stride * room.step[i]


@inlined
def _hold_pose(matrix: Floats) -> None:
    """Takes the pose out of the normal equations."""
    for i in range(POSE):
        matrix[i, :] = 0.0
        matrix[:, i] = 0.0
        matrix[i, i] = 1.0


@inlined
def _next_scale(scale: float, moved: float, gain: float, aim: FitTarget, room: FitBuffers) -> float:
    """Returns the scale of the robust weights: wide until the unit has found its place."""
    if aim.tight > 0.0:
        return max(0.5 * scale, aim.tight)
    least = _FLOOR * aim.contrast * gain
    if aim.noise > 0.0 and moved < _NEAR:
        return max(_SCALE * aim.noise * gain, least)
    return min(scale, max(_SCALE * math.sqrt(room.sums[4] / room.sums[3]), least))


@inlined
def _stride(sums: Floats) -> float:
    """Returns the factor by which steps of fixed robust weights are too short."""
    return min(sums[1] / max(sums[2], 1e-9), _STRIDE)


@inlined
def _compare(look: TemplateArrays, room: FitBuffers) -> None:
    """Fills how the unit has moved since its pixels were selected."""
    state, before = room.state, room.selected
    cos, sin = math.cos(before[2]) / look.step, math.sin(before[2]) / look.step
    x, y = state[0] - before[0], state[1] - before[1]
    room.moved[0], room.moved[1] = cos * x + sin * y, cos * y - sin * x
    room.moved[2] = state[2] - before[2]


@inlined
def _descend(
    scene: FramePixels, look: TemplateArrays, aim: FitTarget, lists: PixelLists, room: FitBuffers
) -> float:
    """Improves the state of one unit.

    Pixels are selected anew where it has moved on by more than a part of a pixel.

    Returns:
        Length of the last step in px, negative if it failed.
    """
    blind, new = aim.tight == 0.0, aim.tight == 0.0 and aim.noise == 0.0
    moved, way, rough = -1.0, _UNKNOWN, 0 if aim.radius > _LARGE else 1
    scale = _UNKNOWN if new else max(aim.contrast * abs(room.state[3]), aim.tight)
    for turn in range(0 if new else 1, aim.most + 1):
        part = 0 if turn == 0 else (rough if turn == 1 and blind else _ALL)
        if way > _NEAR:
            select_pixels(scene, look, room.state, room.box, lists)
            way = 0.0
            for i in range(POSE):
                room.selected[i] = room.state[i]
        _compare(look, room)
        gather_equations(look, lists, lists.pixels[part], 1 / (scale * scale), room)
        if turn == 0:
            _hold_pose(room.matrix)
        if not (
            room.sums[3] > _FEWEST * (part + 1) and invert(room.matrix, room.factor, room.inverse)
        ):
            return -1.0
        _solve(room, POSE if turn == 0 else 0)
        step = room.step
        moved = max(math.hypot(step[0], step[1]) * aim.scale, abs(step[2]) * aim.radius)
        stride = min(_stride(room.sums) if moved < _NEAR else 1.0, _LONGEST / max(moved, 1e-9))
        _advance(room, stride)
        way += moved * stride
        past, gain = scale, abs(room.state[3])
        scale = aim.contrast * gain if turn == 0 else _next_scale(scale, moved, gain, aim, room)
        if turn > 0 and part == _ALL and moved < _STILL and scale > 0.7 * past:
            break
    return moved


@inlined
def _summarise(
    look: TemplateArrays,
    lists: PixelLists,
    room: FitBuffers,
    full: float,
    moved: float,
    out: Floats,
) -> None:
    """Writes a unit's row as `unpack` reads it."""
    told, sums, inverse, half = len(TOLD), room.sums, room.inverse, room.part
    white, blocks, last = UNKNOWNS, UNKNOWNS + _SQUARE, UNKNOWNS + 2 * _SQUARE
    gather_scatter(look, lists.ends, lists.blocks[_ALL], room)
    for i in range(UNKNOWNS):
        out[i] = room.state[i]
    for i in range(told):
        half[:] = 0.0
        for k in range(UNKNOWNS):
            for j in range(UNKNOWNS):
                half[j] += inverse[TOLD[i], k] * room.scatter[k, j]
        for j in range(told):
            total = 0.0
            for k in range(UNKNOWNS):
                total += half[k] * inverse[TOLD[j], k]
            out[blocks + told * i + j] = total
            out[white + told * i + j] = inverse[TOLD[i], TOLD[j]]
    gain = room.state[3] * room.state[3]
    out[last] = math.sqrt(sums[4] / sums[3])
    out[last + 1] = sums[1] / max(full * gain, sums[0])
    out[last + 2] = lists.blocks[_ALL]
    out[last + 3] = moved
    out[last + 4] = sums[0] / gain


@uncounted
def fit_patches(
    scene: FramePixels,
    templates: Templates,
    start: FitStart,
    chosen: Mask,
    most: int,
    lists: PixelLists,
    room: FitBuffers,
    out: Floats,
) -> None:
    """Fits all chosen units; fills out (units, 62) in the order of `unpack`.

    Args:
        scene: the frame.
        templates: the units.
        start: where to start.
        chosen: (units,) which to fit.
        most: largest number of full steps.
        lists: for the pixels of the largest of the units.
        room: for that one.
        out: filled; NaN where a unit cannot be fitted.
    """
    box, size = room.box, templates.weight.shape[1]
    for unit in range(len(chosen)):
        out[unit] = np.nan
        if not chosen[unit]:
            continue
        _box(scene.image.shape, start.middle[unit], start.radius[unit], box)
        if box[1] - box[0] < 4 or box[3] - box[2] < 4:
            continue
        cells = templates.cells
        cut_out(scene, box, lists)
        kind = cells.kind[unit].reshape(-1)
        for node in range(size * size):  # one after the other, before they are read here and there
            room.kind[node] = kind[node]
        unfold(templates.brightness[unit], templates.weight[unit], cells.span[unit], room.nodes)
        look = TemplateArrays(
            room.kind,
            size,
            templates.half,
            templates.step,
            templates.centre[unit, 0],
            templates.centre[unit, 1],
            templates.reach[unit] + 0.71 * SIZE / start.scale[unit],
            start.middle[unit, 1],
            start.drift[unit, 0],
            start.drift[unit, 1],
            start.drift[unit, 2],
        )
        for i in range(UNKNOWNS):
            room.state[i] = start.state[unit, i]
        aim = FitTarget(
            templates.contrast[unit],
            start.scale[unit],
            start.radius[unit],
            start.noise[unit],
            start.tight[unit],
            most,
        )
        moved = _descend(scene, look, aim, lists, room)
        if moved >= 0.0:
            out[unit] = 0.0
            _summarise(look, lists, room, start.full[unit], moved, out[unit])


def unpack(out: Floats) -> PoseFits:
    """Names the columns of `fit_patches`' output."""
    pose, light, white, blocks, rest = np.split(
        out, np.cumsum([POSE, UNKNOWNS - POSE, _SQUARE, _SQUARE]), axis=1
    )
    shape = (len(out), len(TOLD), len(TOLD))
    return PoseFits(pose, light, white.reshape(shape), blocks.reshape(shape), *rest.T)
