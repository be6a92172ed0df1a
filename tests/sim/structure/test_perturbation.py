import numpy as np
import pytest
import shapely

from sim import structure
from sim.structure.gaps import polygons
from sim.structure.perturbation import clashing_units
from tests.tables import cases

LATTICE = structure.quads(5, 4, 15.0, 2.25, np.deg2rad(20.0))
CUTOFF = np.deg2rad(-10.0)
CONTACT = structure.VoidAngleContact(np.deg2rad(-15.0), CUTOFF)
PLAIN = structure.Material(1.0, 120.0, 1.19, 1.5, 1.5, 0.1, 0.2)


def drawn(
    seed: int, vertices: np.ndarray = LATTICE.vertices, **sizes: float | tuple[float, float]
) -> structure.PerturbedStructure:
    given = structure.Perturbation(**sizes)  # type: ignore[arg-type]
    return structure.perturbed(LATTICE, vertices, PLAIN, given, CONTACT, (seed,))


def draw(largest: float, seed: int = 0) -> np.ndarray:
    copy = drawn(seed, geometry=largest)
    assert copy.sound
    return copy.vertices - LATTICE.vertices


def test_shifts_are_evenly_spread_and_keep_the_ligaments() -> None:
    shifts = np.stack([draw(0.45, seed) for seed in range(40)])
    assert np.abs(shifts).max() <= 0.45
    assert np.abs(shifts).max() > 0.449
    assert abs(shifts.mean()) < 0.01
    assert shifts.std() == pytest.approx(0.45 / np.sqrt(3), rel=0.02)
    ends = shifts[:, LATTICE.ligaments]
    np.testing.assert_allclose(ends[:, :, 0], ends[:, :, 1], atol=1e-12)
    np.testing.assert_array_equal(draw(0.45, 7), draw(0.45, 7))
    assert np.abs(draw(0.45, 7) - draw(0.45, 8)).max() > 0.1


def test_what_clashes_is_drawn_again_as_long_as_there_is_room() -> None:
    found = [drawn(seed, geometry=4.0) for seed in range(10)]
    assert any(copy.clashes for copy in found)
    for copy in found:
        assert copy.sound
        assert (copy.redrawn > 0) == (copy.clashes > 0)
        assert len(structure.overlapping_pairs(LATTICE, copy.vertices)) == 0
        assert np.asarray(structure.void_angles(LATTICE, copy.vertices)).min() > CUTOFF
        rings = copy.vertices.reshape(-1, 4, 2)
        assert all(shapely.Polygon(ring).is_valid for ring in rings)
    squeezed = LATTICE.vertices.copy()
    squeezed[:4] += [12.0, 0.0]  # the first unit lies on its neighbour
    copy = drawn(0, squeezed, geometry=1e-3)
    assert not copy.sound
    assert set(clashing_units(LATTICE, squeezed, CONTACT)) >= {0, 1}


def test_units_are_assembled_whole() -> None:
    made = drawn(3, assembly=(0.2, np.deg2rad(1.0)))
    assert made.sound
    before, after = (polygons(LATTICE, each) for each in (LATTICE.vertices, made.vertices))
    np.testing.assert_allclose(shapely.area(after), shapely.area(before), rtol=1e-12)
    apart = shapely.distance(shapely.centroid(before), shapely.centroid(after))
    assert 0.15 < apart.mean() < 0.35
    for corners, moved in zip(before, after, strict=True):
        shapes = [shapely.get_coordinates(each) for each in (corners, moved)]
        was, now = (np.linalg.norm(np.diff(each, axis=0), axis=1) for each in shapes)
        np.testing.assert_allclose(now, was, rtol=1e-12)


def test_every_ligament_gets_stiffnesses_of_its_own() -> None:
    made = [drawn(seed, ligaments=0.1).material for seed in range(700)]
    names = ("axial_stiffness", "shear_stiffness", "bending_stiffness")
    ratios = [
        np.ravel([getattr(each, name) / getattr(PLAIN, name) for each in made]) for name in names
    ]
    for factor in ratios:
        assert factor.std() == pytest.approx(0.1, rel=0.03)
        assert factor.mean() == pytest.approx(1.0, abs=0.003)
        assert factor.min() >= 0.7 - 1e-12
    assert np.corrcoef(ratios[0], ratios[1])[0, 1] < 0.02
    assert (made[0].density, made[0].contact_stiffness) == (1.0, 1.5)
    np.testing.assert_array_equal(made[0].damping_rotation, 0.2)


@cases("sim", "kind, name, count")
def test_other_constants_vary_together_or_by_unit(kind: str, name: str, count: int) -> None:
    made = drawn(0, **{kind: 0.1}).material  # type: ignore[arg-type]
    assert len(np.unique(getattr(made, name))) == count
    assert (getattr(made, name) != getattr(PLAIN, name)).all()
