"""The baseline solves the same problem, and what is skipped by compiling once changes nothing."""

from functools import partial

import numpy as np
import pytest

from benchmarks.harness import errors, result_of
from benchmarks.methods import jax_baseline, selection
from benchmarks.scenes import paper_scenes
from benchmarks.suites import SKIPS, Skip
from sim.scene import Clamp, Evaluator, Scene, make_plan, mimicking, sample_times
from sim.solvers import Harmonic, PrescribedMotion
from sim.structure import quads
from tests.benchmarks.test_suites import COMPILED, refuse_change


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
        frozen=None,
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


def test_the_continuous_adjoint_of_diffrax_comes_to_that_of_its_steps() -> None:
    every = {method.name: method for method in selection.methods("small_wave")}
    discrete, continuous = (
        every[name].prepare(1e-6, "gradient")().values
        for name in ("diffrax Tsit5", "diffrax Tsit5, backsolve")
    )
    found = errors(continuous, discrete)
    assert found["displacement"] < 1e-12  # two programs of the same steps
    assert 0 < found["gradient"] < 1e-3


@pytest.mark.parametrize(
    "skip", [skip for skip in SKIPS if skip.name in COMPILED], ids=lambda skip: skip.name
)
def test_a_skip_changes_nothing_beyond_its_tolerance(skip: Skip) -> None:
    """Each in a process of its own, which has not loaded the loops before."""
    prepare = partial(skip.prepare, "small_wave")
    values = [result_of(prepare, made, "loss") for made in (0.0, 1.0)]
    refuse_change(skip, *values)
