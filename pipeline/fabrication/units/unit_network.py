"""One structure of a design before anything is made of it: units that are present, ligaments."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
import xarray as xr
from shapely import Polygon

from pipeline.fabrication.parts import UnmadeError, labels
from pipeline.fabrication.units.slot_candidates import Corner
from sim.core import Floats

_HAIR = 1e-6


@dataclass(frozen=True)
class UnitNetwork:
    """One structure of a design: what is there, before anything is made of it.

    Attributes:
        numbers: (n,) ids of the units that are present.
        polygons: as designed, by id.
        labels: by id.
        index: (i, j) by id.
        ligaments: (id, (unit, vertex), (unit, vertex), unit vector from the first to the second).
        clamped, driven: ids.
    """

    numbers: tuple[int, ...]
    polygons: dict[int, Polygon]
    labels: dict[int, str]
    index: dict[int, tuple[int, int]]
    ligaments: tuple[tuple[int, tuple[int, int], tuple[int, int], Floats], ...]
    clamped: tuple[int, ...]
    driven: tuple[int, ...]


def network(design: xr.Dataset, structure: str) -> UnitNetwork:
    """The structure "intact", "altered" or "cloaked" of a design."""
    vertices = design["vertices" if structure == "cloaked" else "vertices_initial"]
    shapes = vertices.transpose("unit", "vertex", "xy").values
    present = np.isfinite(shapes[:, :3]).all(axis=(1, 2))
    if structure != "intact":
        present &= design["region"].values != _flag(design["region"], "void")
    ids = design["unit"].values
    index = list(zip(design["i"].values.tolist(), design["j"].values.tolist(), strict=True))
    names = labels(index)
    ends = zip(design["ligament_unit"].values, design["ligament_vertex"].values, strict=True)
    row = {int(number): at for at, number in enumerate(ids)}
    joined = []
    for number, ((a, b), (p, q)) in enumerate(ends):
        if present[row[int(a)]] and present[row[int(b)]]:
            vector = shapes[row[int(b)], q] - shapes[row[int(a)], p]
            along = vector / np.linalg.norm(vector)
            joined.append((number, (int(a), int(p)), (int(b), int(q)), along))
    support = design["support"].values
    there = np.flatnonzero(present)
    return UnitNetwork(
        tuple(int(ids[at]) for at in there),
        {int(ids[at]): _polygon(shapes[at]) for at in there},
        {int(ids[at]): names[at] for at in there},
        {int(ids[at]): index[at] for at in there},
        tuple(joined),
        tuple(int(ids[at]) for at in there if support[at] == _flag(design["support"], "clamped")),
        tuple(int(ids[at]) for at in there if support[at] == _flag(design["support"], "driven")),
    )


def _flag(variable: xr.DataArray, meaning: str) -> int:
    meanings = variable.attrs["flag_meanings"].split()
    return int(variable.attrs["flag_values"][meanings.index(meaning)])


def _polygon(points: Floats) -> Polygon:
    return Polygon(points[np.isfinite(points).all(axis=1)])


def corners(net: UnitNetwork) -> dict[int, list[Corner]]:
    """The vertices that take a slot, by id of the unit."""
    found: dict[int, list[Corner]] = defaultdict(list)
    for number, (a, p), (b, q), along in net.ligaments:
        found[a].append(Corner(p, number, -along))
        found[b].append(Corner(q, number, along))
    return found


def refuse_overlaps(net: UnitNetwork, file: Path) -> None:
    """Check that the units of a design are simple polygons, apart from each other.

    Raises:
        UnmadeError: they are not; names the first ones and the remedy.
    """
    polygons = [net.polygons[number] for number in net.numbers]
    for number, polygon in zip(net.numbers, polygons, strict=True):
        if not polygon.is_valid or not polygon.exterior.is_ccw:
            remedy = "design it with constraints on edges and angles"
            what = f"the outline of unit {net.labels[number]} crosses itself"
            lines = (polygon.exterior,)
            raise UnmadeError(what, lines, *lines, file=file, key="vertices", remedy=remedy)
    tree = shapely.STRtree(polygons)
    for first, second in tree.query(polygons, "intersects").T:
        shared = polygons[first].intersection(polygons[second])
        if first < second and shared.area > _HAIR:
            pair = " and ".join(net.labels[net.numbers[at]] for at in (first, second))
            what = f"the units {pair} overlap in the design"
            remedy = 'ask for a gap in the design, e.g. constraints.gap: "0.2 mm"'
            both = (polygons[first], polygons[second])
            raise UnmadeError(what, both, shared, file=file, key="vertices", remedy=remedy)
