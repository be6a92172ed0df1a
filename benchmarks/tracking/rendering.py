"""Renders bare units on a board, apart from the virtual lab: a second opinion on it.

Pixels are covered exactly, by signed areas of the outlines' pieces; OpenCV blurs and adds hands.
"""

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple, TypeAlias, cast

import av
import cv2
import numpy as np
from scipy.spatial import cKDTree

from pipeline.tracking.geometry import SpecimenOutlines
from sim.core import Floats, Image, Singles

_FINE = 2
"""The optics blur on a grid so many times as fine as the pixels."""
_PARTS = 6
"""Pieces of an edge, which a lens or a shutter bends."""
_ROUNDS = 4

Motion: TypeAlias = Callable[[Floats], Floats]
"""Poses (n, units, 3) in mm and rad at times (n,) in s."""
Covering: TypeAlias = Callable[[Singles, float], None]
"""Draws what else is in view at a time in s, in place."""


class View(NamedTuple):
    """Holds a camera and its light."""

    size: tuple[int, int] = (640, 640)  # columns and rows
    scale: float = 4.0  # px/mm on the axis
    distance: float = 900.0  # from the specimen, mm; lines of sight are parallel without it
    tilt: float = 0.02  # about x, rad
    fisheye: bool = False  # whether the angle to the axis, not its tangent, maps to the radius
    blur: float = 0.7  # standard deviation of the optics, px
    # exposure, readout: of a frame, and from its first row to its last, s
    exposure: float = 0.0
    readout: float = 0.0
    # dark, light: shades of units and board
    dark: float = 30.0
    light: float = 205.0
    # standard deviation of the sensor at each brightness: of nothing, and its root's
    noise: tuple[float, float] = (2.0, 0.12)

    def variance(self, brightness: Floats) -> Floats:
        """Computes the variance of the sensor's noise."""
        still, shot = self.noise
        return np.asarray(still**2 + shot**2 * np.maximum(brightness, 0))

    def project(self, points: Floats) -> Floats:
        """Maps points (..., 2) in mm about the specimen's middle to pixels, y down."""
        x, y = points[..., 0], points[..., 1]
        across = np.stack([x, -y * np.cos(self.tilt)], axis=-1)
        depth = self.distance + y * np.sin(self.tilt)
        slope = across / depth[..., None]
        if self.fisheye:
            radius = np.maximum(np.linalg.norm(slope, axis=-1, keepdims=True), 1e-12)
            slope = slope / radius * np.arctan(radius)
        return (np.array(self.size) - 1) / 2 + self.scale * self.distance * slope


class Renderer:
    """Draws a specimen that moves.

    Args:
        specimen: its units.
        motion: of them.
        view: how it is seen.
        cover: hands, bolts, whatever else is in view.
        seed: of the noise.
    """

    def __init__(
        self,
        specimen: SpecimenOutlines,
        motion: Motion,
        view: View,
        cover: Covering | None = None,
        seed: int = 0,
    ) -> None:
        self._motion, self._view, self._cover = motion, view, cover
        self._random = np.random.default_rng(seed)
        self._middle = specimen.centre.mean(axis=0)
        self._centre = specimen.centre
        parts = np.arange(_PARTS) / _PARTS
        self._outline = [
            np.concatenate(
                [a + parts[:, None] * (b - a) for a, b in zip(p, np.roll(p, -1, 0), strict=True)]
            )
            for p in map(specimen.polygon, range(specimen.count))
        ]

    def frame(self, time: float) -> Singles:
        """Returns brightness (rows, columns) of a frame whose exposure is centred about a time."""
        clean = self.clean(time)
        spread = np.sqrt(self._view.variance(clean))
        return np.asarray(clean + spread * self._random.normal(size=clean.shape), np.float32)

    def clean(self, time: float) -> Floats:
        """Returns what a frame would be without noise."""
        instants = self._view.exposure * (np.arange(n := self._instants(time)) + 0.5) / n
        shown = [self._instant(time + at - self._view.exposure / 2) for at in instants]
        return np.asarray(np.mean(shown, axis=0))

    def _instants(self, time: float) -> int:
        if not self._view.exposure:
            return 1
        ends = self._motion(time + self._view.exposure * np.array([-0.5, 0.5]))
        longest = self._view.scale * np.linalg.norm(np.diff(ends[..., :2], axis=0), axis=-1).max()
        return int(min(max(4, 3 * longest), 40))

    def _instant(self, time: float) -> Singles:
        view, (columns, rows) = self._view, self._view.size
        share = covered(
            (rows * _FINE, columns * _FINE),
            [(polygon + 0.5) * _FINE for polygon in self._outlines(time)],
        )
        fine = np.asarray(view.light + (view.dark - view.light) * share, np.float32)
        blurred = cv2.GaussianBlur(fine, (0, 0), _FINE * view.blur)
        small = cv2.resize(blurred, (columns, rows), interpolation=cv2.INTER_AREA)
        image = np.asarray(small, np.float32)
        if self._cover is not None:
            self._cover(image, time)
        return np.asarray(image, np.float32)

    def _outlines(self, time: float) -> list[Floats]:
        """Returns the units' outlines in px, each point at the time at which its row is read."""
        rows = self._view.size[1]
        rest = self._motion(np.array([time]))[0]
        out = []
        for unit, outline in enumerate(self._outline):
            there = self._placed(unit, outline, rest[unit])
            for _ in range(_ROUNDS if self._view.readout else 0):
                late = time + self._view.readout * (there[:, 1] / rows - 0.5)
                there = self._placed(unit, outline, self._motion(late)[:, unit])
            out.append(there)
        return out

    def _placed(self, unit: int, outline: Floats, pose: Floats) -> Floats:
        x, y, turn = pose.T
        cos, sin = np.cos(turn), np.sin(turn)
        turned = np.stack(
            [cos * outline[:, 0] - sin * outline[:, 1], sin * outline[:, 0] + cos * outline[:, 1]],
            axis=1,
        )
        shift = np.stack([x, y], axis=-1)
        return self._view.project(self._centre[unit] - self._middle + turned + shift)


