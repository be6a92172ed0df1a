"""What a check finds: the part, what is wrong with it, which parameter to change, and where."""

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
    """One violated rule.

    Attributes:
        part: the part in words, such as "unit U012".
        what: what is wrong with it, with the measured and the wanted number.
        key: parameter of the section `fabrication` to change, dotted.
        remedy: how to change it.
        file: the written file in which it was found.
        around: outlines to show, in mm.
        spot: where the fault is, in mm.
    """

    part: str
    what: str
    key: str
    remedy: str
    file: Path
    around: tuple[Geometry, ...] = ()
    spot: Geometry | None = None


def stop(faults: Sequence[Fault], pictures: Path) -> None:
    """Ends an export with the first fault, naming the other parts, if there is any fault.

    Args:
        faults: what the checks found.
        pictures: folder for small pictures of the first faults.

    Raises:
        UserError: there is a fault.
    """
    if not faults:
        return
    first = faults[0]
    shown = [
        draw(
            f"{fault.part}\n{fault.what}",
            fault.around,
            fault.spot,
            pictures / f"fault_{number}.png",
        )
        for number, fault in enumerate(faults[:PICTURES], 1)
        if fault.around
    ]
    remedy = first.remedy + (f"; see {shown[0]}" if first.around else "")
    told = f"{first.part}: {first.what}{_others(faults)}"
    raise UserError(told, file=first.file, key=f"fabrication.{first.key}", remedy=remedy)


def _others(faults: Sequence[Fault]) -> str:
    """How many faults there are beside the first, and in which parts."""
    if len(faults) == 1:
        return ""
    parts = list(dict.fromkeys(fault.part for fault in faults))
    named = ", ".join(parts[:_NAMED]) + (", ..." if len(parts) > _NAMED else "")
    return f" ({len(faults)} faults in all: {named})"


def draw(title: str, around: Sequence[Geometry], spot: Geometry | None, path: Path) -> Path:
    """A small picture of a fault: outlines in black, the spot in red, a scale in mm."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.0, 4.0), layout="constrained")
    axes = figure.add_subplot()
    for outline in around:
        _plot(axes, outline, _INK, 1.0)
    if spot is not None:
        _plot(axes, spot, _FAULT, 2.5)
    axes.set_title(title, fontsize=7, wrap=True)
    axes.set(aspect="equal", xlabel="mm", ylabel="mm", **_window(around, spot))
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150, metadata={"Software": None})
    return path


def _window(around: Sequence[Geometry], spot: Geometry | None) -> dict[str, tuple[float, float]]:
    """Limits around the part and its spot."""
    from shapely import MultiPolygon, box, total_bounds

    shapes = [*around, *([] if spot is None else [spot])]
    left, low, right, high = total_bounds(
        [box(*shape.bounds) for shape in shapes or [MultiPolygon()]]
    )
    return {
        "xlim": (left - _MARGIN, right + _MARGIN),
        "ylim": (low - _MARGIN, high + _MARGIN),
    }


def _plot(axes: Axes, shape: Geometry, colour: str, width: float) -> None:
    """Points, lines and outlines of polygons."""
    from matplotlib.collections import LineCollection
    from shapely import get_coordinates, get_parts

    parts = get_parts(shape)
    points = [get_coordinates(part) for part in parts if part.geom_type == "Point"]
    lines = [get_coordinates(part) for part in parts if part.geom_type.startswith("Line")]
    for part in parts:
        if part.geom_type == "Polygon":
            lines += [get_coordinates(ring) for ring in (part.exterior, *part.interiors)]
    axes.add_collection(LineCollection(lines, colors=colour, linewidths=width))
    for point in points:
        axes.plot(*point.T, color=colour, marker="o")
