"""Letters that are found at several places: which of these make a text in reading order."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from sim.core import Floats

_AHEAD, _BELOW = 0.5, -0.9  # heights from letter to letter, at least


def in_order(places: Sequence[Floats], weights: Sequence[Floats]) -> tuple[list[int], float]:
    """The heaviest choice of one place for each letter, on a line or below each other.

    Args:
        places: (n, 2) of each letter, upright, in heights.
        weights: (n,) of these places.

    Returns:
        The places that are taken and their weight; none with a weight of zero if no choice reads.
    """
    if not all(map(len, places)):
        return [], 0.0
    choices = [_heaviest(places, weights, below=below) for below in (False, True)]
    return max(choices, key=lambda choice: choice[1])


def _heaviest(
    places: Sequence[Floats], weights: Sequence[Floats], *, below: bool
) -> tuple[list[int], float]:
    """From letter to letter: the best way to each place of the next one."""
    sums, before = weights[0], []
    for (first, second), weight in zip(pairwise(places), weights[1:], strict=True):
        steps = second[None] - first[:, None]
        follows = steps[..., 1] < _BELOW if below else steps[..., 0] > _AHEAD
        ways = np.where(follows, sums[:, None], -np.inf)
        before.append(ways.argmax(axis=0))
        sums = ways.max(axis=0) + weight
    if not np.isfinite(sums).any():
        return [], 0.0
    taken = [int(sums.argmax())]
    for way in reversed(before):
        taken.append(int(way[taken[-1]]))
    return taken[::-1], float(sums.max())
