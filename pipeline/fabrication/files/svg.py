"""Writes sheets as SVG at true scale: one unit of the drawing is one millimetre."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from pipeline.fabrication.plates import LaserSheet
from sim.core import Floats

COLOURS = {
    "REFERENCE": "#808080",
    "ENGRAVE": "#00a000",
    "SCORE": "#ff0000",
    "CUT_INNER": "#0000ff",
    "CUT_OUTER": "#000000",
}
"""Layers in the order in which they are drawn and cut, with the colours of their lines."""

_HAIRLINE = 0.0762  # mm, 0.003 in: what cutters take for a cut


def write_svg(sheet: LaserSheet, path: Path) -> None:
    """Writes a sheet; y points up on the sheet and down in the file."""
    width, height = sheet.size
    head = (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<svg xmlns="http://www.w3.org/2000/svg"'
        ' xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"'
        f' width="{width:g}mm" height="{height:g}mm" viewBox="0 0 {width:g} {height:g}">\n'
        f"<title>{sheet.name}</title>\n"
    )
    body = "".join(_layer(name, sheet) for name in COLOURS)
    path.write_text(f"{head}{body}</svg>\n", encoding="utf-8", newline="\n")


def _layer(name: str, sheet: LaserSheet) -> str:
    shapes = list(_shapes(name, sheet))
    if not shapes:
        return ""
    return (
        f'<g id="{name}" inkscape:groupmode="layer" inkscape:label="{name}" fill="none"'
        f' stroke="{COLOURS[name]}" stroke-width="{_HAIRLINE}">\n'
        + "".join(f"{shape}\n" for shape in shapes)
        + "</g>\n"
    )


def _shapes(layer: str, sheet: LaserSheet) -> Iterator[str]:
    width, height = sheet.size
    if layer == "REFERENCE":
        yield f'<path d="M0,0H{width:g}V{height:g}H0Z"/>'
    for part in sheet.parts:
        for stroke in {"ENGRAVE": part.engraving, "SCORE": part.scores}.get(layer, ()):
            yield f'<path d="M{_pairs(stroke, height)}"/>'
        for hole in part.holes if layer == "CUT_INNER" else ():
            x, y, radius = hole.centre[0], height - hole.centre[1], hole.diameter / 2
            yield f'<circle cx="{_number(x)}" cy="{_number(y)}" r="{_number(radius)}"/>'
        if layer == "CUT_OUTER":
            outline = np.asarray(part.outline.exterior.coords)[:-1]
            yield f'<path inkscape:label="{part.id}" d="M{_pairs(outline, height)}Z"/>'


def _pairs(points: Floats, height: float) -> str:
    return " ".join(f"{_number(x)},{_number(height - y)}" for x, y in points)


def _number(value: float) -> str:
    return f"{value:.5f}".rstrip("0").rstrip(".")
