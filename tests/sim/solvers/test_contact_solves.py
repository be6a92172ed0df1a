"""Solves with contact on the distance of units: nothing overlaps, and gradients stay exact."""

from collections.abc import Callable
from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest

from sim.collision import CandidatePairs, new_pairs
from sim.core import Floats, NewContactPairs, SimulationError
from sim.energy import observe, system_of, workspace
from sim.quasistatics import StaticSolver, eigenvalue_and_slopes, static_solver
from sim.quasistatics.equilibrium_path import follow
from sim.quasistatics.newton import FACTORS
from sim.quasistatics.snap import relax
from sim.solvers import LinearRamp, Records, Solver, adjoint_cases, solve_case, solve_cases
from sim.structure import clearance, close_pairs, displaced
from sim.time_integration import ExplicitSolver, ImplicitSolver
from sim.vibration import highest_frequency, linearised
from tests.sim.solvers.test_gradients import Ray, assert_exact_in_contact
from tests.sim.structures import Rig, hand_made, rotating_squares, shaken, squeezed

DISTANCE = 0.1875
DURATION = 0.012
ASKED = np.linspace(0.0, DURATION, 41)


DYNAMIC: dict[str, Callable[[Rig], Solver]] = {
    "implicit": lambda rig: ImplicitSolver(
        rig.topology, np.linspace(0.0, DURATION, 61), ASKED, tolerance=1e-8
    ),
    "explicit": lambda rig: ExplicitSolver(rig.topology, DURATION, 200, ASKED),
}


def equilibria(rig: Rig) -> StaticSolver:
    return StaticSolver(rig.topology, np.array([0.6, 1.0]), relative=1e-13)


def path(rig: Rig, solver: Solver) -> Floats:
    """States (n_times, n_units, 3) of a rig."""
    found = solve_case(solver, rig.values, rig.drive)[0]
    return found.reshape(len(found), -1, 3)


def assert_clear_in_contact(rig: Rig, states: Floats) -> None:
    """Units touch, and none overlap, by independent geometry."""
    found = clearance(rig.lattice, rig.lattice.vertices, states)
    assert found.overlaps.max() == 0
    assert 0.0 < found.gap.min() < DISTANCE
    seen = observe(rig.topology, rig.values, states)
    assert seen.contact_energy.max() > 0.0
    near = [
        close_pairs(
            rig.lattice, displaced(rig.lattice, rig.lattice.vertices, state[None])[0], DISTANCE
        )
        for state in states
    ]
    assert seen.contact_pairs.tolist() == [len(pairs) for pairs in near]


def overlaps(rig: Rig, states: Floats) -> int:
    return int(clearance(rig.lattice, rig.lattice.vertices, states).overlaps.max())


def test_a_lattice_that_overlaps_with_contact_on_angles_does_not_on_distances() -> None:
    """The paper's lattice, its right column driven by 15 mm."""
    rig, loads = squeezed(15.0, 15, distance=DISTANCE), np.linspace(0.1, 1.0, 10)
    angles = replace(rig, distance=None)
    assert overlaps(angles, path(angles, StaticSolver(angles.topology, loads))) == 2
    assert_clear_in_contact(rig, path(rig, StaticSolver(rig.topology, loads)))


def test_one_large_step_ends_where_small_ones_do() -> None:
    rig = squeezed(10.0, distance=DISTANCE)
    at_once, in_steps = (
        path(rig, StaticSolver(rig.topology, loads))[-1]
        for loads in (np.ones(1), np.linspace(0.05, 1.0, 20))
    )
    np.testing.assert_allclose(at_once, in_steps, atol=1e-7)


def test_a_structure_that_starts_all_but_touching() -> None:
    """Squares turned until their corners all but meet, and pressed on with a large load."""
    rig = squeezed(4.0, bias_deg=49.4, distance=DISTANCE)
    start = clearance(rig.lattice, rig.lattice.vertices, np.zeros((1, 25, 3))).gap[0]
    assert start < DISTANCE
    assert_clear_in_contact(rig, path(rig, StaticSolver(rig.topology, np.ones(1))))


def test_what_overlaps_or_is_driven_through_is_an_error() -> None:
    rig = squeezed(1.0, bias_deg=53.0, distance=DISTANCE)
    with pytest.raises(SimulationError, match="overlap at rest"):
        path(rig, StaticSolver(rig.topology, np.ones(1)))
    rig = Rig(rotating_squares(3), np.array([3]), np.array([4]), LinearRamp(-10.0, 1.0), DISTANCE)
    with pytest.raises(SimulationError, match="try "):
        path(rig, StaticSolver(rig.topology, np.array([0.2, 1.0])))


def square(x: float, y: float = 0.0) -> Floats:
    return np.array([x, y]) + 4.0 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


def far_apart(depth: float) -> Rig:
    """A square on a ligament, and far from both a driven one that is not joined to anything."""
    squares = hand_made([square(0.0), square(10.0), square(50.0, 1.0)], np.array([[2, 7], [1, 4]]))
    return Rig(squares, np.array([0]), np.array([2]), LinearRamp(-depth, 1.0), DISTANCE)


def test_units_meet_that_were_far_apart_at_rest() -> None:
    rig = far_apart(32.5)
    assert isinstance(rig.topology.contact, CandidatePairs)
    assert [1, 2] not in rig.topology.contact.pairs.tolist()
    states = path(rig, StaticSolver(rig.topology, np.linspace(0.25, 1.0, 4)))
    assert_clear_in_contact(rig, states)
    assert states[-1, 1, 0] < -0.4


