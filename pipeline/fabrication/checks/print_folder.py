"""Checks the folders print/ and fixture/: each part as a file of its own and on one plate."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from shapely import Geometry

from pipeline.fabrication.checks import plate_checks
from pipeline.fabrication.checks.assembled_specimen import check_outline
from pipeline.fabrication.checks.expected_parts import every_unit
from pipeline.fabrication.checks.package_record import PackageRecord
from pipeline.fabrication.engraving import read_sunk
from pipeline.fabrication.readback import BUG, Fault, MeshBody, fault, read_meshes
from pipeline.problem.sections import Fabrication

_ALIKE = 1e-3
"""Relative difference of volume that two files of one part may have."""

_NEAR = 5e-3  # mm between the same vertex of two files


def check(record: PackageRecord) -> Iterator[Fault]:
    """Faults of all meshes of parts in a package."""
    folder, wanted, asked = record.folder / "print", record.wanted, record.asked
    units = {path.stem: read_meshes.read_stl(path) for path in sorted(folder.glob("units/*.stl"))}
    yield from every_unit(Counter(units.keys()), wanted, folder / "units")
    for label, solid in units.items():
        faults = list(read_meshes.check(solid))
        yield from faults
        if not faults and label in wanted.polygons:
            yield from _unit(label, solid, record)
    names, faults = _plates(folder.glob("units_*.3mf"), units, asked)
    yield from faults
    yield from every_unit(Counter(names), wanted, folder)
    for path in sorted(folder.glob("coupon_*.3mf")):
        yield from plate_checks.check_plate(read_meshes.read_3mf(path), asked.print)


def check_fixtures(record: PackageRecord) -> Iterator[Fault]:
    """Faults of clamps, adapter and jig: solids, each on one plate as in its own file."""
    folder = record.folder / "fixture"
    parts = {path.stem: read_meshes.read_stl(path) for path in sorted(folder.glob("*.stl"))}
    for solid in parts.values():
        yield from read_meshes.check(solid)
    names, faults = _plates(folder.glob("*.3mf"), parts, record.asked)
    yield from faults
    if sorted(names) != sorted(parts):
        what = "the plates do not hold each of the fixture's parts once"
        yield Fault("the fixture", what, "fixture", BUG, folder)


def first_level(asked: Fabrication) -> float:
    """Height up to which a unit may be drawn in, or zero."""
    return min(asked.print.layer, asked.labels.depth)


def levels(asked: Fabrication) -> list[float]:
    """Heights at which a unit's section changes, from the bed to its top."""
    top, first = asked.thickness, first_level(asked)
    recess = asked.markers.depth if asked.markers.kind != "none" else 0.0
    raised = recess if asked.markers.kind == "dots" else -recess
    return sorted({0.0, first, asked.labels.depth, top, top + raised})


def _unit(label: str, solid: MeshBody, record: PackageRecord) -> Iterator[Fault]:
    """Height, volume, outline and id of one unit."""
    asked = record.asked
    high = solid.extent[1][2]
    tall = {asked.thickness, max(levels(asked))}  # raised dots need not have room
    if min(abs(high - wanted) for wanted in tall) > read_meshes.TOLERANCE:
        what = f"it is {high:.3f} mm high instead of {max(tall):g} mm"
        yield fault(solid, what, "thickness")
    yield from read_meshes.volume(solid, levels(asked))
    middle = solid.section(asked.thickness / 2)
    yield from check_outline(label, solid.file, middle, record.found)
    yield from _id(label, solid, middle, record)


def _id(label: str, solid: MeshBody, outline: Geometry, record: PackageRecord) -> Iterator[Fault]:
    """The id that is sunk into the underside, where it can be read on the top."""
    words, pose = record.letters.get(label, label), record.engraved.get(label)
    asked = record.asked
    low = first_level(asked) if first_level(asked) < asked.labels.depth else 0.0
    inner = outline.buffer(-asked.print.first_layer_inset - _NEAR)
    underside = solid.section((low + asked.labels.depth) / 2)
    if pose is not None and not read_sunk.shows(words, underside, inner, pose):
        what = f"its underside does not show {words} and how it stands"
        yield fault(solid, what, "labels.height", "give larger letters")


def _plates(
    paths: Iterable[Path], parts: Mapping[str, MeshBody], asked: Fabrication
) -> tuple[list[str], list[Fault]]:
    """Names of the objects on plates, and faults: each is to be as in its own file."""
    names: list[str] = []
    faults: list[Fault] = []
    for path in sorted(paths):
        plate = read_meshes.read_3mf(path)
        names += [solid.name for solid in plate]
        faults += plate_checks.check_plate(plate, asked.print)
        faults += _others(plate, parts)
    return names, faults


def _others(plate: Sequence[MeshBody], parts: Mapping[str, MeshBody]) -> Iterator[Fault]:
    """Objects of a plate that are not what their own files hold."""
    for solid in plate:
        if solid.name in parts and not _same(solid, parts[solid.name]):
            yield fault(solid, f"it is another part than {parts[solid.name].file.name}")


def _same(one: MeshBody, other: MeshBody) -> bool:
    """Whether two meshes have one size and one volume."""
    first, second = (solid.extent[1] - solid.extent[0] for solid in (one, other))
    volumes = [solid.mesh.volume for solid in (one, other)]
    return bool(
        np.allclose(first, second, rtol=0, atol=2 * read_meshes.TOLERANCE)
        and abs(volumes[0] - volumes[1]) < _ALIKE * volumes[1]
        and _astray(one, other) < _NEAR
    )


def _astray(one: MeshBody, other: MeshBody) -> float:
    """Largest distance from a vertex of a mesh to one of the other, both at the origin."""
    from scipy.spatial import KDTree

    ours, theirs = (solid.vertices - solid.extent[0] for solid in (one, other))
    there, back = KDTree(theirs).query(ours)[0], KDTree(ours).query(theirs)[0]
    return float(max(there.max(), back.max()))
