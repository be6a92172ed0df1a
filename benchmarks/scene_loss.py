"""Runs of a scene's loss."""

from __future__ import annotations

from benchmarks.frame import Run, Sample
from benchmarks.ladders import cases
from benchmarks.scenes import work_of
from sim import dynamics
from sim.dynamics import Solver


def loss(name: str, solver: Solver) -> Run:
    """Run of the loss alone by a solver."""
    return _loss_of(cases.case(name), solver)


def _loss_of(posed: cases.Case, solver: Solver) -> Run:
    def run() -> Sample:
        motion, _, records = dynamics.forward(solver, posed.values, posed.scene.drives)
        work = work_of(records.records[0])
        return Sample(posed.results(*posed.measured(motion, posed.values)), work)

    return _warmed(run)


def _warmed(run: Run) -> Run:
    run()
    return run
