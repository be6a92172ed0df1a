from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from sim.core import Floats
from sim.energy import Topology, gradient, system_of, workspace
from sim.quasistatics import BRANCHING, LIMIT_POINT, StaticSolver
from sim.quasistatics.newton import FACTORS
from sim.solvers import LinearRamp, TimeSeries
from sim.structure import ConcreteParameters, quads
from sim.vibration import linearised
from tests.sim.structures import NONE, Rig, squeezed

LENGTH = 2.25


def with_law(rig: Rig, axial: float, shear: float, bending: float) -> ConcreteParameters:
    return rig.values._replace(law=np.tile([axial, shear, bending], (len(rig.values.law), 1)))


def test_a_strut_of_three_units_branches_where_the_formula_says() -> None:
    """The middle unit moves sideways when k_l e (l - e) = k_s l^2, of ligaments shortened by e."""
    rig = Rig(quads(3, 1, 15.0, LENGTH, 0.0), np.array([0]), np.array([2]), LinearRamp(-0.1, 1.0))
    axial, shear = 120.0, 1.19
    values = with_law(rig, axial, shear, 30.0)
    shortened = LENGTH * (1.0 - np.sqrt(1.0 - 4.0 * shear / axial)) / 2.0
    ends = []
    for sense in (1.0, -1.0):
        solver = StaticSolver(rig.topology, np.linspace(0.1, 1.0, 10), sense=sense)
        record = solver.forward(values, rig.drive)[2]
        at = int(np.flatnonzero(record.jumped)[0])
        assert record.jumped[at] == BRANCHING
        assert record.snapped[at] == pytest.approx(2.0 * shortened / 0.1, rel=1e-6)
        assert np.count_nonzero(record.jumped) == 1
        ends.append(record.states[-1])
    assert abs(ends[0][4]) > 0.1
    np.testing.assert_allclose(ends[0][4], -ends[1][4], rtol=1e-7)


@pytest.mark.parametrize("coupling", [0.0, 1e-10, 1e-8, 1e-6])
def test_struts_that_buckle_at_once_go_ways_of_their_own(coupling: float) -> None:
    """Springs between two struts part their modes, and which way both buckle, by nothing to see."""
    pair = quads(3, 2, 15.0, LENGTH, 0.0)
    left = np.array([0, 3])
    rig = Rig(pair, left, left + 2, LinearRamp(-0.1, 1.0))
    values = with_law(rig, 120.0, 1.19, 30.0)
    rows = pair.index[pair.unit[pair.ligaments], 1]
    values.law[rows[:, 0] != rows[:, 1]] *= coupling
    for count in (1, 7):
        solver = StaticSolver(rig.topology, np.arange(1, count + 1) / count)
        states, _, record = solver.forward(values, rig.drive)
        assert record.jumped[record.jumped > 0].tolist() == [BRANCHING]
        aside = states[-1].reshape(2, 3, 3)[:, 1, 1]
        np.testing.assert_allclose(aside, [-0.35, 0.35], atol=2e-3)


class Truss:
    """A unit that moves only up and down, held by a spring above, between two that pass it by.

    Its equilibria are those of k y + 2 g(y - v) = 0, with v the height of the two beside it and g
    the force across of a ligament whose ends are ``span`` apart.
    """

    axial, shear, span = 120.0, 1.19, 1.25

    def __init__(self) -> None:
        times = np.array([0.0, 1.0, 2.0])
        inward = LENGTH - self.span
        path = np.array([[0.0, 0.0, 0.0], [inward, 2.0, 0.0], [inward, -2.0, 0.0]])
        motion = np.stack([path, path * [-1.0, 1.0, 1.0]], axis=1)
        self.rig = Rig(
            quads(3, 2, 15.0, LENGTH, 0.0), NONE, np.array([0, 2]), TimeSeries(times, motion)
        )
        held = np.setdiff1d(np.arange(18), [4])
        self.topology: Topology = replace(self.rig.topology, held=held)

    def across(self, s: float) -> float:
        length = np.hypot(self.span, s)
        gamma, slope = np.arctan2(s, self.span), self.span / length**2
        stretch = self.axial * (length - LENGTH) * s / length
        return float(stretch + self.shear * LENGTH**2 * gamma * slope)

    def stiffness(self, s: float) -> float:
        rate = (self.across(s + 1e-5) - self.across(s - 1e-5)) / 2e-5
        return self.axial + 2.0 * rate

    def height(self, v: float, low: float, high: float) -> float:
        return float(brentq(lambda y: self.axial * y + 2 * self.across(y - v), low, high))


