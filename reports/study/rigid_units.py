"""Draws a structure of rigid units at true size, at rest or deformed.

A unit moves as a rigid body: vertex = centroid + u + R(theta) (vertex - centroid). Units are one
PolyCollection and ligaments one broken line, so that a figure of a dozen structures stays small.
"""

from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.problem.sections import Lattice
from sim.core import Floats, Ints

SURROUNDINGS, CLOAK, SOURCE, VOID, INCLUSION = range(5)
FREE, CLAMPED, DRIVEN = 0, 1, 2


@dataclass(frozen=True)
class RigidUnits:
    """Describes a network of rigid units, flat.

    vertices (n_units, n_vertices, 2) mm, counter-clockwise, padded with NaN, all NaN for a unit
    that is absent, as are its ligaments; site (n_units, 2) mm
    lattice point; ligament_unit and ligament_vertex (n_ligaments, 2); region, support (n_units,).
    """

    vertices: Floats
    site: Floats
    ligament_unit: Ints
    ligament_vertex: Ints
    region: Ints
    support: Ints

    @property
    def centroid(self) -> Floats:
        """Centroids (n_units, 2) in mm of the flat units."""
        return polygon_centroids(self.vertices)

    @property
    def n_units(self) -> int:
        """Returns number of units, absent ones included."""
        return len(self.vertices)

    @property
    def present(self) -> NDArray[np.bool_]:
        """Tells whether each unit is there (n_units,)."""
        return np.asarray(np.isfinite(self.vertices[..., 0]).any(axis=1))


def on_lattice(data: xr.Dataset, lattice: Lattice) -> RigidUnits:
    """Returns structure of a dataset as ``from_dataset`` does, its sites those of any lattice."""
    held = from_dataset(data, lattice.spacing)
    return replace(held, site=np.array([(x, y) for _, x, y in lattice.sites()]))


def from_dataset(data: xr.Dataset, spacing: float, vertices: str = "vertices") -> RigidUnits:
    """Returns structure held by a design dataset, or by one `structure` of a response dataset.

    Its sites are those of a square lattice; see ``on_lattice``.
    """
    index = np.stack([data["i"].values, data["j"].values], axis=-1)
    shape = data[vertices].transpose("unit", "vertex", "xy").values.astype(float)
    unit, vertex = (data[name].values.astype(int) for name in ("ligament_unit", "ligament_vertex"))
    there = ~np.isnan(shape[unit, vertex, 0]).any(axis=1)
    return RigidUnits(
        vertices=shape,
        site=spacing * index.astype(float),
        ligament_unit=unit[there],
        ligament_vertex=vertex[there],
        region=data["region"].values.astype(int),
        support=data["support"].values.astype(int),
    )


def polygon_centroids(vertices: Floats) -> Floats:
    """Centroids (n, 2) of polygons (n, m, 2) by the shoelace formula, NaN vertices left out."""
    missing = np.isnan(vertices[..., :1])
    # A repeated first vertex adds neither area nor moment.
    ring = np.where(missing, vertices[:, :1], vertices)
    local = ring - ring[:, :1]
    following = np.roll(local, -1, axis=1)
    cross = local[..., 0] * following[..., 1] - local[..., 1] * following[..., 0]
    moment = ((local + following) * cross[..., None]).sum(axis=1)
    return ring[:, 0] + moment / (3.0 * cross.sum(axis=1))[:, None]


def deformed(structure: RigidUnits, displacement: Floats | None = None) -> Floats:
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
    return (centroid + displacement[:, :2])[:, None] + turned


def unit_at(structure: RigidUnits, point: Floats) -> int:
    """Returns unit whose lattice point lies nearest to `point` (mm)."""
    return int(np.argmin(np.linalg.norm(structure.site - point, axis=1)))


def middle_of_top_edge(structure: RigidUnits) -> int:
    """Returns unit in the middle of the top row (the left one of two)."""
    low, high = structure.site.min(axis=0), structure.site.max(axis=0)
    return unit_at(structure, np.array([0.5 * (low[0] + high[0]) - 1e-6, high[1]]))
