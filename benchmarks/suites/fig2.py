"""Figure 2's loss and gradient over four load angles: what one evaluation of a design costs."""

from __future__ import annotations

from functools import partial

import numpy as np

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
from sim.scene import Evaluator, make_plan, mimicking, sample_times
from sim.structure import Symmetry

ANGLES = (0.0, 45.0, 90.0, 135.0)
MEASURED_ANGLE = 45.0
"""The one angle that the baseline is measured at."""
OURS, OURS_C4, THEIRS, THEIRS_FORWARD = (
    "ours",
    "ours, C4 symmetry",
    "diffrax Dopri5",
    "diffrax Dopri5, loss only",
)


def benchmark() -> Benchmark:
    """The benchmark."""
    one_angle = f"one angle ({MEASURED_ANGLE:g} deg) measured; times are of four: scaled"
    return Benchmark(
        name="fig2",
        title="loss and gradient over four load angles, 15 x 15 units, 1 s at 2 Hz",
        reference=_tight,
        candidates=(
            Candidate(OURS, partial(_ours, "none")),
            Candidate(OURS_C4, partial(_ours, "C4")),
            Candidate(
                THEIRS, _diffrax_gradient, repeats=1, share=0.25, baseline=True, note=one_angle
            ),
            Candidate(
                THEIRS_FORWARD, _diffrax_loss, repeats=2, share=0.25, baseline=True, note=one_angle
            ),
        ),
        targets=(
            Target("four angles, no symmetry", seconds_of(OURS), "s", at_most=0.8, aim=0.3),
            Target("loss error", error_of(OURS, "loss"), at_most=1e-4),
            Target("gradient error", error_of(OURS, "gradient"), at_most=3e-4),
            Target("times faster than diffrax", speed_up(OURS, THEIRS), at_least=200),
            Target("times faster, C4", speed_up(OURS_C4, THEIRS), at_least=200),
        ),
    )


def _tight() -> Run:
    """Our explicit integrator of order 4 at the tight accuracy, each angle by itself."""
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


def _diffrax_gradient() -> Run:
    scene = paper_scenes.one_case(paper_scenes.fig2(), MEASURED_ANGLE)
    return _at_one_angle(jax_baseline.prepare_gradient(_loss(), scene.space.n_variables))


def _diffrax_loss() -> Run:
    scene = paper_scenes.one_case(paper_scenes.fig2(), MEASURED_ANGLE)
    return _at_one_angle(jax_baseline.prepare_loss(_loss(), scene.space.n_variables))


def _loss() -> jax_baseline.Loss:
    scene = paper_scenes.one_case(paper_scenes.fig2(), MEASURED_ANGLE)
    method = jax_baseline.RungeKutta(rtol=1e-8, atol=1e-4)
    return jax_baseline.loss(scene, 0, method, sample_times(scene), mimicking(scene))


def _at_one_angle(whole: Run) -> Run:
    def run() -> Sample:
        values, work = whole()
        return Sample({f"{name}@one": value for name, value in values.items()}, work)

    return run
