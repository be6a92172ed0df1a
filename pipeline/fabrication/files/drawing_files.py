"""Writes sheets in millimetres at true scale: DXF R2010, R12 for old cutters, and SVG."""

from __future__ import annotations

import io
import logging
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
LAYER_COLOURS = {
    "REFERENCE": "#808080",
    "ENGRAVE": "#00a000",
    "SCORE": "#ff0000",
    "CUT_INNER": "#0000ff",
    "CUT_OUTER": "#000000",
}
"""Layers in the order in which they are drawn and cut, with the colours of their lines."""

_HAIRLINE = 0.0762  # mm, 0.003 in: what cutters take for a cut


def write_dxf(sheet: LaserSheet, path: Path, version: Literal["R2010", "R12"] = "R2010") -> None:
    """Writes a sheet; inner cuts come before the outer one of the same part."""
    document = _new_document(version)
    space = document.modelspace()
    width, height = sheet.size
    low, high = (0.0, 0.0, 0.0), (width, height, 0.0)
    document.header["$EXTMIN"], document.header["$EXTMAX"] = low, high
    # or ezdxf writes those of the layout over them, unless the lower one is the origin
    space.reset_extents(low, high)
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
    logging.getLogger("ezdxf").setLevel(logging.ERROR)  # R12 knows no units: said for each file
    document = new(version)
    if version != "R12":  # which knows no units
        document.header["$INSUNITS"] = 4
    document.header["$MEASUREMENT"] = 1
    document.appids.add(APPLICATION)
    for name, colour in LAYERS.items():
        document.layers.add(name, color=colour, plot=name != "REFERENCE")  # told by R2010 alone
    return document


def _add_part(space: Modelspace, part: FlatPart) -> Iterator[Any]:
    for stroke in part.engraving:
        yield _add_line(space, stroke, "ENGRAVE")
    for stroke in part.scores:
        yield _add_line(space, stroke, "SCORE")
    for hole in part.holes:
        yield space.add_circle(hole.centre, hole.diameter / 2, dxfattribs={"layer": "CUT_INNER"})
    for cut in part.cuts:
        whole = not part.tabs
        yield _add_line(space, cut[:-1] if whole else cut, "CUT_OUTER", closed=whole)


def _add_line(space: Modelspace, points: Floats, layer: str, *, closed: bool = False) -> Any:  # noqa: ANN401
    """Adds points rounded to 1e-6 mm, without repetitions of the one before, as a polyline."""
    rounded = np.round(points, 6)
    distinct = np.append(True, (np.diff(rounded, axis=0) != 0.0).any(axis=1))
    old = space.doc.dxfversion == "AC1009"
    add = space.add_polyline2d if old else space.add_lwpolyline
    return add(rounded[distinct].tolist(), close=closed, dxfattribs={"layer": layer})


def write_svg(sheet: LaserSheet, path: Path) -> None:
    """Writes a sheet; y points up on the sheet and down in the file."""
    width, height = map(_number, sheet.size)
    head = (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<svg xmlns="http://www.w3.org/2000/svg"'
        ' xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"'
        f' width="{width}mm" height="{height}mm" viewBox="0 0 {width} {height}">\n'
        f"<title>{sheet.name}</title>\n"
    )
    body = "".join(_layer(name, sheet) for name in LAYER_COLOURS)
    path.write_text(f"{head}{body}</svg>\n", encoding="utf-8", newline="\n")


def _layer(name: str, sheet: LaserSheet) -> str:
    shapes = list(_shapes(name, sheet))
    if not shapes:
        return ""
    return (
        f'<g id="{name}" inkscape:groupmode="layer" inkscape:label="{name}" fill="none"'
        f' stroke="{LAYER_COLOURS[name]}" stroke-width="{_HAIRLINE}">\n'
        + "".join(f"{shape}\n" for shape in shapes)
        + "</g>\n"
    )


def _shapes(layer: str, sheet: LaserSheet) -> Iterator[str]:
    width, height = sheet.size
    if layer == "REFERENCE":
        yield f'<path d="M0,0H{_number(width)}V{_number(height)}H0Z"/>'
    for part in sheet.parts:
        for stroke in {"ENGRAVE": part.engraving, "SCORE": part.scores}.get(layer, ()):
            yield f'<path d="M{_pairs(stroke, height)}"/>'
        for hole in part.holes if layer == "CUT_INNER" else ():
            x, y, radius = hole.centre[0], height - hole.centre[1], hole.diameter / 2
            yield f'<circle cx="{_number(x)}" cy="{_number(y)}" r="{_number(radius)}"/>'
        if layer == "CUT_OUTER":
            for cut in part.cuts:
                way = _pairs(cut, height) if part.tabs else f"{_pairs(cut[:-1], height)}Z"
                yield f'<path inkscape:label="{part.id}" d="M{way}"/>'


def _pairs(points: Floats, height: float) -> str:
    return " ".join(f"{_number(x)},{_number(height - y)}" for x, y in points)


def _number(value: float) -> str:
    return f"{value:.5f}".rstrip("0").rstrip(".")
