"""The flat parts beside the units: shims, template, spacer comb, coupon."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import shapely
from shapely import LineString, Polygon, box

from pipeline.fabrication.font import extent, text, turned
from pipeline.fabrication.parts import Circle, Floats, Part, Shim, Specimen, Strokes
from pipeline.fabrication.strips import strips
from pipeline.problem.fabrication import Fabrication

_SPECK = 0.01  # mm, shorter lines are left out
_RIM = 10.0  # mm of the template around the specimen
_SMALL, _RIM_OF_FOIL = 2.0, 0.4  # mm, letters on shims
_TOOTH = 8.0  # mm, length of the comb's teeth
_HANDLE = 12.0  # mm, back of the comb
_MOST_TEETH = 14
_COUPON_PITCH, _COUPON_DEPTH = 11.0, 14.0  # mm


def shim_pieces(specimen: Specimen, wanted: Fabrication) -> list[Part]:
    """Every piece of foil, the shortest first; the first of each length, a spare, tells it."""
    return [
        Part(
            shim.id,
            box(0.0, 0.0, shim.length, shim.width),
            wanted.shims.thickness,
            engraving=_length(shim) if piece == 0 else (),
        )
        for shim in specimen.shims
        for piece in range(shim.count)
    ]


def _length(shim: Shim) -> Strokes:
    """The length of a shim across it, or along it, if there is room."""
    words, centre = f"{shim.length:g}", (shim.length / 2, shim.width / 2)
    long, high = np.add(extent(words, _SMALL), 2 * _RIM_OF_FOIL)
    for angle, room in ((np.pi / 2, centre[::-1]), (0.0, centre)):
        if long <= 2 * room[0] and high <= 2 * room[1]:
            return turned(text(words, _SMALL), angle, centre)
    return ()


def comb(specimen: Specimen, spacing: float, gap: float, wanted: Fabrication) -> Part:
    """A comb whose teeth keep the units of a row at their distance while shims go in.

    Args:
        specimen: whose longest row gives the number of teeth.
        spacing: of the lattice, mm.
        gap: length of the ligaments, mm.
        wanted: sheet and thickness.
    """
    columns = max(unit.column for unit in specimen.units)
    room = (wanted.laser.sheet[0] - 2 * wanted.laser.margin) / spacing
    teeth = max(1, min(columns, _MOST_TEETH, math.floor(room) - 1))
    width = teeth * spacing
    points = [(0.0, 0.0), (width, 0.0), (width, _HANDLE)]
    for tooth in reversed(range(teeth)):
        middle = (tooth + 0.5) * spacing
        left, right, top = middle - gap / 2, middle + gap / 2, _HANDLE + _TOOTH
        points += [(right, _HANDLE), (right, top), (left, top), (left, _HANDLE)]
    points.append((0.0, _HANDLE))
    told = _title(f"{gap:g}", (width / 2, _HANDLE / 2), 4.0)
    return Part("COMB", Polygon(points), wanted.laser.template_thickness, engraving=told)


def coupon(wanted: Fabrication) -> Part:
    """A block with a slot for each clearance of the ladder, to find the one that holds a shim."""
    width = _COUPON_PITCH * len(wanted.coupon)
    block = box(0.0, 0.0, width, _COUPON_DEPTH)
    written: list[Floats] = []
    for step, clearance in enumerate(wanted.coupon):
        middle = (step + 0.5) * _COUPON_PITCH
        half = wanted.shims.thickness / 2 + clearance
        block = block.difference(
            box(middle - half, _COUPON_DEPTH - wanted.slots.depth, middle + half, 2 * _COUPON_DEPTH)
        )
        written += _title(f"{clearance:.2f}", (middle, 4.5), min(2.6, wanted.labels.height))
    outline = shapely.orient_polygons(Polygon(block.exterior))
    return Part("COUPON", outline, wanted.thickness, engraving=tuple(written))


def _title(words: str, centre: tuple[float, float], height: float) -> Strokes:
    return turned(text(words, height), 0.0, centre)


def templates(specimen: Specimen, spacing: float, wanted: Fabrication) -> Iterator[Part]:
    """Plates to mark the tracking dots through, with the outlines of the units to lay them on.

    A template that is larger than a sheet is split along the lines between the units' sites.
    """
    whole = shapely.total_bounds([unit.outline for unit in specimen.units])
    room = [side - 2 * wanted.laser.margin - wanted.laser.kerf for side in wanted.laser.sheet]
    axes = [cuts(*limits, spacing, most) for limits, most in zip(_axes(whole), room, strict=True)]
    number = 0
    for y0, y1 in pairwise(axes[1]):
        for x0, x1 in pairwise(axes[0]):
            number += 1
            yield _template(number, specimen, box(x0, y0, x1, y1), wanted)


def _axes(bounds: Floats) -> tuple[tuple[float, float], tuple[float, float]]:
    x0, y0, x1, y1 = (float(value) for value in bounds)
    return (x0 - _RIM, x1 + _RIM), (y0 - _RIM, y1 + _RIM)


def cuts(start: float, stop: float, spacing: float, most: float) -> list[float]:
    """Where to cut an axis into pieces of at most ``most``, mm; inner cuts between two sites."""
    pieces = math.ceil((stop - start) / max(most, spacing))
    while True:
        wanted = np.linspace(start, stop, pieces + 1)[1:-1]
        inner = (np.round(wanted / spacing - 0.5) + 0.5) * spacing
        edges = [start, *inner.tolist(), stop]
        if max(np.diff(edges)) <= most or pieces > (stop - start) / spacing:
            return edges
        pieces += 1


def _template(number: int, specimen: Specimen, tile: Polygon, wanted: Fabrication) -> Part:
    shapely.prepare(tile)
    holes = tuple(
        Circle(dot.centre, dot.diameter)
        for unit in specimen.units
        for dot in unit.markers
        if tile.contains(shapely.Point(dot.centre).buffer(dot.diameter / 2 + wanted.laser.gap / 4))
    )
    inner = tile.buffer(-wanted.laser.gap / 4, join_style="mitre")
    lines = [
        np.asarray(piece.coords)
        for unit in specimen.units
        for piece in shapely.get_parts(unit.outline.exterior.intersection(inner))
        if piece.length > _SPECK
    ]
    if wanted.shims.strips:
        lines += [
            np.asarray(piece.coords)
            for _, points in strips(specimen)
            for piece in shapely.get_parts(LineString(points).intersection(inner))
            if piece.length > _SPECK
        ]
    x0, y0, _, _ = tile.bounds
    name = f"TEMPLATE{number}"
    width, height = extent(name, 4.0)
    told = turned(text(name, 4.0), 0.0, (x0 + width / 2 + 3.0, y0 + height / 2 + 2.0))
    return Part(name, tile, wanted.laser.template_thickness, holes, told, tuple(lines))
