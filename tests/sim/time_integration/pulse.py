"""Drives of the tests of integrators: a smooth one with its solution, and one that closes voids."""

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np

from sim.core import Floats, Numbers
from sim.time_integration import ExplicitSolver
from tests.sim.structures import Rig, rotating_squares

DURATION = 4e-3


class Pulse(NamedTuple):
    """A sin^6(pi t / 2 T) along a direction: five derivatives vanish at the start."""

    amplitude: float
    duration: float
    direction: float

    def __call__(self, times: Numbers) -> Numbers:
        xp = times.__array_namespace__()
        push = self.amplitude * xp.sin(xp.pi * times / (2 * self.duration)) ** 6
        c, s = xp.cos(self.direction), xp.sin(self.direction)
        return xp.stack([c * push, s * push, 0.02 * push], axis=-1)


def pulsed() -> Rig:
    """3 x 3 squares, one clamped and one pushed smoothly; no contact."""
    return Rig(rotating_squares(3), np.array([0]), np.array([4]), Pulse(1.0, DURATION, 0.4))


@cache
def _exact_end() -> Floats:
    rig = pulsed()
    solver = ExplicitSolver(rig.topology, DURATION, 3200, np.array([DURATION]))
    return solver.forward(rig.values, rig.drive)[0][-1]


def exact_end(rig: Rig) -> Floats:
    """Free displacements at the end, good to about 1e-11 mm."""
    return _exact_end()[rig.topology.free_dofs]


def order(end: Callable[[int], Floats], steps: tuple[int, int], exact: Floats) -> float:
    """Order of convergence between two numbers of steps."""
    free = pulsed().topology.free_dofs
    coarse, fine = (np.linalg.norm(end(n)[free] - exact) for n in steps)
    return float(np.log(coarse / fine) / np.log(steps[1] / steps[0]))
