"""Waves by the explicit method at the steps that a plan chooses: agreement, energy, memory."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.scenes import BARRIER, CUTOFF, MATERIAL
from sim.core import Floats
from sim.energy import gradient, system_of, workspace
from sim.scene import Loads, Objective, Scene, Structure, concrete_parameters, make_plan, mimicking
from sim.solvers import Harmonic, PrescribedMotion, TimeSeries, solve_case
from sim.structure import quads
from sim.time_integration import BLANES_MOAN, ExplicitSolver
from sim.vibration import highest_frequency
from tests.sim.structures import NONE, Rig, rotating_squares

SIDE = 12
HOLE = np.array([65, 66, 77, 78])


def shaken_lattice() -> Scene:
    """12 x 12 squares without the middle ones, shaken along the left edge until voids close."""
    intact = quads(SIDE, SIDE, 15.0, 2.25, np.deg2rad(20.0))
    kept = np.setdiff1d(np.arange(SIDE**2), HOLE)
    left = SIDE * np.arange(SIDE)
    shaken = Harmonic(4.5, 30.0, 0.0, rise=0.01, delay=0.015)
    whole = Scene(
        Structure(intact, MATERIAL),
        Loads((PrescribedMotion(left, shaken),), duration=0.07),
        Objective(region=kept, samples=71),
    )
    holed = intact.without(HOLE)
    places = holed.positions(kept)
    cases = (PrescribedMotion(holed.positions(left), shaken),)
    return whole.updated(lattice=holed, cases=cases, region=places, reference=whole)


def motion(scene: Scene, finer: int = 1) -> tuple[Floats, Floats]:
    """Displacement (n_times, n_units, 3), and smallest void angle at each time."""
    values = concrete_parameters(scene, scene.lattice.vertices)
    solver = make_plan(scene, scene.lattice.vertices).solver
    assert isinstance(solver, ExplicitSolver)
    finer_solver = replace(solver, n_steps=finer * solver.n_steps)
    states = solve_case(finer_solver, values, scene.loads.cases[0])[0].reshape(
        scene.objective.samples, -1, 3
    )
    return states, scene.topology.smallest_void_angle(values.void, states)


def loss(scene: Scene, whole: Floats, part: Floats) -> float:
    """Of a holed lattice whose intact one moves as ``whole``."""
    assert scene.objective.reference is not None
    measure = mimicking(scene, whole[None][:, :, scene.objective.reference.objective.region])
    values = concrete_parameters(scene, scene.lattice.vertices)
    return float(measure(part[None], values)[0])


@pytest.mark.slow
def test_the_chosen_steps_agree_with_much_shorter_ones() -> None:
    holed = shaken_lattice()
    assert holed.objective.reference is not None
    (whole, closed), (part, _) = motion(holed.objective.reference), motion(holed)
    (fine_whole, _), (fine_part, _) = motion(holed.objective.reference, 6), motion(holed, 6)
    assert BARRIER < closed.min() < CUTOFF
    for coarse, fine in ((whole, fine_whole), (part, fine_part)):
        np.testing.assert_allclose(coarse, fine, atol=1e-2 * np.abs(fine).max())
    exact = loss(holed, fine_whole, fine_part)
    assert exact > 0.05
    assert loss(holed, whole, part) == pytest.approx(exact, rel=1e-3)


@pytest.mark.parametrize(("bias_deg", "share"), [(20.0, 0.5), (40.0, 0.1)], ids=["free", "touch"])
@pytest.mark.slow
def test_energy_does_not_drift_in_1e5_steps(bias_deg: float, share: float) -> None:
    """At half the stability limit or more, undamped, after the drive has come to rest.

    Where voids close, the limit is that in the state in which one is closed most.
    """
    rig = pushed(bias_deg)
    step = share * stability_limit(rig)
    u, v = undamped(rig, step, 100_000)
    system = system_of(rig.topology, rig.values)
    work = workspace(system)
    potential = np.array([sum(gradient(state, system, work.kinematics, work.force)) for state in u])
    energy = potential + 0.5 * v**2 @ rig.values.mass.ravel()
    voids = rig.topology.smallest_void_angle(rig.values.void, u.reshape(len(u), -1, 3))
    assert (voids.min() < CUTOFF) == (bias_deg > 20.0)
    assert step >= 0.5 * stability_limit(rig, u[voids.argmin()])
    np.testing.assert_allclose(energy, energy[0], rtol=1e-3)


def pushed(bias_deg: float) -> Rig:
    """Squares whose middle one is pushed and turned at once, then held."""
    push = TimeSeries(np.array([0.0, 1e-3, 1e3]), np.array([[0.0] * 3, *[[1.0, 0.5, 0.05]] * 2]))
    return Rig(rotating_squares(3, bias_deg), np.array([0]), np.array([4]), push)


def undamped(rig: Rig, step: float, n_steps: int) -> tuple[Floats, Floats]:
    """Displacement and velocity (n_times, n_dofs) every second step after the push."""
    values = rig.values._replace(damping=np.zeros_like(rig.values.damping))
    asked = np.asarray(step * np.arange(500, n_steps + 1, 2))
    solver = ExplicitSolver(rig.topology, n_steps * step, n_steps, asked)
    u, v, record = solver.forward(values, rig.drive)
    assert record.steps.n_steps == n_steps
    v[:, rig.topology.held] = 0.0
    return u, v


def stability_limit(rig: Rig, state: Floats | None = None) -> float:
    """Longest stable step, s: without contact, or with that in a state."""
    touching = NONE if state is None else None
    frequency = highest_frequency(rig.topology, rig.values, state, touching)
    return BLANES_MOAN.stability / frequency


def test_memory_of_the_adjoint_grows_with_the_root_of_the_steps() -> None:
    rig = Rig(rotating_squares(3), np.array([0]), np.array([4]), Harmonic(0.1, 30.0))
    solver = ExplicitSolver(rig.topology, 0.01, 400, np.array([0.01]))
    _, _, record = solver.forward(rig.values, rig.drive)
    assert record.steps.n_steps == solver.n_steps
    assert record.checkpoints.nbytes < solver.adjoint_memory()
    longer = replace(solver, n_steps=100 * solver.n_steps)
    assert longer.adjoint_memory() == pytest.approx(10 * solver.adjoint_memory(), rel=0.1)
