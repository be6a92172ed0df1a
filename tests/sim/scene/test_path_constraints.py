from dataclasses import replace
from functools import cache
from pathlib import Path
from unittest.mock import Mock

import jax.numpy as jnp
import numpy as np
import pytest

import sim
from sim.constraints import ConstraintVector
from sim.core import Floats
from sim.optimise import Journal, Result
from sim.scene import PathConstraints, foil_strains, path_constraints
from sim.scene.evaluation import _confirmation
from sim.solvers import solve_cases
from sim.structure import Copies, FoilLimit
from tests.sim.structures import central, pressed, taylor_orders
from tests.tables import some

FOIL = FoilLimit(thickness=0.25, strain=0.05)
LIMITS = sim.Limits(edge_length=3.0, block_angle=float(np.deg2rad(30.0)), void_angle=0.0)


@cache
def scene(share: float | None, foil: FoilLimit | None = None) -> sim.Scene:
    """5 x 5 squares pushed together over four loads; the middle is to stay where it is."""
    return pressed(9.0, steps=4, snap_margin=share, foil=foil)


@cache
def best_design(share: float | None) -> Result:
    """The best of some evaluations; with a share of the eigenvalue to keep, it does not snap."""
    evaluations, radius = (25, 0.15) if share is None else (9, 0.25)
    options = sim.SqpOptions(evaluations=evaluations, radius=radius, retreats=0)
    return sim.minimise(scene(share), LIMITS, options=options)


def margins(posed: sim.Scene) -> PathConstraints:
    return PathConstraints(posed, sim.make_plan(posed), ConstraintVector(posed.space, sim.Limits()))


@pytest.mark.parametrize(
    ("share", "foil", "count"), some([(0.05, FOIL, 5), (0.05, None, 4), (None, FOIL, 1)], 1)
)
def test_slopes_of_margins(share: float | None, foil: FoilLimit | None, count: int) -> None:
    posed = scene(share, foil)
    constraint, rng = margins(posed), np.random.default_rng(3)
    design = rng.uniform(-0.5, 0.5, posed.space.n_variables)
    way = rng.normal(size=len(design))
    way /= np.linalg.norm(way)
    values, jacobian = constraint(design)
    orders = taylor_orders(
        lambda step: constraint(design + step * way)[0], jacobian @ way, np.geomspace(1e-1, 1e-3, 5)
    )
    assert values.shape == (count,)
    np.testing.assert_allclose(orders, 2.0, atol=0.1)


def test_the_margin_is_the_smallest_eigenvalue_passed_over_its_bound() -> None:
    """Four loads are passed for each."""
    posed = scene(0.05)
    constraint, still = margins(posed), np.zeros(posed.space.n_variables)
    plan = sim.make_plan(posed)
    record = sim.simulate(posed, still, plan=replace(plan, solver=plan.confirming)).records[0]
    smallest = record.eigenvalue.reshape(4, 4).min(axis=1)
    assert (smallest < record.eigenvalue[3::4]).any()
    values, _ = constraint(still)
    np.testing.assert_allclose(values + 1.0, smallest / constraint.bound, rtol=1e-4)
    assert constraint.named(2) == ("snap", "load 3 of case 0")


def test_a_design_snaps_unless_it_is_to_avoid_it() -> None:
    found = {}
    for share in (None, 0.2):
        shipped = best_design(share)
        found[share] = shipped, sim.simulate(scene(share), shipped.x).records[0]
    snapping, avoiding = found[None], found[0.2]
    assert (snapping[1].jumped > 0).any()
    assert not avoiding[1].jumped.any()
    assert avoiding[1].eigenvalue.min() > margins(scene(0.2)).bound
    assert avoiding[0].loss < 0.5 * avoiding[0].evaluations[0].loss


def test_a_snap_is_a_value_that_leads_out_of_it() -> None:
    """Its slope is that of central differences, and a start that snaps is not moved far."""
    posed, snapping = scene(0.2), best_design(None).x
    constraint = margins(posed)
    values, jacobian = constraint(snapping)
    load = int(values.argmin())
    assert values[load] < -1.0
    assert sim.simulate(posed, snapping).records[0].jumped[load]
    way = np.random.default_rng(1).normal(size=len(snapping))
    slope = central(lambda step: constraint(snapping + step * way)[0][load], 1e-5)
    assert (jacobian @ way)[load] == pytest.approx(float(slope), rel=1e-3)
    led = constraint.recover_start(snapping)
    assert constraint(led)[0].min() >= 0.0
    assert not sim.simulate(posed, led).records[0].jumped.any()
    assert np.abs(led - snapping).max() < 0.5


