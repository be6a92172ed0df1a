"""Sheets as DXF in millimetres: R2010, and R12 for old cutters."""

from __future__ import annotations

import io
import logging
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from pipeline.fabrication.parts import Floats, Part
from pipeline.fabrication.sheets import Sheet

if TYPE_CHECKING:
    from ezdxf.document import Drawing
    from ezdxf.entities.dxfgfx import DXFGraphic
    from ezdxf.layouts.layout import Modelspace

Version = Literal["R2010", "R12"]

APPLICATION = "METACLOAK"
"""Outer cuts carry the id of their part as extended data under this name."""

LAYERS = {"CUT_INNER": 5, "CUT_OUTER": 7, "ENGRAVE": 3, "SCORE": 1, "REFERENCE": 8}
"""Layers and their AutoCAD colours: blue, black or white, green, red, grey."""


def write(sheet: Sheet, path: Path, version: Version) -> None:
    """Write a sheet; inner cuts come before the outer one of the same part."""
    document = _new(version)
    space = document.modelspace()
    width, height = sheet.size
    rim = np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])
    _line(space, rim, "REFERENCE", version, closed=True)
    for part in sheet.parts:
        _draw(space, part, version)
    stream = io.StringIO()
    document.write(stream)
    path.write_text(stream.getvalue(), encoding="utf-8", newline="\n")


def _new(version: Version) -> Drawing:
    from ezdxf._options import options
    from ezdxf.filemanagement import new

    options.write_fixed_meta_data_for_testing = True  # no dates, no random ids: the same bytes
    logging.getLogger("ezdxf").setLevel(logging.ERROR)  # R12 has no place for units, and it says so
    document = new(version)
    if version != "R12":
        document.header["$INSUNITS"] = 4
        document.header["$MEASUREMENT"] = 1
    document.appids.add(APPLICATION)
    for name, colour in LAYERS.items():
        document.layers.add(name, color=colour)
    return document


def _draw(space: Modelspace, part: Part, version: Version) -> None:
    for stroke in part.engraving:
        _line(space, stroke, "ENGRAVE", version)
    for stroke in part.scores:
        _line(space, stroke, "SCORE", version)
    for hole in part.holes:
        space.add_circle(hole.centre, hole.diameter / 2, dxfattribs={"layer": "CUT_INNER"})
    outline = np.asarray(part.outline.exterior.coords)[:-1]
    cut = _line(space, outline, "CUT_OUTER", version, closed=True)
    cut.set_xdata(APPLICATION, [(1000, part.id)])


def _line(
    space: Modelspace, points: Floats, layer: str, version: Version, *, closed: bool = False
) -> DXFGraphic:
    rounded = list(_distinct(np.round(points, 6).tolist()))
    if version == "R12":
        return space.add_polyline2d(rounded, close=closed, dxfattribs={"layer": layer})
    return space.add_lwpolyline(rounded, close=closed, dxfattribs={"layer": layer})


def _distinct(points: Iterable[list[float]]) -> Iterator[tuple[float, float]]:
    """Points without repetitions of the one before."""
    before = None
    for x, y in points:
        if (x, y) != before:
            yield x, y
        before = (x, y)
