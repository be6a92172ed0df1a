from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from sim import structure
from sim.constraints import ConstraintVector, Limits, margins
from sim.constraints.manufacturability import separation, void_angle
from sim.constraints.slot_walls import slot_pairs
from sim.core import Floats
from sim.optimise import SqpOptions, minimise
from tests.sim.structures import RING, central
from tests.tables import some

ROOM = structure.SlotRoom(grip=1.0, depth=5.0, width=0.45, wall=0.8, tip=0.1)
LIMITS = Limits(
    edge_length=5.0, block_angle=np.pi / 6, convex=True, void_angle=0.0, gap=0.2, slots=ROOM
)

LATTICE = structure.quads(5, 5, 15.0, 2.25, np.deg2rad(20))
SPACE = structure.design_space(LATTICE, RING, np.array([12]))
CONSTRAINTS = ConstraintVector(SPACE, LIMITS)


def random_design(size: float, seed: int = 0, space: structure.DesignSpace = SPACE) -> Floats:
    return np.random.default_rng(seed).uniform(-size, size, space.n_variables)


@pytest.mark.parametrize("symmetry", some(["C4", "none"], 1))
def test_jacobian_by_definition(symmetry: structure.Symmetry) -> None:
    space = structure.design_space(LATTICE, RING, np.array([12]), symmetry)
    constraints = ConstraintVector(space, replace(LIMITS, slots=None))
    design = random_design(0.8, space=space)

    def plain(x: jax.Array) -> jax.Array:
        vertices = space.vertices(x)
        measured = [jax.vmap(kind.measure)(vertices[kind.places]) for kind in constraints.kinds]
        parts = zip(constraints.kinds, measured, strict=True)
        return jnp.concatenate([kind.scale * kind.margins(values) for kind, values in parts])

    values, jacobian = constraints(design)
    np.testing.assert_allclose(values, plain(jnp.asarray(design)), atol=1e-12)
    np.testing.assert_allclose(jacobian.toarray(), jax.jit(jax.jacobian(plain))(design), atol=1e-12)


@pytest.mark.slow
def test_jacobian_by_difference() -> None:
    design, way = random_design(0.8), random_design(1.0, seed=1)
    slope = central(lambda step: CONSTRAINTS.values(design + step * way), 1e-6)
    np.testing.assert_allclose(CONSTRAINTS(design)[1] @ way, slope, atol=1e-7)


@pytest.mark.slow
def test_only_places_that_the_design_can_change_are_constrained() -> None:
    _, jacobian = CONSTRAINTS(random_design(0.5))
    free = np.isin(np.arange(LATTICE.n_vertices), SPACE.free_vertices)
    touched = free | free[LATTICE.next_vertex]
    assert len(CONSTRAINTS.kinds[0].places) == touched.sum() < LATTICE.n_vertices
    rows = np.asarray(abs(jacobian).sum(axis=1)).ravel()
    edges = slice(0, len(CONSTRAINTS.kinds[0].places))
    assert (rows[edges] > 0).all()


def test_every_corner_is_constrained_even_without_a_ligament() -> None:
    space = structure.design_space(LATTICE, np.array([0]))
    corners = ConstraintVector(space, Limits(block_angle=0.5)).kinds[0].places
    assert set(range(4)) <= set(corners[:, 1])


def block_angles(lattice: structure.Lattice, vertices: Floats) -> Floats:
    """Interior angle (n_vertices,) of each unit at each vertex, on [0, 2 pi), rad."""
    following, preceding = (
        (vertices[beside] - vertices) @ np.array([1.0, 1.0j])
        for beside in (lattice.next_vertex, lattice.previous_vertex)
    )
    return np.asarray(np.mod(np.angle(preceding / following), 2 * np.pi))


