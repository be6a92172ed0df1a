"""The gradient that an optimiser sees is that of the loss it sees, in every static study.

The design is the initial lattice, every variable moved a little at random, and is varied along a
random direction. The steps are so small that hardly a void or gap crosses the contact's cutoff.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pipeline import problem
from pipeline.posing import law_comparison, scene_of
from pipeline.runtime import ROOT
from sim.core import Floats
from sim.quasistatics import StaticSolver
from sim.scene import Evaluator, Scene, make_plan

PROBLEMS = {path.parent.name: path for path in ROOT.glob("experiments/*/problem.yaml")}
STATIC = sorted(name for name, path in PROBLEMS.items() if problem.load(path).static)
LARGEST = 0.02
"""mm by which the variables of the design differ from the initial lattice."""
STEPS = np.geomspace(1e-4, 1e-5, 4)
"""mm along the direction."""
H = 1e-4

Evaluate = Callable[[Floats], tuple[float, Floats, Floats]]


def posed(path: Path, law: str) -> tuple[Scene, Evaluate]:
    """A study's scene under a law of contact, its equilibria to almost all digits."""
    asked = problem.load(path)
    scene = scene_of(law_comparison.under(asked, law), path.parent)
    plan = make_plan(scene)
    assert isinstance(plan.solver, StaticSolver)
    return scene, Evaluator(scene, replace(plan, solver=replace(plan.solver, relative=1e-13)))


@pytest.mark.parametrize("law", ["angle", "geometric"])
@pytest.mark.parametrize("name", STATIC)
def test_the_gradient_of_a_study(name: str, law: str) -> None:
    scene, evaluate = posed(PROBLEMS[name], law)
    start, direction = np.random.default_rng(3).uniform(-1, 1, (2, scene.space.n_variables))
    loss, gradient, _ = evaluate(LARGEST * start)
    slope = float(gradient @ direction)

    def change(step: float) -> float:
        return evaluate(LARGEST * start + step * direction)[0] - loss

    remainders = [abs(change(step) - step * slope) for step in STEPS]
    order = np.polyfit(np.log(STEPS), np.log(remainders), 1)[0]
    central = (8 * (change(H) - change(-H)) - (change(2 * H) - change(-2 * H))) / (12 * H)
    assert order == pytest.approx(2.0, abs=0.05)
    assert slope == pytest.approx(central, rel=1e-6)
