"""Reads a specimen from its design: outlines of the units at rest and joined pairs."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr

from pipeline.datasets.tables import TABLES
from sim.core import Floats, Ints, Mask

_SAME = 0.5  # mm between a vertex of a track and the same one of a design


@dataclass(frozen=True)
class SpecimenOutlines:
    """Holds the units that a video shows, in the specimen's frame.

    Attributes:
        ids: (units,) ids in the design; absent units are left out.
        centre: (units, 2) centroids at rest, mm.
        outline: (units, vertices, 2) vertices at rest relative to the centroid, counter-clockwise,
            NaN padded, mm.
        joint: (ligaments, 2) pairs of joined units, as places in `ids`.
        joined: (units, vertices) whether a ligament ends at the vertex.
    """

    ids: Ints
    centre: Floats
    outline: Floats
    joint: Ints
    joined: Mask

    @property
    def count(self) -> int:
        """Counts the units."""
        return len(self.ids)

    @cached_property
    def area(self) -> Floats:
        """Returns the areas (units,) of the outlines, mm^2."""
        return np.array([float(np.sum(_cross(self.polygon(k))) / 2) for k in range(self.count)])

    @cached_property
    def radius(self) -> Floats:
        """Returns the distance (units,) of the farthest vertex from the centroid, mm."""
        return np.nanmax(np.linalg.norm(self.outline, axis=2), axis=1)

    @cached_property
    def pitch(self) -> float:
        """Returns the median distance of joined units, mm."""
        ends = self.centre[self.joint]
        return float(np.median(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)))

    def polygon(self, unit: int) -> Floats:
        """Returns the vertices of a unit relative to its centroid, without padding, mm."""
        outline = self.outline[unit]
        return outline[~np.isnan(outline[:, 0])]


def as_built(design: xr.Dataset, structure: str) -> xr.Dataset:
    """Replaces a design's vertices by those of a structure: intact, altered or cloaked."""
    if structure == "cloaked":
        return design
    vertices = design["vertices_initial"]
    if structure == "altered":
        void = TABLES["design"]["region"].flags["void"]
        vertices = vertices.where(design["region"] != void)
    return design.assign(vertices=vertices)


def difference_of_vertices(tracked: Floats, built: Floats) -> str | None:
    """Describes how vertices (units, vertices, 2) of a track differ from others, NaN where absent.

    None where all lie within half a millimetre.
    """
    if tracked.shape != built.shape or not np.array_equal(np.isnan(tracked), np.isnan(built)):
        return "other units are absent, or they have other vertices"
    apart = float(np.nanmax(np.abs(tracked - built)))
    return f"vertices are up to {apart:.2f} mm apart" if apart > _SAME else None


def outlines_of_design(design: xr.Dataset) -> SpecimenOutlines:
    """Reads the specimen of a design dataset; units without vertices are absent."""
    vertices = design["vertices"].transpose("unit", "vertex", "xy").values
    present = ~np.isnan(vertices[:, 0, 0])
    place = np.cumsum(present) - 1
    units = design["ligament_unit"].values
    kept = present[units].all(axis=1)
    joined = np.zeros(vertices.shape[:2], dtype=bool)
    joined[units[kept].ravel(), design["ligament_vertex"].values[kept].ravel()] = True
    centre = np.stack([_centroid(shape[~np.isnan(shape[:, 0])]) for shape in vertices[present]])
    return SpecimenOutlines(
        design["unit"].values[present],
        centre,
        vertices[present] - centre[:, None],
        place[units[kept]],
        joined[present],
    )


def clamped_units(design: xr.Dataset) -> Mask:
    """Marks the clamped ones among the units (units,) that are present."""
    present = np.isfinite(design["vertices"].transpose("unit", "vertex", "xy").values[:, 0, 0])
    flag = TABLES["design"]["support"].flags["clamped"]
    return np.asarray(design["support"].values[present] == flag)


def _centroid(polygon: Floats) -> Floats:
    cross = _cross(polygon)
    following = np.roll(polygon, -1, axis=0)
    return ((polygon + following) * cross[:, None]).sum(axis=0) / (3 * cross.sum())


def _cross(polygon: Floats) -> Floats:
    """Returns the cross products (n,) of vertices with those after them."""
    following = np.roll(polygon, -1, axis=0)
    return polygon[:, 0] * following[:, 1] - polygon[:, 1] * following[:, 0]
