"""Estimates unknowns, memory and time of a scene before anything is computed."""

from typing import NamedTuple

import numpy as np

from sim.scene.scene import Scene

ENTRIES = 8.0
"""Of a factor, over n log2(n) unknowns: 7.0 of 120 thousand (`make bench`)."""
SECONDS, SECONDS_EACH = 6e-9, 2e-7
"""To factorise a tangent of n unknowns, over n^1.5; and of all loops, over n."""
FACTORISATIONS, IN_TIME = 4, 8
"""For each load, and for each implicit step with its adjoint."""
STEPS, FIRST_STEPS = 20, 30
"""Implicit steps in each period of the drive, and at its start."""
HELD_STATES = 4
"""Arrays of all states that a solve and its adjoint hold."""


class Cost(NamedTuple):
    """Holds what a scene is likely to cost.

    Attributes:
        unknowns: number of free degrees of freedom.
        memory: bytes of one load case.
        seconds: of one core for loss and gradient of a design; a lower bound where motions in time
            need explicit steps.
    """

    unknowns: int
    memory: float
    seconds: float


def estimate_cost(scene: Scene, n_times: int) -> Cost:
    """Estimates the cost of a scene that is asked for at a number of times."""
    n, loads = 3 * scene.lattice.n_units - len(scene.loads.held), scene.loads
    each = SECONDS * n**1.5 + SECONDS_EACH * n
    if loads.static:
        work, states = FACTORISATIONS * n_times, n_times
    else:
        states = int(FIRST_STEPS + STEPS * (loads.drive_frequency or 1.0) * loads.duration)
        work = IN_TIME * states
    memory = 8.0 * (ENTRIES * n * np.log2(max(n, 2)) + HELD_STATES * states * n)
    return Cost(n, memory, each * work * len(loads.cases))
