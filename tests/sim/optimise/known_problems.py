"""Constrained problems with known optima, for the tests of the optimisers."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

Loss = Callable[[np.ndarray], tuple[float, np.ndarray, np.ndarray]]
Constrain = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True)
class Known:
    """A problem, where to start, and its solution."""

    loss: Loss
    constraints: Constrain | None
    start: np.ndarray
    optimum: np.ndarray
    bounds: tuple[float, float] | None = None


def rosenbrock(x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    bend, off = x[1] - x[0] ** 2, 1 - x[0]
    slope = np.array([-400 * x[0] * bend - 2 * off, 200 * bend])
    return float(100 * bend**2 + off**2), slope, np.zeros(0)


def in_disc(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.array([1.5 - x @ x]), -2 * x[None]


def rosenbrock_in_disc() -> Known:
    return Known(rosenbrock, in_disc, np.array([-1.0, 0.5]), np.array([0.9072339, 0.8227554]))


def corner() -> Known:
    """Linear loss over the part of a disc above a parabola: two curved constraints active."""

    def loss(x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        return float(-x[0] - 0.5 * x[1]), np.array([-1.0, -0.5]), np.zeros(0)

    def constraints(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values = np.array([2 - x @ x, x[1] - x[0] ** 2])
        return values, np.array([-2 * x, [-2 * x[0], 1.0]])

    return Known(loss, constraints, np.array([0.0, 0.5]), np.array([1.0, 1.0]))


def shifted_bowl() -> Known:
    """Bounds only: a bowl whose bottom lies outside the box."""
    bottom = np.array([2.0, -0.5, 0.3, -3.0])

    def loss(x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        return float(np.sum((x - bottom) ** 2)), 2 * (x - bottom), np.zeros(0)

    return Known(loss, None, np.zeros(4), np.clip(bottom, -1, 1), (-1.0, 1.0))


def cantilever() -> Known:
    """Svanberg's five-segment beam (1987): weight under a limit of the tip's deflection."""
    share = np.array([61.0, 37.0, 19.0, 7.0, 1.0])

    def loss(x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        return float(0.0624 * x.sum()), np.full(5, 0.0624), np.zeros(0)

    def constraints(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.array([1 - share @ x**-3]), (3 * share * x**-4)[None]

    optimum = np.array([6.01601, 5.30917, 4.49433, 3.50147, 2.15267])
    return Known(loss, constraints, np.full(5, 5.0), optimum, (1.0, 10.0))


def many(n: int = 100, m: int = 500) -> Known:
    """Convex: a bowl and sparse, curved constraints, most of them redundant.

    Its optimum is set by construction: the multipliers of some active constraints are chosen and
    the bowl's bottom follows from stationarity.
    """
    random = np.random.default_rng(1)
    matrix = random.normal(size=(m, n)) * (random.random((m, n)) < 0.05)
    bend = 0.05 * matrix**2
    root = random.normal(size=(n, n))
    hessian = root @ root.T / n + 0.1 * np.eye(n)
    optimum = random.normal(size=n) * 0.3
    active = random.random(m) < 0.12
    slack = np.where(active, 0.0, random.uniform(0.05, 1.0, m))
    level = matrix @ optimum + bend @ optimum**2 + slack
    multipliers = np.where(active, random.uniform(0.1, 1.0, m), 0.0)
    pull = (matrix + 2 * bend * optimum).T @ multipliers
    bottom = optimum + np.linalg.solve(hessian, pull)

    def loss(x: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        slope = hessian @ (x - bottom)
        return float(slope @ (x - bottom) / 2), slope, np.zeros(0)

    def constraints(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return level - matrix @ x - bend @ x**2, -matrix - 2 * bend * x

    return Known(loss, constraints, np.zeros(n), optimum)