def test_margins_are_those_of_the_geometry_and_name_the_worst_unit() -> None:
    design = random_design(1.0)
    vertices = CONSTRAINTS.vertices(design)
    np.testing.assert_allclose(vertices, SPACE.vertices(jnp.asarray(design)), atol=1e-13)
    found = margins(LATTICE, vertices, LIMITS)
    edges = np.linalg.norm(vertices[LATTICE.next_vertex] - vertices, axis=1)
    assert tuple(found)[-4:] == ("gap", "slot_angle", "slot_wall", "slot_gap")
    first, second = LATTICE.unit[slot_pairs(LATTICE)[:, [1, 6]]].T
    np.testing.assert_array_equal(first, second)
    ends = np.bincount(LATTICE.ligament_units.ravel())
    np.testing.assert_array_equal(np.bincount(first), ends * (ends - 1) // 2)
    assert found["edge_length"].value == pytest.approx(edges.min() - 5)
    angles = block_angles(LATTICE, vertices)
    assert found["block_angle"].value == pytest.approx(angles.min() - np.pi / 6)
    assert found["convexity"].value == pytest.approx(np.pi - angles.max())
    assert found["void_angle"].value == pytest.approx(
        float(structure.void_angles(LATTICE, vertices).min())
    )
    assert found["gap"].value == pytest.approx(
        structure.smallest_gap(LATTICE, vertices).distance - 0.2
    )
    vertices = LATTICE.vertices.copy()
    unit = 3 + 5 * 2
    vertices[4 * unit] = vertices[4 * unit + 1] + [0.5, -0.5]
    worst = margins(LATTICE, vertices, Limits(edge_length=5.0))["edge_length"]
    assert worst.units == (unit,)
    assert worst.value == pytest.approx(np.hypot(0.5, 0.5) - 5.0)
    assert "unit (3, 2)" in worst.where


@pytest.mark.parametrize("degrees", [-40.0, -1.0, 0.0, 90.0, 179.0, 181.0, 269.0, 271.0, 300.0])
def test_void_angles_unwrap_from_minus_45_to_315_degrees(degrees: float) -> None:
    turn = np.deg2rad(degrees)
    sides = jnp.array([[0, 0], [1, 0], [3, 1], [3 + np.cos(turn), 1 + np.sin(turn)]])
    assert np.rad2deg(float(void_angle(sides))) == pytest.approx(degrees)
    slope = jax.grad(void_angle)(sides)
    assert np.isfinite(slope).all()


def test_block_and_void_angles_close_the_circle_for_any_design() -> None:
    vertices = CONSTRAINTS.vertices(random_design(2.0))
    around = structure.void_angles(LATTICE, vertices).sum(axis=1)
    blocks = block_angles(LATTICE, vertices)[LATTICE.ligaments].sum(axis=1)
    np.testing.assert_allclose(around + blocks, 2 * np.pi, atol=1e-12)


@pytest.mark.parametrize("gap", [None, 0.2])
def test_only_the_gap_keeps_diagonal_neighbours_apart(gap: float | None) -> None:
    """Two units pushed at one another across a void, all angles and lengths being respected."""
    lattice = structure.quads(4, 4, 15.0, 2.25, np.deg2rad(20))
    space = structure.design_space(lattice, np.array([5, 6, 9, 10]))
    limits = Limits(edge_length=3.0, block_angle=np.pi / 6, convex=True, void_angle=0.0, gap=gap)
    constraints = ConstraintVector(space, limits)
    rings = np.stack([np.arange(20, 24), np.arange(40, 44)])
    distance = jax.jit(jax.value_and_grad(lambda x: separation(space.vertices(x)[rings])))

    def push(x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        value, slope = distance(x)
        return float(value), np.asarray(slope), np.zeros(0)

    options = SqpOptions(evaluations=40, retreats=0, target=-0.5)
    found = minimise("sqp", push, constraints, np.zeros(space.n_variables), options=options)
    vertices = constraints.vertices(found.x)
    assert found.violation == 0.0
    assert min(margin.value for margin in margins(lattice, vertices, limits).values()) >= 0
    overlapping = structure.overlapping_pairs(lattice, vertices).tolist()
    if gap is None:
        assert [5, 10] in overlapping
        assert margins(lattice, vertices, LIMITS)["gap"].value < -0.2
    else:
        assert overlapping == []
        assert structure.smallest_gap(lattice, vertices).distance == pytest.approx(gap, abs=1e-2)


def convex_ring(seed: int, centre: tuple[float, float]) -> np.ndarray:
    """Four vertices on an ellipse: a convex quadrilateral, counter-clockwise."""
    random = np.random.default_rng(seed)
    angle = np.cumsum(random.uniform(0.3, 1.5, 4))
    axes = random.uniform(1.0, 4.0, 2)
    return np.stack([np.cos(angle), np.sin(angle)], axis=1) * axes + centre


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.floats(-12, 12), st.floats(-12, 12))
def test_separation_is_the_distance_of_convex_polygons(seed: int, x: float, y: float) -> None:
    one, other = convex_ring(seed, (0.0, 0.0)), convex_ring(seed + 1, (x, y))
    found = float(separation(jnp.asarray(np.stack([one, other]))))
    first, second = shapely.Polygon(one), shapely.Polygon(other)
    if shapely.area(shapely.intersection(first, second)) > 1e-9:
        assert found < 0
    else:
        assert found == pytest.approx(shapely.distance(first, second), abs=1e-9)


def test_separation_is_on_the_safe_side_and_ignores_padding() -> None:
    dart = np.array([[0.0, 0.0], [4.0, 0.0], [1.0, 1.0], [0.0, 4.0]])
    square = np.array([[2.0, 2.0], [3.0, 2.0], [3.0, 3.0], [2.0, 3.0]])
    true = shapely.distance(shapely.Polygon(dart), shapely.Polygon(square))
    assert float(separation(jnp.asarray(np.stack([dart, square])))) <= true
    one, other = convex_ring(3, (0.0, 0.0)), convex_ring(4, (9.0, 1.0))
    padded = np.stack([np.concatenate([ring, ring[-1:]]) for ring in (one, other)])
    plain = np.stack([one, other])
    assert separation(jnp.asarray(padded)) == pytest.approx(separation(jnp.asarray(plain)))
    assert np.isfinite(jax.grad(separation)(jnp.asarray(padded))).all()


def test_no_requirement_means_no_constraint() -> None:
    values, jacobian = ConstraintVector(SPACE, Limits())(np.zeros(SPACE.n_variables))
    assert values.shape == (0,)
    assert jacobian.shape == (0, SPACE.n_variables)
