"""The baseline of the benchmarks, compiled as a whole, solves the same problem."""

import numpy as np
import pytest

from benchmarks.methods import jax_baseline
from benchmarks.scenes import paper_scenes
from sim.scene import Clamp, Evaluator, Scene, make_plan, mimicking, sample_times
from sim.solvers import Harmonic, PrescribedMotion
from sim.structure import quads


def small() -> Scene:
    """A lattice of 3 x 3 units shaken for a moment, explicit and tight."""
    lattice = quads(3, 3, 15.0, 2.25, np.deg2rad(20.0))
    return paper_scenes.fig2(accuracy="tight").updated(
        lattice=lattice,
        supports=(Clamp(np.array([0, 2, 6, 8])),),
        cases=(PrescribedMotion(np.array([4]), Harmonic(1.0, 20.0, 0.3)),),
        weights=None,
        duration=0.01,
        frequency=20.0,
        cloak=np.array([1, 3]),
        region=np.array([5, 7]),
        samples=21,
    )


def test_the_baseline_finds_the_same_loss() -> None:
    scene = small()
    start = np.zeros(scene.space.n_variables)
    loss, _, _ = Evaluator(scene, make_plan(scene))(start)
    method = jax_baseline.RungeKutta(rtol=1e-8, atol=1e-8, max_steps=4096)
    of_case = jax_baseline.loss(scene, method, sample_times(scene), mimicking(scene))
    values, work = jax_baseline.prepare(of_case, len(start), "loss")()
    assert float(values["loss"]) == pytest.approx(loss, rel=1e-4)
    assert work["steps"] > 100
