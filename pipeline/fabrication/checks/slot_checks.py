"""Finds the slots in the outline of a written unit, and checks them against the design.

The outline that a file holds is closed by a disc somewhat wider than a slot: the filled
areas are the slots, the rest of the design's polygon are truncated tips and fillets.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np
import shapely
from shapely import Geometry, LineString, Polygon

from pipeline.fabrication.readback import BUG, Fault
from pipeline.problem.sections import Fabrication
from sim.core import Floats
from sim.structure import angle_between

_TOLERANCE = 5e-3  # mm, of lengths on a closed outline
_CLOSING = 1.0  # radius of the disc in slot widths
_DEEP = 1.6  # slot widths from the inner end, where the width is measured
_HAIRLINE = 0.01  # mm, half of the width
_FAR, _BACK, _HAIR = 50.0, 0.01, 2e-4  # mm


@dataclass(frozen=True)
class MeasuredSlot:
    """Holds the measures of a slot in an outline."""

    vertex: int  # the nearest vertex of the design
    shape: Geometry  # the slot, from its mouth to its inner end
    inner: LineString  # its inner end, across
    depth: float  # from the vertex to the inner end, mm
    width: float  # mm
    wall: float  # thinnest wall around the inner end, mm
    lip: float  # thinnest wall beside the mouth, mm
    held: LineString  # its middle line, from where both walls are there to the inner end


def measured_slots(design: Polygon, made: Polygon, width: float) -> list[MeasuredSlot]:
    """Measures slots about `width` mm wide in a unit `made` of `design`, both in one frame."""
    filled = shapely.get_parts(closed(made, width).difference(made.buffer(1e-4)))
    corners = np.asarray(design.exterior.coords)[:-1]
    return [_measured(shape, made, corners) for shape in filled if shape.area > width**2]


def closed(made: Polygon, width: float) -> Geometry:
    """Fills the slots of an outline."""
    radius = _CLOSING * width
    return made.buffer(radius, quad_segs=16).buffer(-radius, quad_segs=16)


def _measured(shape: Polygon, made: Polygon, corners: Floats) -> MeasuredSlot:
    """Measures one slot."""
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
    lip, held = _lip(made, inner, axis), _held(made, inner, axis)
    return MeasuredSlot(vertex, within, line, depth, width, wall, lip, held)


def _owner(shape: Polygon, corners: Floats) -> int:
    """Finds the vertex that a slot comes from: near to it, and above all on its axis."""
    box = np.asarray(shapely.minimum_rotated_rectangle(shape).exterior.coords)[:3]
    sides = np.diff(box, axis=0)
    along = _unit(sides[np.argmax(np.linalg.norm(sides, axis=1))])
    to = corners - np.asarray(shape.centroid.coords[0])
    aside = np.abs(to[:, 0] * along[1] - to[:, 1] * along[0])
    return int((shapely.distance(shapely.points(corners), shape) + 10.0 * aside).argmin())


def _ends(shape: Polygon, vertex: Floats) -> tuple[tuple[Floats, Floats], float]:
    """Measures the short sides of a slot, inner one first, and its width at the inner end.

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
    """Measures the thinnest wall beside the mouth; the tips may be cut back unevenly."""
    across = np.array([-axis[1], axis[0]])
    aside = np.sign((inner - inner.mean(axis=0)) @ across)[:, None] * across
    starts = inner + _HAIR * aside
    beside = _through(starts, -np.stack([axis, axis]), made)
    tips = starts - (beside - _BACK)[:, None] * axis
    return float(_through(tips, aside, made).min())


def _held(made: Polygon, inner: Floats, axis: Floats) -> LineString:
    """Draws the middle line of a slot as far as there are walls on both sides.

    Across the inner end, as cut: where the mouth is cut back unevenly the axis is a little aside.
    """
    end, across = inner.mean(axis=0), _unit(inner[1] - inner[0])
    way = np.array([-across[1], across[0]]) * np.sign(axis @ [-across[1], across[0]])
    starts = inner + _BACK * np.array([[-1.0], [1.0]]) * across
    walls = _through(starts, -np.stack([way, way]), made)
    grip = max(_HAIR, float(walls.min()))
    return LineString([end - grip * way, end])


def _through(starts: Floats, ways: Floats, made: Polygon) -> Floats:
    """Measures how far (n,) rays along unit vectors (n, 2) go through a unit before they leave."""
    rays = shapely.linestrings(np.stack([starts, starts + _FAR * ways], axis=1))
    pieces, ray = shapely.get_parts(shapely.intersection(rays, made), return_index=True)
    first = shapely.distance(pieces, shapely.points(starts)[ray]) < _HAIR
    reach = np.zeros(len(starts))
    np.maximum.at(reach, ray[first], shapely.length(pieces[first]))
    return reach


def _unit(vector: Floats) -> Floats:
    return vector / np.linalg.norm(vector)


@dataclass(frozen=True)
class UnitSection:
    """Holds a unit as a file has it, beside its design."""

    label: str  # id of the unit
    file: Path  # with the unit
    design: Polygon  # the polygon as designed
    made: Geometry  # the outline in the file, in the design's frame
    ligaments: Sequence[int]  # vertices at which a ligament ends, one entry a ligament
    # measures of the slots, where they are known
    slots: Sequence[MeasuredSlot] | None = None

    def fault(self, what: str, key: str, remedy: str, spot: Geometry) -> Fault:
        """Makes a fault of the unit at a spot."""
        around = (self.design.exterior, self.made)
        return Fault(f"unit {self.label}", what, key, remedy, self.file, around, spot)


