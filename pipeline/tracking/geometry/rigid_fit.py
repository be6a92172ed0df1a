"""Fits rigid motions in the plane between two sets of points (Kabsch), and applies rotations."""

import numpy as np

from sim.core import Floats, Reals

_ROUNDS = 8
_TUKEY = 4.685
_LEAST = 1e-9


def rotation_matrix(angle: float) -> Floats:
    """Returns the matrix (2, 2) of a counter-clockwise rotation, rad."""
    cos, sin = np.cos(angle), np.sin(angle)
    return np.array([[cos, -sin], [sin, cos]])


def arm_swing(angle: Reals, arm: Reals) -> Reals:
    """Displaces (..., 2) the ends of arms (..., 2) that turn by angles (...) in rad."""
    cos, sin = np.cos(angle) - 1, np.sin(angle)
    x, y = arm[..., 0], arm[..., 1]
    return np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)


def rigid_motion(
    before: Floats, after: Floats, weight: Floats | None = None
) -> tuple[float, Floats]:
    """Fits rotation (rad) and shift (2,) that carry points (n, 2) onto others, least squares.

    ``after = R(rotation) before + shift``. One point gives no rotation.
    """
    share = np.ones(len(before)) if weight is None else weight
    share = share / share.sum()
    first, last = share @ before, share @ after
    a, b = before - first, after - last
    cross = share @ (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    dot = share @ (a * b).sum(axis=1)
    turn = float(np.arctan2(cross, dot))
    return turn, last - rotation_matrix(turn) @ first


def robust_motion(before: Floats, after: Floats, sigma: float) -> tuple[float, Floats, Floats]:
    """Fits the same with Tukey's weights, and returns these (n,): zero marks an outlier.

    Args:
        before: (n, 2) points.
        after: (n, 2) where they went.
        sigma: standard deviation of their coordinates.
    """
    weight = np.ones(len(before))
    for _ in range(_ROUNDS):
        turn, shift = rigid_motion(before, after, np.maximum(weight, _LEAST))
        rest = np.linalg.norm(after - before @ rotation_matrix(-turn) - shift, axis=1)
        scale = max(sigma, 1.4826 * float(np.median(rest))) * _TUKEY
        weight = np.where(rest < scale, (1 - (rest / scale) ** 2) ** 2, 0.0)
    return turn, shift, weight