@pytest.mark.parametrize("kept", some([0.6, 1.0, 0.3], 1))
def test_a_journal_remembers_constraints_under_loads(
    kept: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With what they watch after a snap: a resumed run designs the same bits, and solves less."""
    posed, snapping = scene(0.2, FOIL._replace(strain=0.5)), best_design(None).x
    path, options = tmp_path / "sqp.journal", sim.SqpOptions(evaluations=4, retreats=0)

    def designed() -> tuple[bytes, int]:
        spied.reset_mock()
        with Journal(path, "key") as journal:
            found = sim.minimise(posed, LIMITS, snapping, options=options, journal=journal)
        return found.x.tobytes(), spied.call_count

    spied = Mock(wraps=solve_cases)
    monkeypatch.setattr(path_constraints, "solve_cases", spied)
    first, count = designed()
    path.write_bytes((data := path.read_bytes())[: int(kept * len(data))])
    again, rest = designed()
    assert again == first
    assert rest == 0 if kept == 1.0 else 0 < rest < count
    assert path.read_bytes() == data


def test_a_design_that_snaps_is_not_confirmed() -> None:
    """Also one that snaps between the loads of the loss alone."""
    posed, snapping = scene(0.2), best_design(None).x
    confirm = _confirmation(posed, sim.make_plan(posed))
    assert confirm is not None
    assert np.isfinite(confirm(np.zeros_like(snapping))[0])
    with pytest.raises(sim.SimulationError, match="snaps at"):
        confirm(snapping)
    options = sim.SqpOptions(evaluations=5, retreats=0)
    shipped = sim.minimise(posed, LIMITS, snapping, options=options)
    assert not sim.simulate(posed, shipped.x).records[0].jumped.any()


def test_imperfect_copies_may_snap_where_the_perfect_structure_does_not(
    caplog: pytest.LogCaptureFixture,
) -> None:
    """A copy as the design that snaps is confirmed, that design with a copy at rest is refused."""
    posed, snapping = scene(0.2), best_design(None).x
    shifts = np.zeros((1, posed.lattice.n_groups, 2))
    shifts[0, posed.lattice.group] = posed.space.vertices(snapping) - posed.lattice.vertices
    stiffness = np.ones((1, 3, posed.lattice.n_ligaments))
    caplog.set_level("INFO")
    for sign, design in ((1, np.zeros_like(snapping)), (-1, snapping)):
        copied = posed.updated(copies=Copies(sign * shifts, stiffness))
        confirm = _confirmation(copied, sim.make_plan(copied))
        assert confirm is not None
        if sign > 0:
            assert np.isfinite(confirm(design)[0])
            assert "1 of 1 paths of imperfect copies snap" in caplog.text
        else:
            with pytest.raises(sim.SimulationError, match="snaps at"):
                confirm(design)


def largest_strain(posed: sim.Scene, design: Floats) -> float:
    """Finds the largest strain of the foil without a norm in its place."""
    response = sim.simulate(posed, design)
    ends = jnp.asarray(response.displacement[0])[:, posed.lattice.ligament_units]
    return float(np.abs(foil_strains(ends, response.parameters, FOIL.thickness)).max())


def test_the_strain_is_a_little_above_the_largest() -> None:
    posed = scene(None, FOIL)
    still = np.zeros(posed.space.n_variables)
    (value,) = margins(posed)(still)[0]
    largest = largest_strain(posed, still)
    assert largest < (1.0 - value) * FOIL.strain < 1.1 * largest
    assert margins(posed).named(0) == ("shim_strain", "case 0")


@pytest.mark.slow
def test_a_design_strains_its_foil_unless_it_is_to_spare_it() -> None:
    """The regular squares are strained by 19 %, the best design by a quarter."""
    strain = {}
    for bound in (None, 0.15):
        posed = scene(None, None if bound is None else FOIL._replace(strain=bound))
        shipped = sim.minimise(posed, LIMITS, options=sim.SqpOptions(evaluations=8, retreats=0))
        strain[bound] = largest_strain(posed, shipped.x)
        assert shipped.loss < 0.5 * sim.simulate(posed, np.zeros(posed.space.n_variables)).loss
    assert strain[0.15] < 0.15
    assert strain[None] > 0.19


def test_a_strain_in_time_has_its_slope() -> None:
    """The foil of a shaken structure; central differences."""
    static = scene(None, FOIL)
    drive = sim.PrescribedMotion(static.loads.driven, sim.Harmonic(2.0, 5.0, np.pi))
    posed = static.updated(
        cases=(drive,), static=False, duration=0.1, frequency=5.0, steps=None, samples=21
    )
    constraint, rng = margins(posed), np.random.default_rng(5)
    design = rng.uniform(-0.5, 0.5, posed.space.n_variables)
    way = rng.normal(size=len(design))
    way *= 1e-3 / np.linalg.norm(way)
    change = central(lambda step: constraint(design + step * way)[0], 1.0)
    np.testing.assert_allclose(constraint(design)[1] @ way, change, rtol=1e-4)
