"""Writes sheets as DXF in millimetres: R2010, and R12 for old cutters."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from pipeline.fabrication.parts import FlatPart
from pipeline.fabrication.plates import LaserSheet
from sim.core import Floats

if TYPE_CHECKING:
    from ezdxf.document import Drawing
    from ezdxf.layouts.layout import Modelspace

APPLICATION = "METACLOAK"
"""All curves of a part carry its id as extended data under this name."""

LAYERS = {"CUT_INNER": 5, "CUT_OUTER": 7, "ENGRAVE": 3, "SCORE": 1, "REFERENCE": 8}
"""Layers and their AutoCAD colours: blue, black or white, green, red, grey."""


def write_dxf(sheet: LaserSheet, path: Path, version: Literal["R2010", "R12"] = "R2010") -> None:
    """Writes a sheet; inner cuts come before the outer one of the same part."""
    document = _new_document(version)
    space = document.modelspace()
    width, height = sheet.size
    document.header["$EXTMIN"], document.header["$EXTMAX"] = (0.0, 0.0, 0.0), (width, height, 0.0)
    rim = np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])
    _add_line(space, rim, "REFERENCE", closed=True)
    for part in sheet.parts:
        for entity in _add_part(space, part):
            entity.set_xdata(APPLICATION, [(1000, part.id)])
    stream = io.StringIO()
    document.write(stream)
    path.write_text(stream.getvalue(), encoding="utf-8", newline="\n")


def _new_document(version: str) -> Drawing:
    from ezdxf._options import options
    from ezdxf.filemanagement import new

    options.write_fixed_meta_data_for_testing = True  # no dates, no random ids: the same bytes
    document = new(version)
    if version != "R12":  # which knows no units
        document.header["$INSUNITS"] = 4
    document.header["$MEASUREMENT"] = 1
    document.appids.add(APPLICATION)
    for name, colour in LAYERS.items():
        document.layers.add(name, color=colour)
    return document


def _add_part(space: Modelspace, part: FlatPart) -> Iterator[Any]:
    for stroke in part.engraving:
        yield _add_line(space, stroke, "ENGRAVE")
    for stroke in part.scores:
        yield _add_line(space, stroke, "SCORE")
    for hole in part.holes:
        yield space.add_circle(hole.centre, hole.diameter / 2, dxfattribs={"layer": "CUT_INNER"})
    outline = np.asarray(part.outline.exterior.coords)[:-1]
    yield _add_line(space, outline, "CUT_OUTER", closed=True)


def _add_line(space: Modelspace, points: Floats, layer: str, *, closed: bool = False) -> Any:  # noqa: ANN401
    """Adds points rounded to 1e-6 mm, without repetitions of the one before, as a polyline."""
    rounded = np.round(points, 6)
    distinct = np.append(True, (np.diff(rounded, axis=0) != 0.0).any(axis=1))
    old = space.doc.dxfversion == "AC1009"
    add = space.add_polyline2d if old else space.add_lwpolyline
    return add(rounded[distinct].tolist(), close=closed, dxfattribs={"layer": layer})
