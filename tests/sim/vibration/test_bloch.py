import numpy as np
import pytest

from benchmarks.scenes import BARRIER, CUTOFF
from sim.core import Floats, SimulationError
from sim.structure import Lattice, VoidAngleContact, kagome
from sim.vibration import UnitCell, bands, brillouin_path, cell_of, strained
from tests.sim.structures import at_rest, rotating_squares
from tests.tables import some

NO_LOOSE = np.zeros((2, 2))


def made(lattice: Lattice, period: tuple[int, int]) -> UnitCell:
    return cell_of(lattice, VoidAngleContact(BARRIER, CUTOFF), at_rest(lattice), period)


LATTICES = [(rotating_squares(8), (2, 2)), (kagome(8, 8, 15.0, 1.5, 1.0), (4, 2))]


@pytest.mark.parametrize(("lattice", "period"), some(LATTICES[::-1], 1), ids=["kagome", "quads"])
def test_a_larger_cell_only_folds_the_bands(lattice: Lattice, period: tuple[int, int]) -> None:
    small, large = made(lattice, period), made(lattice, (2 * period[0], 2 * period[1]))
    one, other = np.pi * np.linalg.inv(small.period).T
    folded = np.array([a * one + b * other for a in (0, 1) for b in (0, 1)])
    expected = np.sort(bands(small, folded).ravel())
    found = bands(large, np.zeros((1, 2)))[0]
    assert found == pytest.approx(expected, rel=1e-8, abs=1e-8 * expected[-1])


def test_a_kagome_lattice_is_told_its_period() -> None:
    """Its cell of two triangles takes two columns, and its bias repeats after two cells."""
    with pytest.raises(ValueError, match=r"after \(2, 2\) .* after \(4, 2\): give period=\(4, 2\)"):
        made(kagome(8, 8, 15.0, 1.5, 1.0), (2, 2))


def test_a_period_of_no_steps_is_refused() -> None:
    with pytest.raises(ValueError, match="one or more each way"):
        made(rotating_squares(8), (0, 2))


def test_two_branches_are_sound(cell: UnitCell) -> None:
    """Two of the bands go to zero with the wave number, in proportion to it."""
    along = np.array([1.0, 0.0])
    near, half = bands(cell, np.array([1e-4 * along, 5e-5 * along]))
    assert np.sqrt(near[:2] / half[:2]) == pytest.approx(2.0, rel=1e-3)
    assert near[2] > 100 * near[1]


@pytest.fixture(scope="module")
def cell() -> UnitCell:
    return made(rotating_squares(6), (2, 2))


@pytest.mark.slow
def test_strain_changes_the_bands_and_keeps_them_real(cell: UnitCell) -> None:
    squeezed = np.diag([-0.03, 0.0])
    relieved = np.diag([0.0, 1.0])
    found = strained(cell, squeezed, relieved)
    assert found.gradient[0, 0] == -0.03
    assert found.gradient[1, 1] < -0.01  # rotating squares draw in
    waves, _ = brillouin_path(cell, 4)
    rest, under = bands(cell, waves), bands(cell, waves, found)
    assert under.min() > -1e-6 * under.max()
    assert np.abs(under[1:-1] / rest[1:-1] - 1).max() > 0.05
    for beyond in (-0.3, -0.6):
        with pytest.raises(SimulationError, match=r"no (stable )?equilibrium beyond"):
            strained(cell, np.diag([beyond, beyond]), NO_LOOSE)
    with pytest.raises(SimulationError, match="change its length"):
        strained(cell, np.diag([0.3, 0.0]), np.diag([0.0, 1.0]))


@pytest.mark.parametrize("angle", [60.0, 75.0, 90.0, 120.0, 140.0])
def test_the_corner_of_the_zone_is_as_near_to_three_wave_vectors(angle: float) -> None:
    """As far from the origin as from two neighbours, and from none nearer: Wigner and Seitz's."""
    period = 30.0 * np.array([[1.0, 0.0], [np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))]])
    cell = made(*LATTICES[0])._replace(period=period)
    waves, marks = brillouin_path(cell, 3)
    grid = np.array([(a, b) for a in range(-3, 4) for b in range(-3, 4)])
    others = grid @ (2 * np.pi * np.linalg.inv(period).T)
    side, corner = (np.sort(np.linalg.norm(others - waves[marks[at]], axis=1)) for at in (1, 2))
    assert side[0] == pytest.approx(side[1]) == pytest.approx(np.linalg.norm(waves[marks[1]]))
    assert corner[0] == pytest.approx(corner[2]) == pytest.approx(np.linalg.norm(waves[marks[2]]))


def test_a_lattice_that_does_not_repeat_has_no_cell() -> None:
    uneven = rotating_squares(6)
    corners: Floats = uneven.vertices.copy()
    corners[5] += 0.1
    with pytest.raises(ValueError, match="does not repeat"):
        made(Lattice(**{**vars(uneven), "vertices": corners}), (2, 2))
    with pytest.raises(ValueError, match="beyond one unit cell"):
        made(rotating_squares(2), (2, 2))
