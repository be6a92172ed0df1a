from dataclasses import replace

import numpy as np
import pytest

from sim.energy import gradient, kinematics_of, system_of
from sim.quasistatics import StaticSolver
from sim.solvers import Harmonic, LinearRamp, solve_case
from sim.time_integration import ExplicitSolver
from sim.vibration import highest_frequency, linearised, lowest_frequency, modes, transmission
from tests.sim.structures import Rig, rotating_squares

FREQUENCY = 30.0


@pytest.fixture(scope="module")
def rig() -> Rig:
    lattice = rotating_squares(4)
    return Rig(lattice, np.array([0, 4]), np.array([11]), Harmonic(1e-3, FREQUENCY, 0.3))


def test_the_stiffness_is_the_derivative_of_the_force(rig: Rig) -> None:
    top, rng = rig.topology, np.random.default_rng(1)
    state = 0.05 * rng.normal(size=top.n_dofs)
    made = linearised(top, rig.values, state)
    system = system_of(top, rig.values)
    kinematics = kinematics_of(system)
    for ids, block in ((made.free, made.stiffness), (made.held, made.coupling)):
        step = np.zeros(top.n_dofs)
        step[ids] = rng.normal(size=len(ids))
        ahead, behind = np.empty(top.n_dofs), np.empty(top.n_dofs)
        gradient(state + 1e-5 * step, system, kinematics, ahead)
        gradient(state - 1e-5 * step, system, kinematics, behind)
        force = (ahead - behind)[made.free] / 2e-5
        assert block @ step[ids] == pytest.approx(force, rel=1e-6, abs=1e-6 * np.abs(force).max())


def test_modes_are_eigenvectors_of_unit_mass_and_hold_the_extremes(rig: Rig) -> None:
    made = linearised(rig.topology, rig.values)
    found = modes(made, 6)
    shapes = found.shape.reshape(6, -1)[:, made.free]
    assert (shapes * made.mass) @ shapes.T == pytest.approx(np.eye(6), abs=1e-8)
    residual = made.stiffness @ shapes.T - (made.mass * shapes).T * found.square
    assert np.abs(residual).max() < 1e-8 * found.square[-1] * np.abs(made.mass * shapes).max()
    lowest = lowest_frequency(rig.topology, rig.values) / (2 * np.pi)
    assert found.frequency[0] == pytest.approx(lowest, rel=1e-4)
    highest = highest_frequency(rig.topology, rig.values)
    top = modes(made, 1, near=1.1 * highest)
    assert 2 * np.pi * top.frequency[-1] == pytest.approx(highest, rel=2e-2)


def test_a_floating_structure_has_three_rigid_motions(rig: Rig) -> None:
    floating = replace(rig.topology, held=np.zeros(0, dtype=np.int64))
    found = modes(linearised(floating, rig.values), 4).frequency
    assert np.abs(found[:3]).max() < 1e-3
    assert found[3] > 1.0
    with pytest.raises(ValueError, match="degrees of freedom"):
        modes(linearised(rig.topology, rig.values), len(rig.topology.free_dofs))


def test_a_small_vibration_in_time_settles_to_the_linear_one(rig: Rig) -> None:
    top, values = rig.topology, rig.values
    heavy = values._replace(damping=100 * values.damping)
    duration = 0.6
    asked = duration - np.arange(19, -1, -1) / 20 / FREQUENCY
    steps = int(np.ceil(duration * highest_frequency(top, heavy)))
    moved, *_ = solve_case(ExplicitSolver(top, duration, steps, asked), heavy, rig.drive)
    made = linearised(top, heavy)
    held = rig.drive.values(top.held, np.array([0.25 / FREQUENCY]))[0]  # where the sine is one
    w = 2 * np.pi * FREQUENCY
    steady = transmission(made, held[:, None], np.array([w])).ravel()
    linear = (steady * np.exp(1j * (w * asked[:, None] - np.pi / 2))).real
    assert np.linalg.norm(moved - linear) < 0.01 * np.linalg.norm(linear)


def test_modes_about_a_compressed_state_differ(rig: Rig) -> None:
    squeezed = replace(rig, motion=LinearRamp(2.0, 1.0, np.pi))
    solver = StaticSolver(squeezed.topology, np.array([1.0]))
    state = solve_case(solver, squeezed.values, squeezed.drive)[0][0]
    rest, strained = (modes(linearised(rig.topology, rig.values, s), 3) for s in (None, state))
    assert np.abs(strained.frequency / rest.frequency - 1).max() > 0.01
    assert (strained.square > 0).all()
