import logging
import re

import numpy as np
import pytest

import sim
from sim.core import Floats
from sim.optimise import InfeasibleStartError, feasible_design, minimise
from tests.sim.structures import pressed


def test_a_projection_that_leads_nowhere_is_given_up() -> None:
    """A margin that no step raises, whatever its slope promises."""
    asked: list[float] = []

    def constrain(x: Floats) -> tuple[Floats, Floats]:
        asked.append(float(x[0]))
        return np.array([-1.0]), np.ones((1, len(x)))

    assert feasible_design(constrain, np.zeros(2), 1.0, 50) is None
    assert len(asked) == 4


def test_what_comes_in_sight_on_the_way_has_rounds_of_its_own() -> None:
    """As the second snap of a path, far from its limit, once the first one is none any more."""

    def constrain(x: Floats) -> tuple[Floats, Floats]:
        first, ahead = x[0] - 0.5, 1.0 - x[1]
        known = first >= 0.0
        second = 100.0 * (1e-3 - ahead**2) if known else np.inf
        return np.array([first, second]), np.diag([1.0, 200.0 * ahead * known])

    found = feasible_design(constrain, np.zeros(2), 1.0, 20)
    assert found is not None
    assert found == pytest.approx([0.5, 1.0 - np.sqrt(1e-3)], abs=1e-4)


def test_a_design_outside_is_moved_to_the_nearest_one_inside() -> None:
    def outside_of_a_circle(x: Floats) -> tuple[Floats, Floats]:
        return np.array([x @ x - 4.0]), 2.0 * x[None]

    found = feasible_design(outside_of_a_circle, np.array([1.14, 1.52]), 1.0, 20)
    assert found is not None
    np.testing.assert_allclose(found, [1.2, 1.6], atol=5e-3)


def test_a_start_is_told_where_its_bounds_put_it() -> None:
    def constrain(x: Floats) -> tuple[Floats, Floats]:
        return x - 5.0, np.ones((1, 1))

    def loss(x: Floats) -> tuple[float, Floats, Floats]:
        return float(x[0]), np.ones(1), np.zeros(0)

    with pytest.raises(InfeasibleStartError, match="constraint 0 by 4"):
        minimise("sqp", loss, constrain, np.array([6.0]), (0.0, 1.0))


@pytest.mark.parametrize(("void_angle", "moved"), [(0.5, False), (0.9, True)])
def test_how_far_a_start_is_moved_is_logged(
    void_angle: float, moved: bool, caplog: pytest.LogCaptureFixture
) -> None:
    limits, options = sim.Limits(void_angle=void_angle), sim.SqpOptions(evaluations=1, retreats=0)
    with caplog.at_level(logging.INFO, logger="sim.optimise"):
        sim.minimise(pressed(1.0, steps=1), limits, options=options)
    found = [line for line in caplog.messages if line.startswith("the start misses void_angle (")]
    assert len(found) == moved
    assert all(
        re.search(r"unit \[1, 0\]\) by 0.137: moved by up to 0.3\d* mm", line) for line in found
    )
