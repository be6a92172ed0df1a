"""Templates of the units: from their outlines alone, or learned from frames of the video.

An outline blurred as the camera blurs it finds units whose faces are unknown; what the frames show
then takes its place, whatever it is: dots, speckle, or the bare edge.
"""

from __future__ import annotations

from copy import copy

import cv2
import numpy as np

from pipeline.runtime import Picture
from pipeline.tracking.fit.normal_equations import SIZE
from pipeline.tracking.fit.patch_correlation import Templates
from pipeline.tracking.fit.spline import sample_spline, spline_coefficients
from pipeline.tracking.fit.template_cells import classify_templates
from pipeline.tracking.geometry import Camera, Depth, SpecimenOutlines
from sim.core import Floats, Ints, Singles

NODES_PER_PIXEL = 1.2
_REACH = 2.5
"""The blurred edge is used so many standard deviations of the blur to the outside, and a pixel."""


_FAR = 1e6


class TemplateGrid:
    """Nodes about the centroids of all units, with their distances to outline and joints.

    Args:
        specimen: the units.
        px_per_mm: of the camera.
        reach: how far the nodes go beyond the outlines, mm.
        depth: of thick units; their outlines are then their silhouettes at rest.

    Attributes:
        step: distance of the nodes, mm.
        half: from the middle to the last node, mm.
        x, y: (nodes, nodes) places relative to the centroid, mm.
        inside: (units, nodes, nodes) signed distance to the outline, positive inside, mm.
        joint: (units, nodes, nodes) distance to the nearest vertex that bears a ligament, mm.
        centre: (units, 2) the centroids at rest, mm.
    """

    def __init__(
        self, specimen: SpecimenOutlines, px_per_mm: float, reach: float, depth: Depth | None = None
    ) -> None:
        self.step = 1 / (NODES_PER_PIXEL * px_per_mm)
        nodes = int(np.ceil((specimen.radius.max() + reach) / self.step)) + 3
        self.half = nodes * self.step
        line = np.arange(-nodes, nodes + 1) * self.step
        self.x, self.y = np.meshgrid(line, line)
        shape = (specimen.count, *self.x.shape)
        self.inside = np.empty(shape, np.float32)
        self.joint = np.empty(shape, np.float32)
        rest = np.zeros((specimen.count, 3))
        back = None if depth is None else depth.offset(specimen.centre, rest)
        for unit in range(specimen.count):
            polygon = specimen.polygon(unit)
            shown = polygon
            if depth is not None and back is not None:
                shown = depth.silhouette(polygon, back[unit])
            self.inside[unit] = self.signed_distance(shown)
            ends = polygon[specimen.joined[unit, : len(polygon)]]
            self.joint[unit] = self._distance(ends)
        self.centre = specimen.centre

    def of(self, units: Ints) -> TemplateGrid:
        """The same for some of the units."""
        made = copy(self)
        made.inside, made.joint = self.inside[units], self.joint[units]
        made.centre = self.centre[units]
        return made

    def _distance(self, points: Floats) -> Floats:
        far = np.full(self.x.shape, np.inf)
        for x, y in points:
            far = np.minimum(far, np.hypot(self.x - x, self.y - y))
        return far

    def signed_distance(self, polygon: Floats) -> Singles:
        """From the nodes (nodes, nodes) to a polygon about the centroid, positive inside, mm."""
        far = np.full(self.x.shape, np.inf)
        odd = np.zeros(self.x.shape, dtype=bool)
        for (ax, ay), (bx, by) in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
            ex, ey = bx - ax, by - ay
            along = ((self.x - ax) * ex + (self.y - ay) * ey) / (ex * ex + ey * ey)
            along = np.clip(along, 0, 1)
            far = np.minimum(far, np.hypot(self.x - ax - along * ex, self.y - ay - along * ey))
            if by != ay:
                crossing = (self.y < ay) != (self.y < by)
                odd ^= crossing & (self.x < ax + (self.y - ay) * ex / ey)
        return np.where(odd, far, -far).astype(np.float32)


def _smooth(value: Singles, low: float, high: float) -> Singles:
    share = np.clip((value - low) / (high - low), 0, 1)
    return share * share * (3 - 2 * share)


def _templates(grid: TemplateGrid, brightness: Singles, weight: Singles) -> Templates:
    """Templates with the contrast that each has within its weight."""
    total = weight.sum(axis=(1, 2))
    mean = (brightness * weight).sum(axis=(1, 2)) / total
    square = ((brightness - mean[:, None, None]) ** 2 * weight).sum(axis=(1, 2)) / total
    distance = np.hypot(grid.x, grid.y)
    reach = np.array([distance[mask > 0].max() for mask in weight])
    contrast = np.sqrt(square)
    cells = classify_templates(brightness, weight, contrast)
    return Templates(brightness, weight, grid.half, grid.step, grid.centre, contrast, reach, cells)


def blurred_silhouette(grid: TemplateGrid, inside: Singles, blur: float) -> Singles:
    """What is inside, one, against what is not, zero, as the camera blurs it."""
    sharp = np.clip(inside / grid.step + 0.5, 0, 1).astype(np.float32)
    spread = np.sqrt(max(blur**2 - grid.step**2 / 12, 0)) / grid.step
    return np.asarray(cv2.GaussianBlur(sharp, (0, 0), float(spread)), np.float32)


