"""The lattice of Figure 7, scene A at the shortest steps, and a large lattice past its snap."""

from dataclasses import replace

import numpy as np

from pipeline import problem
from pipeline.posing import scene_of
from pipeline.runtime import ROOT
from sim.core import Floats
from sim.quasistatics import StaticSolver
from sim.scene import Scene, concrete_parameters, make_plan, mimicking
from sim.solvers import LinearRamp, solve_case
from sim.structure import quads
from sim.time_integration import ExplicitSolver
from tests.sim.scene.test_reference import assert_agrees_with_scene_a, outcome_of_scene_a
from tests.sim.structures import Rig

PROBLEM = ROOT / "experiments/fig7/problem.yaml"


def motion(scene: Scene, finer: int) -> Floats:
    """Displacement (n_times, n_units, 3)."""
    solver = make_plan(scene, scene.lattice.vertices).solver
    assert isinstance(solver, ExplicitSolver)
    solver = replace(solver, n_steps=finer * solver.n_steps)
    values = concrete_parameters(scene, scene.lattice.vertices)
    return solve_case(solver, values, scene.loads.cases[0])[0].reshape(
        scene.objective.samples, -1, 3
    )


def test_they_agree_with_steps_of_a_sixth() -> None:
    holed = scene_of(problem.load(PROBLEM), PROBLEM.parent)
    assert holed.objective.reference is not None
    values = concrete_parameters(holed, holed.lattice.vertices)
    losses = []
    for finer in (1, 6):
        whole, part = motion(holed.objective.reference, finer), motion(holed, finer)
        measure = mimicking(holed, whole[None][:, :, holed.objective.reference.objective.region])
        losses.append((whole, part, float(measure(part[None], values)[0])))
    (*coarse, loss), (*fine, exact) = losses
    for one, other in zip(coarse, fine, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-2 * np.abs(other).max())
    np.testing.assert_allclose(loss, exact, rtol=1e-3)


def test_scene_a_at_tight_accuracy() -> None:
    assert_agrees_with_scene_a(outcome_of_scene_a("tight"), motion=1e-4, loss=1e-6, gradient=5e-5)


SIDE = 160


def test_the_end_past_a_snap_does_not_depend_on_the_loads() -> None:
    """Beyond its limit point this lattice creeps, and mirrored columns are critical at once."""
    left = SIDE * np.arange(SIDE)
    lattice = quads(SIDE, SIDE, 15.0, 2.3, np.deg2rad(20.0))
    rig = Rig(lattice, left, left + SIDE - 1, LinearRamp(-0.1 * SIDE * 15.0, 1.0))
    once, often = (
        StaticSolver(rig.topology, np.arange(1, count + 1) / count).forward(rig.values, rig.drive)
        for count in (1, 10)
    )
    np.testing.assert_allclose(once[2].snaps, often[2].snaps, rtol=0, atol=1e-6)
    assert len(once[2].snaps) == 1
    # what the residual's tolerance leaves open, over the smallest eigenvalue of 2e-4 N/mm
    np.testing.assert_allclose(once[0][-1], often[0][-1], rtol=0, atol=2e-4)
