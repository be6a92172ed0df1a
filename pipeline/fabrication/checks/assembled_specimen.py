"""Checks the units in the file of the assembled specimen, where the design has them.

Nothing has to be moved to compare them. The same unit lies elsewhere in other files and is compared
with its outline here.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import shapely
from shapely import Geometry, STRtree

from pipeline.fabrication.checks.package_record import ExpectedParts, PackageRecord, Shapes
from pipeline.fabrication.checks.slot_checks import UnitSection, check_section
from pipeline.fabrication.readback import BUG, TOLERANCE, Fault, MeshBody, check_solid, closest
from pipeline.problem.sections import Fabrication


def unit_sections(
    solid: MeshBody, expected: ExpectedParts, settings: Fabrication
) -> dict[str, Geometry]:
    """Cuts an assembled specimen into outlines, each over the design that it covers most of."""
    sections = shapely.get_parts(solid.section(settings.plain_height))
    labels, designs = list(expected.polygons), np.array(list(expected.polygons.values()))
    over, under = STRtree(designs).query(sections, predicate="intersects")
    shared = shapely.area(shapely.intersection(sections[over], designs[under]))
    owned: dict[str, list[Geometry]] = {label: [] for label in labels}
    for number, section in enumerate(sections):
        mine = np.flatnonzero(over == number)
        if len(mine):
            owned[labels[under[mine[np.argmax(shared[mine])]]]].append(section)
    return {label: own[0] for label, own in owned.items() if len(own) == 1}


def check_assembled(solid: MeshBody, record: PackageRecord) -> Iterator[Fault]:
    """Checks the assembled specimen: all units in their places, true to the design, apart."""
    expected, shapes, settings = record.expected, record.shapes, record.settings
    faults = list(check_solid(solid, bodies=len(expected.polygons)))
    yield from faults
    if faults:
        return
    for label in sorted(expected.polygons.keys() - shapes.keys()):
        yield solid.fault(f"unit {label} is not in its place")
    for label, shape in shapes.items():
        design, vertices = expected.polygons[label], expected.slots[label]
        section = UnitSection(label, solid.file, design, shape, vertices, record.slots.get(label))
        yield from check_section(section, settings)
    labels, outlines = list(shapes), np.array(list(shapes.values()))
    for first, second, gap in closest(outlines, settings.minimum_gap - TOLERANCE):
        what = f"{gap:.3f} mm from unit {labels[second]}, less than {settings.minimum_gap:g} mm"
        remedy = "lower it, or design with a larger gap (constraints.gap)"
        shown = (outlines[first], outlines[second])
        spot = shapely.shortest_line(*shown)
        yield Fault(f"unit {labels[first]}", what, "minimum_gap", remedy, solid.file, shown, spot)


def check_outline(label: str, file: Path, shape: Geometry, shapes: Shapes) -> Iterator[Fault]:
    """Checks a unit in a file of its own: its outline is that in the specimen, moved."""
    if label not in shapes:
        return
    there = shapes[label]
    shift = np.subtract(there.bounds[:2], shape.bounds[:2])
    moved = shapely.transform(shape, lambda points: points + shift)
    near = 2 * TOLERANCE
    if not (moved.buffer(near).covers(there) and there.buffer(near).covers(moved)):
        what = "it has another outline than in the assembled specimen"
        yield Fault(f"unit {label}", what, "print", BUG, file, (there, moved), moved.boundary)
