"""Designs that keep away from snaps."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from benchmarks.scenes import MATERIAL
from sim.constraints import ConstraintVector, Limits
from sim.core import Floats, SimulationError
from sim.optimise import SqpOptions
from sim.scene import (
    Clamp,
    Design,
    Loads,
    Objective,
    Scene,
    SnapMargin,
    Structure,
    make_plan,
    minimise,
    simulate,
)
from sim.solvers import LinearRamp, PrescribedMotion
from tests.sim.structures import rotating_squares

LIMITS = Limits(edge_length=3.0, block_angle=float(np.deg2rad(30.0)), void_angle=0.0)


@cache
def scene(share: float | None) -> Scene:
    """5 x 5 squares pushed together over four loads; the middle is to stay where it is."""
    left = 5 * np.arange(5)
    drive = PrescribedMotion(left + 4, LinearRamp(-9.0, 1.0))
    around = np.array([6, 7, 8, 11, 13, 16, 17, 18])
    return Scene(
        Structure(rotating_squares(5), MATERIAL),
        Loads((drive,), (Clamp(left),), static=True),
        Objective(region=np.array([12]), steps=4, snap_margin=share),
        Design(cloak=around),
    )


def margins(posed: Scene) -> SnapMargin:
    return SnapMargin(posed, make_plan(posed), ConstraintVector(posed.space, Limits()))


def test_the_slope_of_the_margins_is_theirs() -> None:
    """The remainder of a Taylor expansion falls with the second power of the step."""
    posed = scene(0.05)
    constraint, rng = margins(posed), np.random.default_rng(3)
    design = rng.uniform(-0.5, 0.5, posed.space.n_variables)
    way = rng.normal(size=len(design))
    way /= np.linalg.norm(way)
    values, jacobian = constraint(design)
    steps = np.geomspace(1e-1, 1e-3, 5)

    def remainder(step: float) -> Floats:
        return constraint(design + step * way)[0] - values - step * (jacobian @ way)

    left = np.abs([remainder(step) for step in steps])
    slopes = np.diff(np.log(left), axis=0) / np.diff(np.log(steps))[:, None]
    assert values.shape == (4,)
    np.testing.assert_allclose(slopes, 2.0, atol=0.1)


def test_the_margin_is_the_eigenvalue_over_its_bound() -> None:
    posed = scene(0.05)
    constraint = margins(posed)
    record = simulate(posed, np.zeros(posed.space.n_variables)).records[0]
    values, _ = constraint(np.zeros(posed.space.n_variables))
    np.testing.assert_allclose(values + 1.0, record.eigenvalue / constraint.bound, rtol=1e-4)
    assert constraint.named(2) == ("snap", "load 3 of case 0")


def test_a_design_snaps_unless_it_is_to_avoid_it() -> None:
    found = {}
    for share in (None, 0.2):
        posed = scene(share)
        shipped = minimise(posed, LIMITS, options=SqpOptions(evaluations=25, retreats=0))
        found[share] = shipped, simulate(posed, shipped.x).records[0]
    snapping, avoiding = found[None], found[0.2]
    assert (snapping[1].jumped > 0).any()
    assert not avoiding[1].jumped.any()
    assert avoiding[1].eigenvalue.min() > margins(scene(0.2)).bound
    assert snapping[0].loss < avoiding[0].loss < 0.5 * avoiding[0].evaluations[0].loss


def test_a_start_that_snaps_is_refused() -> None:
    posed = scene(0.2)
    constraint = margins(posed)
    snapping = minimise(scene(None), LIMITS, options=SqpOptions(evaluations=25, retreats=0))
    with pytest.raises(SimulationError, match="snaps at"):
        constraint(snapping.x)
