"""Large lattices: the end of a compression past a snap, whatever the loads."""

import numpy as np

from sim.quasistatics import StaticSolver
from sim.solvers import LinearRamp
from sim.structure import quads
from tests.sim.structures import Rig

SIDE = 160


def test_the_end_past_a_snap_does_not_depend_on_the_loads() -> None:
    """Beyond its limit point this lattice creeps, and mirrored columns are critical at once."""
    left = SIDE * np.arange(SIDE)
    lattice = quads(SIDE, SIDE, 15.0, 2.3, np.deg2rad(20.0))
    rig = Rig(lattice, left, left + SIDE - 1, LinearRamp(-0.1 * SIDE * 15.0, 1.0))
    once, often = (
        StaticSolver(rig.topology, np.arange(1, count + 1) / count).forward(rig.values, rig.drive)
        for count in (1, 10)
    )
    np.testing.assert_allclose(once[2].snaps, often[2].snaps, rtol=0, atol=1e-6)
    assert len(once[2].snaps) == 1
    # what the residual's tolerance leaves open, over the smallest eigenvalue of 2e-4 N/mm
    np.testing.assert_allclose(once[0][-1], often[0][-1], rtol=0, atol=2e-4)