def template_weight(
    inside: Singles, joint: Singles, blur: float, pixel: float, kind: str
) -> Singles:
    """Weight of nodes in templates that are learned: what is inside, and the blurred edge.

    Outside, what is near a joint moves otherwise. Bare units are followed by their edges alone,
    dots and speckle without them, where the specimen's kind is not left open ("auto").
    """
    outside = _REACH * blur + 0.5 * pixel
    if kind in ("dots", "speckle"):
        return np.asarray(_smooth(inside, outside, outside + pixel), np.float32)
    weight = _smooth(inside, -outside - pixel, -outside)
    beyond = _smooth(-inside, -0.5 * blur, 0.5 * blur)
    weight *= 1 - beyond * (1 - _smooth(joint, 3 * pixel, 4 * pixel))
    if kind == "bare":
        weight *= 1 - _smooth(inside, outside, outside + pixel)
    return np.asarray(weight, np.float32)


def outline_templates(grid: TemplateGrid, blur: float, pixel: float) -> Templates:
    """Bright outlines on a dark ground, blurred; only a band about the edges has weight.

    Args:
        grid: the nodes.
        blur: standard deviation of the camera's blur, mm.
        pixel: size of a pixel, mm.
    """
    faces = np.stack([blurred_silhouette(grid, inside, blur) for inside in grid.inside])
    outside = _REACH * blur + 0.5 * pixel
    weight = _smooth(grid.inside, -outside - pixel, -outside)
    weight *= 1 - _smooth(grid.inside, outside, outside + pixel)
    weight *= _smooth(grid.joint, outside, outside + 2 * pixel)
    return _templates(grid, faces, weight.astype(np.float32))


class TemplateLearner:
    """Averages what frames show of the units, each seen from the unit's own frame.

    Args:
        grid: the nodes.
        blur: standard deviation of the camera's blur, mm.
        pixel: size of a pixel, mm.
        kind: auto, dots, speckle or bare.
    """

    def __init__(self, grid: TemplateGrid, blur: float, pixel: float, kind: str) -> None:
        self._grid = grid
        self._weight = template_weight(grid.inside, grid.joint, blur, pixel, kind)
        outside = _REACH * blur + 0.5 * pixel
        self._wanted = [
            np.nonzero(grid.inside[u] > -outside - 4 * pixel) for u in range(len(grid.centre))
        ]
        self._sum = np.zeros(grid.inside.shape)
        self._count = np.zeros(grid.inside.shape)

    def add(
        self, image: Picture, camera: Camera, pose: Floats, photometry: Floats, share: Floats
    ) -> None:
        """Adds a frame.

        Args:
            image: the frame.
            camera: the camera.
            pose: (units, 3) where the units are; NaN for those to leave out.
            photometry: (units, 4) gain, offset and slopes that the frame has over the template.
            share: (units,) weight of the units.
        """
        coefs = spline_coefficients(image.astype(np.float64))
        grid = self._grid
        for unit in np.nonzero(np.isfinite(pose[:, 0]) & (share > 0))[0]:
            rows, columns = self._wanted[unit]
            x, y = grid.x[rows, columns], grid.y[rows, columns]
            cos, sin = np.cos(pose[unit, 2]), np.sin(pose[unit, 2])
            place = grid.centre[unit] + pose[unit, :2]
            points = place + np.stack([cos * x - sin * y, sin * x + cos * y], axis=1)
            seen = camera.project(points)
            value = np.empty(len(x))
            sample_spline(
                coefs, np.ascontiguousarray(seen[:, 0]), np.ascontiguousarray(seen[:, 1]), value
            )
            gain, offset, sx, sy = photometry[unit]
            value = (value - offset - (sx * x + sy * y) / grid.half) / gain
            good = np.isfinite(value)
            self._sum[unit, rows[good], columns[good]] += share[unit] * value[good]
            self._count[unit, rows[good], columns[good]] += share[unit]

    def templates(self) -> Templates:
        """The mean of what was added."""
        seen = self._count > 0
        face = np.divide(self._sum, self._count, out=np.zeros_like(self._sum), where=seen)
        weight = np.where(seen, self._weight, np.float32(0))
        level = (face * weight).sum(axis=(1, 2)) / np.maximum(weight.sum(axis=(1, 2)), 1e-9)
        face = np.where(seen, face, level[:, None, None])
        return _templates(self._grid, face.astype(np.float32), weight)


def pixel_plane(camera: Camera) -> Singles:
    """Place (rows, columns, 2) in the specimen's plane of every pixel, mm.

    Rows and columns are filled up to whole blocks, with places far from everything.
    """
    columns, rows = camera.size
    u, v = np.meshgrid(np.arange(columns, dtype=float), np.arange(rows, dtype=float))
    out = np.full((-(-rows // SIZE) * SIZE, -(-columns // SIZE) * SIZE, 2), _FAR, np.float32)
    for row in range(0, rows, 64):  # a few rows at a time: the inverse needs several copies
        strip = slice(row, min(row + 64, rows))
        out[strip, :columns] = camera.unproject(np.stack([u[strip], v[strip]], axis=-1))
    return out
