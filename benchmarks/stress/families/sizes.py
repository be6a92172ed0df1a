"""Lattices from 3 x 3 to 120 x 120 units."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from benchmarks.stress import (
    LAWS,
    Check,
    StressCase,
    StressFamily,
    StressScene,
    Wanted,
    equilibria,
    motions,
    pressed,
    shaken,
    squares,
)
from sim.solvers import Harmonic
from sim.time_integration import ExplicitSolver, ImplicitSolver

SIDES = (3, 4, 5, 8, 15, 30, 60, 120)
TOUCHING = 30
"""Largest lattice that is also pressed with contact on distances."""


def family() -> StressFamily:
    """The family."""
    return StressFamily(
        "sizes",
        f"squares of {SIDES[0]} to {SIDES[-1]} units a side, and strips: pressed by 10 %, shaken by"
        " either integrator",
        "balance by the definition, void angles and overlaps by geometry, half the steps",
        _cases,
    )


def _cases(small: bool) -> Iterator[StressCase]:
    shapes = [(side, side) for side in SIDES] + [(60, 2), (3, 40), (2, 2)]
    for columns, rows in [(3, 3), (8, 8)] if small else shapes:
        lattice, name = squares(columns, rows), f"{columns} x {rows}"
        loads = np.array([1.0])
        wanted: Wanted = "solution" if columns > 2 else "refusal"  # or no unit is free
        yield StressCase(
            f"{name}, pressed", partial(equilibria, pressed(lattice, 0.1), loads), wanted
        )
        if max(columns, rows) <= TOUCHING:
            touching = pressed(lattice, 0.1, contact=LAWS["distances"])
            attempt = partial(equilibria, touching, loads)
            yield StressCase(f"{name}, contact on distances", attempt, wanted)
        if min(columns, rows) > 2:
            case = shaken(lattice, Harmonic(1.0, 60.0, 0.8), duration=2e-3, frequency=60.0)
            for integrator in ("implicit", "explicit"):
                yield StressCase(
                    f"{name}, shaken, {integrator}", partial(_shaken, case, integrator)
                )


def _shaken(case: StressScene, integrator: str) -> Sequence[Check]:
    duration, asked = case.scene.loads.duration, np.linspace(0.0, case.scene.loads.duration, 6)
    if integrator == "explicit":
        return motions(case, asked, 0.05, ExplicitSolver(case.topology, duration, 50, asked))
    times = np.linspace(0.0, duration, 41)
    return motions(case, asked, 0.05, ImplicitSolver(case.topology, times, asked))
