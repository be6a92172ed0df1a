"""Estimates print time and filament of a plate, from the lines that a slicer fills its layers with.

The lines are those of PrusaSlicer's standard settings (2.5): layers of 0.3 mm, three perimeters of
0.45 mm, infill between them, solid at the top, at the bottom and in small areas. Each straight line
is run from rest to rest at the speed of its kind and one acceleration. Beside the slicer's own
times it is off by less than 15 % (tests/clients/test_fabrication.py).
"""

import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
import shapely
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from pipeline.fabrication.parts import PrintedPart
from sim.core import Floats

LAYER, WIDTH = 0.3, 0.45
"""Height of a layer and width of a line, mm."""
PITCH = WIDTH - LAYER * (1.0 - math.pi / 4.0)
"""Of neighbouring lines with round sides, mm."""
PERIMETERS, SHELLS = 3, 3
"""Lines around an area; solid layers below a top and above a bottom."""
SOLID_BELOW, SMALL_LOOP = 70.0, 13.0 * math.pi
"""Areas (mm^2) filled as solids, and loops (mm) run slowly."""
OUTER, INNER, SMALL, SOLID, SPARSE, TRAVEL = 30.0, 60.0, 15.0, 20.0, 80.0, 130.0
"""Speeds of the kinds of lines, mm/s."""
ACCELERATION, JERK, RETRACTION = 1500.0, 10.0, 0.1
"""mm/s^2; change of speed without acceleration, mm/s; s for pulling back and on."""
STRAND = math.pi / 4.0 * 1.75**2
"""Section of the filament, mm^2."""


class PrintEstimate(NamedTuple):
    """Holds what printing takes: time, s, and length of filament, mm."""

    seconds: float
    filament: float


def estimate_print(parts: Iterable[PrintedPart], infill: float) -> PrintEstimate:
    """Estimates a plate with some parts, filled inside to a share ``infill``."""
    every = [_part(part, infill) for part in parts]
    return PrintEstimate(*(float(sum(each)) for each in zip(*every, strict=True)))


def _part(part: PrintedPart, infill: float) -> PrintEstimate:
    seconds = volume = 0.0
    far = math.hypot(*part.size)
    insides = [layer.area.buffer(-PERIMETERS * PITCH, join_style="mitre") for layer in part.layers]
    large = any(_is_large(area) for inside in insides for area in shapely.get_parts(inside))
    surfaces = list(_surfaces(part)) if large else []
    for layer, inside in zip(part.layers, insides, strict=True):
        count = (layer.top - layer.bottom) / LAYER
        loops = list(_loops(layer.area))
        length = sum(float(edges.sum()) for edges, _ in loops)
        once = sum(float(_run(edges, speed).sum()) for edges, speed in loops)
        solid = sum(
            (min(layer.top, high) - max(layer.bottom, low)) * inside.intersection(area).area
            for low, high, area in surfaces
            if low < layer.top and layer.bottom < high
        )
        for area in (each for each in shapely.get_parts(inside) if each.area > 0.0):
            share = 1.0
            if _is_large(area):
                share = min(1.0, solid / (inside.area * (layer.top - layer.bottom)))
            for density, speed in ((share, SOLID), ((1.0 - share) * infill, SPARSE)):
                length += density * area.area / PITCH
                once += _filled(area, density, speed)
        pieces = len(shapely.get_parts(layer.area))
        seconds += count * (once + pieces * (far / TRAVEL + RETRACTION))
        volume += count * length * PITCH * LAYER
    return PrintEstimate(seconds, volume / STRAND)


def _is_large(area: BaseGeometry) -> bool:
    """Tests that an area is too large to be filled as a solid whatever lies above and below."""
    return bool(area.area > SOLID_BELOW)


def _surfaces(part: PrintedPart) -> Iterator[tuple[float, float, BaseGeometry]]:
    """Yields the slabs below tops and above bottoms that are filled as solids: heights, area."""
    covers = [Polygon(), *(layer.area for layer in part.layers), Polygon()]
    shell = SHELLS * LAYER
    for layer, below, above in zip(part.layers, covers, covers[2:], strict=False):
        yield layer.bottom, layer.bottom + shell, layer.area.difference(below)
        yield layer.top - shell, layer.top, layer.area.difference(above)


def _loops(area: BaseGeometry) -> Iterator[tuple[Floats, float]]:
    """Yields the edges (n,) of the perimeters of an area, mm, with their speed."""
    for number in range(PERIMETERS):
        ring = area.buffer(-(number + 0.5) * PITCH, join_style="mitre").simplify(0.01)
        for polygon in (each for each in shapely.get_parts(ring) if each.area > 0.0):
            for line in (polygon.exterior, *polygon.interiors):
                edges = np.hypot(*np.diff(shapely.get_coordinates(line), axis=0).T)
                usual = OUTER if number == 0 else INNER
                yield edges, usual if edges.sum() > SMALL_LOOP else SMALL


def _filled(area: Polygon, density: float, speed: float) -> float:
    """Estimates the time of parallel lines over an area, s.

    A line is as long as a convex area's chord is on average, pi A / P.
    """
    chord = math.pi * area.area / area.length
    return density * area.area / PITCH / chord * float(_run(np.array([chord]), speed)[0])


def _run(lengths: Floats, speed: float) -> Floats:
    """Computes the times (n,) of straight lines between corners, from jerk to jerk, s."""
    gain = max(speed - JERK, 0.0)
    ramps = (speed**2 - (speed - gain) ** 2) / ACCELERATION  # length of both
    cruising = lengths / speed + gain**2 / (ACCELERATION * speed)
    slow = speed - gain
    peak = np.sqrt(slow**2 + ACCELERATION * lengths)
    return np.asarray(np.where(lengths > ramps, cruising, 2.0 * (peak - slow) / ACCELERATION))
