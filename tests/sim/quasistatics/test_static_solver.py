from dataclasses import replace

import numpy as np
import pytest

from benchmarks.scenes import BARRIER, CUTOFF
from sim.core import Floats, Ints
from sim.energy import gradient, system_of, workspace
from sim.linalg import Storage
from sim.quasistatics import BRANCHING, StaticSolver
from sim.solvers import DISPLACEMENT, FORCE, FREE, LinearRamp, MotionLaw, TimeSeries, solve_case
from sim.structure import quads
from tests.sim.structures import LEFT, NONE, Rig, mixed_polygons, rotating_squares, squeezed


def out_of_balance(rig: Rig, state: Floats) -> Floats:
    """Forces (n_free,) on the free dofs, N and N mm."""
    system = system_of(rig.topology, rig.values)
    work = workspace(system)
    gradient(state.ravel(), system, work.kinematics, work.force)
    return work.force[rig.topology.free_dofs]


def void_angles(rig: Rig, states: Floats) -> Floats:
    motion = states.reshape(len(states), -1, 3)
    return rig.topology.smallest_void_angles(rig.values.void, motion)


def path(rig: Rig, loads: Floats) -> Floats:
    return solve_case(StaticSolver(rig.topology, loads), rig.values, rig.drive)[0]


def test_every_state_is_in_balance_and_inside_the_barrier() -> None:
    rig, loads = squeezed(9.0), np.linspace(0.1, 1.0, 7)
    states = path(rig, loads)
    assert states.dtype == np.float64
    for load, state in zip(loads, states, strict=True):
        assert np.abs(out_of_balance(rig, state)).max() < 1e-8
        moved = state.reshape(-1, 3)
        np.testing.assert_allclose(moved[LEFT + 4], [[-9.0 * load, 0.0, 0.0]] * 5)
        np.testing.assert_array_equal(moved[LEFT], 0.0)
    rig = squeezed(11.0)
    angles = void_angles(rig, path(rig, np.linspace(0.1, 1.0, 10)))
    assert angles.min() > BARRIER
    assert (angles < CUTOFF).sum() > 5


def test_a_stiff_inclusion_is_in_balance_as_far_as_rounding_allows() -> None:
    rig = squeezed(3.0)
    touched = (rig.topology.ligament_units == 12).any(axis=1)
    law = np.where(touched[:, None], 200.0, 1.0) * rig.values.law
    stiff = rig.values._replace(law=law)
    solver = StaticSolver(rig.topology, np.linspace(0.25, 1.0, 4))
    states, _, record = solver.forward(stiff, rig.drive)
    finer, _, _ = solver.refined(record).forward(stiff, rig.drive)
    np.testing.assert_allclose(states, finer, atol=1e-9)


def test_a_structure_that_starts_in_contact_relaxes_first() -> None:
    """Squares turned so far that their voids are at -12 deg, beyond the cutoff, at the start."""
    rig = squeezed(1.0, bias_deg=51.0)
    assert np.rad2deg(rig.values.void.min()) == pytest.approx(-12.0)
    states = path(rig, np.array([0.0, 1.0]))
    assert np.abs(states[0]).max() > 1e-5
    assert np.abs(out_of_balance(rig, states[0])).max() < 1e-8
    angles = void_angles(rig, states)
    assert BARRIER < angles.min() < CUTOFF


def test_a_whole_turn_and_more() -> None:
    """A free structure follows the one unit that is turned, rigidly and around several times."""
    angles = np.linspace(0.0, 9.0, 31)
    turning = TimeSeries(angles, np.column_stack([np.zeros((31, 2)), angles]))
    rig = Rig(rotating_squares(3), NONE, np.array([4]), turning)
    states = path(rig, angles[1:]).reshape(-1, 9, 3)
    offset = rig.lattice.site - rig.lattice.site[4]
    for angle, state in zip(angles[1:], states, strict=True):
        c, s = np.cos(angle), np.sin(angle)
        np.testing.assert_allclose(state[:, :2], offset @ [[c, s], [-s, c]] - offset, atol=1e-7)
        np.testing.assert_allclose(state[:, 2], angle, atol=1e-8)


def test_winding_of_two_units_against_each_other() -> None:
    """Voids opened by more than half a turn do not read as closed."""
    angles = np.linspace(0.0, 1.0, 11)
    turning = TimeSeries(angles, np.outer(angles, [-3.0, 2.0, 2.6]))
    rig = Rig(mixed_polygons(), np.array([0]), np.array([7]), turning)
    states = path(rig, angles[1:])
    assert np.isfinite(states).all()
    assert void_angles(rig, states).min() > BARRIER


