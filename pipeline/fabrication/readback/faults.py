"""Reports faults of written files: the part, the parameter to change, and a picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.runtime import UserError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from shapely import Geometry

BUG = "run the same command again; if it stays, the exporter has a bug"
"""The remedy where no parameter helps."""

PICTURES = 6
"""Most pictures that one stop leaves behind."""

_MARGIN = 1.5  # mm around what a picture shows
_NAMED = 5
_INK, _FAULT = "#1a1a1a", "#d1242f"


@dataclass(frozen=True)
class Fault:
    """Holds one violated rule."""

    part: str  # the part in words, such as "unit U012"
    what: str  # the fault, with the measured and the required number
    key: str  # parameter of the section `fabrication` to change, dotted
    remedy: str  # how to change it
    file: Path  # the written file with the fault
    around: tuple[Geometry, ...] = ()  # outlines to show, in mm
    spot: Geometry | None = None  # where the fault is, in mm


def unreadable(kind: str, path: Path, why: object) -> UserError:
    """Makes the error of a written file that cannot be read back."""
    what = f"{kind} that was just written cannot be read back: {why}"
    return UserError(what, file=path, remedy=BUG)


def stop(faults: Sequence[Fault], pictures: Path) -> None:
    """Ends an export with the first fault, if any, and draws the first ones into a folder.

    Raises:
        UserError: there is a fault.
    """
    if not faults:
        return
    first = faults[0]
    shown = [
        draw(f"{one.part}\n{one.what}", one.around, one.spot, pictures / f"fault_{number}.png")
        for number, one in enumerate(faults[:PICTURES], 1)
        if one.around
    ]
    what = f"{first.part}: {first.what}"
    if len(faults) > 1:
        parts = list(dict.fromkeys(fault.part for fault in faults))
        named = ", ".join(parts[:_NAMED]) + (", ..." if len(parts) > _NAMED else "")
        what += f" ({len(faults)} faults in all: {named})"
    remedy = first.remedy + (f"; see {shown[0]}" if first.around else "")
    raise UserError(what, file=first.file, key=f"fabrication.{first.key}", remedy=remedy)


def draw(title: str, around: Sequence[Geometry], spot: Geometry | None, path: Path) -> Path:
    """Draws a small picture of a fault: outlines in black, the spot in red, a scale in mm."""
    from matplotlib.figure import Figure
    from shapely import box, total_bounds

    figure = Figure(figsize=(4.0, 4.0), layout="constrained")
    axes = figure.add_subplot()
    for outline in around:
        _plot(axes, outline, _INK, 1.0)
    if spot is not None:
        _plot(axes, spot, _FAULT, 2.5)
    shapes = [*around, *([] if spot is None else [spot])]
    left, low, right, high = total_bounds([box(*shape.bounds) for shape in shapes])
    axes.set_title(title, fontsize=7, wrap=True)
    axes.set(aspect="equal", xlabel="mm", ylabel="mm")
    axes.set_xlim(left - _MARGIN, right + _MARGIN)
    axes.set_ylim(low - _MARGIN, high + _MARGIN)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150, metadata={"Software": None})
    return path


def _plot(axes: Axes, shape: Geometry, colour: str, width: float) -> None:
    """Plots points, lines and outlines of polygons."""
    from matplotlib.collections import LineCollection
    from shapely import get_coordinates, get_dimensions, get_parts

    parts = get_parts(shape)
    areas = [get_parts(part.boundary) for part in parts[get_dimensions(parts) == 2]]
    lines = [*parts[get_dimensions(parts) == 1], *(ring for rings in areas for ring in rings)]
    segments = [get_coordinates(line) for line in lines]
    axes.add_collection(LineCollection(segments, colors=colour, linewidths=width))
    for point in parts[get_dimensions(parts) == 0]:
        axes.plot(*get_coordinates(point).T, color=colour, marker="o")
