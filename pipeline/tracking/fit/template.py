"""Makes templates of the units: from their outlines alone, or learned from a frame.

An outline blurred as the camera blurs it finds units whose faces are unknown; what the frames show
then takes its place, whatever it is: dots, speckle, or the bare edge.
"""

from __future__ import annotations

from copy import copy

import cv2
import numpy as np
from scipy.ndimage import spline_filter

from pipeline.runtime import Picture, compiled
from pipeline.tracking.fit.compared_pixels import SIZE
from pipeline.tracking.fit.patch_correlation import Templates
from pipeline.tracking.fit.template_cells import classify_templates
from pipeline.tracking.geometry import Camera, Depth, SpecimenOutlines
from sim.core import Floats, Ints, Singles

NODES_PER_PIXEL = 1.2
_REACH = 2.5
"""The blurred edge is used so many standard deviations of the blur to the outside, and a pixel."""


_SPREAD = float(np.sqrt((SIZE**2 - 1) / 12))
"""Standard deviation of the columns, or rows, of a block's pixels."""


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
        line: (nodes,) places of their columns, and of their rows, relative to the centroid, mm.
        x, y: (nodes, nodes) places, mm.
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
        self.line = line = self.step * np.arange(-nodes, nodes + 1, dtype=np.float64)
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
            square = np.full(self.x.shape, np.inf)
            for x, y in polygon[specimen.joined[unit, : len(polygon)]]:
                square = np.minimum(square, (line - x) ** 2 + (line[:, None] - y) ** 2)
            self.joint[unit] = np.sqrt(square)
        self.centre = specimen.centre

    def of(self, units: Ints) -> TemplateGrid:
        """Returns the grid of some of the units."""
        made = copy(self)
        made.inside, made.joint = self.inside[units], self.joint[units]
        made.centre = self.centre[units]
        return made

    def signed_distance(self, polygon: Floats) -> Singles:
        """Measures from the nodes to a polygon about the centroid, positive inside, mm."""
        found = np.empty(self.x.shape, np.float32)
        scratch = np.empty((2, len(self.line)))
        measure_distance(self.line, np.ascontiguousarray(polygon, dtype=np.float64), scratch, found)
        return found


@compiled
def measure_distance(
    line: Floats,
    polygon: Floats,
    scratch: Floats,
    out: Singles,
    n_line: int = 0,
    n_polygon: int = 0,
) -> None:
    """Measures from nodes (n_line, n_line) to a polygon, positive inside; scratch (2, n_line)."""


def _smooth(value: Singles, low: float, high: float) -> Singles:
    share = np.clip((value - low) / (high - low), 0, 1)
    return share * share * (3 - 2 * share)


def _templates(
    grid: TemplateGrid, brightness: Singles, weight: Singles, noise: float = 0.0
) -> Templates:
    """Makes templates with the contrast that each has within its weight.

    One without weight, of a unit that no frame at rest shows, is never found.
    """
    total = np.maximum(weight.sum(axis=(1, 2)), 1e-9)
    mean = (brightness * weight).sum(axis=(1, 2)) / total
    square = ((brightness - mean[:, None, None]) ** 2 * weight).sum(axis=(1, 2)) / total
    distance = np.hypot(grid.x, grid.y)
    reach = np.array([distance[mask > 0].max(initial=0.0) for mask in weight])
    contrast = np.sqrt(square).astype(np.float64)
    cells = classify_templates(brightness, weight, contrast, noise)
    nodes = brightness, weight, grid.half, grid.step
    return Templates(*nodes, grid.centre, contrast, reach, noise, cells)


def blurred_silhouette(grid: TemplateGrid, inside: Singles, blur: float) -> Singles:
    """Blurs a silhouette, one inside and zero outside, as the camera does."""
    sharp = np.clip(inside / grid.step + 0.5, 0, 1).astype(np.float32)
    spread = np.sqrt(max(blur**2 - grid.step**2 / 12, 0)) / grid.step
    return np.asarray(cv2.GaussianBlur(sharp, (0, 0), float(spread)), np.float32)


