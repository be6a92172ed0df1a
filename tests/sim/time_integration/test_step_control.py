"""The step control meets the times it is to stop at, and stalls only where steps fail."""

import numpy as np
import pytest

from sim.core import Floats, SimulationError
from sim.time_integration import ImplicitSolver, adapted
from tests.sim.time_integration.pulse import DURATION, pulsed


def steps(stops: list[float], tolerance: float = 1e-2) -> Floats:
    """Ends of the steps in shares of the duration, for stops in such shares."""
    rig, whole = pulsed(), np.array([0.0, DURATION])
    solver = ImplicitSolver(rig.topology, whole, whole[-1:])
    at = DURATION * np.array(stops)
    return adapted(solver, rig.values, rig.drive, tolerance, stops=at).times / DURATION


def test_stops_near_each_other_are_met_as_one() -> None:
    alone = steps([0.3, 0.7])
    assert {0.3, 0.7} <= set(alone.round(12))
    np.testing.assert_array_equal(steps([0.3, 0.7, 0.7 + 5e-10]), alone)
    np.testing.assert_array_equal(steps([5e-10, 0.3, 0.7, 1 - 5e-10]), alone)


def test_a_tolerance_that_no_step_meets_is_an_error() -> None:
    with pytest.raises(SimulationError, match="loosen the tolerance"):
        steps([0.5], tolerance=1e-300)
