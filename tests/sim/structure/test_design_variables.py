import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.core import Floats, Ints
from sim.structure import Symmetry, design_space, quads
from tests.sim.structures import RING, mixed_polygons, rotating_squares

MIDDLE = np.array([12])
OPERATION: dict[Symmetry, Floats] = {
    "C4": np.array([[0.0, -1.0], [1.0, 0.0]]),
    "mirror_x": np.diag([-1.0, 1.0]),
    "mirror_y": np.diag([1.0, -1.0]),
}


def random_design(n: int, seed: int = 0) -> Floats:
    return np.random.default_rng(seed).uniform(-1, 1, n)


def test_zero_design_is_the_lattice_itself() -> None:
    lattice = rotating_squares()
    space = design_space(lattice, RING, MIDDLE)
    np.testing.assert_array_equal(space.vertices(jnp.zeros(space.n_variables)), lattice.vertices)


@pytest.mark.parametrize("more", [-1, 1])
def test_a_design_of_another_scene_is_refused(more: int) -> None:
    space = design_space(rotating_squares(), RING, MIDDLE)
    with pytest.raises(ValueError, match=f"where .{space.n_variables},. is wanted"):
        space.vertices(np.zeros(space.n_variables + more))


@given(seed=st.integers(0, 10_000))
@settings(max_examples=20)
def test_no_design_changes_a_ligament_or_a_frozen_unit(seed: int) -> None:
    lattice = rotating_squares()
    space = design_space(lattice, RING, MIDDLE)
    vertices = np.asarray(space.vertices(random_design(space.n_variables, seed)))
    ends = vertices[lattice.ligaments]
    np.testing.assert_allclose(ends[:, 1] - ends[:, 0], lattice.ligament_vectors, atol=1e-12)
    np.testing.assert_array_equal(vertices[48:52], lattice.vertices[48:52])


def test_variables_are_shifts_of_the_cloaks_vertices() -> None:
    lattice = rotating_squares()
    space = design_space(lattice, RING, MIDDLE)
    moved = np.asarray(space.vertices(np.ones(space.n_variables))) - lattice.vertices
    touched = np.flatnonzero(np.abs(moved).max(axis=1) > 0)
    np.testing.assert_array_equal(touched, space.free_vertices)
    assert np.isin(lattice.unit[touched], RING).sum() == 4 * len(RING) - 4
    np.testing.assert_array_equal(moved[touched], 1.0)
    lattice = mixed_polygons()
    space = design_space(lattice, np.arange(lattice.n_units))
    shift = np.arange(2 * lattice.n_groups, dtype=float)
    moved = np.asarray(space.vertices(shift)) - lattice.vertices
    np.testing.assert_allclose(moved, shift.reshape(-1, 2)[lattice.group], atol=1e-12)


@pytest.mark.parametrize("symmetry", OPERATION)
def test_symmetric_designs_map_onto_themselves(symmetry: Symmetry) -> None:
    lattice = rotating_squares(bias_deg=20.0 if symmetry == "C4" else 0.0)
    space = design_space(lattice, RING, MIDDLE, symmetry)
    vertices = np.asarray(space.vertices(random_design(space.n_variables)))
    assert same_set(vertices, turned(vertices, OPERATION[symmetry]))
    assert np.abs(vertices - lattice.vertices).max() > 0.1
    if symmetry == "C4":
        assert space.n_variables == design_space(lattice, RING, MIDDLE).n_variables // 4


def turned(vertices: Floats, operation: Floats) -> Floats:
    middle = np.array([30.0, 30.0])
    return (vertices - middle) @ operation.T + middle


def same_set(one: Floats, other: Floats) -> bool:
    apart = np.linalg.norm(one[:, None] - other[None], axis=2)
    return bool(apart.min(axis=0).max() < 1e-9 and apart.min(axis=1).max() < 1e-9)


@pytest.mark.parametrize("symmetry", ["none", "mirror_x"])
def test_memory_grows_as_the_cloak_does(symmetry: Symmetry) -> None:
    lattice = quads(60, 60, 15.0, 3.0, np.deg2rad(25.0))
    space = design_space(lattice, np.arange(lattice.n_units), symmetry=symmetry)
    assert 10_000 < space.basis.nnz <= space.basis.shape[0]


def test_project_inverts_a_symmetric_design() -> None:
    lattice = rotating_squares()
    space = design_space(lattice, RING, MIDDLE, "C4")
    design = random_design(space.n_variables)
    shifts = np.zeros((lattice.n_groups, 2))
    shifts[lattice.group] = np.asarray(space.vertices(design)) - lattice.vertices
    np.testing.assert_allclose(space.project(shifts), design, atol=1e-12)


@pytest.mark.parametrize(
    ("cloak", "symmetry"),
    [(RING, "mirror_x"), (RING[:-1], "C4")],
    ids=["turned squares have no mirror", "cloak without its copy"],
)
def test_a_symmetry_that_is_not_there_is_refused(cloak: Ints, symmetry: Symmetry) -> None:
    with pytest.raises(ValueError, match="symmetry"):
        design_space(rotating_squares(), cloak, MIDDLE, symmetry)