def test_polygons_of_any_kind() -> None:
    """The mixed network pulled apart: same code, balance, and energy equal to the work done."""
    loads = np.linspace(0.0, 1.0, 201)
    rig = Rig(mixed_polygons(), np.array([0]), np.array([4, 7]), LinearRamp(1.5, 1.0, 0.7))
    states = path(rig, loads)
    assert np.abs(out_of_balance(rig, states[-1])).max() < 1e-8
    system = system_of(rig.topology, rig.values)
    work = workspace(system)
    energies, forces = [], []
    for state in states:
        energies.append(sum(gradient(state, system, work.kinematics, work.force)))
        forces.append(work.force.copy())
    done = np.sum((np.array(forces)[1:] + forces[:-1]) / 2 * np.diff(states, axis=0))
    assert done == pytest.approx(energies[-1] - energies[0], rel=1e-4)


def chain(motion: MotionLaw, driven: Ints) -> Rig:
    """Nine squares in a straight line, the first of them clamped."""
    return Rig(quads(9, 1, 15.0, 2.25, 0.0), np.array([0]), driven, motion)


def test_a_straight_chain_buckles_and_says_so() -> None:
    """Exactly straight it stays in balance beyond the branching, but not in a minimum."""
    rig = chain(LinearRamp(-6.0, 1.0), np.array([8]))
    record = StaticSolver(rig.topology, np.linspace(0.1, 1.0, 10)).forward(rig.values, rig.drive)[2]
    lateral = np.abs(record.states.reshape(10, 9, 3)[:, :, 1]).max(axis=1)
    first = int(np.flatnonzero(record.jumped)[0])
    np.testing.assert_array_equal(record.stable, 1)
    assert record.jumped[record.jumped > 0].tolist() == [BRANCHING]
    assert (lateral[:first] < 1e-9).all()
    assert (lateral[first:] > 1.0).all()


@pytest.mark.parametrize("length", [21, 81])
def test_a_long_chain_finds_its_way_out_of_a_branch_that_ends(length: int) -> None:
    """Its lowest modes are so soft that the energy is all but flat where they set in."""
    squares = quads(length, 1, 15.0, 2.25, 0.0)
    drive = LinearRamp(-0.4 * length, 1.0)
    rig = Rig(squares, np.array([0]), np.array([length - 1]), drive)
    record = StaticSolver(rig.topology, np.linspace(0.1, 1.0, 10)).forward(rig.values, rig.drive)[2]
    np.testing.assert_array_equal(record.stable, 1)
    assert record.jumped[record.jumped > 0].tolist() == [BRANCHING]


def bowed() -> Rig:
    """A chain pushed together with its middle to one side, which then moves to the other side.

    Either half may bow to either side.
    """
    times = np.array([0.0, 1.0, 2.0])
    middle, end = [[0, 0, 0], [-3, 5, 0], [-3, -5, 0]], [[0, 0, 0], [-6, 0, 0], [-6, 0, 0]]
    motion = np.stack([middle, end], axis=1).astype(float)
    return chain(TimeSeries(times, motion), np.array([4, 8]))


def test_more_loads_on_the_way_change_nothing() -> None:
    rig, loads = squeezed(9.0), np.array([0.3, 0.7, 1.0])
    solver = StaticSolver(rig.topology, loads)
    states, _, record = solver.forward(rig.values, rig.drive)
    assert (record.stable == 1).all()
    assert not record.jumped.any()
    for finer in (solver.refined(record), replace(solver, substeps=10)):
        np.testing.assert_allclose(
            finer.forward(rig.values, rig.drive)[0], states, rtol=0, atol=1e-8
        )


@pytest.mark.parametrize("substeps", [1, 3])
def test_the_peak_of_a_cycle_between_output_loads_is_passed(substeps: int) -> None:
    """A chain is pushed to one side as it buckles, to the other one later, and is let go there."""
    times, motion = np.array([0.0, 0.5, 1.0, 2.0, 3.0]), np.zeros((5, 2, 3))
    motion[:, 0, 0], motion[:, 1, 1] = [0.0, -3.0, -6.0, -6.0, -6.0], [0.0, 1.0, 0.0, -1.0, 0.0]
    control = np.array([[DISPLACEMENT] * 3, [FREE, FORCE, FREE]])
    rig = replace(chain(TimeSeries(times, motion), np.array([8, 4])), control=control)
    solver = StaticSolver(rig.topology, np.array([1.0, 3.0]), substeps=substeps)
    found = solver.forward(rig.values, rig.drive)[2]
    middle = found.states.reshape(2, -1, 3)[:, 4, 1]
    assert middle[0] > 5.0
    assert middle[1] == pytest.approx(-middle[0])
    assert found.jumped[1]
    assert 2.0 > found.snapped[1] > 1.0


