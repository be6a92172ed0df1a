"""Measures Figure 4's loss and gradient at the final load: equilibrium against damped dynamics."""

from functools import partial

import numpy as np
from jax import Array

from benchmarks.harness import (
    Method,
    Run,
    Sample,
    Suite,
    Target,
    Task,
    error_of,
    in_turn,
    seconds_of,
    time_ratio,
)
from benchmarks.methods import jax_baseline
from benchmarks.scenes import paper_scenes
from sim.core import Floats
from sim.quasistatics import StaticSolver
from sim.scene import GradientChain, parameters_of_design
from sim.structure import Parameters

OURS, THEIRS = "ours", "pseudo-dynamics, diffrax Dopri5"


def suite() -> Suite:
    """Makes the suite."""
    theirs = partial(Method, own=False, baseline=True)
    strict = partial(_equilibrium, np.linspace(0.0, 1.0, 26)[1:], 1e-12)
    return in_turn(
        "fig4",
        "strain energy of a region and its gradient at the final load, 15 x 15 units",
        ("the same equilibrium by 25 loads, each to a hundredth of the usual residual", strict),
        (
            Method(OURS, partial(_equilibrium, np.ones(1), 1e-10)),
            theirs(THEIRS, partial(_dynamics, "gradient"), repeats=1),
            theirs("pseudo-dynamics, loss only", partial(_dynamics, "loss"), repeats=2),
        ),
        (
            Target("final load", seconds_of(OURS), "s", at_most=0.03, aim=0.01),
            Target("loss error", error_of(OURS, "loss"), at_most=1e-9),
            Target("gradient error", error_of(OURS, "gradient"), at_most=1e-7),
            Target("times faster than pseudo-dynamics", time_ratio(THEIRS, OURS), at_least=2000),
        ),
        225,
    )


def _equilibrium(loads: Floats, relative: float) -> Run:
    scene = paper_scenes.fig4()
    solver = StaticSolver(scene.topology, loads, relative=relative)
    energy = paper_scenes.final_energy(scene)

    def final(displacement: Array, values: Parameters[Array]) -> tuple[Array, Array]:
        value = energy(displacement[:, -1:], values)[0]
        return value, value

    evaluate = partial(
        GradientChain(parameters_of_design(scene), final, designed=True),
        solver=solver,
        cases=scene.loads.cases,
    )
    start = np.zeros(scene.space.n_variables)
    work = paper_scenes.counted(scene, solver, [0])

    def run() -> Sample:
        value, gradient, _ = evaluate(start)
        return Sample({"loss": np.asarray(value), "gradient": np.asarray(gradient)}, work)

    run()
    return run


def _dynamics(task: Task) -> Run:
    scene = paper_scenes.fig4_as_dynamics()
    method = jax_baseline.RungeKutta(rtol=1e-8, atol=1e-8)
    end = np.array([scene.loads.duration])
    loss = jax_baseline.loss(scene, method, end, paper_scenes.final_energy(scene))
    return jax_baseline.prepare(loss, scene.space.n_variables, task)
