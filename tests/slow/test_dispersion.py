"""The steps that a plan chooses for the lattice of Figure 7, intact and with its void."""

from dataclasses import replace

import numpy as np

from pipeline import problem
from pipeline.posing import scene_of
from pipeline.runtime import ROOT
from sim.core import Floats
from sim.scene import Scene, concrete_parameters, make_plan, mimicking
from sim.solvers import solve_case
from sim.time_integration import ExplicitSolver

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