def test_damped_motion_ends_where_units_meet() -> None:
    rig = far_apart(32.0)
    system, counts = system_of(rig.topology, rig.values), np.zeros(4, dtype=np.int64)
    motion = np.zeros(rig.topology.n_dofs)
    motion[3], motion[6] = -1.0, -32.0
    drag = np.ones_like(motion)
    assert not relax(motion, drag, 1e-10, 1e-10, system, workspace(system), counts)
    assert new_pairs(system.contacts).tolist() == [[1, 2]]
    assert counts[FACTORS] < 100


def test_a_path_goes_on_from_the_load_before_units_met(monkeypatch: pytest.MonkeyPatch) -> None:
    rig = squeezed(10.0, distance=DISTANCE)
    contact, loads = rig.topology.contact, np.linspace(0.05, 1.0, 20)
    assert isinstance(contact, CandidatePairs)
    bare = replace(rig.topology, contact=replace(contact, pairs=contact.pairs[:1]))
    roomy = solve_case(StaticSolver(rig.topology, loads), rig.values, rig.drive)[2]
    followed = Mock(wraps=follow)
    monkeypatch.setattr(static_solver, "follow", followed)
    found = solve_case(StaticSolver(bare, loads, continues=True), rig.values, rig.drive)[2]
    begun = [call.args[1] for call in followed.call_args_list]
    assert begun == sorted(begun)
    assert begun[1] > 0
    np.testing.assert_allclose(found.states, roomy.states, atol=1e-9)
    np.testing.assert_array_equal(found.jumped, roomy.jumped)


@pytest.mark.parametrize("kind", ["static", *DYNAMIC])
def test_a_sweep_back_makes_room_for_pairs_that_it_alone_finds_near(kind: str) -> None:
    """The broad phase looks at other states on the way back; a pair without room has no contact."""
    if kind == "static":
        rig = far_apart(32.5)
        solver: Solver = StaticSolver(rig.topology, np.linspace(0.25, 1.0, 4))
        without = rig.topology
    else:
        rig = shaken(bias_deg=44.0, distance=DISTANCE)
        solver, contact = DYNAMIC[kind](rig), rig.topology.contact
        assert isinstance(contact, CandidatePairs)
        without = replace(rig.topology, contact=replace(contact, pairs=contact.pairs[:1]))
    cases = [rig.drive]
    motion, velocity, records = solve_cases(solver, rig.values, cases)
    bars = np.ones_like(motion), np.zeros_like(velocity)
    known = adjoint_cases(solver, records, *bars)
    bare = [replace(record, topology=without) for record in records.records]
    found = adjoint_cases(solver, Records(rig.values, cases, bare), *bars)
    assert np.abs(known.parameters.corner).max() > 0.0
    for one, other in zip(known.parameters, found.parameters, strict=True):
        np.testing.assert_allclose(other, one, rtol=1e-9, atol=1e-9 * np.abs(one).max())


def test_an_eigenvalue_counts_contact_of_pairs_that_were_far_apart() -> None:
    rig = far_apart(32.5)
    solver = StaticSolver(rig.topology, np.linspace(0.25, 1.0, 4))
    record = solve_case(solver, rig.values, rig.drive)[2]
    roomy, bare = (
        eigenvalue_and_slopes(topology, rig.values, record.states[-1])
        for topology in (record.topology, rig.topology)
    )
    assert bare[0] == pytest.approx(roomy[0], rel=1e-9)
    assert roomy[0] == pytest.approx(record.eigenvalue[-1], rel=1e-4)


def test_vibrations_count_contact_of_pairs_that_were_far_apart() -> None:
    rig = far_apart(32.5)
    record = solve_case(StaticSolver(rig.topology, np.ones(1)), rig.values, rig.drive)[2]
    state = record.states[-1].reshape(-1, 3)
    roomy, bare = (
        linearised(topology, rig.values, state).stiffness.toarray()
        for topology in (record.topology, rig.topology)
    )
    np.testing.assert_allclose(bare, roomy, rtol=1e-12)
    assert highest_frequency(record.topology, rig.values, state) > 0.0
    with pytest.raises(NewContactPairs, match="1 and 2 meet"):
        highest_frequency(rig.topology, rig.values, state)


@pytest.mark.parametrize("solver", DYNAMIC)
def test_motions_stay_clear(solver: str) -> None:
    rig = shaken(bias_deg=44.0, distance=DISTANCE)
    assert_clear_in_contact(rig, path(rig, DYNAMIC[solver](rig)))


@pytest.mark.parametrize("quantity", ["design", "stiffness", "contact", "drive"])
def test_gradients_of_equilibria(quantity: str) -> None:
    ray = Ray(squeezed(10.0, distance=DISTANCE), equilibria, quantity)
    assert_clear_in_contact(ray.rig, path(ray.rig, ray.solver))
    assert_exact_in_contact(ray)


@pytest.mark.parametrize("quantity", ["design", "contact"])
@pytest.mark.parametrize("solver", DYNAMIC)
def test_gradients_of_motions(solver: str, quantity: str) -> None:
    ray = Ray(shaken(bias_deg=44.0, distance=DISTANCE), DYNAMIC[solver], quantity)
    assert_exact_in_contact(ray)