def recorded(times: Floats, depth: Floats, noise: float = 0.0) -> Rig:
    """Squares of which one side follows a recorded motion, mm, with noise in all dofs."""
    scales = noise * np.array([1.0, 1.0, 1.0 / 7.5])
    motion = np.random.default_rng(0).normal(scale=scales, size=(len(times), 3))
    motion[:, 0] -= depth
    return replace(squeezed(6.0), motion=TimeSeries(times, motion - motion[0]))


def test_noise_of_a_recorded_ramp_has_no_peaks() -> None:
    times, outputs = np.linspace(0.0, 1.0, 501), np.linspace(0.05, 1.0, 20)
    rig = recorded(times, 6.0 * times, noise=0.006)
    assert not np.concatenate(rig.drive.passed_peaks(outputs, 7.5)).size
    there_and_back = recorded(times, 6.0 * np.sin(np.pi * times), noise=0.006)
    (peak,) = np.concatenate(there_and_back.drive.passed_peaks(np.array([0.3, 0.8]), 7.5))
    assert peak == pytest.approx(0.5, abs=0.05)


def test_a_known_path_serves_between_loads_without_a_peak() -> None:
    times, outputs = np.linspace(0.0, 1.0, 101), np.linspace(0.1, 1.0, 10)
    rig = recorded(times, 6.0 * np.minimum(times / 0.75, 4.0 * (1.0 - times)))
    cold = StaticSolver(rig.topology, outputs).forward(rig.values, rig.drive)[2]
    warm = StaticSolver(rig.topology, outputs, start=cold).forward(rig.values, rig.drive)[2]
    np.testing.assert_allclose(warm.states, cold.states, rtol=0, atol=1e-8)
    assert warm.counts[1] < 0.7 * cold.counts[1]


def test_a_path_known_from_a_similar_structure_saves_work_and_changes_nothing() -> None:
    rig, loads = squeezed(9.0), np.linspace(0.1, 1.0, 10)
    shifts = np.random.default_rng(0).uniform(-0.3, 0.3, rig.space.n_variables)
    solver, values = StaticSolver(rig.topology, loads), rig.values_of(shifts)
    similar = solver.forward(rig.values, rig.drive)[2]
    cold = solver.forward(values, rig.drive)[2]
    warm = replace(solver, start=similar).forward(values, rig.drive)[2]
    np.testing.assert_allclose(warm.states, cold.states, rtol=0, atol=1e-8)
    assert warm.counts[1] < cold.counts[1]


def test_a_known_path_on_another_branch_is_not_followed() -> None:
    """The halves bow at the first load; the known path is that of a chain bowed the other way."""
    rig, loads = bowed(), np.linspace(0.0, 2.0, 21)[1:]
    solver = StaticSolver(rig.topology, loads)
    cold = solver.forward(rig.values, rig.drive)[2]
    mirror = np.tile([1.0, -1.0, -1.0], 9)
    mirrored = replace(cold, states=cold.states * mirror, tangents=cold.tangents * mirror)
    warm = replace(solver, start=mirrored).forward(rig.values, rig.drive)[2]
    np.testing.assert_allclose(warm.states, cold.states, rtol=0, atol=1e-7)
    np.testing.assert_array_equal(warm.jumped, cold.jumped)


def test_all_storages_lead_to_the_same_states() -> None:
    rig, loads = squeezed(9.0), np.array([0.5, 1.0])
    found = []
    storages: tuple[Storage, ...] = ("band", "panels", "fronts")
    for storage in storages:
        top = replace(rig.topology, storages=(storage,))
        found.append(StaticSolver(top, loads, relative=1e-13).forward(rig.values, rig.drive)[0])
    for other in found[1:]:
        np.testing.assert_allclose(found[0], other, rtol=0, atol=1e-12 * np.abs(found[0]).max())


def test_a_structure_moved_far_is_in_balance_as_far_as_rounding_allows() -> None:
    """Rounding grows with the displacements: a chain carried 50 m is not less in balance."""
    far = TimeSeries(np.array([0.0, 1.0]), np.array([[0.0, 0.0, 0.0], [5e4, 3e4, 0.3]]))
    rig = Rig(quads(5, 1, 15.0, 2.25, 0.0), NONE, np.array([4]), far)
    moved = path(rig, np.array([0.5, 1.0]))[-1].reshape(-1, 3)
    np.testing.assert_allclose(moved[:, 2], 0.3, atol=1e-7)
    np.testing.assert_allclose(moved[4], [5e4, 3e4, 0.3])
