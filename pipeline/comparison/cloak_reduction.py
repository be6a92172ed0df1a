"""Computes the reduction of a measured quantity by a cloak, with its interval."""

import numpy as np

from sim.core import Floats


def compute_reduction(before: Floats, after: Floats) -> Floats:
    """Computes value and ends of the interval (3,) of 1 - after / before, of two such (3,).

    The distances of the ends from the values add up as those of independent errors do, to first
    order. There is none on the side of a value that noise puts beyond its own interval.
    """
    first, last = before[0], after[0]
    value = 1 - last / first
    (first_down, first_up), (last_down, last_up) = (
        np.maximum([each[0] - each[1], each[2] - each[0]], 0.0) for each in (before, after)
    )
    down = np.hypot(last_up / first, last * first_down / first**2)
    up = np.hypot(last_down / first, last * first_up / first**2)
    return np.array([value, value - down, value + up])
