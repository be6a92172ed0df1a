"""Designs whose units are as slender as the constraints let them be."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks.stress import (
    Check,
    RandomDesigns,
    StressCase,
    StressFamily,
    StressScene,
    equilibria,
    motions_as_advised,
    pressed,
    shaken,
    squares,
)
from sim.solvers import Harmonic

LARGEST = 7.0
KEEP = 0.97
SIDE = 7
AT_BOUNDS = 0.3
"""Smallest margin of a design that counts as being at the bounds, mm."""


def family() -> StressFamily:
    """The family."""
    return StressFamily(
        "slender",
        f"designs of {SIDE} x {SIDE} units cut back from shifts of {LARGEST:g} mm until they just"
        " keep to edges of 3 mm, corners of 30 deg, gaps of 0.2 mm: pressed by 10 %, shaken",
        "as the random designs; and the design's own smallest margin",
        _cases,
    )


def _cases(small: bool) -> Iterator[StressCase]:
    lattice = squares(SIDE)
    draws = RandomDesigns(lattice, np.array([SIDE * SIDE // 2]), LARGEST, KEEP)
    plate = pressed(lattice, 0.1)
    slow = shaken(lattice, Harmonic(4.5, 2.0, 0.8), duration=0.25, frequency=2.0)
    fast = shaken(lattice, Harmonic(2.0, 60.0, 0.8), duration=0.02, frequency=60.0)
    for seed in range(1 if small else 40):
        for case, name in ((plate, "pressed"), (slow, "slowly shaken"), (fast, "shaken")):
            yield StressCase(f"design {seed}, {name}", partial(_attempt, draws, seed, case))


def _attempt(draws: RandomDesigns, seed: int, case: StressScene) -> Sequence[Check]:
    vertices = draws(seed)
    margin = Check("smallest margin, mm", draws.at_bounds(vertices), AT_BOUNDS)
    made = replace(case, vertices=vertices)
    if case.scene.loads.static:
        return [margin, *equilibria(made, np.array([0.5, 1.0]))]
    return [
        margin,
        *motions_as_advised(made, np.linspace(0.0, case.scene.loads.duration, 26), 0.05),
    ]
