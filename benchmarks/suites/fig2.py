"""Measures Figure 2's loss and gradient over four load angles: one evaluation of a design."""

from functools import partial

import numpy as np

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
from sim.scene import Evaluator, make_plan, mimicking, sample_times
from sim.structure import Symmetry

ANGLES = (0.0, 45.0, 90.0, 135.0)
MEASURED_ANGLE = 45.0
"""The one angle that the baseline is measured at."""
OURS, OURS_C4, THEIRS = "ours", "ours, C4 symmetry", "diffrax Dopri5"


def suite() -> Suite:
    """Makes the suite."""
    note = f"one angle ({MEASURED_ANGLE:g} deg) measured; times are of four: scaled"
    theirs = partial(Method, own=False, share=0.25, baseline=True, note=note)
    return in_turn(
        "fig2",
        "loss and gradient over four load angles, 15 x 15 units, 1 s at 2 Hz",
        ("our explicit integrator of order 4 at the tight accuracy", _tight),
        (
            Method(OURS, partial(_ours, "none")),
            Method(OURS_C4, partial(_ours, "C4")),
            theirs(THEIRS, partial(_diffrax, "gradient"), repeats=1),
            theirs(f"{THEIRS}, loss only", partial(_diffrax, "loss"), repeats=2),
        ),
        (
            Target("four angles, no symmetry", seconds_of(OURS), "s", at_most=0.8, aim=0.3),
            Target("loss error", error_of(OURS, "loss"), at_most=1e-4),
            Target("gradient error", error_of(OURS, "gradient"), at_most=3e-4),
            Target("times faster than diffrax", time_ratio(THEIRS, OURS), at_least=200),
            Target("times faster, C4", time_ratio(THEIRS, OURS_C4), at_least=200),
        ),
        225,
    )


def _tight() -> Run:
    """Solves by our explicit integrator of order 4 at the tight accuracy, each angle by itself."""
    scene = paper_scenes.fig2(accuracy="tight")
    angles = [paper_scenes.one_case(scene, degrees) for degrees in ANGLES]
    evaluates = [Evaluator(angle, make_plan(angle)) for angle in angles]
    symmetric = paper_scenes.fig2(symmetry="C4").space.basis

    def run() -> Sample:
        found = [evaluate(np.zeros(scene.space.n_variables)) for evaluate in evaluates]
        losses = np.array([loss for loss, _, _ in found])
        gradients = np.array([gradient for _, gradient, _ in found])
        gradient = gradients.mean(axis=0)
        values = {
            "loss": np.asarray(losses.mean()),
            "gradient": gradient,
            "gradient@C4": gradient @ symmetric,
        }
        measured = ANGLES.index(MEASURED_ANGLE)
        values |= {"loss@one": losses[measured], "gradient@one": gradients[measured]}
        return Sample(values, {})

    return run


def _ours(symmetry: Symmetry) -> Run:
    scene = paper_scenes.fig2(symmetry=symmetry)
    plan = make_plan(scene)
    evaluate, start = Evaluator(scene, plan), np.zeros(scene.space.n_variables)
    work = paper_scenes.counted(scene, plan.solver, [int(case) for case in plan.simulated])
    name = "gradient" if symmetry == "none" else f"gradient@{symmetry}"

    def run() -> Sample:
        loss, gradient, _ = evaluate(start)
        return Sample({"loss": np.asarray(loss), name: gradient}, work)

    run()
    return run


def _diffrax(task: Task) -> Run:
    scene = paper_scenes.one_case(paper_scenes.fig2(), MEASURED_ANGLE)
    method = jax_baseline.RungeKutta(rtol=1e-8, atol=1e-4)
    loss = jax_baseline.loss(scene, method, sample_times(scene), mimicking(scene))
    return jax_baseline.prepare(loss, scene.space.n_variables, task, "@one")
