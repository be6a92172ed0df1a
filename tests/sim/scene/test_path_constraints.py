"""Designs that keep away from snaps, and spare their foil."""

from functools import cache

import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks.scenes import MATERIAL
from sim.constraints import ConstraintVector, Limits
from sim.core import Floats, SimulationError
from sim.optimise import Result, SqpOptions
from sim.scene import (
    Clamp,
    Design,
    Loads,
    Objective,
    PathConstraints,
    Scene,
    Structure,
    foil_strains,
    make_plan,
    minimise,
    simulate,
)
from sim.scene.evaluation import _from_rest
from sim.solvers import Harmonic, LinearRamp, PrescribedMotion
from sim.structure import FoilLimit
from tests.sim.structures import rotating_squares

FOIL = FoilLimit(thickness=0.25, strain=0.05)
LIMITS = Limits(edge_length=3.0, block_angle=float(np.deg2rad(30.0)), void_angle=0.0)


@cache
def scene(share: float | None, foil: FoilLimit | None = None) -> Scene:
    """5 x 5 squares pushed together over four loads; the middle is to stay where it is."""
    left = 5 * np.arange(5)
    drive = PrescribedMotion(left + 4, LinearRamp(-9.0, 1.0))
    around = np.array([6, 7, 8, 11, 13, 16, 17, 18])
    return Scene(
        Structure(rotating_squares(5), MATERIAL),
        Loads((drive,), (Clamp(left),), static=True),
        Objective(region=np.array([12]), steps=4, snap_margin=share, foil=foil),
        Design(cloak=around),
    )


@cache
def best_design(share: float | None) -> Result:
    """The best of 25 evaluations; with a share of the eigenvalue to keep, it does not snap."""
    return minimise(scene(share), LIMITS, options=SqpOptions(evaluations=25, retreats=0))


def margins(posed: Scene) -> PathConstraints:
    return PathConstraints(posed, make_plan(posed), ConstraintVector(posed.space, Limits()))


@pytest.mark.parametrize(
    ("share", "foil", "count"), [(0.05, None, 4), (None, FOIL, 1), (0.05, FOIL, 5)]
)
def test_the_slope_of_the_margins_is_theirs(
    share: float | None, foil: FoilLimit | None, count: int
) -> None:
    """The remainder of a Taylor expansion falls with the second power of the step."""
    posed = scene(share, foil)
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
    assert values.shape == (count,)
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
        shipped = best_design(share)
        found[share] = shipped, simulate(scene(share), shipped.x).records[0]
    snapping, avoiding = found[None], found[0.2]
    assert (snapping[1].jumped > 0).any()
    assert not avoiding[1].jumped.any()
    assert avoiding[1].eigenvalue.min() > margins(scene(0.2)).bound
    assert snapping[0].loss < avoiding[0].loss < 0.5 * avoiding[0].evaluations[0].loss


def test_a_start_that_snaps_is_refused() -> None:
    posed = scene(0.2)
    with pytest.raises(SimulationError, match="snaps at"):
        margins(posed)(best_design(None).x)


def test_a_start_that_snaps_is_drawn_back() -> None:
    posed, snapping = scene(0.2), best_design(None)
    options = SqpOptions(evaluations=5, retreats=0)
    shipped = minimise(posed, LIMITS, snapping.x, options=options)
    first = shipped.evaluations[0].x
    assert 0.0 < np.linalg.norm(first) < np.linalg.norm(snapping.x)
    assert not simulate(posed, shipped.x).records[0].jumped.any()


def test_a_design_that_snaps_between_the_loads_of_the_loss_is_not_shipped() -> None:
    posed = scene(0.2)
    snapping = best_design(None).x
    confirm = _from_rest(posed, make_plan(posed))
    assert confirm is not None
    assert np.isfinite(confirm(np.zeros_like(snapping))[0])
    with pytest.raises(SimulationError, match="snaps at"):
        confirm(snapping)


def largest_strain(posed: Scene, design: Floats) -> float:
    """Finds the largest strain of the foil without a norm in its place."""
    response = simulate(posed, design)
    ends = jnp.asarray(response.displacement[0])[:, posed.lattice.ligament_units]
    return float(np.abs(foil_strains(ends, response.parameters, FOIL.thickness)).max())


def test_the_strain_is_a_little_above_the_largest() -> None:
    posed = scene(None, FOIL)
    still = np.zeros(posed.space.n_variables)
    (value,) = margins(posed)(still)[0]
    largest = largest_strain(posed, still)
    assert largest < (1.0 - value) * FOIL.strain < 1.1 * largest
    assert margins(posed).named(0) == ("shim_strain", "case 0")


def test_a_design_strains_its_foil_unless_it_is_to_spare_it() -> None:
    """The regular squares are strained by 19 %, the best design by a quarter."""
    strain = {}
    for bound in (None, 0.15):
        posed = scene(None, None if bound is None else FOIL._replace(strain=bound))
        shipped = minimise(posed, LIMITS, options=SqpOptions(evaluations=8, retreats=0))
        strain[bound] = largest_strain(posed, shipped.x)
        assert shipped.loss < 0.5 * simulate(posed, np.zeros(posed.space.n_variables)).loss
    assert strain[0.15] < 0.15
    assert strain[None] > 0.19


def test_a_strain_in_time_has_its_slope() -> None:
    """The foil of a shaken structure; central differences."""
    static = scene(None, FOIL)
    drive = PrescribedMotion(static.loads.driven, Harmonic(2.0, 5.0, np.pi))
    posed = static.updated(
        cases=(drive,), static=False, duration=0.1, frequency=5.0, steps=None, samples=21
    )
    constraint, rng = margins(posed), np.random.default_rng(5)
    design = rng.uniform(-0.5, 0.5, posed.space.n_variables)
    way = rng.normal(size=len(design))
    way *= 1e-3 / np.linalg.norm(way)
    slope = constraint(design)[1] @ way
    change = (constraint(design + way)[0] - constraint(design - way)[0]) / 2
    np.testing.assert_allclose(slope, change, rtol=1e-4)
