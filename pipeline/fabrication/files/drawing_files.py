"""Writes sheets in millimetres at true scale: DXF R2010, R12 for old cutters, and SVG."""

from __future__ import annotations

import io
import logging
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from pipeline.fabrication.plates import LaserSheet
from sim.core import Floats

if TYPE_CHECKING:
    from ezdxf.document import Drawing

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

_ENTITIES = "  2\nENTITIES\n"  # begins the section of a DXF that holds the curves
_HAIRLINE = 0.0762  # mm, 0.003 in: what cutters take for a cut


def write_dxf(sheet: LaserSheet, path: Path, version: Literal["R2010", "R12"] = "R2010") -> None:
    """Writes a sheet; inner cuts come before the outer one of the same part."""
    document = new_document(version, sheet.size)
    records = "".join(_records(sheet, _CurveRecords(document)))
    stream = io.StringIO()
    document.write(stream)
    text = stream.getvalue().replace(_ENTITIES, _ENTITIES + records, 1)
    path.write_text(text, encoding="utf-8", newline="\n")


def new_document(version: str, size: tuple[float, float]) -> Drawing:
    """Makes a document with the layers of a sheet of this size, mm, and nothing drawn."""
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
    low, high = (0.0, 0.0, 0.0), (*size, 0.0)
    document.header["$EXTMIN"], document.header["$EXTMAX"] = low, high
    # or ezdxf writes those of the layout over them, unless the lower one is the origin
    document.modelspace().reset_extents(low, high)
    classes = document.classes
    classes.add_required_classes(document.dxfversion)  # from a set, whose order differs by process
    classes.classes = dict(sorted(classes.classes.items()))
    return document


def _records(sheet: LaserSheet, drawn: _CurveRecords) -> Iterator[str]:
    width, height = sheet.size
    rim = [(0.0, 0.0), (width, 0.0), (width, height), (0.0, height)]
    yield drawn.line(_distinct(np.array(rim)), "REFERENCE", closed=True)
    for part in sheet.parts:
        for stroke in part.engraving:
            yield drawn.line(_distinct(stroke), "ENGRAVE", part.id)
        for stroke in part.scores:
            yield drawn.line(_distinct(stroke), "SCORE", part.id)
        for hole in part.holes:
            yield drawn.circle(hole.centre, hole.diameter / 2, "CUT_INNER", part.id)
        for cut in part.cuts:
            whole = not part.tabs
            points = _distinct(cut[:-1] if whole else cut)
            yield drawn.line(points, "CUT_OUTER", part.id, closed=whole)


def _distinct(points: Floats) -> list[list[float]]:
    """Lists points rounded to 1e-6 mm, without repetitions of the one before."""
    rounded = np.round(points, 6)
    kept = np.append(True, (np.diff(rounded, axis=0) != 0.0).any(axis=1))
    return list(rounded[kept].tolist())


class _CurveRecords(NamedTuple):
    """Formats curves of one document as its records, byte for byte as ezdxf writes its entities.

    An entity for each vertex of an R12 would take ten times as long as all the rest of a sheet.
    Curves take the next free handles of the document.
    """

    document: Drawing  # R2010 or R12

    def line(
        self, points: Sequence[Sequence[float]], layer: str, part: str = "", *, closed: bool = False
    ) -> str:
        """Formats a polyline through points (x, y), mm, of a part or of none."""
        if not self._is_old:
            vertices = "".join(f" 10\n{x}\n 20\n{y}\n" for x, y in points)
            head = f"{self._head('LWPOLYLINE', layer)}100\nAcDbPolyline\n"
            return f"{head} 90\n{len(points)}\n 70\n{closed:d}\n{vertices}{_owner(part)}"
        head, end = self._head("POLYLINE", layer), self._head("SEQEND", layer)
        vertices = "".join(
            f"{self._head('VERTEX', layer)} 10\n{x}\n 20\n{y}\n 30\n0.0\n 70\n0\n"
            for x, y in points
        )
        start = f" 66\n1\n 10\n0.0\n 20\n0.0\n 30\n0.0\n 70\n{closed:d}\n"
        return f"{head}{start}{_owner(part)}{vertices}{end}"

    def circle(self, centre: Sequence[float], radius: float, layer: str, part: str) -> str:
        """Formats a circle of a part, mm."""
        x, y = centre
        kind = "" if self._is_old else "100\nAcDbCircle\n"
        place = f" 10\n{x}\n 20\n{y}\n 30\n0.0\n 40\n{radius}\n"
        return f"{self._head('CIRCLE', layer)}{kind}{place}{_owner(part)}"

    @property
    def _is_old(self) -> bool:
        return bool(self.document.dxfversion == "AC1009")

    def _head(self, kind: str, layer: str) -> str:
        """Begins a record with its kind, its handle and its layer."""
        head = f"  0\n{kind}\n  5\n{self.document.entitydb.next_handle()}\n"
        if self._is_old:
            return f"{head}  8\n{layer}\n"
        space = self.document.modelspace().layout_key
        return f"{head}330\n{space}\n100\nAcDbEntity\n  8\n{layer}\n"


def _owner(part: str) -> str:
    """Names the part of a curve in its extended data."""
    return f"1001\n{APPLICATION}\n1000\n{part}\n" if part else ""


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
