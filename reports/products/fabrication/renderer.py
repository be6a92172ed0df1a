"""Renders triangles in parallel projection with a depth buffer: what a mesh file looks like."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from matplotlib.colors import to_rgb
from numpy.typing import NDArray

from sim.core import Image

AnyFloats: TypeAlias = NDArray[np.floating]
Integers: TypeAlias = NDArray[np.integer]

AZIMUTH, ELEVATION = -76.0, 50.0
"""Direction of view in degrees: from the front, somewhat from the right, and from above."""

_LIGHT = np.array([-0.35, -0.5, 0.79])
_AMBIENT = 0.45
_SAMPLES = 2  # per pixel and direction
_CHUNK = 500_000  # candidates for a pixel at a time
_CREASE = 0.8  # cosine below which two neighbouring pixels show an edge
_STEP = 0.6  # mm in depth that show an edge
_RIM = 12  # pixels around the picture


@dataclass(frozen=True)
class Body:
    """Describes triangles (m, 3) of vertices (n, 3) in mm, in one colour."""

    vertices: AnyFloats
    triangles: Integers
    colour: str


@dataclass(frozen=True)
class View:
    """Holds right, up and towards the eye, as rows of a rotation; pixels per mm; the origin."""

    axes: AnyFloats
    scale: float
    shift: AnyFloats


def picture(bodies: list[Body], width: int, elevation: float = ELEVATION) -> Image:
    """Returns image (height, width, 3) of bodies on white; the width is in pixels.

    The eye is at an elevation above the horizon, degrees; 90 looks straight down.
    """
    azimuth = AZIMUTH if elevation < 90.0 else -90.0
    view, shape = _fitted(bodies, _axes(azimuth, elevation), width * _SAMPLES)
    depth = np.full(shape, -np.inf, dtype=np.float32)
    face = np.full(shape, -1, dtype=np.int32)
    normals: list[AnyFloats] = []
    colours: list[AnyFloats] = []
    for body in bodies:
        drawn = sum(map(len, normals))
        normals.append(_draw(body, view, depth, face, drawn))
        colours.append(np.tile(to_rgb(body.colour), (len(normals[-1]), 1)))
    return _reduced(_shaded(depth, face, np.concatenate(normals), np.concatenate(colours)))


def _axes(azimuth: float, elevation: float) -> AnyFloats:
    """Returns unit vectors to the right, upwards and to the eye."""
    a, e = np.radians([azimuth, elevation])
    eye = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return np.stack([right, np.cross(eye, right), eye])


def _fitted(bodies: list[Body], axes: AnyFloats, width: int) -> tuple[View, tuple[int, int]]:
    """Returns the view that fills an image of this width, and the image's rows and columns."""
    seen = np.concatenate([body.vertices for body in bodies]) @ axes[:2].T
    low, high = seen.min(axis=0), seen.max(axis=0)
    rim = _RIM * _SAMPLES
    scale = (width - 2 * rim) / (high[0] - low[0])
    height = int(np.ceil((high[1] - low[1]) * scale)) + 2 * rim
    height += -height % _SAMPLES
    return View(axes, scale, rim - low * scale), (height, width)


