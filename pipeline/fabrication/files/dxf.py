"""Sheets as DXF R2010 in millimetres."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pipeline.fabrication.parts import FlatPart
from pipeline.fabrication.plates import LaserSheet
from sim.core import Floats

if TYPE_CHECKING:
    from ezdxf.document import Drawing
    from ezdxf.entities.dxfgfx import DXFGraphic
    from ezdxf.layouts.layout import Modelspace

APPLICATION = "METACLOAK"
"""Outer cuts carry the id of their part as extended data under this name."""

LAYERS = {"CUT_INNER": 5, "CUT_OUTER": 7, "ENGRAVE": 3, "SCORE": 1, "REFERENCE": 8}
"""Layers and their AutoCAD colours: blue, black or white, green, red, grey."""


def write(sheet: LaserSheet, path: Path) -> None:
    """Write a sheet; inner cuts come before the outer one of the same part."""
    document = _new()
    space = document.modelspace()
    width, height = sheet.size
    rim = np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])
    _line(space, rim, "REFERENCE", closed=True)
    for part in sheet.parts:
        _draw(space, part)
    stream = io.StringIO()
    document.write(stream)
    path.write_text(stream.getvalue(), encoding="utf-8", newline="\n")


def _new() -> Drawing:
    from ezdxf._options import options
    from ezdxf.filemanagement import new

    options.write_fixed_meta_data_for_testing = True  # no dates, no random ids: the same bytes
    document = new("R2010")
    document.header["$INSUNITS"] = 4
    document.header["$MEASUREMENT"] = 1
    document.appids.add(APPLICATION)
    for name, colour in LAYERS.items():
        document.layers.add(name, color=colour)
    return document


def _draw(space: Modelspace, part: FlatPart) -> None:
    for stroke in part.engraving:
        _line(space, stroke, "ENGRAVE")
    for stroke in part.scores:
        _line(space, stroke, "SCORE")
    for hole in part.holes:
        space.add_circle(hole.centre, hole.diameter / 2, dxfattribs={"layer": "CUT_INNER"})
    cut = _line(space, np.asarray(part.outline.exterior.coords)[:-1], "CUT_OUTER", closed=True)
    cut.set_xdata(APPLICATION, [(1000, part.id)])


def _line(space: Modelspace, points: Floats, layer: str, *, closed: bool = False) -> DXFGraphic:
    rounded = list(distinct(points))
    return space.add_lwpolyline(rounded, close=closed, dxfattribs={"layer": layer})


def distinct(points: Floats) -> Iterator[tuple[float, float]]:
    """Points rounded to 1e-6 mm, without repetitions of the one before."""
    before = None
    for x, y in np.round(points, 6).tolist():
        if (x, y) != before:
            yield x, y
        before = (x, y)
