"""Computes the reduction of a measured quantity by a cloak, with its interval."""

import numpy as np

from sim.core import Floats


def compute_reduction(before: Floats, after: Floats) -> Floats:
    """Computes value and ends of the interval (3,) of 1 - after / before, of two such (3,).

    The distances of the ends from the values add up as those of independent errors do, to first
    order.
    """
    first, first_low, first_high = before
    last, last_low, last_high = after
    value = 1 - last / first
    down = np.hypot((last_high - last) / first, last * (first - first_low) / first**2)
    up = np.hypot((last - last_low) / first, last * (first_high - first) / first**2)
    return np.array([value, value - down, value + up])
