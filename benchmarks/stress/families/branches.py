"""Paths that end in a limit point or branch."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from benchmarks.stress import (
    Check,
    StressCase,
    StressFamily,
    StressScene,
    admissible,
    apart,
    balanced,
    posed,
    solved,
    squares,
)
from sim.quasistatics import static_solver
from sim.solvers import LinearRamp, TimeSeries
from sim.structure import quads


def family() -> StressFamily:
    """The family."""
    return StressFamily(
        "branches",
        "straight chains that buckle, bowed ones that snap through, thin lattices that fold: by few"
        " load steps and by many",
        "every state a minimum of the definition's energy; a path without a jump in the record ends"
        " where one of ten times the steps does",
        _cases,
    )


def _cases(small: bool) -> Iterator[StressCase]:
    lengths = (9,) if small else (5, 9, 21, 41)
    for length in lengths:
        for n_loads in (1,) if small else (1, 3, 10, 50):
            for name, case in _paths(length):
                attempt = partial(_followed, case, n_loads)
                yield StressCase(f"{name} of {length} units in {n_loads} loads", attempt)


def _paths(length: int) -> Iterator[tuple[str, StressScene]]:
    chain = quads(length, 1, 15.0, 2.25, 0.0)
    push = LinearRamp(-0.6 * length, 1.0)
    yield "a straight chain", posed(chain, [0], [length - 1], push, static=True)
    middle = length // 2
    times = np.array([0.0, 0.5, 1.0])
    bow = 0.5 * length
    centre = np.array([[0, 0, 0], [-bow / 2, bow, 0], [-bow / 2, -bow, 0]])
    end = np.array([[0, 0, 0], [-bow, 0, 0], [-bow, 0, 0]])
    snap = TimeSeries(times, np.stack([centre, end], axis=1))
    yield (
        "a bowed chain snapping through",
        posed(chain, [0], [middle, length - 1], snap, static=True),
    )
    strip = squares(length, 2)
    ends = strip.index[:, 0]
    fold = LinearRamp(-1.5 * length, 1.0)
    yield (
        "a strip of two rows",
        posed(
            strip, np.flatnonzero(ends == 0), np.flatnonzero(ends == length - 1), fold, static=True
        ),
    )


def _followed(case: StressScene, n_loads: int) -> Sequence[Check]:
    loads = np.arange(1, n_loads + 1) / n_loads
    answer = solved(case, case.solver(loads))
    checks = [*admissible(case, answer.displacement), *balanced(case, answer)]
    record = answer.record
    assert isinstance(record, static_solver.StaticRecord)
    if record.jumped.any():
        return checks
    fine = solved(case, case.solver(np.arange(1, 10 * n_loads + 1) / (10 * n_loads)))
    same = fine._replace(displacement=fine.displacement[9::10])
    difference = apart(case, answer, same)
    return [*checks, Check("difference from ten times the loads", difference, 1e-6)]
