"""Samples the spread of a simulation under tolerances of specimens and constants.

Specimens are drawn (pipeline/posing/perturbed.py) and simulated under the same drive. The
band between
two quantiles of theirs, taken at p (n + 1) (Weibull's), holds the next specimen with the stated
probability, at each instant and for each unit by itself.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from pipeline.comparison.redrive import HeldMotion, drive_as_measured
from pipeline.posing import PosedStructure, drawn
from pipeline.problem import Problem
from pipeline.runtime import cli
from sim.core import Floats, Ints
from sim.energy import observe
from sim.quasistatics import StaticSolver
from sim.scene import Scene, cases_of, drive_force, make_plan, simulate
from sim.solvers import Measure, Solved, Solver, run_batch

STREAM = 1
"""First word of the seeds of all draws here, so that no other specimen equals one of them."""


class Specimens(NamedTuple):
    """Holds specimens that were simulated."""

    displacement: Floats  # (n_samples, n_times, n_units, 3) of the units of the structure's lattice
    drive_force: Floats  # (n_samples, n_times, 2) force of the drive on all its units, N
    failures: tuple[str, ...]  # of each specimen drawn that has no simulation, why


def sample_specimens(
    asked: Problem,
    structure: PosedStructure,
    times: Floats,
    held: HeldMotion | None = None,
    case: int = 0,
    threads: int = 1,
) -> Specimens:
    """Draws and simulates specimens of a structure, as many and as far off as the problem asks for.

    `times` (n_times,) are those of the output, ascending, s; `held` is the measured motion that
    drives them in place of the planned one of a load case.

    Raises:
        SimulationError: the structure as designed cannot be simulated.
    """
    planned, vertices = structure
    scene = planned.alone(case) if held is None else drive_as_measured(planned, held)
    seeds = [(STREAM, asked.prediction.seed, number) for number in range(asked.prediction.samples)]
    made = [drawn(scene, vertices, asked.tolerances, seed) for seed in seeds]
    failures = [copy.failure for copy in made if copy.failure is not None]
    solver = _solver(scene, vertices, times)
    cases = (
        case
        for copy in made
        if copy.failure is None
        for case in cases_of(copy.scene, copy.vertices, solver)
    )
    courses, leading = [], planned.loads.cases[case].leading
    with cli.progress(len(made), "specimens", initial=len(failures)) as bar:
        for outcome in run_batch(cases, _measure(scene, leading), threads):
            if outcome.value is None:
                failures.append(outcome.failure or "")
            else:
                courses.append(outcome.value)
            bar.update(failed=len(failures))
    shape = (len(courses), len(times))
    return Specimens(
        np.array([motion for motion, _ in courses]).reshape(*shape, scene.lattice.n_units, 3),
        np.array([force for _, force in courses]).reshape(*shape, 2),
        tuple(failures),
    )


def _solver(scene: Scene, vertices: Floats, times: Floats) -> Solver:
    """The plan's solver; of a path of equilibria, with the steps of the structure as designed."""
    plan = make_plan(scene, vertices, times, gradient=False)
    solver = plan.solver
    if not isinstance(solver, StaticSolver):
        return solver
    response = simulate(scene, vertices=vertices, plan=plan)
    return replace(solver, start=response.records[0])


def _measure(scene: Scene, leading: Ints) -> Measure[tuple[Floats, Floats]]:
    def reduce(solved: Solved) -> tuple[Floats, Floats]:
        case, motion = solved.case, solved.displacement
        seen = observe(scene.topology, case.values, motion)
        times = case.solver.output_times
        return motion, drive_force(scene, case.values, seen, case.drive, times, leading)

    return reduce


def band_limits(values: Floats, level: float) -> Floats:
    """Computes lower limit, median and upper limit (3, ...) of samples (n_samples, ...).

    The limits hold the next sample with the probability ``level``; with too few samples for that
    they are the least and the greatest of them.
    """
    below = (1 - level) / 2
    shares = [below, 0.5, 1 - below]
    return np.asarray(np.quantile(values, shares, axis=0, method="weibull"))


def widen_band(band: Floats, sigma: Floats, level: float) -> Floats:
    """Widens the band (3, ...) by standard uncertainties ``sigma`` (...) of a measurement."""
    low, middle, high = band
    noise = ndtri((1 + level) / 2) * sigma
    return np.stack(
        [middle - np.hypot(middle - low, noise), middle, middle + np.hypot(high - middle, noise)]
    )
