"""Tries paths that end in a limit point or branch, and turns beyond 180 deg."""

from collections.abc import Iterator, Sequence

import numpy as np

from benchmarks.stress import (
    NONE,
    Check,
    StressCase,
    StressScene,
    attempt,
    check_admissible,
    check_balance,
    equilibria,
    family,
    largest_difference,
    motions,
    posed,
    solved,
    squares,
)
from sim.core import Floats
from sim.quasistatics import static_solver
from sim.solvers import LinearRamp, TimeSeries
from sim.structure import quads


@family
def branches(small: bool) -> Iterator[StressCase]:
    """Yields the cases."""
    lengths = (9,) if small else (5, 9, 21, 41)
    for length in lengths:
        for n_loads in (1,) if small else (1, 3, 10, 50):
            for name, case in _paths(length):
                yield attempt(
                    f"{name} of {length} units in {n_loads} loads", _followed, case, n_loads
                )


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
    through = posed(chain, [0], [middle, length - 1], snap, static=True)
    yield "a bowed chain snapping through", through
    strip = squares(length, 2)
    ends = strip.index[:, 0]
    fold = LinearRamp(-1.5 * length, 1.0)
    left, right = (np.flatnonzero(ends == place) for place in (0, length - 1))
    yield "a strip of two rows", posed(strip, left, right, fold, static=True)


def _followed(case: StressScene, n_loads: int) -> Sequence[Check]:
    loads = np.arange(1, n_loads + 1) / n_loads
    answer = solved(case, case.solver(loads))
    checks = [*check_admissible(case, answer.displacement), *check_balance(case, answer)]
    record = answer.record
    assert isinstance(record, static_solver.StaticRecord)
    if record.jumped.any():
        return checks
    fine = solved(case, case.solver(np.arange(1, 10 * n_loads + 1) / (10 * n_loads)))
    same = fine._replace(displacement=fine.displacement[9::10])
    difference = largest_difference(case, answer, same)
    return [*checks, Check("difference from ten times the loads", difference, 1e-6)]


PERIOD = 0.05


@family
def windings(small: bool) -> Iterator[StressCase]:
    """Yields the cases."""
    for turns in (1.0,) if small else (0.5, 0.75, 1.0, 3.0, 100.0):
        yield attempt(f"a free lattice turned {turns:g} times", _rigid, turns)
    for turns in () if small else (0.6, 1.1, 1.5, 2.2):
        yield attempt(f"a chain rolled up {turns:g} times", _rolled, turns)
    for turns in (1.5,) if small else (0.6, 1.5, 2.2):
        for integrator in ("implicit", "explicit"):
            name = f"a lattice whirled {turns:g} times, {integrator}"
            yield attempt(name, _whirled, turns, integrator)


def _turning(turns: float, n: int, duration: float) -> TimeSeries:
    angles = np.linspace(0.0, 2 * np.pi * turns, n)
    times = np.linspace(0.0, duration, n)
    return TimeSeries(times, np.column_stack([np.zeros((n, 2)), angles]))


def _rigid(turns: float) -> Sequence[Check]:
    n = max(9, int(8 * turns) + 1)
    case = posed(squares(3), NONE, [4], _turning(turns, n, 1.0), static=True)
    loads = np.linspace(0.0, 1.0, n)[1:]
    answer = solved(case, case.solver(loads))
    angles = 2 * np.pi * turns * loads
    offset = case.scene.lattice.site - case.scene.lattice.site[4]
    c, s = np.cos(angles), np.sin(angles)
    turned = np.stack([np.stack([c, s], -1), np.stack([-s, c], -1)], -2)
    place = offset @ turned - offset
    expected = np.concatenate([place, np.repeat(angles[:, None, None], 9, axis=1)], axis=-1)
    other = answer._replace(displacement=expected.reshape(len(loads), -1))
    return [
        Check("distance from the rigid rotation", largest_difference(case, answer, other), 1e-8)
    ]


def _rolled(turns: float) -> Sequence[Check]:
    """Bends a long chain into a spiral: its last unit goes where that of a closing ring would."""
    n_units = 41
    chain = quads(n_units, 1, 15.0, 2.25, 0.0)
    n = 121
    share = np.linspace(0.0, 1.0, n)
    angle = 2 * np.pi * turns * share
    curvature = angle / (n_units - 1)
    place = _arc_end(curvature, n_units)
    straight = np.array([15.0 * (n_units - 1), 0.0])
    motion = np.column_stack([place - straight, angle])
    case = posed(chain, [0], [n_units - 1], TimeSeries(share, motion), static=True)
    return equilibria(case, share[5::5])


def _arc_end(turn: Floats, n_units: int) -> Floats:
    """Returns the end (n, 2) of units whose centres lie on a polygon with that turn at each."""
    angles = turn[:, None] * (np.arange(n_units - 1) + 0.5)
    return 15.0 * np.stack([np.cos(angles).sum(axis=1), np.sin(angles).sum(axis=1)], axis=1)


def _whirled(turns: float, integrator: str) -> Sequence[Check]:
    n = 201
    share = np.linspace(0.0, 1.0, n)
    smooth = share**2 * (3 - 2 * share)
    series = TimeSeries(
        PERIOD * share, np.column_stack([np.zeros((n, 2)), 2 * np.pi * turns * smooth])
    )
    case: StressScene = posed(squares(3), NONE, [4], series, duration=PERIOD, integrator=integrator)
    return motions(case, np.linspace(0.0, PERIOD, 26), 0.05)