def check_section(shape: UnitSection, settings: Fabrication) -> Iterator[Fault]:
    """Checks a unit's outline: in one piece, true to the design, slots for all shims, walls."""
    made = shape.made
    if not isinstance(made, Polygon) or made.is_empty or made.interiors:
        what = "a slot cuts through it" if not made.is_empty else "it is empty"
        yield shape.fault(what, "slots.depth_max", "lower it", made)
        return
    yield from _check_hairlines(shape, made)
    found = shape.slots
    if found is None:
        found = measured_slots(shape.design, made, settings.slot_width)
    yield from _check_area(shape, closed(made, settings.slot_width), settings)
    at, ends = sorted(slot.vertex for slot in found), sorted(shape.ligaments)
    if at != ends:
        slots, joints = (", ".join(map(str, vertices)) or "none" for vertices in (at, ends))
        what = f"slots at the vertices {slots}, ligaments at {joints}"
        yield shape.fault(what, "slots.depth_min", "lower it", made)
    for slot in found:
        yield from _check_slot(shape, slot, settings)
    yield from _check_apart(shape, found, settings)


def _check_hairlines(shape: UnitSection, made: Polygon) -> Iterator[Fault]:
    """Checks for walls that are thinner than any tool, however short."""
    inner = made.buffer(-_HAIRLINE, join_style="mitre", mitre_limit=100.0)
    thin = made.difference(inner.buffer(1.1 * _HAIRLINE, join_style="mitre", mitre_limit=100.0))
    if thin.length > _HAIRLINE:
        what = "a hairline sticks out of it, or nearly cuts it in two"
        yield shape.fault(what, "slots.tip", BUG, thin)


def _check_area(shape: UnitSection, filled: Geometry, settings: Fabrication) -> Iterator[Fault]:
    """Checks that a unit grows no more than it may, and loses area only at its corners."""
    made, design = shape.made, shape.design
    beyond = made.difference(design.buffer(settings.slots.thicken + _TOLERANCE))
    if not beyond.is_empty:
        yield shape.fault("it reaches beyond the design", "minimum_gap", BUG, beyond)
    lost = design.buffer(-_TOLERANCE).difference(filled).difference(_corners(shape, settings))
    if not lost.is_empty:
        what = "material of the design is missing away from its corners"
        yield shape.fault(what, "slots.depth_max", "lower it", lost)


def _corners(shape: UnitSection, settings: Fabrication) -> Geometry:
    """Covers the corners that may lose material: truncated tips beside slots, fillets."""
    slots, corners = settings.slots, np.asarray(shape.design.exterior.coords)[:-1]
    truncated = slots.depth_max - slots.depth_min + settings.slot_width
    reaches = settings.fillet_radius * _fillet_reach(corners) + 4 * _TOLERANCE
    slotted = np.isin(np.arange(len(corners)), shape.ligaments)
    reaches = np.where(slotted, np.maximum(truncated, reaches), reaches)
    return shapely.union_all(shapely.buffer(shapely.points(corners), reaches))


def _fillet_reach(corners: Floats) -> Floats:
    """Measures how far (n,) from the corners (n, 2) fillets of radius one begin; 0 of hollow ones.

    Between edges at an angle a that is 1 / tan(a / 2) along both.
    """
    ahead, behind = (np.roll(corners, -step, axis=0) - corners for step in (1, -1))
    angle = np.asarray(angle_between(ahead, behind)) % (2.0 * np.pi)
    return np.maximum(0.0, 1.0 / np.tan(angle / 2.0))


def _check_slot(shape: UnitSection, slot: MeasuredSlot, settings: Fabrication) -> Iterator[Fault]:
    limits, where = settings.slots, f"the slot at vertex {slot.vertex}"
    if abs(slot.width - settings.slot_width) > 2 * _TOLERANCE:
        what = f"{where} is {slot.width:.3f} mm wide instead of {settings.slot_width:.3f} mm"
        yield shape.fault(what, "slots.clearance", BUG, slot.shape)
    if slot.wall < settings.minimum_wall - _TOLERANCE:
        what = (
            f"{where} leaves a wall of {slot.wall:.2f} mm, less than {settings.minimum_wall:g} mm"
        )
        remedy = "lower it, or lower slots.depth_min to let the slot be shorter"
        yield shape.fault(what, "minimum_wall", remedy, slot.inner)
    if not limits.depth_min - _TOLERANCE < slot.depth < limits.depth_max + _TOLERANCE:
        depths = f"{limits.depth_min:g} to {limits.depth_max:g} mm"
        what = f"{where} is {slot.depth:.2f} mm deep, not {depths}"
        yield shape.fault(what, "slots.depth_min", "widen the limits", slot.shape)
    if slot.lip < limits.tip - _TOLERANCE:
        what = f"{where} leaves tips of {slot.lip:.2f} mm at its mouth, less than {limits.tip:g} mm"
        yield shape.fault(what, "slots.tip", BUG, slot.shape)


def _check_apart(
    shape: UnitSection, found: Sequence[MeasuredSlot], settings: Fabrication
) -> Iterator[Fault]:
    """Checks the walls between the slots of a unit."""
    least = settings.minimum_wall
    for first, second in combinations(found, 2):
        gap = float(first.shape.distance(second.shape))
        if gap < least - 2 * _TOLERANCE:
            pair = f"the slots at vertices {first.vertex} and {second.vertex}"
            what = f"{pair} are {gap:.2f} mm apart, less than {least:g} mm"
            spot = shapely.shortest_line(first.shape, second.shape)
            yield shape.fault(what, "slots.depth", "lower it", spot)
