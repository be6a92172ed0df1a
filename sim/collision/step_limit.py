"""Limits a step so that no units pass through each other."""

from sim.collision.polygons import ContactArrays
from sim.core import Floats, compiled

FAR = 1.2
"""Multiples of a step that are looked at, as in ``step_limit.c``."""


@compiled
def collision_free_step(motion: Floats, contacts: ContactArrays, step: Floats) -> float:
    """Finds the multiple of ``step`` (n_dofs,) up to which no two units meet; inf if beyond FAR."""
