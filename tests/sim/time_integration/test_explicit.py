from dataclasses import replace

import numpy as np
import pytest

import sim.time_integration.explicit
from benchmarks.scenes import BARRIER, CUTOFF
from sim.core import Floats, SimulationError
from sim.energy import hessian_product, locate, observe, system_of, workspace
from sim.solvers import Harmonic, solve_case
from sim.time_integration import BLANES_MOAN, LEAPFROG, ExplicitSolver, ImplicitSolver, Splitting
from sim.vibration import highest_frequency, lowest_frequency
from tests.sim.structures import Rig, mixed_polygons, shaken
from tests.sim.time_integration import pulse

SPLITTINGS = pytest.mark.parametrize(
    "splitting", [LEAPFROG, BLANES_MOAN], ids=["leapfrog", "Blanes-Moan"]
)


def solver_for(rig: Rig, n_steps: int, splitting: Splitting = BLANES_MOAN) -> ExplicitSolver:
    asked = np.linspace(0.0, 0.012, n_steps + 1)
    return ExplicitSolver(rig.topology, 0.012, n_steps, asked, splitting=splitting)


@SPLITTINGS
def test_coefficients_are_symmetric_and_consistent(splitting: Splitting) -> None:
    assert splitting.drifts.sum() == pytest.approx(1.0)
    assert splitting.kicks.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(splitting.drifts, splitting.drifts[::-1])
    np.testing.assert_allclose(splitting.kicks, splitting.kicks[::-1])


@pytest.mark.parametrize(
    ("splitting", "steps"), [(LEAPFROG, (800, 1600)), (BLANES_MOAN, (100, 200))]
)
def test_order_of_convergence(splitting: Splitting, steps: tuple[int, int]) -> None:
    rig = pulse.pulsed()

    def end(n_steps: int) -> Floats:
        asked = np.array([pulse.DURATION])
        solver = ExplicitSolver(rig.topology, pulse.DURATION, n_steps, asked, splitting=splitting)
        u, _, record = solver.forward(rig.values, rig.drive)
        assert record.steps.n_steps == n_steps
        return u[-1]

    assert pulse.order(end, steps, pulse.exact_end(rig)) == pytest.approx(splitting.order, abs=0.1)


def test_both_integrators_agree() -> None:
    """Of polygons of any kind, too."""
    motion = Harmonic(0.5, 60.0, 1.0, rise=0.002, delay=0.005)
    mixed = Rig(mixed_polygons(), np.array([0]), np.array([7]), motion)
    for rig, end, n_steps, *off in (
        (shaken(1.0), 0.012, 600, 2e-3, 3e-2),
        (mixed, 0.02, 4000, 1e-2, 6e-2),
    ):
        times = np.linspace(0.0, end, 1201)
        implicit = ImplicitSolver(rig.topology, times, times[::100], tolerance=1e-6)
        explicit = ExplicitSolver(rig.topology, end, n_steps, times[::100])
        one, other = (solve_case(s, rig.values, rig.drive) for s in (implicit, explicit))
        for found, wanted, share in zip(one[:2], other[:2], off, strict=True):
            np.testing.assert_allclose(found, wanted, atol=share * np.abs(wanted).max())


def test_a_step_beyond_the_stability_limit_is_cut() -> None:
    rig = shaken(1.0)
    limit = 0.012 * highest_frequency(rig.topology, rig.values) / BLANES_MOAN.stability
    coarse = solver_for(rig, int(0.6 * limit))
    u, _, record = coarse.forward(rig.values, rig.drive)
    assert limit <= record.steps.n_steps < 2.0 * limit
    fine = replace(solver_for(rig, 1000), output_times=coarse.output_times).forward(
        rig.values, rig.drive
    )[0]
    np.testing.assert_allclose(u, fine, atol=2e-2 * np.abs(fine).max())


def test_states_that_ask_for_more_steps_are_no_failed_step(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sim.time_integration.explicit, "MAX_REFINEMENTS", 1)
    rig = shaken(4.0)
    with pytest.raises(SimulationError, match=r"states that need \d+ steps to be") as failure:
        solver_for(rig, 40).forward(rig.values, rig.drive)
    assert failure.value.step is None


def test_units_overlap_in_no_output_between_two_steps() -> None:
    """The interpolated state of a hard collision may be where no unit can be."""
    rig = shaken(5.3, distance=0.2)
    solver = ExplicitSolver(rig.topology, 0.03, 900, np.linspace(0.0, 0.03, 6001))
    u, _, record = solve_case(solver, rig.values, rig.drive)
    seen = observe(rig.topology, rig.values, u.reshape(len(u), -1, 3))
    assert np.isfinite(seen.contact_energy).all()
    assert seen.contact_energy.max() > 0.0
    assert record.steps.n_steps > 1800  # so many let units overlap at an output


@SPLITTINGS
def test_every_state_stays_inside_the_barrier(splitting: Splitting) -> None:
    rig = shaken(2.5, bias_deg=45.0)
    u, _, record = solver_for(rig, 600, splitting).forward(rig.values, rig.drive)
    states = u.reshape(len(u), -1, 3)
    angles = rig.topology.smallest_void_angles(rig.values.void, states)
    assert BARRIER < angles.min() < CUTOFF
    checked = record.checkpoints[:, 0].reshape(-1, rig.lattice.n_units, 3)
    assert rig.topology.smallest_void_angles(rig.values.void, checked).min() > BARRIER


def test_deep_contact_takes_no_shorter_steps() -> None:
    rig = shaken(3.0, bias_deg=45.0)
    rough = solver_for(rig, 300)
    u, _, record = rough.forward(rig.values, rig.drive)
    assert record.steps.n_steps == rough.n_steps
    angles = rig.topology.smallest_void_angles(rig.values.void, u.reshape(len(u), -1, 3))
    assert BARRIER < angles.min() < np.deg2rad(-13.0)
    fine = replace(solver_for(rig, 1280), output_times=rough.output_times).forward(
        rig.values, rig.drive
    )[0]
    np.testing.assert_allclose(u, fine, atol=6e-2 * np.abs(fine).max())


def test_a_run_that_would_fill_the_memory_is_refused_before_it_begins() -> None:
    rig = shaken(1.0)
    stiff = rig.values._replace(law=rig.values.law * 1e14)
    with pytest.raises(SimulationError, match=r"explicit run needs \d+ steps .* try softer"):
        solver_for(rig, 200).forward(stiff, rig.drive)


def test_eigenfrequencies_are_those_of_the_dense_problem() -> None:
    rig = Rig(mixed_polygons(), np.array([0]), np.array([7]), Harmonic(1.0, 1.0))
    system = system_of(rig.topology, rig.values)
    work, n = workspace(system), rig.topology.n_dofs
    stiffness = np.empty((n, n))
    locate(np.zeros(n), system, work.kinematics)
    for k in range(n):
        column = np.zeros(n)
        hessian_product(np.zeros(n), system, work.kinematics, np.eye(n)[k], column)
        stiffness[:, k] = column
    free = rig.topology.free_dofs
    root = np.sqrt(system.mass[free])
    squares = np.linalg.eigvalsh(stiffness[np.ix_(free, free)] / np.outer(root, root))
    assert highest_frequency(rig.topology, rig.values) ** 2 == pytest.approx(squares[-1], rel=2e-2)
    assert lowest_frequency(rig.topology, rig.values) ** 2 == pytest.approx(squares[0], rel=1e-2)
