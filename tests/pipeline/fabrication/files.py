"""Writes small drawings and meshes by hand, right or wrong, for the checks to read."""

import zipfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from ezdxf.filemanagement import new
from trimesh import Trimesh

from pipeline.fabrication.readback import Curve
from sim.core import Floats, Ints

COLOURS = {"CUT_INNER": 5, "CUT_OUTER": 1, "ENGRAVE": 2, "SCORE": 3, "REFERENCE": 8}
PENS = {1: "#ff0000", 2: "#ffff00", 3: "#00ff00", 5: "#0000ff", 8: "#808080", 7: "#000000"}
INKSCAPE = "http://www.inkscape.org/namespaces/inkscape"
CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"


def rectangle(
    x: float, y: float, width: float, height: float, part: str, layer: str = "CUT_OUTER"
) -> Curve:
    """A closed rectangle with its lower left corner at (x, y)."""
    points = [(x, y), (x + width, y), (x + width, y + height), (x, y + height)]
    return Curve(part, layer, "LWPOLYLINE", np.array(points), closed=True)


def stroke(points: Sequence[tuple[float, float]], part: str, layer: str = "ENGRAVE") -> Curve:
    return Curve(part, layer, "LWPOLYLINE", np.array(points, dtype=float), closed=False)


def sheet(width: float = 100.0, height: float = 60.0) -> list[Curve]:
    """A sheet with two square plates, a hole and two letters in each."""
    curves = [rectangle(0, 0, width, height, "SHEET", "REFERENCE")]
    for part, x in (("A1", 10.0), ("B1", 40.0)):
        curves += [
            stroke([(x + 2, 4 + 10), (x + 2, 4 + 14), (x + 4, 4 + 14)], part),
            stroke([(x + 6, 4 + 10), (x + 6, 4 + 14)], part),
            rectangle(x + 10, 20, 4, 5, part, "CUT_INNER"),
            rectangle(x, 10, 20, 20, part),
        ]
    return curves


def write_dxf(
    path: Path,
    curves: Iterable[Curve],
    *,
    units: int = 4,
    colours: Mapping[str, int] | None = None,
    version: str = "R2010",
) -> Path:
    document = new(version)
    document.header["$INSUNITS"] = units
    document.appids.add("METACLOAK")
    pens = COLOURS | dict(colours or {})
    space = document.modelspace()
    for curve in curves:
        if curve.layer not in document.layers:
            document.layers.add(curve.layer, color=pens.get(curve.layer, 7))
        look: dict[str, Any] = {"layer": curve.layer} | ({"color": 4} if curve.own_colour else {})
        entity = _entity(space, curve, look)
        if curve.part:
            entity.set_xdata("METACLOAK", [(1000, curve.part)])
    document.saveas(path)
    return path


def _entity(space: Any, curve: Curve, look: dict[str, Any]) -> Any:  # noqa: ANN401
    if curve.kind == "SPLINE":
        return space.add_spline([(*point, 0.0) for point in curve.points], dxfattribs=look)
    if curve.kind == "TEXT":
        return space.add_text("A1", height=3.0, dxfattribs=look)
    if curve.kind == "POLYLINE":
        return space.add_polyline2d(curve.points, close=curve.closed, dxfattribs=look)
    return space.add_lwpolyline(curve.points, close=curve.closed, dxfattribs=look)


def write_svg(
    path: Path, curves: Iterable[Curve], size: tuple[float, float], head: str = ""
) -> Path:
    """An SVG with these curves, y down; `head` in place of its own opening words."""
    width, height = size
    words = head or f'width="{width:g}mm" height="{height:g}mm" viewBox="0 0 {width:g} {height:g}"'
    lines = [f'<svg xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="{INKSCAPE}" {words}>']
    for curve in curves:
        points = " L ".join(f"{x:.6f} {height - y:.6f}" for x, y in curve.points)
        pen = PENS[COLOURS.get(curve.layer, 7)]
        name = f'inkscape:label="{curve.part}" ' if curve.part else ""
        close = " Z" if curve.closed else ""
        path_words = f'<path {name}fill="none" stroke="{pen}" d="M {points}{close}"/>'
        lines.append(f'<g id="{curve.layer}">{path_words}</g>')
    path.write_text("\n".join([*lines, "</svg>"]), encoding="utf-8")
    return path


def write_stl(path: Path, vertices: Floats, triangles: Ints) -> Path:
    Trimesh(vertices, triangles, process=False).export(path)
    return path


def write_3mf(
    path: Path,
    bodies: Mapping[str, tuple[Floats, Ints]],
    places: Mapping[str, tuple[float, float]],
    unit: str = "millimeter",
) -> Path:
    """A 3MF with named objects, each moved to its place on the plate."""
    objects, items = [], []
    for number, (name, (vertices, triangles)) in enumerate(bodies.items(), 1):
        points = "".join(f'<vertex x="{x:.6f}" y="{y:.6f}" z="{z:.6f}"/>' for x, y, z in vertices)
        faces = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in triangles)
        mesh = f"<mesh><vertices>{points}</vertices><triangles>{faces}</triangles></mesh>"
        objects.append(f'<object id="{number}" name="{name}" type="model">{mesh}</object>')
        x, y = places[name]
        items.append(f'<item objectid="{number}" transform="1 0 0 0 1 0 0 0 1 {x} {y} 0"/>')
    model = (
        f'<?xml version="1.0"?><model unit="{unit}" xmlns="{CORE}">'
        f"<resources>{''.join(objects)}</resources><build>{''.join(items)}</build></model>"
    )
    with zipfile.ZipFile(path, "w") as package:
        package.writestr("3D/3dmodel.model", model)
    return path
