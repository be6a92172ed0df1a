"""The measured scenes are what they are said to be, and the baseline solves the same problem."""

from __future__ import annotations

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks import baseline, scenes
from sim.evaluation import evaluator, objective, structure
from sim.lattice import quads
from sim.loads import Harmonic, held_dofs
from sim.plan import concrete_parameters, make_plan, sample_times
from sim.potential import gradient
from sim.scene import Scene
from sim.system import system_of


def small() -> Scene:
    """A lattice of 3 x 3 units shaken for a moment, explicit and tight."""
    lattice = quads(3, 3, 15.0, 2.25, np.deg2rad(20.0))
    return replace(
        scenes.fig2(accuracy="tight"),
        lattice=lattice,
        clamped=held_dofs(np.array([0, 2, 6, 8]), np.array([], dtype=np.int64)),
        driven=np.array([4]),
        motions=(Harmonic(1.0, 20.0, 0.3),),
        weights=np.ones(1),
        duration=0.01,
        frequency=20.0,
        cloak=np.array([1, 3]),
        region=np.array([5, 7]),
        samples=21,
    )


def test_counts_of_variables() -> None:
    assert scenes.fig2().space.n_variables == 304
    assert scenes.fig2(symmetry="C4").space.n_variables == 76
    assert scenes.fig4().space.n_variables == 280


def test_one_case_keeps_its_direction() -> None:
    (motion,) = scenes.one_case(scenes.fig2(), 135.0).motions
    assert isinstance(motion, Harmonic)
    assert float(motion.direction) == pytest.approx(np.deg2rad(135.0))


def test_the_baseline_has_the_same_forces() -> None:
    scene = scenes.fig2()
    values = concrete_parameters(scene, scene.lattice.vertices)
    motion = 0.05 * np.random.default_rng(0).normal(size=scene.topology.n_dofs)
    ours = np.empty_like(motion)
    gradient(motion, system_of(scene.topology, values), np.empty((225, 4)), ours)
    made = structure(scene)(jnp.zeros(scene.space.n_variables))
    theirs = baseline.force(scene)(made, jnp.asarray(motion.reshape(-1, 3)))
    np.testing.assert_allclose(np.ravel(theirs), ours, atol=1e-12 * np.abs(ours).max())


def test_the_baseline_finds_the_same_loss() -> None:
    scene = small()
    start = np.zeros(scene.space.n_variables)
    loss, _, _ = evaluator(scene, make_plan(scene))(start)
    method = baseline.RungeKutta(rtol=1e-8, atol=1e-8, max_steps=4096)
    of_case = baseline.loss(scene, 0, method, sample_times(scene), objective(scene))
    values, work = baseline.prepare_loss(of_case, len(start))()
    assert float(values["loss"]) == pytest.approx(loss, rel=1e-4)
    assert work["steps"] > 100
