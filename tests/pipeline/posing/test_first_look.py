import numpy as np
import pytest

from pipeline.posing import compliance_shares
from sim.structure import Material, quads

MATERIAL = Material(6e-9, 120.0, 1.2, 1.5, 1.5, 0.0, 0.0)
MODULUS, THICKNESS = 2000.0, 8.0


def share(half_length: float, half_width: float) -> float:
    """Share of the middle unit of three by three squares that is a rhombus instead."""
    lattice = quads(3, 3, 15.0, 2.25, np.deg2rad(20.0))
    vertices = np.array(lattice.vertices)
    reach = np.array([[half_length, 0], [0, half_width], [-half_length, 0], [0, -half_width]])
    vertices[16:20] = lattice.site[4] + reach
    return float(compliance_shares(lattice, vertices, MATERIAL, MODULUS, THICKNESS)[4])


@pytest.mark.parametrize(("half_length", "half_width"), [(6.0, 5.0), (8.0, 1.0), (9.0, 0.3)])
def test_a_rhombus_by_hand(half_length: float, half_width: float) -> None:
    a, b = half_length, half_width
    # w = 4 b x of the nearer end at 2 a x, from 0.08 to the middle
    along = 2 * a / (4 * b) * 2 * np.log(0.5 / 0.08) / (MODULUS * THICKNESS)
    across = 12 * a**2 / (16 * b**2) * along
    bend = 12 * 2 * a / (64 * b**3) * (0.08**-2 - 0.5**-2) / (MODULUS * THICKNESS)
    found = share(a, b)
    expected = max(120.0 * along / 2, 120.0 * across / 1.5, 1.5 * bend / 2)
    assert found == pytest.approx(expected, rel=0.05)
