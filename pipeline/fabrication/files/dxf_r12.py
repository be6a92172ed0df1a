"""Sheets as DXF R12 in millimetres, for old cutters: plain tags, written one after the other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from pipeline.fabrication.files.dxf import APPLICATION, LAYERS, distinct
from pipeline.fabrication.parts import Circle, FlatPart
from pipeline.fabrication.plates import LaserSheet
from sim.core import Floats

Tag = tuple[int, str | int | float]

_CLOSED, _SEQUENCE = 1, 1  # flag of a closed polyline, of vertices that follow


def write(sheet: LaserSheet, path: Path) -> None:
    """Write a sheet; inner cuts come before the outer one of the same part."""
    text = "".join(f"{code}\n{_value(value)}\n" for code, value in _tags(sheet))
    path.write_text(text, encoding="ascii", newline="\n")


def _value(value: str | float) -> str:
    return f"{value:.6f}" if isinstance(value, float) else str(value)


def _tags(sheet: LaserSheet) -> Iterator[Tag]:
    width, height = sheet.size
    yield from _section("HEADER", _header(width, height))
    yield from _section("TABLES", _tables())
    yield from _section("ENTITIES", _entities(sheet))
    yield 0, "EOF"


def _run(*tags: Tag) -> tuple[Tag, ...]:
    return tags


def _section(name: str, content: Iterable[Tag]) -> Iterator[Tag]:
    yield from _run((0, "SECTION"), (2, name))
    yield from content
    yield 0, "ENDSEC"


def _header(width: float, height: float) -> Iterator[Tag]:
    yield from _run((9, "$ACADVER"), (1, "AC1009"))
    yield from _run((9, "$EXTMIN"), (10, 0.0), (20, 0.0), (30, 0.0))
    yield from _run((9, "$EXTMAX"), (10, float(width)), (20, float(height)), (30, 0.0))


def _tables() -> Iterator[Tag]:
    yield from _run((0, "TABLE"), (2, "LTYPE"), (70, 1), (0, "LTYPE"), (2, "CONTINUOUS"), (70, 0))
    yield from _run((3, "Solid line"), (72, 65), (73, 0), (40, 0.0), (0, "ENDTAB"))
    yield from _run((0, "TABLE"), (2, "LAYER"), (70, len(LAYERS) + 1))
    for name, colour in {"0": 7, **LAYERS}.items():
        yield from _run((0, "LAYER"), (2, name), (70, 0), (62, colour), (6, "CONTINUOUS"))
    yield 0, "ENDTAB"
    yield from _run((0, "TABLE"), (2, "APPID"), (70, 1), (0, "APPID"), (2, APPLICATION), (70, 0))
    yield 0, "ENDTAB"


def _entities(sheet: LaserSheet) -> Iterator[Tag]:
    width, height = sheet.size
    rim = np.array([[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])
    yield from _polyline(rim, "REFERENCE", closed=True)
    for part in sheet.parts:
        yield from _part(part)


def _part(part: FlatPart) -> Iterator[Tag]:
    for stroke in part.engraving:
        yield from _polyline(stroke, "ENGRAVE")
    for stroke in part.scores:
        yield from _polyline(stroke, "SCORE")
    for hole in part.holes:
        yield from _circle(hole)
    outline = np.asarray(part.outline.exterior.coords)[:-1]
    yield from _polyline(outline, "CUT_OUTER", closed=True, name=part.id)


def _circle(hole: Circle) -> Iterator[Tag]:
    x, y = hole.centre
    yield from _run((0, "CIRCLE"), (8, "CUT_INNER"), (10, float(x)), (20, float(y)), (30, 0.0))
    yield 40, hole.diameter / 2


def _polyline(points: Floats, layer: str, *, closed: bool = False, name: str = "") -> Iterator[Tag]:
    yield from _run((0, "POLYLINE"), (8, layer), (66, _SEQUENCE), (10, 0.0), (20, 0.0), (30, 0.0))
    yield 70, _CLOSED if closed else 0
    if name:
        yield from _run((1001, APPLICATION), (1000, name))
    for x, y in distinct(points):
        yield from _run((0, "VERTEX"), (8, layer), (10, x), (20, y), (30, 0.0))
    yield from _run((0, "SEQEND"), (8, layer))
