"""Finds the slots in a unit as it was made, and checks them against the design.

The outline that a file holds is closed by a disc somewhat wider than a slot: what that fills are
the slots, what is still missing of the design's polygon are truncated tips and fillets.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from shapely import Geometry, LineString, Point, Polygon

from pipeline.fabrication.readback import Fault
from pipeline.problem.sections import Fabrication
from sim.core import Floats

TOLERANCE = 5e-3
"""Lengths found on a closed outline are right to this, mm."""

_CLOSING = 1.0  # radius of the disc in slot widths
_DEEP = 1.6  # slot widths from the inner end, where the width is measured
_HAIRLINE = 0.01  # mm, half of the width
_FAR, _BACK, _HAIR = 50.0, 0.01, 2e-4  # mm


@dataclass(frozen=True)
class FoundSlot:
    """A slot found in an outline.

    Attributes:
        vertex: the nearest vertex of the design.
        shape: the slot, from its mouth to its inner end.
        inner: its inner end, across.
        depth: from the vertex to the inner end, mm.
        width: mm.
        wall: thinnest wall around the inner end, mm.
        lip: thinnest wall beside the mouth, mm.
    """

    vertex: int
    shape: Geometry
    inner: LineString
    depth: float
    width: float
    wall: float
    lip: float


def slots(design: Polygon, made: Polygon, width: float) -> list[FoundSlot]:
    """Slots about `width` mm wide in a unit `made` of `design`, both in one frame."""
    filled = shapely.get_parts(closed(made, width).difference(made.buffer(1e-4)))
    corners = np.asarray(design.exterior.coords)[:-1]
    return [_found(shape, made, corners) for shape in filled if shape.area > width**2]


def closed(made: Polygon, width: float) -> Geometry:
    """The outline with its slots filled."""
    radius = _CLOSING * width
    return made.buffer(radius, quad_segs=16).buffer(-radius, quad_segs=16)


def _found(shape: Polygon, made: Polygon, corners: Floats) -> FoundSlot:
    """Measures of one slot."""
    vertex = _owner(shape, corners)
    ends, width = _ends(shape, corners[vertex])
    inner, mouth = ends
    axis = _unit(np.mean(inner, axis=0) - np.mean(mouth, axis=0))
    depth = float((np.mean(inner, axis=0) - corners[vertex]) @ axis)
    line = LineString(inner)
    end = np.mean(inner, axis=0)
    reach = LineString([end, end - depth * axis]).buffer(width, cap_style="flat")
    around = shapely.union(made, shape.buffer(2e-4)).boundary
    wall = float(line.distance(around.difference(shape.buffer(0.1 * width))))
    within = shape.intersection(reach)
    return FoundSlot(vertex, within, line, depth, width, wall, _lip(made, inner, axis))


def _owner(shape: Polygon, corners: Floats) -> int:
    """The vertex that a slot comes from: near to it, and above all on its axis."""
    box = np.asarray(shapely.minimum_rotated_rectangle(shape).exterior.coords)[:3]
    sides = np.diff(box, axis=0)
    along = _unit(sides[np.argmax(np.linalg.norm(sides, axis=1))])
    to = corners - np.asarray(shape.centroid.coords[0])
    aside = np.abs(to[:, 0] * along[1] - to[:, 1] * along[0])
    return int((shapely.distance(shapely.points(corners), shape) + 10.0 * aside).argmin())


def _ends(shape: Polygon, vertex: Floats) -> tuple[tuple[Floats, Floats], float]:
    """The short sides of a slot, inner one first, and its width at the inner end.

    Where the mouth is cut back unevenly it is wider, and so is the rectangle around all of it.
    """
    (inner, mouth), width = _short_sides(shape, vertex)
    kept = shape.intersection(LineString(inner).buffer(_DEEP * width))
    (inner, _), width = _short_sides(kept, vertex)
    return (inner, mouth), width


def _short_sides(shape: Geometry, vertex: Floats) -> tuple[tuple[Floats, Floats], float]:
    box = np.asarray(shapely.minimum_rotated_rectangle(shape).exterior.coords)[:4]
    sides = np.linalg.norm(np.roll(box, -1, axis=0) - box, axis=1)
    first = int(np.argmin(sides[:2]))
    short = [np.stack([box[k], box[(k + 1) % 4]]) for k in (first, first + 2)]
    short.sort(key=lambda side: -float(np.linalg.norm(side.mean(axis=0) - vertex)))
    return (short[0], short[1]), float(sides[first])


def _lip(made: Polygon, inner: Floats, axis: Floats) -> float:
    """Thinnest wall beside the mouth, across the slot; the tips may be cut back unevenly."""
    across = np.array([-axis[1], axis[0]])
    walls = []
    for corner in inner:
        aside = across * np.sign((corner - inner.mean(axis=0)) @ across)
        start = corner + _HAIR * aside
        beside = _first(LineString([start, start - _FAR * axis]), made)
        tip = start - (beside - _BACK) * axis
        walls.append(_first(LineString([tip, tip + _FAR * aside]), made))
    return min(walls)


def _first(ray: LineString, made: Polygon) -> float:
    """How far a ray goes through a unit before it leaves it."""
    start = Point(ray.coords[0])
    pieces = shapely.get_parts(ray.intersection(made))
    return max((piece.length for piece in pieces if piece.distance(start) < _HAIR), default=0.0)


def _unit(vector: Floats) -> Floats:
    return vector / np.linalg.norm(vector)


@dataclass(frozen=True)
class MadeOutline:
    """A unit as a file holds it, beside its design.

    Attributes:
        label: id of the unit.
        file: where it was read.
        design: the polygon as designed.
        made: the outline in the file, in the design's frame.
        ligaments: vertices at which a ligament ends, one entry a ligament.
    """

    label: str
    file: Path
    design: Polygon
    made: Geometry
    ligaments: Sequence[int]


def check(shape: MadeOutline, asked: Fabrication) -> Iterator[Fault]:
    """Faults of a unit's outline: whole, true to the design, slots where shims go, walls."""
    made = shape.made
    if not isinstance(made, Polygon) or made.is_empty or made.interiors:
        what = "a slot cuts through it" if not made.is_empty else "it is empty"
        yield _fault(shape, what, "slots.depth_max", "lower it", made)
        return
    yield from _hairlines(shape, made)
    found = slots(shape.design, made, asked.slot_width)
    yield from _true_to_design(shape, closed(made, asked.slot_width), asked)
    at, wanted = sorted(slot.vertex for slot in found), sorted(shape.ligaments)
    if at != wanted:
        what = f"slots at the vertices {_listed(at)}, ligaments at {_listed(wanted)}"
        yield _fault(shape, what, "slots.depth_min", "lower it", made)
    for slot in found:
        yield from _of_slot(shape, slot, asked)
    yield from _apart(shape, found, asked)


