"""The measured scenes are what they are said to be, and the baseline solves the same problem."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest

from benchmarks.methods import jax_baseline
from benchmarks.scenes import paper_scenes
from sim.energy import gradient, system_of
from sim.scene import concrete_parameters, parameters_of_design
from sim.solvers import Harmonic


def test_counts_of_variables() -> None:
    assert paper_scenes.fig2().space.n_variables == 304
    assert paper_scenes.fig2(symmetry="C4").space.n_variables == 76
    assert paper_scenes.fig4().space.n_variables == 280


def test_one_case_keeps_its_direction() -> None:
    (motion,) = paper_scenes.one_case(paper_scenes.fig2(), 135.0).loads.motions
    assert isinstance(motion, Harmonic)
    assert float(motion.direction) == pytest.approx(np.deg2rad(135.0))


def test_the_baseline_has_the_same_forces() -> None:
    scene = paper_scenes.fig2()
    values = concrete_parameters(scene, scene.lattice.vertices)
    motion = 0.05 * np.random.default_rng(0).normal(size=scene.topology.n_dofs)
    ours = np.empty_like(motion)
    gradient(motion, system_of(scene.topology, values), np.empty((225, 4)), ours)
    made = parameters_of_design(scene)(jnp.zeros(scene.space.n_variables))
    theirs = jax_baseline.force(scene)(made, jnp.asarray(motion.reshape(-1, 3)))
    np.testing.assert_allclose(np.ravel(theirs), ours, atol=1e-12 * np.abs(ours).max())
