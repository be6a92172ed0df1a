from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely import Polygon
from shapely.affinity import rotate

from sim.core import Floats
from sim.structure import Lattice, displaced, void_angles
from sim.structure.geometry import inertia
from tests.sim.structures import hand_made, mixed_polygons, rotating_squares


def perturbed(lattice: Lattice, size: float = 0.8) -> Floats:
    rng = np.random.default_rng(3)
    return lattice.vertices + rng.uniform(-size, size, (lattice.n_groups, 2))[lattice.group]


def test_inertia_is_that_of_the_polygons() -> None:
    lattice = mixed_polygons()
    vertices = perturbed(lattice)
    centroid, area, polar = (np.asarray(part) for part in inertia(lattice, vertices))
    for unit in range(lattice.n_units):
        polygon = Polygon(vertices[lattice.unit == unit])
        assert area[unit] == pytest.approx(polygon.area, rel=1e-12)
        np.testing.assert_allclose(centroid[unit], polygon.centroid.coords[0], atol=1e-11)
        assert polar[unit] == pytest.approx(polar_by_triangles(polygon), rel=1e-10)


def polar_by_triangles(polygon: Polygon) -> float:
    """Second moment about the centroid: exact quadrature on the fan of triangles about a vertex."""
    ring = np.array(polygon.exterior.coords)[:-1] - polygon.centroid.coords[0]
    total = 0.0
    for one, two in pairwise(ring[1:]):
        area = 0.5 * np.linalg.det([one - ring[0], two - ring[0]])
        middles = [(ring[0] + one) / 2, (one + two) / 2, (two + ring[0]) / 2]
        total += area * np.mean([m @ m for m in middles])
    return float(total)


def test_inertia_does_not_depend_on_where_the_unit_lies() -> None:
    """Cancellation far from the origin would show in the polar moment first."""
    lattice = rotating_squares(9)
    _, area, polar = (np.asarray(part) for part in inertia(lattice, lattice.vertices))
    np.testing.assert_allclose(area, area[0], rtol=1e-12)
    np.testing.assert_allclose(polar, polar[0], rtol=1e-12)


@pytest.mark.parametrize(
    "lattice", [rotating_squares(), mixed_polygons()], ids=["squares", "mixed"]
)
def test_void_angles_follow_the_rotations_exactly(lattice: Lattice) -> None:
    vertices = perturbed(lattice)
    motion = np.random.default_rng(1).normal(size=(lattice.n_units, 3)) * [2.0, 2.0, 0.1]
    before = np.asarray(void_angles(lattice, vertices))
    after = np.asarray(void_angles(lattice, displaced(lattice, vertices, motion)))
    a, b = lattice.ligament_units.T
    turn = motion[a, 2] - motion[b, 2]
    change = after - before - np.stack([turn, -turn], axis=1)
    np.testing.assert_allclose(np.mod(change + 1.0, 2 * np.pi), 1.0, atol=1e-12)


def test_void_angles_of_rotating_squares() -> None:
    lattice = rotating_squares(3, bias_deg=20.0)
    angles = np.rad2deg(void_angles(lattice, lattice.vertices))
    np.testing.assert_allclose(np.sort(angles, axis=1), np.tile([50.0, 130.0], (12, 1)), atol=1e-9)


def slender(degrees: float) -> Lattice:
    """Two needles side by side, joined at their tips, whose other void is wide."""
    half = np.deg2rad(degrees) / 2
    long, broad = 10.0 * np.cos(half), 10.0 * np.sin(half)
    needle = np.array([[0.0, 0.0], [long, -broad], [long, broad]])
    c, s = np.cos(0.1), np.sin(0.1)
    turns = np.array([[[c, -s], [s, c]], [[c, s], [-s, c]]])
    return hand_made([needle @ turns[0], needle @ turns[1] + [0.0, 0.5]], np.array([[0, 3]]))


def test_a_void_between_slender_units_reaches_beyond_315_degrees() -> None:
    """Voids and corners at a ligament go once round; a narrow void may overlap all the same."""
    for degrees in (2.0, 12.0):
        lattice = slender(degrees)
        narrow, wide = np.sort(np.rad2deg(void_angles(lattice, lattice.vertices))[0])
        between = np.rad2deg(0.2)
        assert (narrow, wide) == pytest.approx((between - degrees, 360 - between - degrees))


@given(turn=st.floats(-90.0, 90.0))
def test_void_angles_are_unwrapped_from_minus_45_to_315_degrees(turn: float) -> None:
    """Two squares at one ligament; the second turns about its end of it."""
    lattice = rotating_squares(2, bias_deg=0.0)
    second = lattice.ligaments[0, 1]
    unit = lattice.unit == lattice.unit[second]
    corner = lattice.vertices[second]
    angle = 2.0 * turn if turn > 0 else turn
    polygon = rotate(Polygon(lattice.vertices[unit]), angle, origin=tuple(corner))
    vertices = lattice.vertices.copy()
    vertices[unit] = np.array(polygon.exterior.coords)[:-1]
    found = np.rad2deg(np.asarray(void_angles(lattice, vertices))[0])
    assert ((found >= -45 - 1e-9) & (found < 315 + 1e-9)).all()
    wanted = np.array([90.0 - angle, 90.0 + angle])
    np.testing.assert_allclose(np.mod(found - wanted + 180, 360), 180, atol=1e-6)
    if abs(angle) < 135:
        np.testing.assert_allclose(found, wanted, atol=1e-6)
