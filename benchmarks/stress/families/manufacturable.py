"""Tries designs drawn at random, all of which can be made, and the most slender of them."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks.stress import (
    LAWS,
    Check,
    RandomDesigns,
    StressCase,
    StressScene,
    attempt,
    equilibria,
    family,
    motions_as_advised,
    pressed,
    shaken,
    squares,
)
from sim.solvers import Harmonic

LARGEST = 2.5
KEEP = 0.8
SIDE = 9
LOADS = np.array([0.5, 1.0])


@family
def designs(small: bool) -> Iterator[StressCase]:
    """Yields the cases."""
    lattice = squares(SIDE)
    draws = RandomDesigns(lattice, np.array([SIDE * SIDE // 2]), LARGEST, KEEP)
    plate = pressed(lattice, 0.1)
    touching = pressed(lattice, 0.1, contact=LAWS["distances"])
    slow = shaken(lattice, Harmonic(4.5, 2.0, 0.8), duration=0.25, frequency=2.0)
    fast = shaken(lattice, Harmonic(2.0, 60.0, 0.8), duration=0.02, frequency=60.0)
    attempts = (
        partial(_equilibria, touching),
        partial(_motion, slow, 0.05),
        partial(_motion, fast, 0.05),
    )
    for seed in range(6 if small else 1000):
        yield attempt(
            f"design {seed}", _both_kinds, draws, seed, plate, attempts[seed % len(attempts)]
        )


def _both_kinds(
    draws: RandomDesigns, seed: int, plate: StressScene, more: partial[Sequence[Check]]
) -> Sequence[Check]:
    vertices = draws(seed)
    return [*_equilibria(plate, vertices), *more(vertices)]


def _equilibria(case: StressScene, vertices: np.ndarray) -> Sequence[Check]:
    return equilibria(replace(case, vertices=vertices), LOADS)


def _motion(case: StressScene, error: float, vertices: np.ndarray) -> Sequence[Check]:
    return motions_as_advised(replace(case, vertices=vertices), 26, error)


WIDEST = 7.0
BARELY = 0.97
WIDTH = 7
AT_BOUNDS = 0.3
"""Smallest margin of a design that counts as being at the bounds, mm."""


@family
def slender(small: bool) -> Iterator[StressCase]:
    """Yields the cases."""
    lattice = squares(WIDTH)
    draws = RandomDesigns(lattice, np.array([WIDTH * WIDTH // 2]), WIDEST, BARELY)
    plate = pressed(lattice, 0.1)
    slow = shaken(lattice, Harmonic(4.5, 2.0, 0.8), duration=0.25, frequency=2.0)
    fast = shaken(lattice, Harmonic(2.0, 60.0, 0.8), duration=0.02, frequency=60.0)
    for seed in range(1 if small else 40):
        for case, name in ((plate, "pressed"), (slow, "slowly shaken"), (fast, "shaken")):
            yield attempt(f"design {seed}, {name}", _slender, draws, seed, case)


def _slender(draws: RandomDesigns, seed: int, case: StressScene) -> Sequence[Check]:
    vertices = draws(seed)
    margin = Check("smallest margin, mm", draws.at_bounds(vertices), AT_BOUNDS)
    made = replace(case, vertices=vertices)
    if case.scene.loads.static:
        return [margin, *equilibria(made, np.array([0.5, 1.0]))]
    return [margin, *motions_as_advised(made, 26, 0.05)]
