"""Forces on units: what they do to a structure is what a displacement does that needs them."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.sparse.linalg as spla

from sim.core import Floats, SimulationError
from sim.energy import gradient, hessian_product, kinematics_of, locate, observe, system_of
from sim.quasistatics import StaticSolver
from sim.solvers import (
    DISPLACEMENT,
    FORCE,
    FREE,
    LinearRamp,
    MotionLaw,
    PrescribedMotion,
    Pulse,
    Solver,
    Superposition,
    TimeSeries,
    Turning,
    held_values,
    solve_case,
)
from sim.time_integration import ExplicitSolver, ImplicitSolver
from sim.vibration import linearised
from tests.sim.structures import CORNERS, MIDDLE, Rig, rotating_squares

SIDEWAYS = np.array([[DISPLACEMENT, FREE, DISPLACEMENT]])
PUSHED = np.array([[FORCE, FREE, DISPLACEMENT]])
LOADS = np.linspace(0.1, 1.0, 10)


def rig(
    motion: MotionLaw, control: object, units: object = MIDDLE, distance: float | None = None
) -> Rig:
    driven = np.asarray(units)
    return Rig(rotating_squares(), CORNERS, driven, motion, distance, np.asarray(control))


def solved(made: Rig, solver: Solver) -> Floats:
    """Motion (n_times, n_units, 3)."""
    return solve_case(solver, made.values, made.drive)[0].reshape(-1, 25, 3)


def static(made: Rig) -> Floats:
    return solved(made, StaticSolver(made.topology, LOADS, relative=1e-13))


def test_force_and_moment_of_a_motion_give_that_motion() -> None:
    aside = LinearRamp(-6.0, 1.0), SIDEWAYS, PUSHED
    round_it = Turning(LinearRamp(0.5, 1.0)), [[FREE, FREE, DISPLACEMENT]], [[FORCE] * 3]
    for dof, (motion, control, answer) in ((0, aside), (2, round_it)):
        moved = rig(motion, control)
        path = static(moved)
        np.testing.assert_allclose(path[:, 12, dof], path[-1, 12, dof] * LOADS)
        assert dof == 2 or np.abs(path[-1, 12, 1]) > 1e-3  # it does give way sideways
        series = np.zeros((len(LOADS) + 1, 3))
        series[1:, dof] = observe(moved.topology, moved.values, path).reaction[:, 12, dof]
        pushed = rig(TimeSeries(np.append(0.0, LOADS), series), answer)
        np.testing.assert_allclose(static(pushed), path, atol=1e-8)


@pytest.mark.parametrize("distance", [None, 0.5])
@pytest.mark.parametrize("kind", ["implicit", "explicit"])
def test_force_of_a_motion_gives_that_motion(kind: str, distance: float | None) -> None:
    """The force is that of the ligaments, and of the unit's own inertia and damping."""
    times, pulse = np.linspace(0.0, 0.02, 2001), Pulse(2.0, 2e-3, delay=8e-3)

    def solver(made: Rig) -> Solver:
        if kind == "explicit":
            return ExplicitSolver(made.topology, times[-1], 2000, times)
        return ImplicitSolver(made.topology, times, times, tolerance=1e-8)

    moved = rig(pulse, SIDEWAYS, distance=distance)
    motion = solved(moved, solver(moved))
    pulled = observe(moved.topology, moved.values, motion).force_on(MIDDLE)[:, 0]

    def along(t: jax.Array) -> jax.Array:
        return pulse(t[None])[0, 0]

    velocity, acceleration = (
        np.asarray(jax.vmap(part)(jnp.asarray(times)))
        for part in (jax.grad(along), jax.grad(jax.grad(along)))
    )
    mass, damping = moved.values.mass[12, 0], moved.values.damping[12, 0]
    force = pulled + mass * acceleration + damping * velocity
    assert np.abs(mass * acceleration).max() > 0.1 * np.abs(force).max()
    series = TimeSeries(times, force[:, None] * [1.0, 0.0, 0.0])
    pushed = rig(series, PUSHED, distance=distance)
    np.testing.assert_allclose(solved(pushed, solver(pushed)), motion, atol=2e-3)


