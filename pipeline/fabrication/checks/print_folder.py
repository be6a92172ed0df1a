"""Checks the folders print/ and fixture/: each part as a file of its own and on one plate."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import combinations
from pathlib import Path

import numpy as np
import shapely
from shapely import Geometry, Polygon, affinity

from pipeline.fabrication.checks.assembled_specimen import check_outline
from pipeline.fabrication.checks.package_record import PackageRecord
from pipeline.fabrication.readback import (
    BUG,
    TOLERANCE,
    VOLUME_TOLERANCE,
    Fault,
    MeshBody,
    check_solid,
    check_volume,
    closest,
    read_3mf,
    read_stl,
)
from pipeline.problem.sections import Fabrication, Print

_NEAR = 5e-3  # mm between the same vertex of two files
_FOOTPRINT = np.array([0.02, 0.5, 0.98])  # shares of its height where a part's footprint is taken
_LEAST_SUNK = 0.1  # mm^2 of an id
_LEAST_HELD = 0.08  # share of a unit that its holder covers
_ROUND = 0.05  # by which the area of a polygon may be less than that of its circle, as a share
_ABOVE_ID = 0.75  # share of the base's thickness, of which an id takes half at most
_SHARED = 0.05  # mm^2 of two holders, of rounding
_HOLDERS = ("CLAMP", "DRIVE")  # begin the names of what holds units that are clamped, or driven
_JIG = "JIG"  # begins the names of its plates
_IN_FLOOR = 1.2  # mm above the bed, where a jig is neither lettered nor has pockets
_PRESSED, _AROUND = 0.01, 5.0  # mm^2 of a unit within a wall, mm shown beside it
_LID = "-LID"  # ends the names of what is bolted on top


def check_print(record: PackageRecord) -> Iterator[Fault]:
    """Checks all meshes of parts in a package."""
    folder, settings = record.folder / "print", record.settings
    units = {path.stem: read_stl(path) for path in sorted(folder.glob("units/*.stl"))}
    yield from record.check_units(dict.fromkeys(units, 1), folder / "units")
    for label, solid in units.items():
        faults = list(check_solid(solid))
        yield from faults
        if not faults and label in record.expected.polygons:
            yield from _check_unit(label, solid, record)
    names, faults = _plate_faults(folder.glob("units_*.3mf"), units, settings)
    yield from faults
    yield from record.check_units({name: names.count(name) for name in names}, folder)
    for path in sorted(folder.glob("coupon_*.3mf")):
        yield from check_plate(read_3mf(path), settings.print)


def check_fixtures(record: PackageRecord) -> Iterator[Fault]:
    """Checks clamps, adapters and jig: solids, each on one plate as in its own file; their hold."""
    folder = record.folder / "fixture"
    parts = {path.stem: read_stl(path) for path in sorted(folder.glob("*.stl"))}
    broken = [fault for solid in parts.values() for fault in check_solid(solid)]
    yield from broken
    if not broken:
        yield from _check_holders(parts, record)
        yield from _check_jig(parts, record)
    names, faults = _plate_faults(folder.glob("*.3mf"), parts, record.settings)
    yield from faults
    if sorted(names) != sorted(parts):
        what = "the plates do not hold each of the fixture's parts once"
        yield Fault("the fixture", what, "fixture", BUG, folder)


def _check_holders(parts: Mapping[str, MeshBody], record: PackageRecord) -> Iterator[Fault]:
    """Checks what holds units: part of each is on a holder; these have bolts, and are apart."""
    expected, settings = record.expected, record.settings
    lids = {f"{name}{_LID}" for name in parts}
    names = [name for name in parts if name.startswith(_HOLDERS) and name not in lids]
    bases = {name: _base(name, parts, settings) for name in names}
    for kind, labels in zip(_HOLDERS, (expected.clamped, expected.driven), strict=True):
        units = {label: expected.polygons[label] for label in labels if label in expected.polygons}
        mine = [base for name, base in bases.items() if name.startswith(kind)]
        for label, shape in units.items():
            if not any(_is_on(shape, base) for base in mine):
                what, folder = "no part of the fixture holds it", record.folder / "fixture"
                yield Fault(f"unit {label}", what, "fixture", BUG, folder, (shape,), shape)
    for name, base in bases.items():
        if len(joined := _drives_on(base, record)) > 1:
            what = f"it joins units of different drives ({joined[0]} and {joined[1]})"
            yield parts[name].fault(what, "fixture", BUG)
        if not _is_bolted(base, settings.fixture.hole):
            what = f"it has no hole of {settings.fixture.hole:g} mm for a bolt"
            yield parts[name].fault(what, "fixture.hole")
    for one, other in combinations(bases, 2):
        if bases[one].intersection(bases[other]).area > _SHARED:
            remedy = "hold units that are farther apart"
            yield parts[other].fault(f"it stands in the way of {one}", "fixture", remedy)


def _check_jig(parts: Mapping[str, MeshBody], record: PackageRecord) -> Iterator[Fault]:
    """Checks that all units of the assembled specimen lie on the jig's plates, in its pockets."""
    plates = [solid for name, solid in parts.items() if name.startswith(_JIG)]
    floor = shapely.union_all([solid.section(_IN_FLOOR) for solid in plates]).buffer(_NEAR)
    below = min(record.settings.fixture.pocket, record.settings.thickness) / 2
    walls = shapely.union_all([s.section(float(s.extent[1][2]) - below) for s in plates])
    for label, shape in record.shapes.items():
        if walls.intersection(shape).area > _PRESSED or not floor.covers(shape):
            what, folder = "it does not fit into its pocket of the jig", record.folder / "fixture"
            shown = (walls.intersection(shape.buffer(_AROUND)), shape)
            yield Fault(f"unit {label}", what, "fixture.clearance", BUG, folder, shown, shape)


