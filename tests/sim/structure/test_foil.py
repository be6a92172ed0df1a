"""Strips of foil between rigid ends, against the elastica and against cubic beams."""

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from sim.structure import Foil, face_strains

LENGTH = 2.25
FOIL = Foil(young_modulus=4500.0, thickness=0.125, width=8.1)


def elastica(first: float, second: float) -> tuple[float, float, float]:
    """Solves t'' = V cos t of an inextensible strip whose ends hold angles against their chord.

    Returns the moments t' at both ends and the lateral force V, with EI and the length 1; no force
    acts along the chord.
    """

    def slopes(s: np.ndarray, y: np.ndarray, force: np.ndarray) -> np.ndarray:
        del s
        return np.stack([y[1], force[0] * np.cos(y[0]), np.sin(y[0])])

    def ends(a: np.ndarray, b: np.ndarray, force: np.ndarray) -> np.ndarray:
        del force
        return np.array([a[0] - first, b[0] - second, a[2], b[2]])

    s = np.linspace(0.0, 1.0, 41)
    guess = np.stack([first + (second - first) * s, np.full_like(s, second - first), 0.0 * s])
    found = solve_bvp(slopes, ends, s, guess, p=np.zeros(1), tol=1e-8)
    assert found.success
    return found.y[1, 0], found.y[1, -1], found.p[0]


@pytest.mark.parametrize("angle", [0.01, 0.3])
def test_stiffness_is_that_of_the_elastica(angle: float) -> None:
    """A relative turn of the ends, and a shear angle; large ones add their square."""
    rigidity = FOIL.young_modulus * FOIL.width * FOIL.thickness**3 / 12  # E I
    _, shear, bending = FOIL.stiffness(LENGTH)
    moments = rigidity / LENGTH * np.array(elastica(-angle / 2, angle / 2)[:2])
    np.testing.assert_allclose(moments, bending * angle, rtol=1e-6)
    lateral = rigidity / LENGTH**2 * abs(elastica(angle, angle)[2])
    np.testing.assert_allclose(lateral, shear * LENGTH * angle, rtol=angle**2 + 1e-4)


def test_the_papers_bending_stiffness_is_that_of_a_tenth_of_a_millimetre() -> None:
    """1.5 N mm/rad; a quarter of a millimetre of polyester would be 14 times as stiff."""
    assert FOIL._replace(thickness=0.10357).stiffness(LENGTH)[2] == pytest.approx(1.5, rel=2e-3)
    assert FOIL._replace(thickness=0.25).stiffness(LENGTH)[2] == pytest.approx(21.1, rel=2e-3)


def test_strains_of_a_strip_are_those_of_a_bent_beam() -> None:
    """Ends turned by a and b against the chord: moments 2EI/l (2a + b) and 2EI/l (a + 2b)."""
    _, shearing, bending = FOIL.stiffness(LENGTH)
    for a, b in ((0.3, 0.1), (-0.2, 0.25), (0.1, 0.1), (-0.2, 0.2)):
        curvature = 2 / LENGTH * max(abs(2 * a + b), abs(a + 2 * b))
        given = (0.01 * LENGTH, -(a + b) / 2, b - a)
        strains = face_strains(given, (shearing, bending), LENGTH, FOIL.thickness)
        assert max(map(abs, strains)) == pytest.approx(0.01 + curvature * FOIL.thickness / 2)
    # the moments at its ends are those that balance the shear force
    shearing, bending, angle = 1.19, 1.5, 0.3
    moment = shearing * LENGTH * angle * LENGTH / 2
    strains = face_strains((0.0, angle, 0.0), (shearing, bending), LENGTH, FOIL.thickness)
    curvature = moment / (bending * LENGTH)
    assert max(map(abs, strains)) == pytest.approx(curvature * FOIL.thickness / 2)
