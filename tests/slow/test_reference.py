"""Agreement with the paper's own code at the accuracy that takes the shortest steps."""

from tests.sim.scene.test_reference import assert_agrees_with_scene_a, outcome_of_scene_a


def test_scene_a_at_tight_accuracy() -> None:
    assert_agrees_with_scene_a(outcome_of_scene_a("tight"), motion=1e-4, loss=1e-6, gradient=5e-5)
