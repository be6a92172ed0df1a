"""Reads one structure of a design: the units and ligaments that are present."""

from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import shapely
import xarray as xr
from numpy.typing import NDArray
from shapely import Polygon

from pipeline.fabrication.parts import UnbuildableUnitError, labels
from pipeline.fabrication.units.slot_candidates import Corner
from sim.core import Floats

_HAIR = 1e-6


@dataclass(frozen=True)
class UnitNetwork:
    """Holds one structure of a design, before anything is built of it."""

    numbers: tuple[int, ...]  # ids of the units that are present
    polygons: dict[int, Polygon]  # as designed, by id
    labels: dict[int, str]  # by id
    index: dict[int, tuple[int, int]]  # (i, j) by id
    # id, (unit, vertex) at both ends, unit vector from the first to the second
    ligaments: tuple[tuple[int, tuple[int, int], tuple[int, int], Floats], ...]
    clamped: tuple[int, ...]  # ids
    driven: tuple[int, ...]
    # angles, rad, of designed slots at both ends of ligaments against these, by id
    turns: dict[int, tuple[float, float]] = field(default_factory=dict)


def network(design: xr.Dataset, structure: str) -> UnitNetwork:
    """Reads the structure "intact", "altered" or "cloaked" of a design.

    A unit in a void is there in the intact structure only; with it go the ligaments that end there.
    """
    vertices = design["vertices" if structure == "cloaked" else "vertices_initial"]
    shapes = vertices.transpose("unit", "vertex", "xy").values
    present = np.isfinite(shapes[:, :3]).all(axis=(1, 2))
    if structure != "intact":
        present &= ~_flagged(design["region"], "void")
    ids = [int(number) for number in design["unit"].values]
    index = list(zip(design["i"].values.tolist(), design["j"].values.tolist(), strict=True))
    names = labels(index)
    row = {number: at for at, number in enumerate(ids)}
    ends = zip(design["ligament_unit"].values, design["ligament_vertex"].values, strict=True)
    joints = []
    for number, ((a, b), (p, q)) in enumerate(ends):
        if present[row[int(a)]] and present[row[int(b)]]:
            vector = shapes[row[int(b)], q] - shapes[row[int(a)], p]
            along = vector / np.linalg.norm(vector)
            joints.append((number, (int(a), int(p)), (int(b), int(q)), along))
    angles = design["end_angles"].transpose("ligament", "end").values
    turned = np.isfinite(angles).all(axis=1) & (structure == "cloaked")
    clamped, driven = (_flagged(design["support"], held) for held in ("clamped", "driven"))
    there = np.flatnonzero(present)
    return UnitNetwork(
        tuple(ids[at] for at in there),
        {ids[at]: Polygon(shapes[at][np.isfinite(shapes[at]).all(axis=1)]) for at in there},
        {ids[at]: names[at] for at in there},
        {ids[at]: index[at] for at in there},
        tuple(joints),
        tuple(ids[at] for at in there if clamped[at]),
        tuple(ids[at] for at in there if driven[at]),
        {
            number: (angles[number, 0], angles[number, 1])
            for number in np.flatnonzero(turned).tolist()
        },
    )


def _flagged(variable: xr.DataArray, meaning: str) -> NDArray[np.bool_]:
    meanings = variable.attrs["flag_meanings"].split()
    return np.asarray(variable.values == variable.attrs["flag_values"][meanings.index(meaning)])


def corners(net: UnitNetwork) -> dict[int, list[Corner]]:
    """Lists the vertices that take a slot, by id of the unit."""
    slotted: dict[int, list[Corner]] = defaultdict(list)
    for number, (a, p), (b, q), along in net.ligaments:
        ends = (net.polygons[unit].exterior.coords[end] for unit, end in ((a, p), (b, q)))
        length = float(shapely.distance(*map(shapely.Point, ends)))
        turns = net.turns.get(number, (None, None))
        slotted[a].append(Corner(p, number, -along, length, turns[0]))
        slotted[b].append(Corner(q, number, along, length, turns[1]))
    return slotted


def refuse_faults(net: UnitNetwork, file: Path) -> None:
    """Checks that units are simple polygons, apart, with one ligament at a vertex.

    Raises:
        UnbuildableUnitError: they are not; names the first ones and the remedy.
    """
    _refuse_overlaps(net, file)
    taken: dict[tuple[int, int], str] = {}
    for _, one, other, _ in net.ligaments:
        name = " - ".join(net.labels[unit] for unit, _ in (one, other))
        for unit, vertex in (one, other):
            if (first := taken.setdefault((unit, vertex), name)) is not name:
                what = f"the ligaments {first} and {name} end at one vertex of unit "
                what += f"{net.labels[unit]}, {vertex}, where their slots would meet"
                remedy = "give each a vertex of its own, a wall and a slot or more apart"
                spot = shapely.Point(net.polygons[unit].exterior.coords[vertex])
                around = (net.polygons[unit],)
                raise UnbuildableUnitError(
                    what, around, spot, file=file, key="ligament_vertex", remedy=remedy
                )


def _refuse_overlaps(net: UnitNetwork, file: Path) -> None:
    """Checks that the units of a design are simple polygons, apart from each other."""
    polygons = [net.polygons[number] for number in net.numbers]
    for number, polygon in zip(net.numbers, polygons, strict=True):
        if not polygon.is_valid or not polygon.exterior.is_ccw:
            remedy = "design it with constraints on edges and angles"
            what = f"the outline of unit {net.labels[number]} crosses itself"
            lines = (polygon.exterior,)
            raise UnbuildableUnitError(
                what, lines, *lines, file=file, key="vertices", remedy=remedy
            )
    tree = shapely.STRtree(polygons)
    for first, second in tree.query(polygons, "intersects").T:
        shared = polygons[first].intersection(polygons[second])
        if first < second and shared.area > _HAIR:
            pair = " and ".join(net.labels[net.numbers[at]] for at in (first, second))
            what = f"the units {pair} overlap in the design"
            remedy = 'ask for a gap in the design, e.g. constraints.gap: "0.2 mm"'
            both = (polygons[first], polygons[second])
            raise UnbuildableUnitError(what, both, shared, file=file, key="vertices", remedy=remedy)
