"""Holds a written package that is being checked, beside the parts that it has to hold."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import xarray as xr
from shapely import Geometry, Polygon

from pipeline.fabrication.checks.slot_checks import MeasuredSlot, measured_slots
from pipeline.fabrication.readback import BUG, Drawing, Fault, read_drawing
from pipeline.fabrication.units import network
from pipeline.problem.sections import Fabrication

NOMINAL = "nominal"
"""Ends the names of sheets without compensation for the kerf."""

Shapes = Mapping[str, Geometry]
"""Outlines by label, where they stand in the specimen."""


@dataclass(frozen=True)
class ExpectedParts:
    """Holds the units of one structure of a design, by label."""

    polygons: dict[str, Polygon]  # outline as designed, in the specimen frame
    # (label, vertex) of both ends of ligaments, by their numbers
    joints: dict[int, tuple[tuple[str, int], tuple[str, int]]]
    clamped: tuple[str, ...] = ()  # labels
    driven: tuple[str, ...] = ()  # likewise

    @cached_property
    def slots(self) -> dict[str, list[int]]:
        """Vertices at which a ligament ends, one entry a ligament, by label."""
        vertices: dict[str, list[int]] = {label: [] for label in self.polygons}
        for label, vertex in sorted(end for joint in self.joints.values() for end in joint):
            vertices[label].append(vertex)
        return vertices


def expected_parts(design: xr.Dataset, structure: str) -> ExpectedParts:
    """Reads the parts of the structure intact, altered or cloaked."""
    net = network(design, structure)
    polygons = {net.labels[number]: net.polygons[number] for number in net.numbers}
    joints = {
        number: ((net.labels[a], p), (net.labels[b], q))
        for number, (a, p), (b, q), _ in net.ligaments
    }
    clamped, driven = (tuple(net.labels[n] for n in held) for held in (net.clamped, net.driven))
    return ExpectedParts(polygons, joints, clamped, driven)


@dataclass(frozen=True)
class PackageRecord:
    """Holds a package's folder beside the parts expected of it."""

    folder: Path  # to be checked
    expected: ExpectedParts  # units and ligaments that have to be there
    shapes: Shapes  # outlines of the units in the assembled specimen
    settings: Fabrication  # of the fabrication
    letters: Mapping[str, str]  # carried by small units instead of their ids, by id
    drives: Sequence[Sequence[str]] = ()  # labels of driven units that move alike

    @cached_property
    def slots(self) -> dict[str, list[MeasuredSlot]]:
        """Slots of the units of the assembled specimen that are in one piece, by label."""
        designs, width = self.expected.polygons, self.settings.slot_width
        return {
            label: measured_slots(designs[label], shape, width)
            for label, shape in self.shapes.items()
            if isinstance(shape, Polygon)
        }

    @cached_property
    def drawings(self) -> dict[tuple[str, str], list[Drawing]]:
        """The sheets by kind and variant, as R2010."""
        sheets: dict[tuple[str, str], list[Drawing]] = {}
        for path in sorted((self.folder / "laser").glob("*.dxf")):
            if not path.stem.endswith("_r12"):
                kind, _, variant = path.stem.split("_")
                sheets.setdefault((kind, variant), []).append(read_drawing(path))
        return sheets

    def check_units(self, counts: Mapping[str, int], where: Path) -> Iterator[Fault]:
        """Checks the number of units: each is there once, and no other."""
        for label in self.expected.polygons:
            if (count := counts.get(label, 0)) != 1:
                what = "it is missing" if count == 0 else f"it is there {count} times"
                yield Fault(f"unit {label}", what, "laser", BUG, where)
        for label in sorted(set(counts) - set(self.expected.polygons)):
            what = "it is made, but the structure has no such unit"
            yield Fault(f"unit {label}", what, "laser", BUG, where)