def test_displacements_are_reciprocal() -> None:
    """Maxwell and Betti: a force here moves what is there as one there moves what is here."""
    shares = {12: np.array([1.0, 0.0]), 17: np.array([0.0, 1.0])}
    directions = {12: 0.3, 17: 2.1}

    def pushed(which: int) -> Floats:
        motions = tuple(LinearRamp(1e-6, 1.0, directions[unit]) for unit in (12, 17))
        only = Superposition(motions, np.diag(shares[which]))
        return static(rig(only, [[FORCE] * 3] * 2, [12, 17]))[-1]

    def along(motion: Floats, unit: int) -> float:
        return float(motion[unit, :2] @ [np.cos(directions[unit]), np.sin(directions[unit])])

    there, here = along(pushed(12), 17), along(pushed(17), 12)
    assert abs(there) > 1e-9
    assert there == pytest.approx(here, rel=1e-5)


def test_small_forces_move_as_the_linear_structure_does() -> None:
    made = rig(LinearRamp(1e-6, 1.0, 0.7), [[FORCE, FORCE, FREE]])
    of, right = linearised(made.topology, made.values), np.zeros(75)
    right[36:38] = 1e-6 * np.cos(0.7), 1e-6 * np.sin(0.7)
    wanted = np.zeros(75)
    wanted[of.free] = spla.spsolve(of.stiffness, right[of.free])
    np.testing.assert_allclose(static(made)[-1].ravel(), wanted, atol=1e-5 * wanted.max())


def test_states_under_a_growing_moment_are_balanced_and_stable() -> None:
    loads = np.linspace(0.02, 1.0, 50)
    made = rig(Turning(LinearRamp(40.0, 1.0)), [[FREE, FREE, FORCE]])
    solver = StaticSolver(made.topology, loads)
    _, _, record = solve_case(solver, made.values, made.drive)
    assert record.stable.all()
    for load, state in zip(loads, record.states, strict=True):
        system = system_of(made.topology, made.values)
        force = np.empty(made.topology.n_dofs)
        gradient(state, system, kinematics_of(system), force)
        assert np.abs(force[made.topology.free_dofs]).max() < 1e-7
        assert state[-1] == pytest.approx(40.0 * load)


def test_the_work_of_a_load_is_part_of_the_energy() -> None:
    made = rig(LinearRamp(1.0, 1.0), [[FORCE] * 3])
    rng, system = np.random.default_rng(3), system_of(made.topology, made.values)
    state, step = (rng.normal(size=78) * np.tile([0.1, 0.1, 0.01], 26) for _ in range(2))
    kinematics, (ahead, behind, product) = kinematics_of(system), np.empty((3, 78))
    units = np.append(np.ones(75, dtype=bool), np.zeros(3, dtype=bool))
    h = 1e-5
    gradient(state, system, kinematics, product)
    slope = product[units] @ step[units]
    moved = np.where(units, step, 0.0)
    energies = [sum(gradient(state + s * h * moved, system, kinematics, ahead)) for s in (1, -1)]
    assert (energies[0] - energies[1]) / (2 * h) == pytest.approx(slope, rel=1e-6)
    gradient(state + h * step, system, kinematics, ahead)
    gradient(state - h * step, system, kinematics, behind)
    locate(state, system, kinematics)
    hessian_product(state, system, kinematics, step, product)
    wanted = (ahead - behind)[units] / (2 * h)
    np.testing.assert_allclose(product[units], wanted, atol=1e-6)
    np.testing.assert_allclose(product[75:], -step[36:39])


def test_forces_are_shared_as_asked() -> None:
    ramps = (LinearRamp(2.0, 1.0), Turning(LinearRamp(3.0, 1.0)))
    motion = Superposition(ramps, np.array([[0.25, 0.0], [0.75, 1.0]]))
    drive = PrescribedMotion(
        np.array([7, 3]), motion, np.array([[FORCE] * 3, [FORCE, FREE, FORCE]])
    )
    np.testing.assert_array_equal(drive.loaded, [3, 7])
    forces = drive.forces(np.array([0.5]))
    np.testing.assert_allclose(forces[0], [[0.25, 0.0, 0.0], [0.75, 0.0, 1.5]])
    held = np.append([0, 1, 2], 75 + np.arange(6))
    values = held_values(held, drive.units, motion(np.array([0.5])), drive.control)
    np.testing.assert_allclose(values, [[0, 0, 0, 0.75, 0, 1.5, 0.25, 0, 0]])


def test_units_under_a_load_that_hang_on_nothing_are_refused() -> None:
    made = replace(rig(LinearRamp(1.0, 1.0), [[FORCE] * 3]), clamped=np.zeros(0, dtype=int))
    with pytest.raises(SimulationError, match="joined to no unit that is held"):
        static(made)
