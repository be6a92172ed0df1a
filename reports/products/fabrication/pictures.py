"""Draws written files: sheets from DXF, plates from 3MF, the specimen from STL."""

import io
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from PIL import Image

from pipeline.fabrication.files import LAYER_COLOURS
from pipeline.fabrication.readback import Curve, MeshBody, read_3mf, read_drawing, read_stl
from reports.base import GREY, MM_PER_INCH, PALE, style
from reports.products.fabrication.renderer import Body, picture

WIDTH = 1000
"""Of a picture in pixels."""

_RIM = 6.0  # mm around a sheet
_BED = "#e6e8ea"
_BED_HEIGHT = 1.0  # mm


def sheet(path: Path) -> bytes:
    """Returns PNG of a drawing: parts filled, layers in their colours."""
    drawing = read_drawing(path)
    points = np.concatenate([curve.points for curve in drawing.curves])
    low, high = points.min(axis=0) - _RIM, points.max(axis=0) + _RIM
    dpi = WIDTH / (high[0] - low[0]) * MM_PER_INCH
    figure = Figure(figsize=tuple((high - low) / MM_PER_INCH), dpi=dpi)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    axes.set_axis_off()
    for layer in LAYER_COLOURS:
        _draw(axes, layer, [curve for curve in drawing.curves if curve.layer == layer])
    stream = io.BytesIO()
    figure.savefig(stream, format="png", metadata={"Software": None})
    return _small(Image.open(stream))


def _draw(axes: Axes, layer: str, curves: list[Curve]) -> None:
    """Draws one layer; outer cuts are filled, holes are white."""
    closed = [curve.points for curve in curves if curve.closed]
    fill = {"CUT_OUTER": PALE, "CUT_INNER": "white"}.get(layer, "none")
    order = list(LAYER_COLOURS).index(layer) if layer != "CUT_OUTER" else 0.5
    axes.add_collection(
        PolyCollection(
            closed, facecolors=fill, edgecolors=LAYER_COLOURS[layer], linewidths=0.9, zorder=order
        )
    )
    strokes = [curve.points for curve in curves if not curve.closed]
    axes.add_collection(
        LineCollection(strokes, colors=LAYER_COLOURS[layer], linewidths=0.9, zorder=order + 1)
    )


def plate(path: Path, bed: tuple[float, float], colour: str) -> bytes:
    """Returns PNG of a printer's plate on its bed."""
    solids = read_3mf(path)
    board = _board(bed)
    return _png(picture([board, *(_body(solid, colour) for solid in solids)], WIDTH))


def assembled(path: Path, colour: str) -> bytes:
    """Returns PNG of the whole specimen."""
    return _png(picture([_body(read_stl(path), colour)], WIDTH))


def prebend_map(path: Path, shims: Collection[Mapping[str, Any]]) -> bytes:
    """Returns PNG of the specimen's outlines, its shims coloured by their strain before any load.

    The manifest has middle and strain of each shim.
    """
    solid = read_stl(path)
    low, high = solid.extent
    units = shapely.get_parts(solid.section((low[2] + high[2]) / 2))
    width, height = (high - low)[:2] + 2 * _RIM
    figure = Figure(figsize=(10.0, 8.5 * height / width), dpi=WIDTH / 10.0)
    axes = figure.add_axes((0.0, 0.0, 0.85, 1.0))
    axes.set(xlim=(low[0] - _RIM, high[0] + _RIM), ylim=(low[1] - _RIM, high[1] + _RIM))
    axes.set_axis_off()
    rings = [np.asarray(unit.exterior.coords) for unit in units]
    axes.add_collection(PolyCollection(rings, facecolors=PALE, edgecolors=GREY, linewidths=0.4))
    x, y = np.array([shim["middle_mm"] for shim in shims]).T
    percent = 100.0 * np.array([shim["strain"] for shim in shims])
    dots = axes.scatter(x, y, 30.0, percent, cmap=style.MAGNITUDE, vmin=0.0, zorder=2)
    bar = figure.colorbar(dots, cax=figure.add_axes((0.88, 0.1, 0.02, 0.8)))
    bar.set_label("strain of the shim before any load, %")
    stream = io.BytesIO()
    figure.savefig(stream, format="png", metadata={"Software": None})
    return _small(Image.open(stream))


def _body(solid: MeshBody, colour: str) -> Body:
    return Body(solid.vertices, solid.triangles, colour)


def _board(bed: tuple[float, float]) -> Body:
    """Returns the bed as a thin board below the parts."""
    width, depth = bed
    corners = np.array([[0.0, 0.0], [width, 0.0], [width, depth], [0.0, depth]])
    top = np.column_stack([corners, np.full(4, -0.01)])
    bottom = np.column_stack([corners, np.full(4, -_BED_HEIGHT)])
    sides = [[a, b, b + 4, a, b + 4, a + 4] for a, b in ((4, 5), (5, 6), (6, 7), (7, 4))]
    faces = [[4, 5, 6], [4, 6, 7], *np.array(sides)[:, [0, 1, 2]], *np.array(sides)[:, [3, 4, 5]]]
    turned = np.array(faces) % 8
    return Body(np.vstack([bottom, top]), turned, _BED)


def _png(pixels: np.ndarray) -> bytes:
    return _small(Image.fromarray(pixels))


def _small(image: Image.Image) -> bytes:
    """Returns a PNG with a palette of its own: a third of the bytes, and no difference to see."""
    stream = io.BytesIO()
    image.convert("RGB").quantize(96, dither=Image.Dither.NONE).save(stream, format="PNG")
    return stream.getvalue()
