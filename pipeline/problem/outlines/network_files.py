"""Polygons and ligaments from a file: a list in CSV, a netCDF dataset, or a drawing in DXF."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from pipeline.runtime import read_bounded

if TYPE_CHECKING:
    from ezdxf.entities.lwpolyline import LWPolyline
    from ezdxf.entities.polyline import Polyline
    from ezdxf.math import Vec3

Point = tuple[float, float]

_LARGEST = 64 << 20  # bytes of a list

COLUMNS = ("kind", "number", "x (mm)", "y (mm)")
"""Header of a CSV; its kinds are `unit` (one row a corner) and `ligament` (one row an end)."""


class NetworkError(ValueError):
    """A file that no lattice can be read from; `remedy` says what to do."""

    def __init__(self, what: str, remedy: str) -> None:
        super().__init__(what)
        self.what = what
        self.remedy = remedy


class Content(NamedTuple):
    """Corners of the units and end points of the ligaments, mm."""

    polygons: tuple[tuple[Point, ...], ...]
    ligaments: tuple[tuple[Point, Point], ...]


def read_network(path: Path) -> Content:
    """The units and ligaments in a file, told by its suffix.

    Raises:
        NetworkError: no such file, unreadable, or without units or ligaments.
    """
    readers = {".csv": _of_csv, ".nc": _of_netcdf, ".dxf": _of_dxf}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise NetworkError("not a kind of file that lattices are read from", "give csv, nc or dxf")
    if not path.is_file():
        raise NetworkError("no such file", "give its path as seen from the problem file")
    found = reader(path)
    if not found.polygons or not found.ligaments:
        missing = "ligaments" if found.polygons else "units"
        raise NetworkError(f"the file has no {missing}", "list units and what joins them")
    return found


def _of_csv(path: Path) -> Content:
    units: dict[int, list[Point]] = {}
    ligaments: dict[int, list[Point]] = {}
    groups = {"unit": units, "ligament": ligaments}
    remedy = f"write the header {','.join(COLUMNS)} and a row for every corner and every end"
    try:
        rows = list(
            csv.reader(io.StringIO(read_bounded(path, _LARGEST).decode("utf-8"), newline=""))
        )
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise NetworkError(f"the list cannot be read: {error}", remedy) from error
    if not rows or tuple(name.strip() for name in rows[0]) != COLUMNS:
        raise NetworkError("the columns of the list are wrong", remedy)
    for number, row in enumerate(rows[1:], start=2):
        try:
            kind, name, x, y = row
            groups[kind.strip()].setdefault(int(name), []).append((float(x), float(y)))
        except (ValueError, KeyError) as error:
            what = f"row {number} of the list is no corner and no end"
            raise NetworkError(what, remedy) from error
    for ligament, ends in ligaments.items():
        if len(ends) != 2:
            raise NetworkError(f"ligament {ligament} has {len(ends)} ends", "give it two rows")
    return Content(
        tuple(tuple(corners) for _, corners in sorted(units.items())),
        tuple((first, second) for _, (first, second) in sorted(ligaments.items())),
    )


def _of_netcdf(path: Path) -> Content:
    """The design of a study, or any dataset with its `vertices` and `ligament_*` variables."""
    import numpy as np
    import xarray as xr

    remedy = "give vertices (unit, vertex, xy), ligament_unit and ligament_vertex (ligament, end)"
    try:
        with xr.open_dataset(path, engine="netcdf4") as data:
            vertices = data["vertices"].transpose("unit", "vertex", "xy").to_numpy()
            unit = data["ligament_unit"].transpose("ligament", "end").to_numpy()
            corner = data["ligament_vertex"].transpose("ligament", "end").to_numpy()
            ends = vertices[unit, corner]
    except (OSError, ValueError, KeyError, IndexError) as error:
        raise NetworkError(f"not a readable lattice: {error}", remedy) from error
    polygons = (corners[~np.isnan(corners).any(axis=1)] for corners in vertices)
    present = ends[~np.isnan(ends).any(axis=(1, 2))]
    return Content(
        tuple(tuple(map(_point, corners.tolist())) for corners in polygons if len(corners)),
        tuple((_point(first), _point(second)) for first, second in present.tolist()),
    )


def _of_dxf(path: Path) -> Content:
    """Closed polylines as units and lines as ligaments, whatever their layers; lengths in mm."""
    from ezdxf import recover
    from ezdxf.entities.lwpolyline import LWPolyline
    from ezdxf.entities.polyline import Polyline
    from ezdxf.enums import InsertUnits
    from ezdxf.units import conversion_factor

    remedy = "save it as DXF with closed polylines for units and lines for ligaments"
    try:
        drawing, audit = recover.readfile(path)
    except Exception as error:  # whatever a parser of another project meets in a damaged file
        raise NetworkError(f"not a readable DXF: {error}", remedy) from error
    if audit.has_errors:
        raise NetworkError(f"the DXF is damaged: {audit.errors[0].message}", remedy)
    unit = InsertUnits(drawing.units)
    unitless = unit == InsertUnits.Unitless
    scale = 1.0 if unitless else conversion_factor(unit, InsertUnits.Millimeters)
    space = drawing.modelspace()
    polygons = tuple(
        tuple(_point((scale * x, scale * y)) for x, y in _corners(line))
        for line in space.query("LWPOLYLINE POLYLINE")
        if isinstance(line, LWPolyline | Polyline) and line.is_closed
    )
    ligaments = tuple(
        (_scaled(line.dxf.start, scale), _scaled(line.dxf.end, scale))
        for line in space.query("LINE")
    )
    return Content(polygons, ligaments)


def _corners(line: LWPolyline | Polyline) -> list[tuple[float, float]]:
    """Corners of a polyline, the first not repeated at its end."""
    from ezdxf.entities.lwpolyline import LWPolyline

    if isinstance(line, LWPolyline):
        points = [(x, y) for x, y in line.vertices()]
    else:
        points = [(place.x, place.y) for place in line.points()]
    return points[:-1] if len(points) > 1 and points[0] == points[-1] else points


def _scaled(place: Vec3, scale: float) -> Point:
    return _point((scale * place.x, scale * place.y))


def _point(xy: Sequence[float]) -> Point:
    return round(float(xy[0]), 9), round(float(xy[1]), 9)
