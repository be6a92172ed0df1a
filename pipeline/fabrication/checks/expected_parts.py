"""What a package has to hold: read from the design's dataset, from nothing that was made of it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from shapely import Polygon

from pipeline.fabrication.parts import labels
from pipeline.fabrication.readback import BUG, Fault


@dataclass(frozen=True)
class Wanted:
    """The units of one structure.

    Attributes:
        polygons: outline as designed by label, in the specimen frame.
        slots: vertices at which a ligament ends, one entry a ligament, by label.
        joints: the ends of each ligament as (label, vertex).
    """

    polygons: dict[str, Polygon]
    slots: dict[str, tuple[int, ...]]
    joints: tuple[tuple[tuple[str, int], tuple[str, int]], ...]


def of_design(design: xr.Dataset, structure: str) -> Wanted:
    """What is to be made of the structure intact, altered or cloaked.

    A unit in a void is there in the intact structure only; with it go the ligaments that end there.
    """
    shapes = design["vertices" if structure == "cloaked" else "vertices_initial"]
    corners = shapes.transpose("unit", "vertex", "xy").values
    removed = _void(design) if structure != "intact" else np.zeros(len(corners), dtype=bool)
    names = labels(zip(design["i"].values.tolist(), design["j"].values.tolist(), strict=True))
    ids = design["unit"].values.tolist()
    polygons = {
        number: Polygon(ring[~np.isnan(ring[:, 0])])
        for number, ring, gone in zip(ids, corners, removed, strict=True)
        if not gone
    }
    slots: dict[int, list[int]] = defaultdict(list)
    name = dict(zip(ids, names, strict=True))
    joints = []
    pairs = zip(design["ligament_unit"].values, design["ligament_vertex"].values, strict=True)
    for units, vertices in pairs:
        if all(int(unit) in polygons for unit in units):
            one, other = (
                (name[int(unit)], int(vertex)) for unit, vertex in zip(units, vertices, strict=True)
            )
            joints.append((one, other))
            for unit, vertex in zip(units, vertices, strict=True):
                slots[int(unit)].append(int(vertex))
    return Wanted(
        {name[number]: polygon for number, polygon in polygons.items()},
        {name[number]: tuple(sorted(slots[number])) for number in polygons},
        tuple(joints),
    )


def _void(design: xr.Dataset) -> np.ndarray:
    region = design["region"]
    meanings = str(region.attrs["flag_meanings"]).split()
    return np.asarray(region.values == region.attrs["flag_values"][meanings.index("void")])


def every_unit(found: Mapping[str, int], wanted: Wanted, where: Path) -> Iterator[Fault]:
    """Faults of the number of units: each is there once, and no other."""
    for label in wanted.polygons:
        if (count := found.get(label, 0)) != 1:
            what = "it is missing" if count == 0 else f"it is there {count} times"
            yield Fault(f"unit {label}", what, "laser", BUG, where)
    for label in sorted(set(found) - set(wanted.polygons)):
        what = "it is made, but the structure has no such unit"
        yield Fault(f"unit {label}", what, "laser", BUG, where)