def test_a_truss_snaps_where_its_stiffness_vanishes() -> None:
    truss = Truss()
    critical = brentq(truss.stiffness, -2.0, -0.1)
    limit = -2.0 * truss.across(critical) / truss.axial - critical
    for count in (8, 21, 100):
        solver = StaticSolver(truss.topology, np.linspace(0.0, 2.0, count + 1)[1:])
        record = solver.forward(with_law(truss.rig, 120.0, 1.19, 1.5), truss.rig.drive)[2]
        at = np.flatnonzero(record.jumped)
        assert record.jumped[at].tolist() == [LIMIT_POINT]
        assert record.snapped[at[0]] == pytest.approx(1.0 + (2.0 - limit) / 4.0, abs=1e-6)
        assert record.states[-1][4] == pytest.approx(truss.height(-2.0, -2.0, 2.0), abs=1e-8)
        smallest = record.eigenvalue[-1]
        assert smallest == pytest.approx(truss.stiffness(record.states[-1][4] + 2.0), rel=1e-5)


def crumpled(seed: int) -> tuple[Rig, ConcreteParameters]:
    """6 x 6 squares with vertices moved at random by up to 2 mm, between plates that close."""
    rig = squeezed(11.0, 6)
    shifts = np.random.default_rng(seed).uniform(-2.0, 2.0, rig.space.n_variables)
    return rig, rig.values_of(shifts)


@pytest.mark.parametrize(("seed", "snaps"), [(19, 1), (27, 1), (31, 2)])
def test_the_end_of_a_path_with_snaps_does_not_depend_on_its_loads(seed: int, snaps: int) -> None:
    rig, values = crumpled(seed)
    records = [
        StaticSolver(rig.topology, np.arange(1, count + 1) / count).forward(values, rig.drive)[2]
        for count in (10, 20, 31, 51, 100, 400)
    ]
    first = records[0]
    assert np.count_nonzero(first.jumped) == snaps
    for other in records[1:]:
        np.testing.assert_allclose(other.states[-1], first.states[-1], rtol=0, atol=1e-8)
        np.testing.assert_allclose(
            other.snapped[other.jumped > 0], first.snapped[first.jumped > 0], rtol=0, atol=1e-7
        )


@pytest.mark.parametrize(("seed", "most"), [(19, 250), (27, 400), (31, 450)])
def test_a_snap_is_found_and_left_by_few_factorisations(seed: int, most: int) -> None:
    """By halving the way to a limit point, and by motion of order 2, they were 282, 594, 756."""
    rig, values = crumpled(seed)
    solver = StaticSolver(rig.topology, np.arange(1, 11) / 10)
    assert solver.forward(values, rig.drive)[2].counts[FACTORS] < most


def test_a_path_that_is_not_left_ends_where_the_structure_snaps() -> None:
    rig, values = crumpled(31)
    loads = np.linspace(0.1, 1.0, 10)
    gone, stayed = (
        StaticSolver(rig.topology, loads, leaves=leaves).forward(values, rig.drive)[2]
        for leaves in (True, False)
    )
    first = int(np.flatnonzero(gone.jumped)[0])
    assert np.flatnonzero(stayed.jumped).tolist() == [first]
    assert stayed.snaps.tolist() == [gone.snaps[0]]
    np.testing.assert_array_equal(stayed.states[:first], gone.states[:first])
    assert np.isnan(stayed.states[first:]).all()