def template_weight(
    inside: Singles, joint: Singles, blur: float, pixel: float, kind: str
) -> Singles:
    """Weighs nodes in templates that are learned: what is inside, and the blurred edge.

    Outside, what is near a joint moves otherwise. Bare units are followed by their edges alone,
    dots and speckle without them, where the specimen's kind is not left open ("auto").
    """
    outside = _REACH * blur + 0.5 * pixel
    if kind in ("dots", "speckle"):
        return np.asarray(_smooth(inside, outside, outside + pixel), np.float32)
    weight = _smooth(inside, -outside - pixel, -outside)
    beyond = _smooth(-inside, -0.5 * blur, 0.5 * blur)
    weight *= 1 - beyond * (1 - _smooth(joint, 1.5 * pixel, 2.5 * pixel))
    if kind == "bare":
        weight *= 1 - _smooth(inside, outside, outside + pixel)
    return np.asarray(weight, np.float32)


def outline_templates(grid: TemplateGrid, blur: float, pixel: float, bright: bool) -> Templates:
    """Draws blurred outlines, one where it is bright and zero where it is dark.

    Slopes of the light scale what is bright: an edge of dark units that were drawn as ones would be
    shifted by them. Only a band about the edges has weight.

    Args:
        grid: the nodes.
        blur: standard deviation of the camera's blur, mm.
        pixel: size of a pixel, mm.
        bright: whether the units are brighter than what is behind them.
    """
    faces = np.stack([blurred_silhouette(grid, inside, blur) for inside in grid.inside])
    faces = faces if bright else 1 - faces
    outside = _REACH * blur + 0.5 * pixel
    weight = _smooth(grid.inside, -outside - pixel, -outside)
    weight *= 1 - _smooth(grid.inside, outside, outside + pixel)
    weight *= _smooth(grid.joint, outside, outside + 2 * pixel)
    return _templates(grid, faces, weight.astype(np.float32))


def learn_templates(
    image: Picture,
    camera: Camera,
    grid: TemplateGrid,
    blur: float,
    pixel: float,
    kind: str,
    noise: float = 0.0,
) -> Templates:
    """Learns the templates of units at rest from what a frame shows of them.

    Args:
        image: the frame.
        camera: the camera.
        grid: the nodes.
        blur: standard deviation of the camera's blur, mm.
        pixel: size of a pixel, mm.
        kind: auto, dots, speckle or bare.
        noise: standard deviation of the frame's.
    """
    coefs = spline_coefficients(image.astype(np.float64))
    wanted = grid.inside > -(_REACH * blur + 0.5 * pixel) - 4 * pixel
    face = np.full(grid.inside.shape, np.nan)
    for unit in range(len(grid.centre)):
        points = grid.centre[unit] + np.stack([grid.x[wanted[unit]], grid.y[wanted[unit]]], axis=1)
        x, y = camera.project(points).T
        value, columns = np.empty(len(points)), coefs.shape[1]
        sample_spline(coefs, columns, np.ascontiguousarray(x), np.ascontiguousarray(y), value)
        face[unit, wanted[unit]] = value
    seen = np.isfinite(face)
    weight = np.where(
        seen, template_weight(grid.inside, grid.joint, blur, pixel, kind), np.float32(0)
    )
    face[~seen] = 0.0
    level = (face * weight).sum(axis=(1, 2)) / np.maximum(weight.sum(axis=(1, 2)), 1e-9)
    face = np.where(seen, face, level[:, None, None])
    return _templates(grid, face.astype(np.float32), weight, noise)


def block_places(camera: Camera) -> Floats:
    """Maps whole blocks to their places (rows, columns, 3, 2) in the specimen's plane.

    Returns:
        Place of a block's middle, change by column and by row of pixels, mm: least squares over the
        pixels of maps that are parabolas within a block.
    """
    columns, rows = camera.size
    u, v = (SIZE * np.arange(size // SIZE) + 0.5 * (SIZE - 1) for size in (columns, rows))
    middle = np.stack(np.meshgrid(u, v), axis=-1)
    ends = np.array([[-1, -1], [1, -1], [-1, 1], [1, 1]])
    places = [camera.unproject(middle + _SPREAD * end) for end in ends]
    ahead, down = (
        sum(sign * place for sign, place in zip(signs, places, strict=True)) / (4 * _SPREAD)
        for signs in ends.T
    )
    return np.stack([np.mean(places, axis=0), ahead, down], axis=-2)


def spline_coefficients(values: Floats) -> Singles:
    """Fits the cubic B-spline (Unser, 1999) through an image or grid (rows, columns)."""
    return np.asarray(spline_filter(values, order=3, mode="mirror", output=np.float64), np.float32)


@compiled
def sample_spline(
    coefs: Singles, columns: int, x: Floats, y: Floats, out: Floats, n_coefs: int = 0, n_x: int = 0
) -> None:
    """Samples at points (column ``x``, row ``y``); NaN where the four by four knots do not fit."""