def _base(name: str, parts: Mapping[str, MeshBody], settings: Fabrication) -> Geometry:
    """Cuts a holder above its id, as it is used: an adapter, without a lid, lies on its back."""
    area = parts[name].section(_ABOVE_ID * settings.fixture.base)
    if f"{name}{_LID}" in parts:
        return area
    return affinity.scale(area, xfact=-1.0, origin=(0.0, 0.0))


def _is_on(unit: Polygon, base: Geometry) -> bool:
    return bool(base.intersection(unit).area > _LEAST_HELD * unit.area)


def _drives_on(base: Geometry, record: PackageRecord) -> list[str]:
    """Lists a unit that is on a base of each group of units that move alike."""
    shapes = record.expected.polygons
    on_it = (
        [label for label in group if label in shapes and _is_on(shapes[label], base)]
        for group in record.drives
    )
    return [labels[0] for labels in on_it if labels]


def _is_bolted(base: Geometry, hole: float) -> bool:
    """Tests that a base has a round hole of this diameter, mm."""
    rings = (ring for part in shapely.get_parts(base) for ring in part.interiors)
    areas = [Polygon(ring).area for ring in rings]
    return bool(np.isclose(areas, np.pi / 4 * hole**2, rtol=_ROUND).any())


def _check_unit(label: str, solid: MeshBody, record: PackageRecord) -> Iterator[Fault]:
    """Checks height, volume, outline and sunk id of one unit."""
    settings = record.settings
    top, sunk, dots = settings.thickness, settings.labels.depth, settings.markers
    first = min(settings.print.layer, sunk)  # height up to which it may be drawn in
    raised = {"none": top, "recess": top - dots.depth, "dots": top + dots.depth}[dots.kind]
    levels = sorted({0.0, first, sunk, top, raised})
    high = solid.extent[1][2]
    if min(abs(high - top), abs(high - levels[-1])) > TOLERANCE:  # dots need not have room
        yield solid.fault(f"it is {high:.3f} mm high instead of {levels[-1]:g} mm", "thickness")
    yield from check_volume(solid, levels)
    middle = solid.section(settings.plain_height)
    yield from check_outline(label, solid.file, middle, record.shapes)
    inner = middle.buffer(-settings.print.first_layer_inset - _NEAR)
    underside = solid.section(((first if first < sunk else 0.0) + sunk) / 2)
    if inner.difference(underside).area < _LEAST_SUNK:
        yield solid.fault("its underside shows no id", "labels.height", "give larger letters")


def check_plate(plate: Sequence[MeshBody], printer: Print) -> Iterator[Fault]:
    """Checks the objects of one plate: on the bed, apart, named, flat on z = 0."""
    faults = [fault for solid in plate for fault in check_solid(solid)]
    yield from faults
    if faults:  # what is no solid has no footprint
        return
    seen = {""}
    for solid in plate:
        if solid.name in seen:
            what = "two objects of this name" if solid.name else "an object without a name"
            yield Fault(f"part {solid.name}", what, "print", BUG, solid.file)
        seen.add(solid.name)
    footprints = np.array([_footprint(solid) for solid in plate])
    room = shapely.box(0.0, 0.0, *printer.bed).buffer(-printer.margin, join_style="mitre")
    for solid, shape in zip(plate, footprints, strict=True):
        if not room.buffer(TOLERANCE).covers(shape):
            what = f"it does not stand on the bed less its margin of {printer.margin:g} mm"
            yield _plate_fault(solid, what, "print.bed", (shape, room))
    for first, second, gap in closest(footprints, printer.gap - TOLERANCE):
        what = f"{gap:.3f} mm from part {plate[second].name}, less than {printer.gap:g} mm"
        shown = (footprints[first], footprints[second])
        yield _plate_fault(plate[first], what, "print.gap", shown)


def _plate_fault(solid: MeshBody, what: str, key: str, shown: tuple[Geometry, Geometry]) -> Fault:
    return Fault(f"part {solid.name}", what, key, BUG, solid.file, shown, shown[0])


def _footprint(solid: MeshBody) -> Geometry:
    """Covers the area of a part on the bed, seen from the top."""
    low, high = solid.extent
    heights = low[2] + (high[2] - low[2]) * _FOOTPRINT
    return shapely.union_all([solid.section(float(height)) for height in heights])


def _plate_faults(
    paths: Iterable[Path], parts: Mapping[str, MeshBody], settings: Fabrication
) -> tuple[list[str], list[Fault]]:
    """Lists names of the objects on plates, and faults: each is to be as in its own file."""
    names: list[str] = []
    faults: list[Fault] = []
    for path in sorted(paths):
        plate = read_3mf(path)
        names += [solid.name for solid in plate]
        faults += check_plate(plate, settings.print)
        for solid in plate:
            if solid.name in parts and not _is_same(solid, parts[solid.name]):
                what = f"it is another part than {parts[solid.name].file.name}"
                faults.append(solid.fault(what))
    return names, faults


def _is_same(one: MeshBody, other: MeshBody) -> bool:
    """Tests that two meshes have one size, one volume, and the same vertices from their corners."""
    from scipy.spatial import KDTree

    first, second = (solid.extent[1] - solid.extent[0] for solid in (one, other))
    volume, same = one.mesh.volume, other.mesh.volume
    if np.abs(first - second).max() > 2 * TOLERANCE or (
        abs(volume - same) >= VOLUME_TOLERANCE * same
    ):
        return False
    ours = one.vertices - one.extent[0]
    theirs = other.mesh.vertices - other.extent[0]  # an STL has them once per triangle
    there, back = KDTree(theirs).query(ours)[0], KDTree(ours).query(theirs)[0]
    return bool(max(there.max(), back.max()) < _NEAR)
