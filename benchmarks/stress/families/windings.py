"""Turns beyond 180 deg: of a whole structure, of its parts against each other, of its ligaments."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from benchmarks.stress import (
    NONE,
    Check,
    StressCase,
    StressFamily,
    StressScene,
    apart,
    equilibria,
    motions,
    posed,
    solved,
    squares,
)
from sim.core import Floats
from sim.solvers import TimeSeries
from sim.structure import quads

PERIOD = 0.05


def family() -> StressFamily:
    """The family."""
    return StressFamily(
        "windings",
        "a free lattice turned as a whole up to 100 times, a chain twisted and rolled up beyond two"
        " turns: equilibria and motions",
        "balance by the definition, void angles by geometry modulo a turn, rigid rotation exactly",
        _cases,
    )


def _cases(small: bool) -> Iterator[StressCase]:
    for turns in (1.0,) if small else (0.5, 0.75, 1.0, 3.0, 100.0):
        yield StressCase(f"a free lattice turned {turns:g} times", partial(_rigid, turns))
    for turns in () if small else (0.6, 1.1, 1.5, 2.2):
        yield StressCase(f"a chain rolled up {turns:g} times", partial(_rolled, turns))
    for turns in (1.5,) if small else (0.6, 1.5, 2.2):
        for integrator in ("implicit", "explicit"):
            name = f"a lattice whirled {turns:g} times, {integrator}"
            yield StressCase(name, partial(_whirled, turns, integrator))


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
    wanted = np.concatenate([place, np.repeat(angles[:, None, None], 9, axis=1)], axis=-1)
    other = answer._replace(displacement=wanted.reshape(len(loads), -1))
    return [Check("distance from the rigid rotation", apart(case, answer, other), 1e-8)]


def _rolled(turns: float) -> Sequence[Check]:
    """A long chain bent into a spiral: its last unit goes where that of a closing ring would."""
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
    """Place (n, 2) of the last of units whose centres lie on a polygon with that turn at each."""
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
