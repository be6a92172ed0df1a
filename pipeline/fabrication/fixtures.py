"""What holds a specimen under test: clamps, grips, the adapter of a driven unit."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
import shapely
from shapely import MultiPolygon, Polygon, affinity, box
from shapely.geometry.base import BaseGeometry

from pipeline.fabrication.flat import cuts
from pipeline.fabrication.lettering import fitted
from pipeline.fabrication.parts import Circle, Specimen, Unit
from pipeline.fabrication.solids import Layer, Solid, discs, flat, merged, pen
from pipeline.problem.fabrication import Fabrication
from pipeline.problem.fabrication import Fixture as Asked

_EDGE = 3  # as many units in a line make an edge
_APART = 3.0  # mm from units that move
_CORRIDOR = 1.0  # mm beside a shim
_HEAD = 4.5  # mm, radius of a bolt's head with its washer
_LID = 3.0  # mm, thickness of lids
_PRESS = 0.2  # mm by which posts are lower than the units, so that the lid presses
_LUG = 2.5  # mm, thickness of the adapter's fingers
_FOOT = 1.5  # mm by which the adapter's back is above the units
_GRID, _PEN = 1e-3, 0.5  # mm, of letters
_THIN = 0.4  # mm, half of the thinnest wall that a jig keeps


def fixtures(specimen: Specimen, wanted: Fabrication, spacing: float) -> Iterator[Solid]:
    """Clamps, grips and adapters of a specimen, each as it lies on the printer's bed.

    Args:
        specimen: what is held.
        wanted: how it is made.
        spacing: of the lattice, mm.
    """
    for kind, labels in (("CLAMP", specimen.clamped), ("DRIVE", specimen.driven)):
        for group in groups([specimen.by_label[label] for label in labels]):
            yield from _holder(kind, group, specimen, wanted, spacing)


def groups(units: Sequence[Unit]) -> list[list[Unit]]:
    """Edges (three or more units of one column or of one row, side by side), and single units."""
    left = {unit.label: unit for unit in units}
    found = []
    for axis in ("column", "row"):
        for place in sorted({getattr(unit, axis) for unit in left.values()}):
            line = [unit for unit in left.values() if getattr(unit, axis) == place]
            if len(line) >= _EDGE:
                found.append(sorted(line, key=lambda unit: (unit.column, unit.row)))
                for unit in line:
                    del left[unit.label]
    return found + [[unit] for unit in left.values()]


def _holder(
    kind: str, group: list[Unit], specimen: Specimen, wanted: Fabrication, spacing: float
) -> Iterator[Solid]:
    if len(group) >= _EDGE:
        yield from _grip(kind, group, specimen, wanted, spacing)
    elif kind == "DRIVE" and not _at_rim(group[0], specimen):
        yield adapter(group[0], specimen, wanted)
    else:
        yield from _pad(kind, group[0], specimen, wanted)


def _at_rim(unit: Unit, specimen: Specimen) -> bool:
    columns = [other.column for other in specimen.units]
    rows = [other.row for other in specimen.units]
    return unit.column in (min(columns), max(columns)) or unit.row in (min(rows), max(rows))


def _pad(kind: str, unit: Unit, specimen: Specimen, wanted: Fabrication) -> Iterator[Solid]:
    """A corner pad with one bolt on the breadboard, and its lid."""
    asked = wanted.fixture
    bolt = nearest_bolt(unit, specimen, asked)
    x, y = bolt
    half = asked.pad / 2
    square = box(x - half, y - half, x + half, y + half)
    footprint = square.union(unit.outline.buffer(2.0)).convex_hull
    hole = (Circle(bolt, asked.hole),)
    yield from _clamp(f"{kind}-{unit.label}", [unit], footprint, hole, specimen, wanted)


def nearest_bolt(unit: Unit, specimen: Specimen, asked: Asked) -> tuple[float, float]:
    """The nearest breadboard hole whose bolt clears all units.

    The specimen's centre lies on a hole of the board or midway between four, whichever brings the
    bolts nearer to the clamped units.
    """
    shapes = shapely.union_all([other.outline for other in specimen.units])
    clear = shapes.buffer(_HEAD + 1.0)
    x0, y0, x1, y1 = shapes.bounds
    centre = np.array([(x0 + x1) / 2, (y0 + y1) / 2])
    return min(
        (_nearest(unit, clear, centre + shift * asked.grid, asked) for shift in (0.0, 0.5)),
        key=lambda spot: unit.outline.distance(shapely.Point(spot)),
    )


def _nearest(
    unit: Unit, clear: BaseGeometry, origin: np.ndarray, asked: Asked
) -> tuple[float, float]:
    here = np.array([unit.design.centroid.x, unit.design.centroid.y])
    middle = np.round((here - origin) / asked.grid)
    steps = np.stack(np.meshgrid(np.arange(-4, 5), np.arange(-4, 5)), axis=-1).reshape(-1, 2)
    spots = origin + (middle + steps) * asked.grid
    spots = spots[~shapely.contains_xy(clear, spots)]
    x, y = spots[np.argmin(np.round(np.linalg.norm(spots - here, axis=1), 6))]
    return float(x), float(y)


def _grip(
    kind: str, group: list[Unit], specimen: Specimen, wanted: Fabrication, spacing: float
) -> Iterator[Solid]:
    """A bar along an edge, with bolts beside it, in pieces that fit the bed; and its lid."""
    upright = group[0].column == group[-1].column
    x0, y0, x1, y1 = shapely.total_bounds([unit.outline for unit in group])
    whole = shapely.total_bounds([unit.outline for unit in specimen.units])
    place = [unit.column if upright else unit.row for unit in specimen.units]
    mine = group[0].column if upright else group[0].row
    low = mine - min(place) <= max(place) - mine  # which side of the specimen the bolts are on
    room = wanted.print.bed[1 if upright else 0] - 2 * wanted.print.margin
    start, stop = (y0, y1) if upright else (x0, x1)
    edge = float(whole[0 if upright else 1] if low else whole[2 if upright else 3])
    pitch, flange = wanted.fixture.bolt_pitch, wanted.fixture.pad
    bolt = edge - flange / 2 if low else edge + flange / 2
    inner = ((x0 + x1) if upright else (y0 + y1)) / 2
    outer = edge - flange if low else edge + flange
    count = math.floor((stop - start - 2 * _HEAD) / pitch) + 1
    first = (start + stop) / 2 - (count - 1) / 2 * pitch
    spots = [first + step * pitch for step in range(count)]
    edges = cuts(float(start), float(stop), spacing, room)
    for number, (low_end, high_end) in enumerate(pairwise(edges), 1):
        span = (*sorted((inner, outer)), low_end, high_end)
        footprint = box(*_oriented(span, upright))
        holes = tuple(
            Circle((bolt, spot) if upright else (spot, bolt), wanted.fixture.hole)
            for spot in spots
            if low_end + _HEAD < spot < high_end - _HEAD
        )
        name = f"{kind}-{group[0].label}-{group[-1].label}"
        name += f"-{number}" if len(edges) > 2 else ""
        yield from _clamp(name, group, footprint, holes, specimen, wanted)


def _oriented(
    span: tuple[float, float, float, float], upright: bool
) -> tuple[float, float, float, float]:
    """Box (x0, y0, x1, y1) of a span across and along an edge."""
    a0, a1, b0, b1 = span
    return (a0, b0, a1, b1) if upright else (b0, a0, b1, a1)


def _clamp(
    name: str,
    held: Sequence[Unit],
    footprint: Polygon,
    holes: tuple[Circle, ...],
    specimen: Specimen,
    wanted: Fabrication,
) -> Iterator[Solid]:
    """A base below the held units with jaws around them, and a lid to be bolted on top."""
    asked = wanted.fixture
    labels = {unit.label for unit in held}
    free = [unit.outline for unit in specimen.units if unit.label not in labels]
    mine = shapely.union_all([unit.outline for unit in held])
    kept = footprint.difference(shapely.union_all(free).buffer(_APART)).difference(discs(holes))
    base = _main(kept)
    jaws = base.difference(mine.buffer(asked.clearance)).difference(corridors(specimen))
    jaws = printable(jaws).intersection(base)
    top, depth = asked.base + wanted.thickness - _PRESS, wanted.labels.depth
    above, below = lettered(name, base, wanted)
    yield Solid(
        name,
        (
            Layer(below, 0.0, depth),
            Layer(base, depth, asked.base),
            Layer(flat(jaws), asked.base, top),
        ),
    )
    yield Solid(f"{name}-LID", (Layer(base, 0.0, _LID - depth), Layer(above, _LID - depth, _LID)))


def lettered(
    name: str, shape: Polygon, wanted: Fabrication
) -> tuple[Polygon | MultiPolygon, Polygon | MultiPolygon]:
    """A shape without the strokes of a name, to be read from above and from below."""
    placed = fitted(name, shape, shape, wanted.labels)
    if placed is None:
        return shape, shape
    above, below = (
        shapely.set_precision(merged(pen(strokes, min(wanted.labels.stroke, _PEN))), _GRID)
        for strokes in (placed.strokes, placed.mirrored)
    )
    return flat(shape.difference(above)), flat(shape.difference(below))


def _main(shape: BaseGeometry) -> Polygon:
    """The largest piece, with its holes."""
    return max(
        (part for part in shapely.get_parts(shape) if isinstance(part, Polygon)),
        key=lambda part: part.area,
    )


def corridors(specimen: Specimen) -> BaseGeometry:
    """The corridors that shims need to be slid in from the top."""
    ends: dict[int, list[np.ndarray]] = {}
    for unit in specimen.units:
        for slot in unit.slots:
            ends.setdefault(slot.ligament, []).extend([slot.mouth])
    lines = [shapely.LineString(pair) for pair in ends.values()]
    return shapely.union_all(shapely.buffer(lines, _CORRIDOR, cap_style="square"))


def adapter(unit: Unit, specimen: Specimen, wanted: Fabrication) -> Solid:
    """A cap with fingers that grips a unit from the top, with a bolt hole over its centroid.

    It is printed on its back: seen as it lies on the bed, it is mirrored. The back may be wider
    than the unit, so a foot keeps it above the neighbours. Where they leave no room for fingers,
    the foot is glued on.
    """
    asked = wanted.fixture
    others = [other.outline for other in specimen.units if other.label != unit.label]
    taken = shapely.union_all(others).buffer(_APART / 2)
    snug = unit.outline.convex_hull.buffer(asked.clearance, join_style="mitre")
    ring = snug.buffer(_LUG, join_style="mitre").difference(snug)
    fingers = printable(ring.difference(taken).difference(corridors(specimen)))
    foot = flat(printable(snug.union(fingers).convex_hull.difference(taken)))
    bolt = Circle((unit.design.centroid.x, unit.design.centroid.y), asked.hole)
    boss = shapely.Point(bolt.centre).buffer(_HEAD + 1.0)
    back = foot.union(boss).convex_hull.difference(discs((bolt,)))
    pierced = foot.difference(discs((bolt,)))
    foot = pierced if shapely.get_num_geometries(pierced) == 1 else foot
    reach = min(asked.pocket, wanted.thickness)
    shapes = ((back, asked.base), (foot, _FOOT), (fingers.intersection(foot), reach))
    layers, low = [], 0.0
    for shape, high in shapes:
        if not shape.is_empty:
            layers.append(Layer(flat(_mirrored(shape)), low, low + high))
            low += high
    return Solid(f"DRIVE-{unit.label}", tuple(layers))


def printable(shape: BaseGeometry) -> BaseGeometry:
    """A shape without the parts that are too thin to print."""
    thick = shape.buffer(-_THIN).buffer(_THIN, join_style="mitre")
    return thick.intersection(shape)


def _mirrored(shape: BaseGeometry) -> BaseGeometry:
    return affinity.scale(shape, xfact=-1.0, origin=(0.0, 0.0))
