"""The units as they stand in the file of the assembled specimen, against the design there.

Nothing has to be moved to compare them. What other files hold of a unit lies elsewhere and is
compared with its outline here.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import shapely
from shapely import Geometry, STRtree

from pipeline.fabrication.checks import slot_checks
from pipeline.fabrication.checks.expected_parts import Wanted
from pipeline.fabrication.checks.sheet_checks import closest
from pipeline.fabrication.checks.slot_checks import MadeOutline
from pipeline.fabrication.readback import BUG, TOLERANCE, Fault, MeshBody, check, fault
from pipeline.problem.sections import Fabrication

Shapes = Mapping[str, Geometry]
"""Outlines by label, where they stand in the specimen."""


def shapes(solid: MeshBody, wanted: Wanted, asked: Fabrication) -> dict[str, Geometry]:
    """Outlines of units in an assembled specimen, each over the design that it covers most of."""
    sections = shapely.get_parts(solid.section(asked.thickness / 2))
    labels, designs = list(wanted.polygons), np.array(list(wanted.polygons.values()))
    over, under = STRtree(designs).query(sections, predicate="intersects")
    shared = shapely.area(shapely.intersection(sections[over], designs[under]))
    found: dict[str, list[Geometry]] = {label: [] for label in labels}
    for number, section in enumerate(sections):
        mine = np.flatnonzero(over == number)
        if len(mine):
            found[labels[under[mine[np.argmax(shared[mine])]]]].append(section)
    return {label: own[0] for label, own in found.items() if len(own) == 1}


def check_assembled(
    solid: MeshBody, found: Shapes, wanted: Wanted, asked: Fabrication
) -> Iterator[Fault]:
    """Faults of the assembled specimen: all units in their places, true to the design, apart."""
    faults = list(check(solid, bodies=len(wanted.polygons)))
    yield from faults
    if faults:
        return
    for label in sorted(wanted.polygons.keys() - found.keys()):
        yield fault(solid, f"unit {label} is not in its place")
    for label, made in found.items():
        shape = MadeOutline(label, solid.file, wanted.polygons[label], made, wanted.slots[label])
        yield from slot_checks.check(shape, asked)
    yield from _gaps(solid, found, asked)


def _gaps(solid: MeshBody, found: Shapes, asked: Fabrication) -> Iterator[Fault]:
    labels, outlines = list(found), np.array(list(found.values()))
    for first, second, gap in closest(outlines, asked.minimum_gap - TOLERANCE):
        what = f"{gap:.3f} mm from unit {labels[second]}, less than {asked.minimum_gap:g} mm"
        remedy = "lower it, or design with a larger gap (constraints.gap)"
        shown = (outlines[first], outlines[second])
        spot = shapely.shortest_line(*shown)
        yield Fault(f"unit {labels[first]}", what, "minimum_gap", remedy, solid.file, shown, spot)


def check_outline(label: str, file: Path, shape: Geometry, found: Shapes) -> Iterator[Fault]:
    """Faults of a unit in a file of its own: its outline is that in the specimen, moved."""
    if label not in found:
        return
    there = found[label]
    shift = np.subtract(there.bounds[:2], shape.bounds[:2])
    moved = shapely.transform(shape, lambda points: points + shift)
    near = 2 * TOLERANCE
    if not (moved.buffer(near).covers(there) and there.buffer(near).covers(moved)):
        what = "it has another outline than in the assembled specimen"
        shown = (there, moved)
        yield Fault(f"unit {label}", what, "print", BUG, file, shown, moved.boundary)