def pose_bound(
    specimen: SpecimenOutlines, motion: Motion, view: View, time: float, cover: Covering | None
) -> Floats:
    """Computes the Cramer-Rao bound (units, 3), mm and rad, of poses in one frame of 8 bits.

    It is NaN out of view. The covariance of a pose p is at least the inverse of
    sum dI/dp dI/dp' / variance over the pixels, of which each is told off to the nearest unit.
    """
    steps = np.array([0.02, 0.02, 0.003])
    slopes = []
    for change in np.diag(steps):
        ends = [
            Renderer(specimen, _moved_by(motion, sign * change), view, cover).clean(time)
            for sign in (1, -1)
        ]
        slopes.append((ends[0] - ends[1]) / (2 * change.sum()))
    clean = Renderer(specimen, motion, view, cover).clean(time)
    moved = specimen.centre - specimen.centre.mean(axis=0) + motion(np.array([time]))[0, :, :2]
    rows, columns = np.indices(clean.shape)
    pixels = np.stack([columns.ravel(), rows.ravel()], axis=1)
    nearest = cKDTree(view.project(moved)).query(pixels)[1]
    weight = (1 / (view.variance(clean) + 1 / 12)).ravel()
    information = np.empty((specimen.count, 3, 3))
    for first, second in np.ndindex(3, 3):
        product = slopes[first].ravel() * slopes[second].ravel() * weight
        information[:, first, second] = np.bincount(nearest, product, specimen.count)
    shown = np.linalg.matrix_rank(information) == 3
    found = np.full((specimen.count, 3), np.nan)
    found[shown] = np.sqrt(np.diagonal(np.linalg.inv(information[shown]), axis1=1, axis2=2))
    return found


def _moved_by(motion: Motion, change: Floats) -> Motion:
    return lambda time: motion(time) + change


def covered(shape: tuple[int, int], polygons: list[Floats]) -> Floats:
    """Returns the part (rows, columns) of each pixel that polygons (n, 2) cover.

    A piece of an outline within one pixel turns what is right of it inside out, by its height: in
    its own pixel to where it lies, beyond wholly. Outlines leave the picture cut off at its rim.
    """
    start = np.concatenate(polygons)
    end = np.concatenate([np.roll(polygon, -1, axis=0) for polygon in polygons])
    low, span = np.minimum(start, end), end - start
    cuts = [np.zeros((len(start), 1)), np.ones((len(start), 1))]
    for axis in range(2):
        count = int(np.ceil(np.abs(span[:, axis]).max())) + 1
        lines = np.floor(low[:, axis])[:, None] + 1 + np.arange(count)
        flat = np.where(span[:, axis] == 0, 1.0, span[:, axis])[:, None]
        cuts.append(np.clip((lines - start[:, axis, None]) / flat, 0, 1))
    cut = np.sort(np.concatenate(cuts, axis=1), axis=1)
    points = start[:, None] + cut[..., None] * span[:, None]
    points = np.clip(points, 0, np.array(shape[::-1]) - 1e-9)
    height = np.diff(points[..., 1], axis=1).ravel()
    middle = (0.5 * (points[:, 1:] + points[:, :-1])).reshape(-1, 2)
    column, row = np.floor(middle).astype(int).T
    out = np.zeros((shape[0], shape[1] + 1))
    own = height * (column + 1 - middle[:, 0])
    np.add.at(out, (row, column), own)
    np.add.at(out, (row, column + 1), height - own)
    return np.abs(np.cumsum(out, axis=1)[:, :-1])


def eight_bit(image: Singles) -> Image:
    """Rounds brightness to 8 bit."""
    return np.clip(np.round(image), 0, 255).astype(np.uint8)


def write_video(
    path: Path, images: list[np.ndarray], times: list[float], codec: str, pixels: str, crf: int
) -> Path:
    """Writes pictures of one format (gray, bgr24, gray16le) at their own times."""
    step = Fraction(1, 90000)
    with av.open(str(path), "w") as container:
        stream = cast("av.VideoStream", container.add_stream(codec, rate=Fraction(30)))
        stream.height, stream.width = images[0].shape[:2]
        stream.pix_fmt, stream.codec_context.time_base = pixels, step
        stream.options = (
            {} if codec == "ffv1" else {"crf": str(crf), "x265-params": "log-level=none"}
        )
        kind = (
            "bgr24"
            if images[0].ndim == 3
            else ("gray16le" if images[0].dtype == np.uint16 else "gray")
        )
        for image, time in zip(images, times, strict=True):
            frame = av.VideoFrame.from_ndarray(image, format=kind)
            frame.pts, frame.time_base = round(time / step), step
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path
