import numpy as np
import pytest

from sim.core import Floats
from sim.quasistatics import SoftestPoint, StaticRecord, StaticSolver, softest_point
from sim.structure import ConcreteParameters
from tests.sim.quasistatics.test_snaps import Truss, crumpled, with_law
from tests.sim.structures import central, squeezed
from tests.tables import some

RIG = squeezed(11.0, 6)
SHIFTS = np.random.default_rng(19).uniform(-2.0, 2.0, RIG.space.n_variables)


def softest(shifts: Floats) -> tuple[SoftestPoint | None, StaticRecord, ConcreteParameters]:
    """The softest point of the way of 6 x 6 squares from rest to the full load."""
    values, loads = RIG.values_of(shifts), np.array([1.0])
    record = StaticSolver(RIG.topology, loads).forward(values, RIG.drive)[2]
    rest = 0.0, np.zeros(RIG.topology.n_dofs)
    return softest_point(RIG.topology, values, RIG.drive, rest, 1.0), record, values


def test_a_truss_is_softest_where_its_ligaments_lie_flat() -> None:
    truss = Truss()
    rig, values = truss.rig, with_law(truss.rig, 120.0, 1.19, 1.5)
    start = StaticSolver(truss.topology, np.array([1.2])).forward(values, rig.drive)[0][0]
    found = softest_point(truss.topology, values, rig.drive, (1.2, start), 2.0)
    assert found is not None
    assert found.eigenvalue == pytest.approx(truss.stiffness(0.0), rel=1e-6)
    assert found.load == pytest.approx(1.5, abs=1e-4)


@pytest.mark.parametrize("share", some([1.35, 1.0, 1.2], 1))
def test_its_eigenvalue_has_its_slope_in_a_fold_and_out_of_one(share: float) -> None:
    found, _, _ = softest(share * SHIFTS)
    way = np.random.default_rng(3).normal(size=len(SHIFTS))

    def value(step: float) -> float:
        other, _, _ = softest(share * SHIFTS + step * way)
        assert other is not None
        return other.eigenvalue

    step = 1e-5
    ends = [RIG.values_of(share * SHIFTS + sign * step * way) for sign in (1.0, -1.0)]
    assert found is not None
    slope = sum(
        float((bar * (after - before)).sum()) / (2.0 * step)
        for bar, after, before in zip(found.slopes, *ends, strict=True)
    )
    assert slope == pytest.approx(float(central(value, 1e-4)), rel=1e-3)


def test_it_vanishes_where_a_fold_appears() -> None:
    """Nothing jumps there: the eigenvalue falls as steadily before as behind."""
    shares = np.linspace(1.26, 1.31, 6)
    found, records, _ = zip(*(softest(share * SHIFTS) for share in shares), strict=True)
    eigenvalues = np.array([one.eigenvalue for one in found])
    snaps = np.array([len(record.snaps) > 0 for record in records])
    assert snaps[0]
    assert not snaps[-1]
    np.testing.assert_array_equal(eigenvalues < 0.0, snaps)
    np.testing.assert_allclose(np.diff(eigenvalues, n=2), 0.0, atol=0.05 * np.ptp(eigenvalues) / 5)


def test_a_path_that_is_softest_at_its_end_has_none() -> None:
    values = RIG.values
    rest = 0.0, np.zeros(RIG.topology.n_dofs)
    assert softest_point(RIG.topology, values, RIG.drive, rest, 0.05) is None


def test_a_path_is_left_behind_its_first_fold() -> None:
    rig, values = crumpled(31)
    record = StaticSolver(rig.topology, np.array([1.0])).forward(values, rig.drive)[2]
    assert len(record.snaps) == 2
    rest = 0.0, np.zeros(rig.topology.n_dofs)
    found = softest_point(rig.topology, values, rig.drive, rest, 1.0)
    assert found is not None
    assert found.eigenvalue < 0.0
    assert found.load < record.snaps[0]
