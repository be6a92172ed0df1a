"""Checks the folders print/ and fixture/: each part as a file of its own and on one plate."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from pipeline.fabrication.checks import plates, solids
from pipeline.fabrication.checks.faults import BUG, Fault
from pipeline.fabrication.checks.placed import Shapes, check_outline
from pipeline.fabrication.checks.solids import Solid, fault
from pipeline.fabrication.checks.wanted import Wanted, every_unit
from pipeline.problem.fabrication import Fabrication

_ALIKE = 1e-3
"""Relative difference of volume that two files of one part may have."""


def check(folder: Path, wanted: Wanted, found: Shapes, asked: Fabrication) -> Iterator[Fault]:
    """Faults of all meshes of parts in a package's folder.

    Args:
        folder: that is checked.
        wanted: the units that have to be there.
        found: outlines of the units in the assembled specimen.
        asked: the parameters of fabrication.
    """
    units = {path.stem: solids.read_stl(path) for path in sorted(folder.glob("units/*.stl"))}
    yield from every_unit(Counter(units.keys()), wanted, folder / "units")
    for label, solid in units.items():
        faults = list(solids.check(solid))
        yield from faults
        if not faults and label in wanted.polygons:
            yield from _unit(label, solid, found, asked)
    names, faults = _plates(folder.glob("units_*.3mf"), units, asked)
    yield from faults
    yield from every_unit(Counter(names), wanted, folder)
    for path in sorted(folder.glob("coupon_*.3mf")):
        yield from plates.check_plate(solids.read_3mf(path), asked.print)


def check_fixtures(folder: Path, asked: Fabrication) -> Iterator[Fault]:
    """Faults of clamps, adapter and jig: solids, each on one plate as in its own file."""
    parts = {path.stem: solids.read_stl(path) for path in sorted(folder.glob("*.stl"))}
    for solid in parts.values():
        yield from solids.check(solid)
    names, faults = _plates(folder.glob("*.3mf"), parts, asked)
    yield from faults
    if sorted(names) != sorted(parts):
        what = "the plates do not hold each of the fixture's parts once"
        yield Fault("the fixture", what, "fixture", BUG, folder)


def levels(asked: Fabrication) -> list[float]:
    """Heights at which a unit's section changes, from the bed to its top."""
    top = asked.thickness
    first = min(asked.print.layer, asked.labels.depth)
    recess = asked.markers.depth if asked.markers.kind != "none" else 0.0
    raised = recess if asked.markers.kind == "dots" else -recess
    return sorted({0.0, first, asked.labels.depth, top, top + raised})


def _unit(label: str, solid: Solid, found: Shapes, asked: Fabrication) -> Iterator[Fault]:
    """Height, volume and outline of one unit."""
    high = solid.extent[1][2]
    tall = max(levels(asked))
    if abs(high - tall) > solids.TOLERANCE:
        yield fault(solid, f"it is {high:.3f} mm high instead of {tall:g} mm", "thickness")
    yield from solids.volume(solid, levels(asked))
    middle = solid.section(asked.thickness / 2)
    yield from check_outline(label, solid.file, middle, found)


def _plates(
    paths: Iterable[Path], parts: Mapping[str, Solid], asked: Fabrication
) -> tuple[list[str], list[Fault]]:
    """Names of the objects on plates, and faults: each is to be as in its own file."""
    names: list[str] = []
    faults: list[Fault] = []
    for path in sorted(paths):
        plate = solids.read_3mf(path)
        names += [solid.name for solid in plate]
        faults += plates.check_plate(plate, asked.print)
        faults += _others(plate, parts)
    return names, faults


def _others(plate: Sequence[Solid], parts: Mapping[str, Solid]) -> Iterator[Fault]:
    """Objects of a plate that are not what their own files hold."""
    for solid in plate:
        if solid.name in parts and not _same(solid, parts[solid.name]):
            yield fault(solid, f"it is another part than {parts[solid.name].file.name}")


def _same(one: Solid, other: Solid) -> bool:
    """Whether two meshes have one size and one volume."""
    first, second = (solid.extent[1] - solid.extent[0] for solid in (one, other))
    volumes = [solid.mesh.volume for solid in (one, other)]
    return bool(
        np.allclose(first, second, rtol=0, atol=2 * solids.TOLERANCE)
        and abs(volumes[0] - volumes[1]) < _ALIKE * volumes[1]
    )
