"""Computes the loss of a scene by one solver, for timing."""

from __future__ import annotations

from benchmarks.harness import Run, Sample
from benchmarks.scenes import load_cases, work_of
from sim.solvers import Solver, solve_cases


def loss_by_solver(name: str, solver: Solver) -> Run:
    """Computes the loss of a named case by a solver."""
    return loss_of_case(load_cases.case(name), solver)


def loss_of_case(posed: load_cases.LoadCase, solver: Solver) -> Run:
    """Computes the loss of a load case by a solver, compiled before."""

    def run() -> Sample:
        motion, _, records = solve_cases(solver, posed.values, posed.scene.loads.cases)
        work = work_of(records.records[0])
        return Sample(posed.results(*posed.measured(motion, posed.values)), work)

    return warmed_up(run)


def warmed_up(run: Run) -> Run:
    """Runs once, so that nothing is left to compile."""
    run()
    return run
