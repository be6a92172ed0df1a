"""What a solve must not start from: each of these once went on without a sign."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from benchmarks.scenes import BARRIER
from sim.core import SimulationError
from sim.quasistatics import StaticSolver
from sim.solvers import Harmonic, LinearRamp, Solver, TimeSeries, inadmissible, solve_case
from sim.time_integration import ExplicitSolver, ImplicitSolver
from tests.sim.structures import Rig, rotating_squares

LEFT = 3 * np.arange(3)
TIMES = np.linspace(0.0, 2e-3, 5)
SOLVERS = pytest.mark.parametrize("kind", ["static", "implicit", "explicit"])


def solver(rig: Rig, kind: str) -> Solver:
    if kind == "static":
        return StaticSolver(rig.topology, TIMES[::2])
    if kind == "implicit":
        return ImplicitSolver(rig.topology, TIMES, TIMES)
    return ExplicitSolver(rig.topology, TIMES[-1], 50, TIMES)


def pulled(bias_deg: float) -> Rig:
    return Rig(rotating_squares(3, bias_deg), LEFT, LEFT + 2, LinearRamp(0.5, TIMES[-1]))


@SOLVERS
def test_voids_closed_beyond_their_barrier_at_rest_are_named(kind: str) -> None:
    """They have no force there: pulled apart they would pass as open ones."""
    rig = pulled(53.0)
    assert np.rad2deg(rig.values.void.min()) == pytest.approx(-16.0)
    with pytest.raises(SimulationError, match=r"void between units \d and \d .* -16 deg at rest"):
        solve_case(solver(rig, kind), rig.values, rig.drive)


@pytest.mark.parametrize("kind", ["implicit", "explicit"])
@pytest.mark.parametrize("end", [0.0, -3.0])
def test_a_drive_that_starts_beyond_a_barrier_is_refused(kind: str, end: float) -> None:
    turning = TimeSeries(TIMES[[0, -1]], np.array([[0.0, 0.0, -2.0], [0.0, 0.0, end]]))
    rig = Rig(rotating_squares(3), np.array([0]), np.array([4]), turning)
    with pytest.raises(SimulationError, match="at the start of the drive"):
        solve_case(solver(rig, kind), rig.values, rig.drive)


@pytest.mark.parametrize("kind", ["implicit", "explicit"])
def test_a_drive_that_starts_inside_another_unit_is_refused(kind: str) -> None:
    jump = TimeSeries(TIMES[[0, -1]], np.array([[-9.0, 0.0, 0.0], [0.0, 0.0, 0.0]]))
    rig = Rig(rotating_squares(3), np.array([0]), np.array([4]), jump, distance=0.1875)
    with pytest.raises(SimulationError, match="overlap at the start of the drive"):
        solve_case(solver(rig, kind), rig.values, rig.drive)


@pytest.mark.parametrize("kind", ["implicit", "explicit"])
@pytest.mark.parametrize("mass", [0.0, -1e-6])
def test_a_unit_without_mass_is_named(kind: str, mass: float) -> None:
    rig = replace(pulled(20.0), motion=Harmonic(0.1, 60.0))
    bad = rig.values.mass.copy()
    bad[4, 2] = mass
    with pytest.raises(SimulationError, match="unit 4 has no mass"):
        solve_case(solver(rig, kind), rig.values._replace(mass=bad), rig.drive)


@SOLVERS
@pytest.mark.parametrize("field", ["law", "contact", "damping"])
def test_negative_constants_are_refused(kind: str, field: str) -> None:
    rig = pulled(20.0)
    bad = getattr(rig.values, field).copy()
    bad.flat[3] = -1e-3
    with pytest.raises(SimulationError, match="is negative in one place"):
        solve_case(solver(rig, kind), rig.values._replace(**{field: bad}), rig.drive)


def test_a_piece_that_hangs_on_nothing_is_named() -> None:
    """In statics; in motion it stays where it is."""
    whole = rotating_squares(3)
    lost = replace(whole, ligaments=whole.ligaments[(whole.ligament_units != 8).all(axis=1)])
    rig = Rig(lost, LEFT, np.array([5]), LinearRamp(0.5, TIMES[-1]))
    with pytest.raises(SimulationError, match=r"unit 8 .* is joined to no unit that is held"):
        solve_case(solver(rig, "static"), rig.values, rig.drive)
    moved = solve_case(solver(rig, "explicit"), rig.values, rig.drive)[0]
    np.testing.assert_array_equal(moved.reshape(5, 9, 3)[:, 8], 0.0)


@SOLVERS
def test_what_leaves_nothing_to_solve_for_is_refused(kind: str) -> None:
    rig = Rig(rotating_squares(3), np.arange(8), np.array([8]), LinearRamp(0.5, TIMES[-1]))
    with pytest.raises(SimulationError, match="every unit is held"):
        solve_case(solver(rig, kind), rig.values, rig.drive)


def test_interpolated_output_has_no_void_beyond_its_barrier() -> None:
    """Squares let go from deep in contact, followed by steps far longer than their bounces."""
    corners, times = np.array([0, 2, 6, 8]), np.linspace(0.0, 5e-3, 11)
    rig = Rig(rotating_squares(3, 52.495), corners, np.array([4]), Harmonic(0.2, 30.0))
    coarse = ImplicitSolver(rig.topology, times, np.linspace(0.0, times[-1], 201))
    found, _, record = solve_case(coarse, rig.values, rig.drive)
    angles = rig.topology.smallest_void_angle(rig.values.void, found.reshape(201, 9, 3))
    assert angles.min() > BARRIER
    assert len(record.times) > len(times)


@pytest.mark.parametrize("distance", [None, 0.1875])
def test_states_with_units_in_one_another_are_told_apart(distance: float | None) -> None:
    rig = replace(pulled(20.0), distance=distance)
    states = np.zeros((3, 9, 3))
    states[1, 4, 2] = -2.0
    states[1, 4, 0] = -9.0
    found = inadmissible(rig.topology, rig.values, states.reshape(3, -1))
    np.testing.assert_array_equal(found, [False, True, False])


@pytest.mark.parametrize(
    ("kind", "broken"),
    [
        *(("static", name) for name in ("drive", "law", "void", "arm")),
        *product(("implicit", "explicit"), ("drive", "law", "void", "mass", "damping")),
    ],
)
def test_nan_never_leaves(kind: str, broken: str) -> None:
    rig = pulled(20.0)
    values, drive = rig.values, rig.drive
    if broken == "drive":
        series = TimeSeries(TIMES[::2], np.array([[0.0] * 3, [np.nan] * 3, [0.0] * 3]))
        drive = rig.driven_by(series)
    else:
        bad = np.array(getattr(values, broken))
        bad.flat[20] = np.nan
        values = values._replace(**{broken: bad})
    with pytest.raises(SimulationError):
        solve_case(solver(rig, kind), values, drive)


@SOLVERS
def test_what_cannot_be_reached_is_an_error_with_its_step_and_a_remedy(kind: str) -> None:
    """Two held neighbours turned against each other beyond the barrier of the void between."""
    closing = TimeSeries(TIMES[[0, -1]], np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 3.0]]))
    rig = Rig(rotating_squares(3), np.array([3]), np.array([4]), closing)
    with pytest.raises(SimulationError, match="try ") as failure:
        solve_case(solver(rig, kind), rig.values, rig.drive)
    assert failure.value.step is not None
    assert kind != "implicit" or failure.value.unit is not None
