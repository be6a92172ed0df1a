"""Designs drawn at random with shifts up to 2.5 mm, all of which can be made."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks.stress import (
    LAWS,
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

LARGEST = 2.5
KEEP = 0.8
SIDE = 9
LOADS = np.array([0.5, 1.0])


def family() -> StressFamily:
    """The family."""
    return StressFamily(
        "designs",
        f"random designs of {SIDE} x {SIDE} units that can be made, shifts up to {LARGEST} mm: each"
        " pressed by 10 %, a third shaken slowly, a third fast, a third with contact on distances",
        "balance by the definition, void angles and overlaps by geometry, half the steps; tight"
        " where the default accuracy does not do, as its message or estimate of error says",
        _cases,
    )


def _cases(small: bool) -> Iterator[StressCase]:
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
        yield StressCase(
            f"design {seed}", partial(_both, draws, seed, plate, attempts[seed % len(attempts)])
        )


def _both(
    draws: RandomDesigns, seed: int, plate: StressScene, more: partial[Sequence[Check]]
) -> Sequence[Check]:
    vertices = draws(seed)
    return [*_equilibria(plate, vertices), *more(vertices)]


def _equilibria(case: StressScene, vertices: np.ndarray) -> Sequence[Check]:
    return equilibria(replace(case, vertices=vertices), LOADS)


def _motion(case: StressScene, error: float, vertices: np.ndarray) -> Sequence[Check]:
    asked = np.linspace(0.0, case.scene.loads.duration, 26)
    return motions_as_advised(replace(case, vertices=vertices), asked, error)
