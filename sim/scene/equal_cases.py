"""Finds load cases that a quarter turn of the structure makes equal, so that one is solved."""

from dataclasses import dataclass

import numpy as np

from sim.core import Floats, Ints
from sim.scene.scene import DIRECTED, Scene
from sim.solvers import PrescribedMotion
from sim.structure import ConcreteParameters, Lattice

QUARTER_TURN = np.array([[0.0, -1.0], [1.0, 0.0]])
SITE_TOLERANCE = 1e-6
"""Distance of a lattice point from the image of another, over the spacing."""
VERTEX_TOLERANCE = 1e-9
"""Distance of a vertex from the image of another, mm."""
SAME = 1e-9
"""Relative difference of equal constants, and of equal directions in rad."""


@dataclass(frozen=True)
class NetworkImage:
    """Holds where a quarter turn about the middle takes each part of a network."""

    unit: Ints  # (n_units,) the image of each unit
    ligament: Ints  # (n_ligaments,) the image of each ligament
    reversed: Ints  # (n_ligaments,) -1 where the image runs the other way, else 1


def equal_cases(scene: Scene, vertices: Floats, values: ConcreteParameters) -> Ints:
    """Finds the first load case (n_cases,) whose loss each load case has.

    A case is a turned copy of another if a quarter turn, or several, takes its driven units and the
    direction of their motion to the other's, and leaves all else alone: polygons, ligaments and
    their stiffness, mass, damping, supports, and the region of the loss. `vertices` (n_vertices, 2)
    are the structure's, mm.
    """
    loads = scene.loads
    every = np.arange(len(loads.cases))
    directed = all(
        isinstance(case.motion, DIRECTED) and case.control is None for case in loads.cases
    )
    if len(every) == 1 or not directed or scene.objective.reference is not None:
        return every
    image = quarter_turn(scene.lattice, vertices)
    clamped = np.unique(loads.clamped // 3)
    if image is None or 3 * len(clamped) != len(loads.clamped):
        return every
    sets = (clamped, loads.driven, scene.objective.region)
    kept = all(np.array_equal(np.sort(image.unit[one]), np.sort(one)) for one in sets)
    if not (kept and _have_same_constants(image, values)):
        return every
    first = every.copy()
    for case in every:
        earlier = (k for k in every[:case] if _is_turned(loads.cases[k], loads.cases[case], image))
        first[case] = next(earlier, case)
    return first


def quarter_turn(lattice: Lattice, vertices: Floats) -> NetworkImage | None:
    """Finds the image of a network under a quarter turn about its middle; None if it changes.

    `vertices` (n_vertices, 2) are the structure's, mm.
    """
    from scipy.spatial import KDTree

    middle = (lattice.site.min(axis=0) + lattice.site.max(axis=0)) / 2

    def images(points: Floats, tolerance: float) -> Ints | None:
        apart, image = KDTree(points).query((points - middle) @ QUARTER_TURN.T + middle)
        within = apart.max() <= tolerance and len(np.unique(image)) == len(points)
        return np.asarray(image) if within else None

    unit = images(lattice.site, SITE_TOLERANCE * lattice.spacing)
    vertex = images(vertices, VERTEX_TOLERANCE)
    if unit is None or vertex is None or (lattice.unit[vertex] != unit[lattice.unit]).any():
        return None
    ends = vertex[lattice.ligaments]
    ligament = _match_rows(np.sort(ends, axis=1), np.sort(lattice.ligaments, axis=1))
    if ligament is None:
        return None
    same_way = (ends == lattice.ligaments[ligament]).all(axis=1)
    return NetworkImage(unit, ligament, np.where(same_way, 1, -1))


def _match_rows(rows: Ints, among: Ints) -> Ints | None:
    """Finds the place (n,) of each row (n, 2) among others, each once; None if they differ."""
    order, wanted = np.lexsort(among.T), np.lexsort(rows.T)
    if len(np.unique(among, axis=0)) < len(among) or (among[order] != rows[wanted]).any():
        return None
    place = np.empty_like(order)
    place[wanted] = order
    return place


def _have_same_constants(image: NetworkImage, values: ConcreteParameters) -> bool:
    """Checks that what a turn takes to one another has the same constants."""
    turned = values.vector @ QUARTER_TURN.T * image.reversed[:, None]
    pairs = (
        (values.law[image.ligament], values.law),
        (values.contact[image.ligament], values.contact),
        (values.mass[image.unit], values.mass),
        (values.damping[image.unit], values.damping),
    )
    # stretch and shear of a ligament are the same from either end, its bend is the opposite
    ones = np.ones_like(image.reversed)
    natural = values.natural * np.stack([ones, ones, image.reversed], axis=1)
    lengths = (
        (values.vector[image.ligament], turned),
        (values.natural[image.ligament], natural),
    )
    return all(
        np.allclose(one, other, rtol=0, atol=VERTEX_TOLERANCE) for one, other in lengths
    ) and all(np.allclose(one, other, rtol=SAME, atol=0) for one, other in pairs)


def _is_turned(one: PrescribedMotion, other: PrescribedMotion, image: NetworkImage) -> bool:
    """Checks if some quarter turns take a load case to another."""
    a, b = one.motion, other.motion
    assert isinstance(a, DIRECTED)
    assert isinstance(b, DIRECTED)
    if type(a) is not type(b) or a._replace(direction=0.0) != b._replace(direction=0.0):
        return False
    units = np.sort(one.units)
    for turns in range(4):
        off = float(b.direction) - float(a.direction) - turns * np.pi / 2
        aligned = abs(np.remainder(off + np.pi, 2 * np.pi) - np.pi) < SAME
        if aligned and np.array_equal(units, np.sort(other.units)):
            return True
        units = np.sort(image.unit[units])
    return False
