"""Draws structures: units, clamps, outlines and arrows of the drive."""

from __future__ import annotations

from collections.abc import Iterable

import matplotlib.patheffects as effects
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import Colormap, Normalize
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, FancyArrowPatch, Rectangle

from reports.base import GREY, INTACT, PALE
from reports.study import CLAMPED, RigidUnits, deformed
from sim.core import Floats


def draw(
    axes: Axes,
    structure: RigidUnits,
    displacement: Floats | None = None,
    *,
    colours: list[str] | None = None,
    values: Floats | None = None,
    colour_map: Colormap | None = None,
    norm: Normalize | None = None,
    margin: float = 6.0,
) -> PolyCollection:
    """Draws units and ligaments, units in `colours` (one each) or `values` through a colour map."""
    corners = deformed(structure, displacement)
    kept = structure.present
    ends = corners[structure.ligament_unit, structure.ligament_vertex]
    gaps = np.full((len(ends), 1, 2), np.nan)  # one broken line is a fraction of many in a file
    x, y = np.concatenate([ends, gaps], axis=1).reshape(-1, 2).T
    axes.add_line(Line2D(x, y, color=GREY, linewidth=0.3, solid_capstyle="butt", zorder=2))
    units = PolyCollection(
        [polygon[~np.isnan(polygon[:, 0])] for polygon in corners[kept]],
        edgecolors=INTACT,
        linewidths=0.15,
        zorder=3,
    )
    if values is None:
        chosen = colours if colours is not None else [PALE] * structure.n_units
        units.set_facecolor([colour for colour, keep in zip(chosen, kept, strict=True) if keep])
    else:
        units.set(array=values[kept], cmap=colour_map, norm=norm)
    axes.add_collection(units)
    frame(axes, structure, margin)
    return units


def frame(axes: Axes, structure: RigidUnits, margin: float) -> None:
    """Sets equal scales and limits `margin` mm beyond the flat structure; no axis lines."""
    points = structure.vertices.reshape(-1, 2)
    low, high = np.nanmin(points, axis=0) - margin, np.nanmax(points, axis=0) + margin
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    axes.set_axis_off()


def draw_clamps(axes: Axes, structure: RigidUnits, pad: float) -> None:
    """Draws hatched pad of `pad` mm under every clamped unit."""
    for x, y in structure.centroid[structure.support == CLAMPED]:
        axes.add_patch(
            Rectangle(
                (x - pad / 2, y - pad / 2),
                pad,
                pad,
                facecolor="white",
                edgecolor=INTACT,
                hatch="/" * 6,
                linewidth=0.4,
                zorder=1,
            )
        )


def outline(axes: Axes, centre: Floats, radii: Iterable[float], colour: str) -> None:
    """Draws dashed circles (mm) around a region."""
    for radius in radii:
        axes.add_patch(
            Circle(
                (float(centre[0]), float(centre[1])),
                radius,
                fill=False,
                edgecolor=colour,
                linewidth=0.8,
                linestyle=(0, (3.0, 1.6)),
                zorder=5,
            )
        )


def drive_arrows(
    axes: Axes, centre: Floats, direction: float, reach: tuple[float, float], colour: str
) -> None:
    """Draws arrows between two distances (mm) on both sides of `centre`, `direction` in degrees."""
    along = np.array([np.cos(np.radians(direction)), np.sin(np.radians(direction))])
    for sign in (1.0, -1.0):
        start, end = (centre + sign * distance * along for distance in reach)
        arrow = FancyArrowPatch(
            (float(start[0]), float(start[1])),
            (float(end[0]), float(end[1])),
            arrowstyle="-|>",
            mutation_scale=7.0,
            shrinkA=0,
            shrinkB=0,
            linewidth=1.5,
            color=colour,
            zorder=7,
        )
        arrow.set_path_effects([effects.withStroke(linewidth=3.0, foreground="white")])
        axes.add_patch(arrow)
