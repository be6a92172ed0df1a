"""Figure 4's loss and gradient at the final load: an equilibrium, against slow damped dynamics."""

from __future__ import annotations

from functools import partial

import numpy as np
from jax import Array

from benchmarks.harness import (
    Benchmark,
    Candidate,
    Run,
    Sample,
    Target,
    error_of,
    seconds_of,
    speed_up,
)
from benchmarks.methods import jax_baseline
from benchmarks.scenes import paper_scenes
from sim.core import Floats
from sim.quasistatics import StaticSolver
from sim.scene import GradientChain, parameters_of_design
from sim.structure import Parameters

OURS, THEIRS, THEIRS_FORWARD = (
    "ours",
    "pseudo-dynamics, diffrax Dopri5",
    "pseudo-dynamics, loss only",
)


def benchmark() -> Benchmark:
    """The benchmark."""
    return Benchmark(
        name="fig4",
        title="strain energy of a region and its gradient at the final load, 15 x 15 units",
        reference=_strict,
        candidates=(
            Candidate(OURS, _ours),
            Candidate(THEIRS, _dynamics_gradient, repeats=1, baseline=True),
            Candidate(THEIRS_FORWARD, _dynamics_loss, repeats=2, baseline=True),
        ),
        targets=(
            Target("final load", seconds_of(OURS), "s", at_most=0.03, aim=0.01),
            Target("loss error", error_of(OURS, "loss"), at_most=1e-9),
            Target("gradient error", error_of(OURS, "gradient"), at_most=1e-7),
            Target("times faster than pseudo-dynamics", speed_up(OURS, THEIRS), at_least=2000),
        ),
    )


def _strict() -> Run:
    """Another way to the same equilibrium: 25 loads, each to a hundredth of the usual residual."""
    return _equilibrium(np.linspace(0.0, 1.0, 26)[1:], 1e-12)


def _ours() -> Run:
    return _equilibrium(np.ones(1), 1e-10)


def _equilibrium(loads: Floats, relative: float) -> Run:
    scene = paper_scenes.fig4()
    solver = StaticSolver(scene.topology, loads, relative=relative)
    energy = paper_scenes.final_energy(scene)

    def final(displacement: Array, values: Parameters[Array]) -> tuple[Array, Array]:
        value = energy(displacement[:, -1:], values)[0]
        return value, value

    evaluate = partial(
        GradientChain(parameters_of_design(scene), final), solver=solver, cases=scene.loads.cases
    )
    start = np.zeros(scene.space.n_variables)
    work = paper_scenes.counted(scene, solver, [0])

    def run() -> Sample:
        value, gradient, _ = evaluate(start)
        return Sample({"loss": np.asarray(value), "gradient": np.asarray(gradient)}, work)

    run()
    return run


def _dynamics_gradient() -> Run:
    return jax_baseline.prepare_gradient(_loss(), paper_scenes.fig4().space.n_variables)


def _dynamics_loss() -> Run:
    return jax_baseline.prepare_loss(_loss(), paper_scenes.fig4().space.n_variables)


def _loss() -> jax_baseline.Loss:
    scene = paper_scenes.fig4_as_dynamics()
    method = jax_baseline.RungeKutta(rtol=1e-8, atol=1e-8)
    end = np.array([scene.loads.duration])
    return jax_baseline.loss(scene, 0, method, end, paper_scenes.final_energy(scene))
