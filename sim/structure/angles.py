"""Measures angles between vectors, in the library of the arrays that are given."""

from sim.core import Numbers


def angle_between(start: Numbers, end: Numbers) -> Numbers:
    """Measures the angle from ``start`` to ``end`` (..., 2), counter-clockwise, on (-pi, pi]."""
    cross = start[..., 0] * end[..., 1] - start[..., 1] * end[..., 0]
    return cross.__array_namespace__().arctan2(cross, (start * end).sum(axis=-1))
