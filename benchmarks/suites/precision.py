"""Work against precision of our own integrators, on Figure 2's load case at 45 deg."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from benchmarks.harness import Benchmark, Candidate, Run, Sample, Target, error_of
from benchmarks.scenes import paper_scenes
from sim.scene import Accuracy, DisplacementMimicking, Scene, make_plan, parameters_of_design
from sim.solvers import Solver, differentiable_motion
from sim.time_integration import (
    BLANES_MOAN,
    LEAPFROG,
    ExplicitSolver,
    ImplicitSolver,
    Splitting,
    halved,
)

SAMPLES = np.linspace(0.0, 1.0, 200)
"""The authors' samples: the loss is their plain sum over these."""
AUTHORS = Path(__file__).resolve().parents[2] / "tests/data/reference/scene_A.npz"
AUTHORS_NAME = "authors' framework, tight"
METHODS: dict[str, Splitting] = {"leapfrog": LEAPFROG, "Blanes-Moan": BLANES_MOAN}
STEPS = (
    ("leapfrog", 20_000),
    ("leapfrog", 40_000),
    ("Blanes-Moan", 12_000),
)


def benchmark() -> Benchmark:
    """The benchmark."""
    implicit: list[tuple[Accuracy, int]] = [("draft", 0), *(("default", k) for k in range(3))]
    return Benchmark(
        name="precision",
        title="time against error, loss and gradient of one load angle (45 deg)",
        reference=partial(_run_with, partial(_explicit, "Blanes-Moan", 36_000), warm=False),
        candidates=(
            *(
                Candidate(_implicit_name(*grid), partial(_run_with, partial(_implicit, *grid)))
                for grid in implicit
            ),
            *(
                Candidate(
                    f"explicit, {method}, {n_steps} steps",
                    partial(_run_with, partial(_explicit, method, n_steps)),
                    repeats=2,
                )
                for method, n_steps in STEPS
            ),
            Candidate(
                AUTHORS_NAME,
                _stored,
                timed=False,
                note="stored results (tests/data/reference), their gradient good to 1e-5: an"
                " independent check of the reference solution",
            ),
        ),
        targets=(
            Target("loss error at default", error_of("implicit, default", "loss"), at_most=2e-4),
            Target(
                "gradient error at default", error_of("implicit, default", "gradient"), at_most=3e-4
            ),
            Target(
                "reference against the authors' loss", error_of(AUTHORS_NAME, "loss"), at_most=1e-6
            ),
        ),
    )


def _implicit_name(accuracy: Accuracy, halvings: int) -> str:
    return f"implicit, {accuracy}" + (f", steps / {2**halvings}" if halvings else "")


def _scene() -> Scene:
    return paper_scenes.one_case(paper_scenes.fig2(), 45.0)


def _implicit(accuracy: Accuracy, halvings: int, scene: Scene) -> Solver:
    asked = scene.updated(accuracy=accuracy, integrator="implicit")
    solver = make_plan(asked, times=SAMPLES).solver
    assert isinstance(solver, ImplicitSolver)
    times = solver.times
    for _ in range(halvings):
        times = halved(times)
    return replace(solver, times=times)


def _explicit(method: str, n_steps: int, scene: Scene) -> Solver:
    return ExplicitSolver(
        scene.topology, scene.loads.duration, n_steps, SAMPLES, splitting=METHODS[method]
    )


def _run_with(make: partial[Solver], warm: bool = True) -> Run:
    scene = _scene()
    solver = make(scene)
    of_design, spacing = parameters_of_design(scene), scene.lattice.spacing
    measure = jax.jit(DisplacementMimicking(scene.objective.region, spacing, np.ones(200)).__call__)
    scale = np.array([spacing, spacing, 1.0])

    def loss(design: Array) -> tuple[Array, Array]:
        values = of_design(design)
        displacement = differentiable_motion(solver, values, scene.loads.cases).displacement
        return measure(displacement, values)[0], displacement[0]

    evaluate = jax.value_and_grad(loss, has_aux=True)
    start = jnp.zeros(scene.space.n_variables)
    work = paper_scenes.counted(scene, solver, [0]) if warm else {}

    def run() -> Sample:
        (value, motion), gradient = evaluate(start)
        values = {
            "rms": np.asarray(motion)[:, scene.objective.region] / scale,
            "loss": np.asarray(value),
            "gradient": np.asarray(gradient),
        }
        return Sample(values, work)

    if warm:
        run()
    return run


def _stored() -> Run:
    """The authors' own results for this load case."""
    scene = _scene()
    spacing = scene.lattice.spacing
    with np.load(AUTHORS) as stored:
        motion = stored["roi_displacement_tight_mm_mm_rad"] / np.array([spacing, spacing, 1.0])
        values = {
            "rms": motion,
            "loss": stored["loss_tight"],
            "gradient": paper_scenes.by_variable(scene, dict(stored)),
        }

    def run() -> Sample:
        return Sample(values, {})

    return run
