"""Draws a structure of rigid units at true size, at rest or deformed.

A unit moves as a rigid body: vertex = centroid + u + R(theta) (vertex - centroid). Units are one
PolyCollection and ligaments one broken line, so that a figure of a dozen structures stays small.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import matplotlib.patheffects as effects
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import Colormap, Normalize
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, FancyArrowPatch, Rectangle
from numpy.typing import NDArray

from reports.style import GREY, INTACT, PALE

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

SURROUNDINGS, CLOAK, SOURCE, VOID, INCLUSION = range(5)
FREE, CLAMPED, DRIVEN = 0, 1, 2


@dataclass(frozen=True)
class Structure:
    """A network of rigid units, flat.

    vertices (n_units, n_vertices, 2) mm, counter-clockwise, padded with NaN, all NaN for a unit
    that is absent, as are its ligaments; site (n_units, 2) mm
    lattice point; ligament_unit and ligament_vertex (n_ligaments, 2); region, support (n_units,).
    """

    vertices: Array
    site: Array
    ligament_unit: Integers
    ligament_vertex: Integers
    region: Integers
    support: Integers

    @property
    def centroid(self) -> Array:
        """Centroids (n_units, 2) in mm of the flat units."""
        return polygon_centroids(self.vertices)

    @property
    def n_units(self) -> int:
        """Number of units, absent ones included."""
        return len(self.vertices)

    @property
    def present(self) -> NDArray[np.bool_]:
        """Whether each unit is there (n_units,)."""
        return np.asarray(np.isfinite(self.vertices[..., 0]).any(axis=1))


def from_dataset(data: xr.Dataset, spacing: float, vertices: str = "vertices") -> Structure:
    """Structure held by a design dataset, or by one `structure` of a response dataset."""
    index = np.stack([data["i"].values, data["j"].values], axis=-1)
    shape = data[vertices].transpose("unit", "vertex", "xy").values.astype(float)
    unit, vertex = (data[name].values.astype(int) for name in ("ligament_unit", "ligament_vertex"))
    there = ~np.isnan(shape[unit, vertex, 0]).any(axis=1)
    return Structure(
        vertices=shape,
        site=spacing * index.astype(float),
        ligament_unit=unit[there],
        ligament_vertex=vertex[there],
        region=data["region"].values.astype(int),
        support=data["support"].values.astype(int),
    )


def polygon_centroids(vertices: Array) -> Array:
    """Centroids (n, 2) of polygons (n, m, 2) by the shoelace formula, NaN vertices left out."""
    missing = np.isnan(vertices[..., :1])
    # A repeated first vertex adds neither area nor moment.
    ring = np.where(missing, vertices[:, :1], vertices)
    local = ring - ring[:, :1]
    following = np.roll(local, -1, axis=1)
    cross = local[..., 0] * following[..., 1] - local[..., 1] * following[..., 0]
    moment = ((local + following) * cross[..., None]).sum(axis=1)
    centroid: Array = ring[:, 0] + moment / (3.0 * cross.sum(axis=1))[:, None]
    return centroid


def deformed(structure: Structure, displacement: Array | None = None) -> Array:
    """Vertices (n_units, n_vertices, 2) mm after `displacement` (n_units, 3) in mm, mm, rad.

    Units whose displacement is NaN (not known) stay at rest.
    """
    if displacement is None:
        return structure.vertices
    displacement = np.nan_to_num(displacement)
    centroid = structure.centroid
    arm = structure.vertices - centroid[:, None]
    cosine, sine = np.cos(displacement[:, 2, None]), np.sin(displacement[:, 2, None])
    turned = np.stack(
        [cosine * arm[..., 0] - sine * arm[..., 1], sine * arm[..., 0] + cosine * arm[..., 1]],
        axis=-1,
    )
    moved: Array = (centroid + displacement[:, :2])[:, None] + turned
    return moved


def draw(
    axes: Axes,
    structure: Structure,
    displacement: Array | None = None,
    *,
    colours: list[str] | None = None,
    values: Array | None = None,
    colour_map: Colormap | None = None,
    norm: Normalize | None = None,
    margin: float = 6.0,
) -> PolyCollection:
    """Draw units and ligaments, units in `colours` (one each) or `values` through a colour map."""
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


def frame(axes: Axes, structure: Structure, margin: float) -> None:
    """Equal scales and limits around the flat structure, `margin` mm beyond it; no axis lines."""
    points = structure.vertices.reshape(-1, 2)
    low, high = np.nanmin(points, axis=0) - margin, np.nanmax(points, axis=0) + margin
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    axes.set_axis_off()


def draw_clamps(axes: Axes, structure: Structure, pad: float) -> None:
    """Hatched pad of `pad` mm under every clamped unit."""
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


def outline(axes: Axes, centre: Array, radii: Iterable[float], colour: str) -> None:
    """Dashed circles (mm) around a region."""
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
    axes: Axes, centre: Array, direction: float, reach: tuple[float, float], colour: str
) -> None:
    """Arrows between two distances (mm) on both sides of `centre`, `direction` in degrees."""
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


def unit_at(structure: Structure, point: Array) -> int:
    """Unit whose lattice point lies nearest to `point` (mm)."""
    return int(np.argmin(np.linalg.norm(structure.site - point, axis=1)))


def middle_of_top_edge(structure: Structure) -> int:
    """Unit in the middle of the top row (the left one of two)."""
    low, high = structure.site.min(axis=0), structure.site.max(axis=0)
    return unit_at(structure, np.array([0.5 * (low[0] + high[0]) - 1e-6, high[1]]))
