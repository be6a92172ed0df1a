"""Measures work against precision of our own integrators, on Figure 2's load case at 45 deg."""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from benchmarks.harness import Method, Run, Sample, Suite, Target, error_of, in_turn
from benchmarks.methods import SPLITTINGS, refined_times
from benchmarks.scenes import paper_scenes
from pipeline.runtime import ROOT
from sim.scene import Accuracy, DisplacementMimicking, Scene, make_plan, parameters_of_design
from sim.solvers import Solver, differentiable_motion
from sim.time_integration import ExplicitSolver, ImplicitSolver

SAMPLES = np.linspace(0.0, 1.0, 200)
"""The authors' samples: the loss is their plain sum over these."""
AUTHORS = ROOT / "tests/data/reference/scene_A.npz"
AUTHORS_NAME = "authors' framework, tight"
AUTHORS_NOTE = (
    "stored results (tests/data/reference), their gradient good to 1e-5: an independent check of"
    " the reference solution"
)
STEPS = (("leapfrog", 25_000), ("leapfrog", 40_000), ("Blanes-Moan", 15_000))


def suite() -> Suite:
    """Makes the suite."""
    grids: list[tuple[Accuracy, int]] = [("draft", 0), *(("default", k) for k in range(3))]
    methods = [
        Method(
            f"implicit, {accuracy}" + (f", steps / {2**halvings}" if halvings else ""),
            partial(_run_with, partial(_implicit, accuracy, halvings)),
        )
        for accuracy, halvings in grids
    ]
    for method, n_steps in STEPS:
        run = partial(_run_with, partial(_explicit, method, n_steps))
        methods.append(Method(f"explicit, {method}, {n_steps} steps", run, repeats=2))
    methods.append(Method(AUTHORS_NAME, _stored, own=False, timed=False, note=AUTHORS_NOTE))
    errors = (
        ("loss error at default", "implicit, default", "loss", 2e-4),
        ("gradient error at default", "implicit, default", "gradient", 3e-4),
        ("reference against the authors' loss", AUTHORS_NAME, "loss", 1e-6),
    )
    subject = "time against error, loss and gradient of one load angle (45 deg)"
    strict = partial(_run_with, partial(_explicit, "Blanes-Moan", 36_000), warm=False)
    reference = ("our explicit method of order 4 with 36 000 steps", strict)
    targets = (Target(told, error_of(*of), at_most=limit) for told, *of, limit in errors)
    return in_turn("precision", subject, reference, tuple(methods), tuple(targets), 225)


def _scene() -> Scene:
    return paper_scenes.one_case(paper_scenes.fig2(), 45.0)


def _implicit(accuracy: Accuracy, halvings: int, scene: Scene) -> Solver:
    asked = scene.updated(accuracy=accuracy, integrator="implicit")
    solver = make_plan(asked, times=SAMPLES).solver
    assert isinstance(solver, ImplicitSolver)
    return replace(solver, times=refined_times(solver.times, halvings))


def _explicit(method: str, n_steps: int, scene: Scene) -> Solver:
    return ExplicitSolver(
        scene.topology, scene.loads.duration, n_steps, SAMPLES, splitting=SPLITTINGS[method]
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
    """Returns the authors' own results for this load case."""
    scene = _scene()
    spacing = scene.lattice.spacing
    with np.load(AUTHORS) as stored:
        values = {
            "rms": stored["roi_displacement_tight_mm_mm_rad"] / np.array([spacing, spacing, 1.0]),
            "loss": stored["loss_tight"],
            "gradient": paper_scenes.by_variable(scene, dict(stored)),
        }
    return partial(Sample, values, {})
