import numpy as np
import pytest
import scipy.sparse as sp
from scipy.optimize import brentq

from sim.core import Floats
from sim.energy import gradient, system_of, workspace
from sim.quasistatics import StaticSolver, trace
from sim.quasistatics.arc_length import Tangent
from tests.sim.quasistatics.test_snaps import Truss, crumpled, with_law


def test_the_path_of_a_truss_turns_where_its_stiffness_vanishes() -> None:
    truss = Truss()
    rig, values = truss.rig, with_law(truss.rig, 120.0, 1.19, 1.5)
    start = StaticSolver(truss.topology, np.array([1.2])).forward(values, rig.drive)[0][0]
    found = trace(truss.topology, values, rig.drive, (1.2, start), 2.0)
    limits = []
    for low, high in ((-2.0, -0.1), (0.1, 2.0)):
        apart = brentq(truss.stiffness, low, high)
        limits.append(-2.0 * truss.across(apart) / truss.axial - apart)
    turns = [1.0 + (2.0 - limit) / 4.0 for limit in limits]
    np.testing.assert_allclose(found.loads[found.turns], turns, rtol=0, atol=1e-8)
    assert found.loads[-1] == pytest.approx(2.0, abs=0.5)
    heights = 2.0 - 4.0 * (found.loads - 1.0)
    for height, state, value in zip(heights, found.states, found.eigenvalue, strict=True):
        if abs(height) <= 2.0:  # beyond, another mode is the softest
            assert value == pytest.approx(truss.stiffness(state[4] - height), abs=1e-3)


def test_a_path_turns_where_the_structure_snaps_and_its_points_are_equilibria() -> None:
    rig, values = crumpled(19)
    loads = np.array([0.5, 1.0])
    record = StaticSolver(rig.topology, loads).forward(values, rig.drive)[2]
    found = trace(rig.topology, values, rig.drive, (0.5, record.states[0]), 1.0)
    back, forward = found.turns
    assert found.loads[back] == pytest.approx(record.snaps[0], abs=1e-7)
    assert found.loads[forward] < found.loads[back]
    assert not found.n_negative[:back].any()
    assert (found.n_negative[back + 1 : forward] == 1).all()
    assert not found.n_negative[forward + 1 :].any()
    system = system_of(rig.topology, values)
    work = workspace(system)
    free, scale = rig.topology.free_dofs, rig.topology.scale[rig.topology.free_dofs]

    def force(state: Floats) -> Floats:
        gradient(state, system, work.kinematics, work.force)
        return np.array(work.force[free] / scale)

    for k in range(0, len(found.loads), 7):
        state, step = found.states[k], 1e-5
        assert np.abs(force(state)).max() < 1e-7
        tangent = np.empty((len(free), len(free)))
        for column, (dof, length) in enumerate(zip(free, scale, strict=True)):
            shift = np.zeros_like(state)
            shift[dof] = step / length
            tangent[:, column] = (force(state + shift) - force(state - shift)) / (2.0 * step)
        spectrum = np.linalg.eigvalsh((tangent + tangent.T) / 2.0)
        if abs(spectrum[0]) > 1e-6:  # at a turn it is zero but for rounding
            assert np.count_nonzero(spectrum < 0.0) == found.n_negative[k]
        assert found.eigenvalue[k] == pytest.approx(spectrum[0], rel=1e-3, abs=1e-5)


def test_every_snap_between_two_loads_is_recorded() -> None:
    rig, values = crumpled(31)
    few, many = (
        StaticSolver(rig.topology, np.arange(1, count + 1) / count).forward(values, rig.drive)[2]
        for count in (1, 20)
    )
    assert len(few.snaps) == 2
    np.testing.assert_allclose(few.snaps, many.snaps, rtol=0, atol=1e-7)


@pytest.mark.parametrize("short", np.arange(1, 20) * 1e-9)
def test_a_load_just_before_a_snap_is_reached(short: float) -> None:
    """Leaves increments hardly any of the way."""
    rig, values = crumpled(31)
    first = StaticSolver(rig.topology, np.ones(1)).forward(values, rig.drive)[2].snaps[0]
    times = np.array([first - short, 1.0])
    record = StaticSolver(rig.topology, times).forward(values, rig.drive)[2]
    np.testing.assert_array_equal(record.stable, 1)


@pytest.mark.parametrize("size", [6, 30])
def test_modes_are_those_nearest_to_zero_from_below(size: int) -> None:
    """However large the structure is."""
    values = np.append([-3.0, -2.0, -1.0], np.arange(1.0, size - 2))
    tangent = Tangent(sp.csc_array(sp.diags_array(values)), np.ones(size))
    assert tangent.n_negative == 3
    for count in (1, 2, 3):
        np.testing.assert_allclose(np.sort(tangent.lowest(count)[0])[::-1], values[2::-1][:count])
    stable = Tangent(sp.csc_array(sp.diags_array(np.abs(values) + 1.0)), np.ones(size))
    assert stable.lowest(1)[0][0] == pytest.approx(2.0)
