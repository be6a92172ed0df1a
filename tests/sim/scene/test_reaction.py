"""The force of the drive as part of what is mimicked."""

import numpy as np
import pytest

from sim.scene import Evaluator, Scene, make_plan, mimicking, simulate
from tests.sim.load_family.test_load_family import mimicked
from tests.sim.scene.test_plan import design_of
from tests.sim.structures import taylor_orders


def posed(reaction: float = 0.5) -> Scene:
    return mimicked().updated(reaction=reaction)


def test_the_force_of_the_cut_ligaments_is_that_of_the_drive() -> None:
    scene = posed()
    response = simulate(scene, design_of(scene, 0.2))
    measure = mimicking(scene)
    force = measure.force(response.displacement, response.parameters)  # type: ignore[union-attr]
    np.testing.assert_allclose(force, response.drive_force, rtol=1e-9, atol=1e-9)
    intact = simulate(scene.objective.reference).drive_force  # type: ignore[arg-type]
    np.testing.assert_allclose(measure.target, intact, rtol=1e-9, atol=1e-9)  # type: ignore[union-attr]


def test_the_loss_is_the_sum_of_both_errors_and_its_gradient_exact() -> None:
    scene = posed()
    design = design_of(scene, 0.2)
    evaluate = Evaluator(scene, make_plan(scene))
    value, gradient, _ = evaluate(design)
    alone = Evaluator(scene.updated(reaction=0.0), make_plan(scene))(design)[0]
    assert scene.objective.reference is not None
    forces = [simulate(scene, design).drive_force, simulate(scene.objective.reference).drive_force]
    missed, size = np.linalg.norm(forces[0] - forces[1]), np.linalg.norm(forces[1][0, -1])
    assert value == pytest.approx(alone + 0.5 * missed / size, rel=1e-9)
    way = gradient / np.linalg.norm(gradient)
    ahead = taylor_orders(
        lambda step: evaluate(design + step * way)[0], gradient @ way, np.array([2e-3, 1e-3])
    )
    np.testing.assert_allclose(ahead, 2.0, atol=0.07)