def test_a_snap_before_any_load_stays_in_the_record() -> None:
    """The strut, its ligaments longer than there is room for, buckles before its ends part."""
    rig = Rig(quads(3, 1, 15.0, LENGTH, 0.0), np.array([0]), np.array([2]), LinearRamp(0.001, 1.0))
    natural = np.tile([0.1, 0.0, 0.0], (2, 1))
    values = with_law(rig, 120.0, 1.19, 30.0)._replace(natural=natural)
    record = StaticSolver(rig.topology, np.array([0.5, 1.0])).forward(values, rig.drive)[2]
    assert np.abs(record.states[:, 4]).min() > 0.1
    assert record.jumped.tolist() == [BRANCHING, 0]
    assert record.snaps.tolist() == [0.0]
    np.testing.assert_array_equal(record.snapped, [0.0, np.nan])


def test_a_path_may_end_before_its_first_load() -> None:
    rig, values = crumpled(19)
    states, _, record = StaticSolver(rig.topology, np.ones(1), leaves=False).forward(
        values, rig.drive
    )
    assert record.jumped[0] > 0
    assert np.isnan(states).all()


def test_a_snap_ends_where_damped_motion_comes_to_rest() -> None:
    """The motion C dq/dt = -dE/dq is followed by an implicit method of SciPy."""
    rig, values = crumpled(19)
    system, free = system_of(rig.topology, values), rig.topology.free_dofs
    work = workspace(system)
    whole = StaticSolver(rig.topology, np.array([1.0])).forward(values, rig.drive)[2]
    snap = float(whole.snapped[0])
    before, after = (
        StaticSolver(rig.topology, np.array([load])).forward(values, rig.drive)[0][0]
        for load in (snap - 1e-6, snap + 1e-4)
    )
    assert np.abs(after - before).max() > 0.1
    state = before.copy()
    state[system.held] = after[system.held]

    def rate(_: float, q: Floats) -> Floats:
        state[free] = q
        gradient(state, system, work.kinematics, work.force)
        return -work.force[free] / system.damping[free]

    found = solve_ivp(rate, (0.0, 1e4), before[free], method="BDF", rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(found.y[:, -1], after[free], rtol=0, atol=1e-5)


@pytest.mark.parametrize("squeeze", [(9.0, 5), (11.0, 6), (-8.0, 6)])
def test_the_eigenvalue_of_every_load_is_that_of_the_dense_tangent(
    squeeze: tuple[float, int],
) -> None:
    """Also where another mode becomes the lowest, to which a symmetric one is orthogonal."""
    rig = squeezed(*squeeze)
    solver = StaticSolver(rig.topology, np.arange(1, 21) / 20)
    record = solver.forward(rig.values, rig.drive)[2]
    scale = rig.topology.scale[rig.topology.free_dofs]
    for state, value in zip(record.states, record.eigenvalue, strict=True):
        stiffness = linearised(rig.topology, rig.values, state.reshape(-1, 3)).stiffness.toarray()
        spectrum = np.linalg.eigvalsh(stiffness / np.outer(scale, scale))
        # within few sweeps modes do not part that are closer than that
        near = spectrum[1] < 1.1 * spectrum[0]
        assert value == pytest.approx(spectrum[0], rel=0.1 if near else 1e-4)


@pytest.mark.parametrize("count", [2, 32, 53, 60, 72, 89, 102, 116, 124, 127])
def test_a_branching_is_not_passed_whatever_the_loads(count: int) -> None:
    """Beside it a state is all but free along the critical mode, and rounding chooses a side."""
    rig = squeezed(11.0, 6)
    record = StaticSolver(rig.topology, np.arange(1, count + 1) / count).forward(
        rig.values, rig.drive
    )[2]
    np.testing.assert_allclose(record.snaps, [0.70405, 0.97762], atol=1e-5)


def test_the_kind_of_a_way_is_that_of_its_first_snap() -> None:
    rig = squeezed(15.0, 8, bias_deg=0.0)
    few, many = (
        StaticSolver(rig.topology, np.arange(1, count + 1) / count).forward(rig.values, rig.drive)[
            2
        ]
        for count in (1, 20)
    )
    assert few.jumped.tolist() == [many.jumped[many.jumped > 0][0]] == [BRANCHING]
