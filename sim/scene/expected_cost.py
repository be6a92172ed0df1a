"""Estimates unknowns, memory and time of a scene before anything is computed."""

from typing import NamedTuple

import numpy as np

from sim.core import Floats
from sim.scene.equal_cases import equal_cases
from sim.scene.parameter_map import concrete_parameters
from sim.scene.scene import Scene
from sim.scene.time_solver import expected_steps

ENTRIES = 8.0
"""Of a factor, over n log2(n) unknowns: 7.0 of 120 thousand (`make bench`)."""
SECONDS, SECONDS_EACH = 6e-9, 2e-7
"""To factorise a tangent of n unknowns, over n^1.5; and of all loops, over n."""
FACTORISATIONS, IN_TIME = 4, 6
"""For each load, and for each implicit step with its adjoint."""
SECONDS_EXPLICIT = 7e-7
"""Of an explicit step with its adjoint, over n (fig7: 6.5e-7, a draft of it: 8e-7)."""
STEPS, FIRST_STEPS = 20, 30
"""States held in each period of the drive, and at its start."""
HELD_STATES = 4
"""Arrays of all states that a solve and its adjoint hold."""


class Cost(NamedTuple):
    """Holds what a scene is likely to cost."""

    unknowns: int  # number of free degrees of freedom
    memory: float  # bytes of one load case
    seconds: float  # of one core for loss and gradient of a design


def estimate_cost(scene: Scene, times: Floats) -> Cost:
    """Estimates the cost of a scene that is asked for at times (n_times,), s."""
    n, loads = count_unknowns(scene), scene.loads
    each, n_cases, states = SECONDS * n**1.5 + SECONDS_EACH * n, len(loads.cases), len(times)
    if loads.static:
        path = FACTORISATIONS * len(times) * each
    else:
        vertices = scene.lattice.vertices
        values = concrete_parameters(scene, vertices)
        integrator, steps = expected_steps(scene, values, times)
        path = steps * (IN_TIME * each if integrator == "implicit" else SECONDS_EXPLICIT * n)
        states = int(FIRST_STEPS + STEPS * (loads.drive_frequency or 1.0) * loads.duration)
        if scene.design.symmetry == "C4" and scene.design.copies is None:
            n_cases = len(np.unique(equal_cases(scene, vertices, values)))
    memory = 8.0 * (ENTRIES * n * np.log2(max(n, 2)) + HELD_STATES * states * n)
    n_copies = 1 if scene.design.copies is None else len(scene.design.copies)
    return Cost(n, memory, path * n_cases * n_copies)


def count_unknowns(scene: Scene) -> int:
    """Counts the free degrees of freedom."""
    return 3 * scene.lattice.n_units - len(scene.loads.held)