def _hairlines(shape: MadeOutline, made: Polygon) -> Iterator[Fault]:
    """No walls that are thinner than any tool, however short."""
    inner = made.buffer(-_HAIRLINE, join_style="mitre", mitre_limit=100.0)
    thin = made.difference(inner.buffer(1.1 * _HAIRLINE, join_style="mitre", mitre_limit=100.0))
    if thin.length > _HAIRLINE:
        what = "a hairline sticks out of it, or nearly cuts it in two"
        yield _fault(shape, what, "slots.tip", "report a bug", thin)


def _listed(vertices: Sequence[int]) -> str:
    return ", ".join(str(vertex) for vertex in vertices) or "none"


def _true_to_design(shape: MadeOutline, filled: Geometry, asked: Fabrication) -> Iterator[Fault]:
    """Nothing beyond the design but what may thicken it, nothing lost but at its corners."""
    made, design = shape.made, shape.design
    beyond = made.difference(design.buffer(asked.slots.thicken + TOLERANCE))
    if not beyond.is_empty:
        yield _fault(shape, "it reaches beyond the design", "minimum_gap", "report a bug", beyond)
    lost = design.buffer(-TOLERANCE).difference(filled).difference(_corners(shape, asked))
    if not lost.is_empty:
        what = "material of the design is missing away from its corners"
        yield _fault(shape, what, "slots.depth_max", "lower it", lost)


def _corners(shape: MadeOutline, asked: Fabrication) -> Geometry:
    """Where a unit may have lost material: truncated tips where there are slots, fillets."""
    slots = asked.slots
    truncated = slots.depth_max - slots.depth_min + asked.slot_width
    reaches = [
        truncated if vertex in shape.ligaments else 4 * asked.fillet_radius + 4 * TOLERANCE
        for vertex in range(len(shape.design.exterior.coords) - 1)
    ]
    points = shapely.points(np.asarray(shape.design.exterior.coords)[:-1])
    return shapely.union_all(shapely.buffer(points, reaches))


def _of_slot(shape: MadeOutline, slot: FoundSlot, asked: Fabrication) -> Iterator[Fault]:
    wanted, where = asked.slots, f"the slot at vertex {slot.vertex}"
    if abs(slot.width - asked.slot_width) > 2 * TOLERANCE:
        what = f"{where} is {slot.width:.3f} mm wide instead of {asked.slot_width:.3f} mm"
        yield _fault(shape, what, "slots.clearance", "report a bug", slot.shape)
    if slot.wall < asked.minimum_wall - TOLERANCE:
        what = f"{where} leaves a wall of {slot.wall:.2f} mm, less than {asked.minimum_wall:g} mm"
        remedy = "lower it, or lower slots.depth_min to let the slot be shorter"
        yield _fault(shape, what, "minimum_wall", remedy, slot.inner)
    if not wanted.depth_min - TOLERANCE < slot.depth < wanted.depth_max + TOLERANCE:
        limits = f"{wanted.depth_min:g} to {wanted.depth_max:g} mm"
        what = f"{where} is {slot.depth:.2f} mm deep, not {limits}"
        yield _fault(shape, what, "slots.depth_min", "widen the limits", slot.shape)
    if slot.lip < wanted.tip - TOLERANCE:
        what = f"{where} leaves tips of {slot.lip:.2f} mm at its mouth, less than {wanted.tip:g} mm"
        yield _fault(shape, what, "slots.tip", "report a bug", slot.shape)


def _apart(shape: MadeOutline, found: Sequence[FoundSlot], asked: Fabrication) -> Iterator[Fault]:
    """No two slots of a unit touch or leave too thin a wall between them."""
    for number, first in enumerate(found):
        for second in found[number + 1 :]:
            gap = float(first.shape.distance(second.shape))
            if gap < asked.minimum_wall - 2 * TOLERANCE:
                pair = f"the slots at vertices {first.vertex} and {second.vertex}"
                what = f"{pair} are {gap:.2f} mm apart, less than {asked.minimum_wall:g} mm"
                spot = shapely.shortest_line(first.shape, second.shape)
                yield _fault(shape, what, "slots.depth", "lower it", spot)


def _fault(shape: MadeOutline, what: str, key: str, remedy: str, spot: Geometry) -> Fault:
    around = (shape.design.exterior, shape.made)
    return Fault(f"unit {shape.label}", what, key, remedy, shape.file, around, spot)