def _draw(body: Body, view: View, depth: AnyFloats, face: Integers, drawn: int) -> AnyFloats:
    """Puts a body's visible triangles into the buffers, counted from `drawn`; their normals."""
    corners = body.vertices[body.triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(across, axis=1)
    facing = (across @ view.axes[2] > 1e-9) & (length > 1e-12)
    corners = corners[facing]
    at = corners @ view.axes[:2].T * view.scale + view.shift
    away = corners @ view.axes[2]
    for which, row, column, height in _covered(at, away, depth.shape):
        closer = height > depth[row, column]
        # Of several on one pixel the last one stays.
        order = np.flatnonzero(closer)[np.argsort(height[closer], kind="stable")]
        place = (row[order], column[order])
        depth[place] = height[order]
        face[place] = which[order] + drawn
    return across[facing] / length[facing, None]


def _covered(
    at: AnyFloats, away: AnyFloats, shape: tuple[int, ...]
) -> Iterator[tuple[Integers, Integers, Integers, AnyFloats]]:
    """Yields triangle, row, column and depth of every pixel inside of a triangle, in chunks."""
    low = np.floor(at.min(axis=1)).astype(np.int64)
    size = np.ceil(at.max(axis=1)).astype(np.int64) - low + 1
    ends = np.cumsum(size.prod(axis=1))
    start = 0
    while start < len(at):
        taken = ends[start - 1] if start else 0
        stop = max(start + 1, int(np.searchsorted(ends, taken + _CHUNK)))
        chosen = np.arange(start, stop)
        which = np.repeat(chosen, size[chosen].prod(axis=1))
        place = np.arange(len(which)) - np.repeat(
            ends[chosen] - size[chosen].prod(axis=1) - taken, size[chosen].prod(axis=1)
        )
        column = low[which, 0] + place % size[which, 0]
        row = low[which, 1] + place // size[which, 0]
        yield from _inside(at, away, which, row, column, shape)
        start = stop


def _inside(
    at: AnyFloats,
    away: AnyFloats,
    which: Integers,
    row: Integers,
    column: Integers,
    shape: tuple[int, ...],
) -> Iterator[tuple[Integers, Integers, Integers, AnyFloats]]:
    """Yields those pixels whose middle lies in their triangle, with y turned down."""
    a, b, c = (at[which, k] for k in range(3))
    point = np.stack([column, row], axis=1) + 0.5
    area = _cross(b - a, c - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        second, third = _cross(point - a, c - a) / area, _cross(b - a, point - a) / area
    first = 1.0 - second - third
    hair = -1e-9
    inside = (first >= hair) & (second >= hair) & (third >= hair)
    inside &= (row >= 0) & (row < shape[0]) & (column >= 0) & (column < shape[1])
    weights = np.stack([first, second, third], axis=1)[inside]
    height = (weights * away[which[inside]]).sum(axis=1)
    yield which[inside], shape[0] - 1 - row[inside], column[inside], height


def _cross(a: AnyFloats, b: AnyFloats) -> AnyFloats:
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def _shaded(depth: AnyFloats, face: Integers, normals: AnyFloats, colours: AnyFloats) -> AnyFloats:
    """Returns colours in the light, darker at edges."""
    light = _LIGHT / np.linalg.norm(_LIGHT)
    bright = _AMBIENT + (1.0 - _AMBIENT) * np.clip(normals @ light, 0.0, 1.0)
    lit = np.vstack([colours * bright[:, None], np.ones((1, 3))]).astype(np.float32)
    shaded = lit[face]  # the last row, -1, is the paper
    shaded[_edges(depth, face, normals)] *= 0.45
    return shaded


def _edges(depth: AnyFloats, face: Integers, normals: AnyFloats) -> NDArray[np.bool_]:
    """Returns pixels of a body next to a jump in depth or a bend of the surface."""
    facing = np.vstack([normals, np.zeros((1, 3))]).astype(np.float32)[face]
    flat = np.where(face >= 0, depth, np.float32(-1e3))
    edge = np.zeros(depth.shape, dtype=bool)
    for axis in (0, 1):
        bent = (facing * np.roll(facing, 1, axis=axis)).sum(axis=-1) < _CREASE
        edge |= bent | (np.abs(flat - np.roll(flat, 1, axis=axis)) > _STEP)
    return edge & (face >= 0)


def _reduced(fine: AnyFloats) -> Image:
    rows, columns = fine.shape[0] // _SAMPLES, fine.shape[1] // _SAMPLES
    blocks = fine.reshape(rows, _SAMPLES, columns, _SAMPLES, 3)
    return np.round(255.0 * blocks.mean(axis=(1, 3))).astype(np.uint8)
