from dataclasses import replace

import numpy as np
import pytest

from benchmarks.scenes import BARRIER, CUTOFF
from sim.core import Floats
from sim.quasistatics import StaticSolver
from sim.solvers import LinearRamp, TimeSeries, solve_case
from sim.time_integration import ImplicitSolver
from sim.time_integration.coefficients import ESDIRK3
from tests.sim.structures import CORNERS, LEFT, MIDDLE, NONE, Rig, rotating_squares, shaken
from tests.sim.time_integration import pulse


def test_order_conditions_and_damping_of_the_method() -> None:
    stages, nodes, end = ESDIRK3.stages, ESDIRK3.nodes, ESDIRK3.stages[-1]
    np.testing.assert_allclose(stages.sum(axis=1), nodes, atol=1e-15)
    np.testing.assert_allclose(stages[1:] @ nodes, nodes[1:] ** 2 / 2, atol=1e-15)
    assert end.sum() == pytest.approx(1)
    assert end @ nodes == pytest.approx(1 / 2)
    assert end @ nodes**2 == pytest.approx(1 / 3)
    assert end @ stages @ nodes == pytest.approx(1 / 6)
    # l-stability: the amplification of a mode vanishes with its frequency growing
    stages, one = ESDIRK3.stages, np.ones(4)
    for z, bound in ((-1e3, 2e-2), (-1e6, 2e-5), (1e4j, 1e-3)):
        growth = 1 + z * stages[-1] @ np.linalg.solve(np.eye(4) - z * stages, one)
        assert abs(growth) < bound


def test_order_of_convergence() -> None:
    rig = pulse.pulsed()

    def end(n_steps: int) -> Floats:
        times = np.linspace(0.0, pulse.DURATION, n_steps + 1)
        solver = ImplicitSolver(rig.topology, times, times[-1:], tolerance=1e-7)
        u, _, record = solver.forward(rig.values, rig.drive)
        assert len(record.times) == len(times)
        return u[-1]

    assert pulse.order(end, (160, 320), pulse.exact_end(rig)) == pytest.approx(3.0, abs=0.1)


def solver_for(rig: Rig, n_steps: int = 60) -> ImplicitSolver:
    times = np.linspace(0.0, 0.012, n_steps + 1)
    return ImplicitSolver(rig.topology, times, times, tolerance=1e-5)


def test_every_stage_stays_inside_the_barrier() -> None:
    rig = shaken(2.5, bias_deg=45.0)
    record = solver_for(rig).forward(rig.values, rig.drive)[2]
    stages = record.u[:-1].reshape(-1, rig.lattice.n_units, 3)
    angles = rig.topology.smallest_void_angles(rig.values.void, stages)
    assert BARRIER < angles.min() < CUTOFF
    closest = rig.topology.closest_void_angles(rig.values.void, stages)
    assert (closest == angles.min(axis=0)).all()


def test_a_grid_that_is_too_coarse_is_split_where_it_fails() -> None:
    rig = shaken(3.0, bias_deg=40.0)
    coarse = solver_for(rig, n_steps=12)
    u, _, record = coarse.forward(rig.values, rig.drive)
    assert len(record.times) > len(coarse.times)
    assert np.isin(coarse.times, record.times).all()
    again = replace(coarse, times=record.times).forward(rig.values, rig.drive)[2]
    np.testing.assert_array_equal(again.times, record.times)
    for name in ("u", "v"):
        found, wanted = getattr(record, name), getattr(again, name)
        np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-5 * np.abs(wanted).max())
    fine = solver_for(rig, n_steps=960)
    close = replace(fine, output_times=coarse.output_times).forward(rig.values, rig.drive)[0]
    assert np.linalg.norm(u - close) < 0.5 * np.linalg.norm(close)


def test_stiff_ligaments_shorten_all_steps_to_come() -> None:
    rig = shaken(0.5)
    law = rig.values.law.copy()
    law[..., 0] *= 1e3
    stiff = rig.values._replace(law=law)
    u, _, record = solver_for(rig).forward(stiff, rig.drive)
    assert len(record.times) > 61
    fine = replace(solver_for(rig, 960), output_times=np.linspace(0.0, 0.012, 61))
    wanted = fine.forward(stiff, rig.drive)[0]
    np.testing.assert_allclose(u, wanted, atol=5e-2 * np.abs(wanted).max())


def test_a_slow_drive_follows_the_equilibria() -> None:
    rig = Rig(rotating_squares(), LEFT, LEFT + 4, LinearRamp(-4.0, 10.0))
    times = np.linspace(0.0, 10.0, 41)
    dynamic = solve_case(
        ImplicitSolver(rig.topology, times, times[-1:], tolerance=1e-6), rig.values, rig.drive
    )[0]
    static = solve_case(StaticSolver(rig.topology, times[-1:]), rig.values, rig.drive)[0]
    np.testing.assert_allclose(dynamic, static, atol=2e-3)


def test_turning_around_several_times() -> None:
    """A free structure whose middle is turned by 9 rad follows it as a rigid body."""
    times = np.linspace(0.0, 4.0, 801)
    smooth = 9.0 * (1 - np.cos(np.pi * times / 4.0)) / 2
    turning = TimeSeries(times, np.column_stack([np.zeros((801, 2)), smooth]))
    rig = Rig(rotating_squares(3), NONE, np.array([4]), turning)
    solver = ImplicitSolver(rig.topology, times, times[-1:], tolerance=1e-6)
    end = solve_case(solver, rig.values, rig.drive)[0].reshape(9, 3)
    np.testing.assert_allclose(end[:, 2], 9.0, atol=1e-2)
    offset = rig.lattice.site - rig.lattice.site[4]
    c, s = np.cos(9.0), np.sin(9.0)
    np.testing.assert_allclose(end[:, :2], offset @ [[c, s], [-s, c]] - offset, atol=0.1)


def test_asked_times_do_not_change_the_steps() -> None:
    rig = shaken(1.0)
    solver = solver_for(rig)
    between = replace(solver, output_times=solver.times[3::7])
    one, other = (s.forward(rig.values, rig.drive) for s in (solver, between))
    np.testing.assert_array_equal(one[2].u[:-1], other[2].u[:-1])
    np.testing.assert_allclose(other[0], one[0][3::7], atol=1e-12)
    np.testing.assert_allclose(other[1], one[1][3::7], atol=1e-9)
    np.testing.assert_allclose(solver.refined(one[2]).times, np.linspace(0.0, 0.012, 121))


def test_a_rough_recorded_drive_needs_few_cuts() -> None:
    """Linear between noisy samples, the unit jumps by up to 0.5 mm a stage."""
    knots = np.linspace(0.0, 0.012, 25)
    noise = np.random.default_rng(5).normal(size=(25, 3)) * [0.5, 0.5, 0.03]
    series = TimeSeries(knots, np.sin(np.pi * knots / 0.012)[:, None] * noise)
    rig = Rig(rotating_squares(), CORNERS, MIDDLE, series)
    record = solver_for(rig).forward(rig.values, rig.drive)[2]
    assert len(record.times) < 75
