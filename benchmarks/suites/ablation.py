"""Measures what a plan can skip, each with and without: the same result for less time.

A skip is prepared with the scene it stands on and whether it is made; its run gives results that
must not depend on that beyond the tolerance stated.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from benchmarks.harness import (
    Measurement,
    MeasuringLimits,
    Method,
    Run,
    Sample,
    Task,
    Tell,
    measure_settings,
    result_of,
)
from benchmarks.methods import gradient_run, loss_run, warmed_up
from benchmarks.scenes import load_cases
from benchmarks.suites import fresh_process, warm
from sim.energy import observe
from sim.scene import Evaluator, make_plan
from sim.solvers import Harmonic, LinearRamp, solve_cases, with_full_adjoint
from sim.time_integration import ImplicitSolver

ROUNDING = 1e-12
DONE, SKIPPED = "done", "skipped"
SLOW_DURATION = 20.0
"""Periods of a static scene's load when its inertia is not left out, s."""


@dataclass(frozen=True)
class Skip:
    """Names something that a plan leaves out."""

    name: str  # what
    prepare: Callable[[str, float, Task], Run]  # for a scene's name, and whether it is skipped
    wave: bool  # whether it stands on the scene in time, or on the static one
    tolerance: float  # relative change of the results that it may make
    why: str  # why it may be left out
    repeats: int | None = None  # at most so many runs; the first alone if that is measured


def unloaded_reference(name: str, skipped: float, _: Task) -> Run:
    """Compares the region with the unloaded lattice at rest, or with its simulation."""
    posed = load_cases.case(name)
    solver = make_plan(posed.scene).solver
    still = posed.scene.driven_by(*map(_with_zero_amplitude, posed.scene.loads.motions))

    def simulated() -> Sample:
        rest, *_ = solve_cases(solver, posed.values, still.loads.cases)
        moved, *_ = solve_cases(solver, posed.values, posed.scene.loads.cases)
        return Sample(posed.results(*posed.measured(moved - rest, posed.values)), {})

    return warmed_up(loss_run(posed, solver) if skipped else simulated)


def _with_zero_amplitude(motion: object) -> Harmonic | LinearRamp:
    assert isinstance(motion, Harmonic | LinearRamp)
    return motion._replace(amplitude=0.0)


def distant_contact(name: str, skipped: float, _: Task) -> Run:
    """Evaluates contact in ligaments whose voids are wide open, or checks it after the run.

    On implicit steps, whichever the plan chooses: explicit ones evaluate every ligament.
    """
    solver = make_plan(load_cases.scene(name).updated(integrator="implicit")).solver
    assert isinstance(solver, ImplicitSolver)
    used = solver if skipped else replace(solver, turn_allowance=np.inf)
    return warmed_up(loss_run(load_cases.case(name), used))


def inertia(name: str, skipped: float, _: Task) -> Run:
    """Solves a slow load as equilibria, or as the motion that it is."""
    scene = load_cases.scene(name)
    (ramp,) = scene.loads.motions
    assert isinstance(ramp, LinearRamp)
    slow = scene.driven_by(
        ramp._replace(duration=SLOW_DURATION),
        static=False,
        duration=SLOW_DURATION,
        integrator="implicit",
    )
    plan = make_plan(scene if skipped else slow)
    posed = load_cases.LoadCase(scene if skipped else slow, load_cases.case(name).target)
    return warmed_up(loss_run(posed, plan.solver))


def other_outputs(name: str, skipped: float, _: Task) -> Run:
    """Observes energies, reactions and void angles at every sample, without need."""
    posed = load_cases.case(name)
    solver = make_plan(posed.scene).solver

    def run() -> Sample:
        motion, *_ = solve_cases(solver, posed.values, posed.scene.loads.cases)
        if not skipped:
            observe(posed.scene.topology, posed.values, motion[0])
        return Sample(posed.results(*posed.measured(motion, posed.values)), {})

    return warmed_up(run)


def far_derivatives(name: str, skipped: float, _: Task) -> Run:
    """Differentiates by the parameters of ligaments that the design does not move."""
    posed = load_cases.case(name)
    solver = make_plan(posed.scene).solver
    if not skipped:
        solver = with_full_adjoint(solver)
    return warmed_up(gradient_run(posed, solver, {}))


def equal_cases(name: str, skipped: float, _: Task) -> Run:
    """Solves load cases that are copies of others, turned by a quarter."""
    scene = load_cases.symmetric(name)
    evaluate = Evaluator(scene, make_plan(scene, every_case=not skipped))
    start = np.zeros(scene.space.n_variables)

    def run() -> Sample:
        loss, gradient, _ = evaluate(start)
        return Sample({"loss": np.asarray(loss), "gradient": gradient}, {})

    return warmed_up(run)


def cold_start(name: str, skipped: float, _: Task) -> Run:
    """Follows paths from rest for every design, or from the last design's."""
    return warm.walk(load_cases.scene(name), 1e-10, warm=bool(skipped))


SKIPS = (
    Skip("unloaded reference", unloaded_reference, True, ROUNDING, "it is zero"),
    Skip("contact of open voids", distant_contact, True, ROUNDING, "checked after each solve"),
    Skip("inertia", inertia, False, 1e-2, "a slow load is a row of equilibria"),
    Skip("outputs not asked for", other_outputs, True, ROUNDING, "the loss needs motions alone"),
    Skip("far derivatives", far_derivatives, True, ROUNDING, "the design moves no ligament there"),
    Skip("equal load cases", equal_cases, True, 1e-6, "the symmetry turns one into the other"),
    Skip("paths from rest", cold_start, False, 1e-9, "a similar design's path is near"),
    Skip("compilation", fresh_process.compilation, True, ROUNDING, "loops are on the disk", 1),
    Skip("fresh factors", fresh_process.factors, True, 1e-4, "stages have a tolerance anyway"),
)


def measure(waves: str, pushes: str, limits: MeasuringLimits, tell: Tell) -> list[Measurement]:
    """Measures every skip on its scene, made and not made, each in a process of its own.

    Errors are what the results change by if it is not skipped.
    """
    measured: list[Measurement] = []
    for skip in SKIPS:
        name = waves if skip.wave else pushes
        units, prepare = load_cases.scene(name).lattice.n_units, partial(skip.prepare, name)
        reference = result_of(prepare, 1.0, "loss")
        for setting in ((DONE, 0.0), (SKIPPED, 1.0)):
            method = Method(skip.name, prepare, (setting,), True, ("loss",), skip.repeats)
            measured += measure_settings(method, reference, units, limits, tell)
    return measured
