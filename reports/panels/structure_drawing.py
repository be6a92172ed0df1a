"""Draws structures: units, clamps, outlines and arrows of the drive."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Literal

import matplotlib.patheffects as effects
import numpy as np
import shapely
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import PolyCollection
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Colormap, Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, FancyArrowPatch, PathPatch, Rectangle
from matplotlib.path import Path

from reports.base import GREY, INTACT, PALE, style
from reports.study import CLAMPED, RigidUnits, deformed
from sim.core import Floats

CLOAK_TINT, CLAMP_TINT = "#c9b3e0", "#4a4d52"
MARGIN = 6.0
"""Room about a structure at rest, mm."""


def tints(
    structure: RigidUnits,
    of_support: Mapping[int, str],
    of_region: Mapping[int, str],
    others: str | Sequence[str],
) -> list[str]:
    """Chooses the colours of units by their support, else by their region; of the `others` too."""
    rest = [others] * structure.n_units if isinstance(others, str) else others
    units = zip(structure.support, structure.region, rest, strict=True)
    return [of_support.get(held) or of_region.get(region, other) for held, region, other in units]


def draw(
    axes: Axes,
    structure: RigidUnits,
    displacement: Floats | None = None,
    *,
    colours: list[str] | None = None,
    values: Floats | None = None,
    colour_map: Colormap | None = None,
    norm: Normalize | None = None,
    margin: float = MARGIN,
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


def colour_bar(
    figure: Figure,
    norm: Normalize,
    colours: Colormap,
    place: tuple[float, float, float],
    label: str,
    extend: Literal["neither", "max"] = "neither",
) -> Colorbar:
    """Draws a bar of colours in the middle of `place`: mm from the left and the top, and height."""
    left, top, height = place
    bar = style.place(figure, left, top + 0.1 * height, 2.4, 0.8 * height)
    made = figure.colorbar(ScalarMappable(norm, colours), cax=bar, extend=extend)
    made.set_label(label, labelpad=3.0)
    bar.tick_params(length=1.5)
    style.short_numbers(bar)
    return made


def draw_clamps(axes: Axes, structure: RigidUnits, pad: float) -> None:
    """Draws hatched pad of `pad` mm under every clamped unit; pads that overlap are joined."""
    look: dict[str, Any] = {"facecolor": "white", "edgecolor": INTACT, "hatch": "/" * 6}
    look |= {"linewidth": 0.4, "zorder": 1}
    corners = structure.centroid[structure.support == CLAMPED] - pad / 2
    if not _overlap(corners, pad):
        for x, y in corners:
            axes.add_patch(Rectangle((x, y), pad, pad, **look))
        return
    for rings in pads(structure, pad):
        outline = Path.make_compound_path(*(Path(ring, closed=True) for ring in rings))
        axes.add_patch(PathPatch(outline, **look))


def pads(structure: RigidUnits, pad: float) -> list[list[Floats]]:
    """Returns outlines (n, 2) of the pads under clamped units, and of holes in each.

    Those that overlap are joined.
    """
    corners = structure.centroid[structure.support == CLAMPED] - pad / 2
    squares = shapely.box(*corners.T, *(corners + pad).T)
    if not _overlap(corners, pad):
        return [[shapely.get_coordinates(square)] for square in squares]
    joined = shapely.union_all(squares)
    for reach in (0.1 * pad, -0.1 * pad):  # closes slits between them
        joined = joined.buffer(reach, join_style="mitre")
    return [
        [shapely.get_coordinates(ring) for ring in (part.exterior, *part.interiors)]
        for part in shapely.get_parts(joined)
    ]


def _overlap(corners: Floats, side: float) -> bool:
    """Tests if any two squares overlap by more than their edges, by their corners (n, 2)."""
    apart = np.abs(corners[:, None] - corners).max(axis=-1)
    np.fill_diagonal(apart, np.inf)
    return bool((apart < 0.99 * side).any())


def outline(axes: Axes, centre: Floats, radii: Iterable[float], colour: str) -> None:
    """Draws dashed circles (mm) around a region."""
    look: dict[str, Any] = {"linestyle": (0, (3.0, 1.6)), "linewidth": 0.8, "edgecolor": colour}
    for radius in radii:
        axes.add_patch(Circle(point(centre), radius, fill=False, zorder=5, **look))


def point(place: Floats) -> tuple[float, float]:
    """Returns a place (2,) as patches take it."""
    return float(place[0]), float(place[1])


def arrow(
    axes: Axes, start: Floats, end: Floats, colour: str, head: float = 6.0, **look: float
) -> FancyArrowPatch:
    """Draws a solid arrow between two places (2,), its `head` in points."""
    settings: dict[str, Any] = {"linewidth": 1.3, "shrinkA": 0, "shrinkB": 0, "color": colour}
    settings |= {"arrowstyle": "-|>", "mutation_scale": head}
    made = FancyArrowPatch(point(start), point(end), **settings | look)
    axes.add_patch(made)
    return made


def drive_arrows(
    axes: Axes, centre: Floats, direction: float, reach: tuple[float, float], colour: str
) -> None:
    """Draws arrows between two distances (mm) on both sides of `centre`, `direction` in degrees."""
    along = np.array([np.cos(np.radians(direction)), np.sin(np.radians(direction))])
    for sign in (1.0, -1.0):
        start, end = (centre + sign * distance * along for distance in reach)
        made = arrow(axes, start, end, colour, 7.0, linewidth=1.5, zorder=7)
        made.set_path_effects([effects.withStroke(linewidth=3.0, foreground="white")])
