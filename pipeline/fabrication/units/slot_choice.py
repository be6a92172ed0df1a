"""The slots of one unit chosen together, so that they keep their distance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.fabrication.units.slot_candidates import Candidates
from pipeline.problem.sections import Fabrication
from sim.core import Floats

_VISITS = 50_000  # choices looked at before the best so far is taken
_HAIR = 1e-6  # mm


def together(offered: Sequence[Candidates], wanted: Fabrication) -> list[Candidates] | None:
    """The cheapest choice of one candidate per corner whose slots keep their distance.

    Candidates come in ascending order of their cost. A choice strikes out what does not go with it
    at the corners after it, whose cheapest remaining candidates bound the cost.
    """
    least = wanted.minimum_wall + wanted.slot_width - _HAIR
    fits = {
        (a, b): distances(offered[a], offered[b]) >= least
        for b in range(len(offered))
        for a in range(b)
    }
    best: tuple[float, list[int]] = (np.inf, [])
    visits = _VISITS

    def descend(picked: list[int], left: list[NDArray[np.bool_]], cost: float) -> None:
        nonlocal best, visits
        corner = len(picked)
        if corner == len(offered):
            best = (cost, picked)
            return
        for choice in np.flatnonzero(left[0]).tolist():
            total = cost + float(offered[corner].cost[choice])
            if total >= best[0] or visits == 0:
                return
            visits -= 1
            after = [
                allowed & fits[corner, later][choice]
                for later, allowed in enumerate(left[1:], corner + 1)
            ]
            if (
                all(allowed.any() for allowed in after)
                and total
                + sum(
                    float(offered[later].cost[allowed.argmax()])
                    for later, allowed in enumerate(after, corner + 1)
                )
                < best[0]
            ):
                descend([*picked, choice], after, total)

    descend([], [np.ones(len(found), dtype=bool) for found in offered], 0.0)
    if not best[1] and offered:
        return None
    return [found.pick(np.array([at])) for found, at in zip(offered, best[1], strict=True)]


def distances(one: Candidates, other: Candidates) -> Floats:
    """(n_one, n_other) distances of the centre lines of slots."""
    a0 = np.broadcast_to(one.mouth, one.ends.shape)[:, None]
    b0 = np.broadcast_to(other.mouth, other.ends.shape)[None]
    a1, b1 = one.ends[:, None], other.ends[None]
    apart = np.minimum.reduce(
        [
            _point_to_segment(a0, b0, b1),
            _point_to_segment(a1, b0, b1),
            _point_to_segment(b0, a0, a1),
            _point_to_segment(b1, a0, a1),
        ]
    )
    crossing = (_side(a0, a1, b0) * _side(a0, a1, b1) < 0) & (
        _side(b0, b1, a0) * _side(b0, b1, a1) < 0
    )
    return np.where(crossing, 0.0, apart)


def _side(start: Floats, end: Floats, point: Floats) -> Floats:
    along, to = end - start, point - start
    return along[..., 0] * to[..., 1] - along[..., 1] * to[..., 0]


def _point_to_segment(point: Floats, start: Floats, end: Floats) -> Floats:
    along = end - start
    share = ((point - start) * along).sum(-1) / (along**2).sum(-1)
    nearest = start + np.clip(share, 0.0, 1.0)[..., None] * along
    return np.linalg.norm(point - nearest, axis=-1)
