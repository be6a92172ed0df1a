"""Reads polygons and ligaments: a list in CSV, a netCDF dataset, or a drawing in DXF."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from pipeline.problem.fields import csv_columns
from pipeline.runtime import UNREADABLE, UserError, check_size

if TYPE_CHECKING:
    from ezdxf.entities.dxfgfx import DXFGraphic
    from ezdxf.entities.lwpolyline import LWPolyline
    from ezdxf.entities.polyline import Polyline
    from ezdxf.math import Vec3

Point = tuple[float, float]

COLUMNS = ("kind", "number", "x (mm)", "y (mm)")
"""Header of a CSV; its kinds are `unit` (one row a corner) and `ligament` (one row an end)."""

STIFFNESS_COLUMNS = ("axial (N/mm)", "shear (N/mm)", "bending (N mm/rad)")
"""Further columns, some or all: of ligaments, in either of their rows or in both."""

Stiffness: TypeAlias = tuple[float | None, float | None, float | None]

LARGEST_FILE = 64 << 20  # bytes
_SMALLER = "give a smaller lattice, or the same one in a file of another kind"

_NOTES = frozenset(
    (
        *("TEXT", "MTEXT", "ATTDEF", "LEADER", "MLEADER", "MULTILEADER", "TOLERANCE"),
        *("DIMENSION", "ARC_DIMENSION", "LARGE_RADIAL_DIMENSION"),
        *("POINT", "XLINE", "RAY", "VIEWPORT", "ACAD_TABLE", "HATCH", "MPOLYGON"),
        *("IMAGE", "WIPEOUT", "PDFUNDERLAY", "DWFUNDERLAY", "DGNUNDERLAY", "OLE2FRAME"),
    )
)
"""Entities of a drawing that lie about, on or below its shapes, and are left aside."""


class NetworkContent(NamedTuple):
    """Holds corners of the units and end points of the ligaments, mm, and what a file says more.

    Axial, shear (N/mm) and bending stiffness (N mm/rad) of each ligament are None where not given.
    """

    polygons: tuple[tuple[Point, ...], ...]
    ligaments: tuple[tuple[Point, Point], ...]
    stiffnesses: tuple[Stiffness, ...] | None = None


def read_network(path: Path) -> NetworkContent:
    """Reads the units and ligaments in a file, told by its suffix.

    Raises:
        UserError: no such file, unreadable, or without units or ligaments.
    """
    readers = {".csv": _of_csv, ".nc": _of_netcdf, ".dxf": _of_dxf}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise UserError(
            "not a kind of file that lattices are read from", remedy="give csv, nc or dxf"
        )
    if not path.is_file():
        raise UserError("no such file", remedy="give its path as seen from the problem file")
    try:
        check_size(path, LARGEST_FILE)
    except OSError as error:
        raise UserError(f"the lattice is not read: {error.strerror}", remedy=_SMALLER) from error
    found = reader(path)
    if not found.polygons or not found.ligaments:
        missing = "ligaments" if found.polygons else "units"
        raise UserError(f"the file has no {missing}", remedy="list units and what joins them")
    return found


def _of_csv(path: Path) -> NetworkContent:
    units: dict[float, list[Point]] = {}
    ligaments: dict[float, list[Point]] = {}
    stiffnesses: dict[float, dict[str, float]] = {}
    groups = {"unit": units, "ligament": ligaments}
    cells = csv_columns.read_cells(path)
    header = tuple(cells.rows[0]) if cells.rows else ()
    more = header[len(COLUMNS) :]
    remedy = (
        f"write the header {','.join(COLUMNS)}, with {', '.join(STIFFNESS_COLUMNS)} if wanted,"
        " and a row for every corner and every end"
    )
    known = len(set(more)) == len(more) and set(more) <= set(STIFFNESS_COLUMNS)
    if header[: len(COLUMNS)] != COLUMNS or not known:
        raise UserError("the columns of the list are wrong", remedy=remedy)
    for line, row in enumerate(cells.rows[1:], start=2):
        number, x, y = (cells.number(row, column) for column in (1, 2, 3))
        group = groups.get(row[0]) if len(row) == len(header) else None
        if group is None or number is None or x is None or y is None:
            what = f"row {line} of the list is no corner and no end"
            raise UserError(what, remedy=remedy)
        group.setdefault(number, []).append((x, y))
        for column, name in enumerate(more, start=len(COLUMNS)):
            if not row[column].strip():
                continue
            value, own = cells.number(row, column), stiffnesses.setdefault(number, {})
            if group is units or value is None or not 0.0 < value == own.setdefault(name, value):
                what = f"row {line} of the list has no {name} that its ligament can have"
                raise UserError(what, remedy="give ligaments one number above zero, units none")
    for ligament, ends in ligaments.items():
        if len(ends) != 2:
            raise UserError(
                f"ligament {ligament:g} has {len(ends)} ends", remedy="give it two rows"
            )
    _check_numbers(units)
    listed = sorted(ligaments.items())
    return NetworkContent(
        tuple(tuple(corners) for _, corners in sorted(units.items())),
        tuple((first, second) for _, (first, second) in listed),
        tuple(_stiffness(stiffnesses.get(number, {})) for number, _ in listed) if more else None,
    )


def _check_numbers(units: Collection[float]) -> None:
    """Refuses numbers by which units would not be found again: they count from 0, without gaps."""
    for wanted, number in enumerate(sorted(units)):
        if number != wanted:
            what = f"{len(units)} units are numbered from 0 on, and the list has {number:g}"
            what += f" where {wanted} is wanted"
            remedy = "number them without gaps: supports and drives list them as [number, 0]"
            raise UserError(what, remedy=remedy)


def _stiffness(given: dict[str, float]) -> Stiffness:
    axial, shear, bending = (given.get(name) for name in STIFFNESS_COLUMNS)
    return axial, shear, bending


def _of_netcdf(path: Path) -> NetworkContent:
    """Reads a study's design, or any dataset with its `vertices` and `ligament_*` variables."""
    import numpy as np
    import xarray as xr

    remedy = "give vertices (unit, vertex, xy), ligament_unit and ligament_vertex (ligament, end)"
    try:
        with xr.open_dataset(path, engine="netcdf4") as data:
            vertices = data["vertices"].transpose("unit", "vertex", "xy").to_numpy().astype(float)
            unit = data["ligament_unit"].transpose("ligament", "end").to_numpy()
            corner = data["ligament_vertex"].transpose("ligament", "end").to_numpy()
            ends = vertices[unit, corner]
    except UNREADABLE as error:
        raise UserError(f"not a readable lattice: {error}", remedy=remedy) from error
    polygons = (corners[~np.isnan(corners).any(axis=1)] for corners in vertices)
    present = ends[~np.isnan(ends).any(axis=(1, 2))]
    return NetworkContent(
        tuple(tuple(map(_point, corners.tolist())) for corners in polygons if len(corners)),
        tuple((_point(first), _point(second)) for first, second in present.tolist()),
    )


