"""Measures true gaps and overlaps between units by computational geometry (shapely), in any state.

Independent of the optimiser's constraint functions: this is what decides whether a structure can be
built and whether its units pass through one another while it moves.
"""

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from sim.core import Floats, Ints
from sim.structure.lattice import Lattice

OVERLAP_AREA = 1e-9
"""Intersections of a smaller area (mm^2) are touching units, not overlapping ones."""

_WIDER = 1.0 + 1e-9  # of a bound, for rounding


@dataclass(frozen=True)
class Gap:
    """Holds the smallest distance between two units."""

    distance: float  # mm, zero if they touch or overlap, infinite if there is only one unit
    units: tuple[int, int]  # ids, ascending; (-1, -1) if there is only one unit


@dataclass(frozen=True)
class Clearance:
    """Holds gaps and overlaps over a history of states."""

    gap: Floats  # (n_states,) smallest distance between any two units, mm
    gap_units: Ints  # (n_states, 2) the units concerned
    overlaps: Ints  # (n_states,) number of overlapping pairs


def polygons(lattice: Lattice, vertices: Floats) -> NDArray[np.object_]:
    """Builds the shapely polygons (n_units,) of the units whose vertices lie at ``vertices``."""
    return shapely.polygons(shapely.linearrings(vertices, indices=lattice.unit))


def smallest_gap(lattice: Lattice, vertices: Floats) -> Gap:
    """Finds the smallest distance between any two units, bonded or not."""
    return _smallest_gap(polygons(lattice, vertices))


def overlapping_pairs(lattice: Lattice, vertices: Floats) -> Ints:
    """Finds the pairs (n_pairs, 2) of units that overlap by more than OVERLAP_AREA, ascending."""
    return _overlapping_pairs(polygons(lattice, vertices))


def close_pairs(lattice: Lattice, vertices: Floats, distance: float) -> Ints:
    """Finds the pairs (n_pairs, 2) of units nearer than ``distance`` (mm), ascending."""
    units = polygons(lattice, vertices)
    return _ascending(shapely.STRtree(units).query(units, "dwithin", distance))


def displaced(lattice: Lattice, vertices: Floats, motion: Floats) -> Floats:
    """Moves the vertices (..., n_vertices, 2) by rigid motions (..., n_units, 3).

    A motion is the displacement (mm) of the polygon's centroid and the turn (rad) about it.
    """
    centre = shapely.get_coordinates(shapely.centroid(polygons(lattice, vertices)))[lattice.unit]
    x, y = (vertices - centre).T
    turn = motion[..., lattice.unit, 2]
    cosine, sine = np.cos(turn), np.sin(turn)
    turned = np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)
    return centre + turned + motion[..., lattice.unit, :2]


def clearance(lattice: Lattice, vertices: Floats, motion: Floats) -> Clearance:
    """Measures gaps and overlaps in each state of a history ``motion`` (n_states, n_units, 3)."""
    gaps, overlaps = [], []
    for state in displaced(lattice, vertices, motion):
        units = polygons(lattice, state)
        gaps.append(_smallest_gap(units))
        touching = gaps[-1].distance == 0.0
        overlaps.append(len(_overlapping_pairs(units)) if touching else 0)
    return Clearance(
        np.array([gap.distance for gap in gaps]),
        np.array([gap.units for gap in gaps], dtype=np.int64).reshape(-1, 2),
        np.array(overlaps, dtype=np.int64),
    )


def _smallest_gap(units: NDArray[np.object_]) -> Gap:
    if len(units) < 2:
        return Gap(np.inf, (-1, -1))
    # No pair is nearer whose boxes are farther apart than the nearest of units that follow each
    # other, which in a lattice are neighbours.
    bound = shapely.distance(units[:-1], units[1:]).min()
    around = shapely.bounds(units) + _WIDER * bound * np.array([-1.0, -1.0, 1.0, 1.0])
    pairs = _ascending(shapely.STRtree(units).query(shapely.box(*around.T)))
    distance = shapely.distance(*units[pairs.T])
    nearest = int(np.argmin(distance))
    a, b = pairs[nearest].tolist()
    return Gap(float(distance[nearest]), (a, b))


def _overlapping_pairs(units: NDArray[np.object_]) -> Ints:
    touching = _ascending(shapely.STRtree(units).query(units, "intersects"))
    parts = shapely.make_valid(units) if len(touching) else units
    shared = shapely.area(shapely.intersection(parts[touching[:, 0]], parts[touching[:, 1]]))
    return touching[shared > OVERLAP_AREA]


def _ascending(pairs: Ints) -> Ints:
    """Lists each unordered pair of a symmetric (2, n) relation once, sorted."""
    once = pairs[:, pairs[0] < pairs[1]].T
    return once[np.lexsort(once.T[::-1])]