def _of_dxf(path: Path) -> NetworkContent:
    """Reads closed polylines as units, lines and open ones of two points as ligaments; to mm.

    Whatever their layers.

    Raises:
        UserError: unreadable, an outline with arcs, a longer line that is open, a block, or what is
            neither a polyline nor a line.
    """
    from ezdxf import recover
    from ezdxf.entities.insert import Insert
    from ezdxf.entities.line import Line
    from ezdxf.entities.lwpolyline import LWPolyline
    from ezdxf.entities.polyline import Polyline
    from ezdxf.enums import InsertUnits
    from ezdxf.units import conversion_factor

    remedy = "save it as DXF with closed polylines for units and lines for ligaments"
    try:
        drawing, audit = recover.readfile(path)
    except Exception as error:  # whatever a parser of another project meets in a damaged file
        raise UserError(f"not a readable DXF: {error}", remedy=remedy) from error
    if audit.has_errors:
        raise UserError(f"the DXF is damaged: {audit.errors[0].message}", remedy=remedy)
    unit = InsertUnits(drawing.units)
    unitless = unit == InsertUnits.Unitless
    scale = 1.0 if unitless else conversion_factor(unit, InsertUnits.Millimeters)
    space = drawing.modelspace()
    polygons: list[tuple[Point, ...]] = []
    ligaments: list[tuple[Point, Point]] = []
    for drawn in space:
        if isinstance(drawn, Line):
            ligaments.append((_scaled(drawn.dxf.start, scale), _scaled(drawn.dxf.end, scale)))
        elif isinstance(drawn, Insert):
            x, y = _scaled(drawn.dxf.insert, scale)
            what = f"the block {drawn.dxf.name} at ({x:g}, {y:g}) mm is not read"
            raise UserError(what, remedy="explode it to the polylines and lines that it shows")
        elif isinstance(drawn, LWPolyline | Polyline):
            _sort_in(drawn, scale, polygons, ligaments)
        elif drawn.dxftype() not in _NOTES:
            what = f"the {drawn.dxftype().lower()}{_place(drawn, scale)} is not read"
            raise UserError(what, remedy="draw it by polylines and lines, or delete it")
    return NetworkContent(tuple(polygons), tuple(ligaments))


def _sort_in(
    line: LWPolyline | Polyline,
    scale: float,
    polygons: list[tuple[Point, ...]],
    ligaments: list[tuple[Point, Point]],
) -> None:
    """Adds a polyline to the polygons if it is closed or ends where it began, or to the ligaments.

    Raises:
        UserError: it has arcs, or is open and longer than a ligament.
    """
    from ezdxf.entities.lwpolyline import LWPolyline

    places = line.vertices_in_wcs() if isinstance(line, LWPolyline) else line.points_in_wcs()
    corners = tuple(_scaled(place, scale) for place in places)
    if not corners:
        return
    x, y = corners[0]
    returns = len(corners) > 1 and corners[0] == corners[-1]
    if line.has_arc:
        remedy = "draw its rounded sides by straight pieces"
        raise UserError(f"the outline from ({x:g}, {y:g}) mm on has arcs", remedy=remedy)
    if line.is_closed or returns:
        polygons.append(corners[:-1] if returns else corners)
    elif len(corners) == 2:
        ligaments.append((corners[0], corners[1]))
    else:
        what = f"the open line from ({x:g}, {y:g}) mm on is neither a unit nor a ligament"
        raise UserError(what, remedy="close it, or draw each ligament by its two ends alone")


def _place(drawn: DXFGraphic, scale: float) -> str:
    """Tells where an entity of a drawing is, if that is known."""
    from ezdxf.bbox import extents

    box = extents([drawn], fast=True)
    if not box.has_data:
        return ""
    x, y = _scaled(box.center, scale)
    return f" about ({x:g}, {y:g}) mm"


def _scaled(place: Vec3, scale: float) -> Point:
    return _point((scale * place.x, scale * place.y))


def _point(xy: Sequence[float]) -> Point:
    return round(float(xy[0]), 9), round(float(xy[1]), 9)
