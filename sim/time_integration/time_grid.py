"""Builds time grids and dense output."""

import numpy as np
import scipy.sparse as sp

from sim.core import Floats, Ints

NEAR = 1e-7
"""Shortest step that is left between times to be met, over the whole."""


def graded(duration: float, first: float, growth: float, largest: float) -> Floats:
    """Makes a grid from 0 to ``duration`` (s) whose steps grow geometrically up to ``largest``.

    A drive that starts with a velocity jump needs short steps first. The grid's shape depends on
    its arguments alone, so it can be frozen.
    """
    n_growing = int(np.ceil(np.log(largest / first) / np.log(growth)))
    steps = np.minimum(first * growth ** np.arange(n_growing + 1), largest)
    if steps.sum() < duration:
        n_more = int(np.ceil((duration - steps.sum()) / largest))
        steps = np.concatenate([steps, np.full(n_more, largest)])
    times = np.concatenate([[0.0], np.cumsum(steps)])
    times = times[: np.searchsorted(times, duration * (1 - 1e-12)) + 1]
    return times * (duration / times[-1])


def halved(times: Floats) -> Floats:
    """Cuts every step of a grid in two."""
    return divided(times, 2)


def divided(times: Floats, parts: int) -> Floats:
    """Cuts every step of a grid into equal parts."""
    steps = np.arange(len(times))
    return np.interp(np.arange(parts * (len(times) - 1) + 1) / parts, steps, times)


def insert_times(times: Floats, stops: Floats) -> Floats:
    """Adds times (n,) that a grid has to meet; points NEAR to the one before are left out."""
    every = np.union1d(times, stops)
    kept = every[np.append(True, np.diff(every) > NEAR * every[-1])]
    kept[-1] = every[-1]
    return kept


def split_steps(times: Floats, steps: Ints) -> Floats:
    """Cuts some of the steps of a grid in two."""
    return np.insert(times, steps + 1, (times[steps] + times[steps + 1]) / 2)


def steps_of(times: Floats, output_times: Floats) -> Ints:
    """Finds the steps (n,) in which the output times lie, each once."""
    found = np.searchsorted(times, output_times, side="right") - 1
    return np.unique(np.clip(found, 0, len(times) - 2))


def check_output_times(output_times: Floats, end: float) -> None:
    """Refuses times of output that do not ascend, or that lie outside of the run.

    Raises:
        ValueError: they do so by more than rounding.
    """
    slack = 1e-9 * end
    if len(output_times) and (
        output_times[0] < -slack
        or output_times[-1] > end + slack
        or (np.diff(output_times) < 0).any()
    ):
        raise ValueError(f"output times must ascend from 0 to {end:g} s, the end of the run")


def stage_times(times: Floats, nodes: Floats) -> Floats:
    """Times (1 + n_steps (n_stages - 1),) of the start and of every implicit stage."""
    stages = times[:-1, None] + np.diff(times)[:, None] * nodes[None, 1:]
    return np.concatenate([times[:1], stages.ravel()])


def hermite_stencils(times: Floats, output_times: Floats) -> tuple[np.ndarray, Floats, Floats]:
    """Computes cubic Hermite interpolation between grid points.

    Returns:
        (n_times,) step in which each output time lies, and the weights (n_times, 4) of value at the
        left and right end, slope at the left and right end, in the value and in the slope.
    """
    interval = np.clip(np.searchsorted(times, output_times, side="right") - 1, 0, len(times) - 2)
    h = times[interval + 1] - times[interval]
    x = (output_times - times[interval]) / h
    value = [
        (1 + 2 * x) * (1 - x) ** 2,
        x**2 * (3 - 2 * x),
        h * x * (1 - x) ** 2,
        h * x**2 * (x - 1),
    ]
    slope = [6 * x * (x - 1) / h, 6 * x * (1 - x) / h, (1 - x) * (1 - 3 * x), x * (3 * x - 2)]
    return interval, np.stack(value, axis=1), np.stack(slope, axis=1)


def hermite_matrices(times: Floats, output_times: Floats) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    """Builds stencils as matrices (n_times, 2 n_times) that act on all values, then all slopes."""
    interval, value, slope = hermite_stencils(times, output_times)
    n = len(times)
    columns = interval[:, None] + np.array([0, 1, n, n + 1])
    rows = np.repeat(np.arange(len(output_times)), 4)
    return tuple(
        sp.csr_matrix((weights.ravel(), (rows, columns.ravel())), shape=(len(output_times), 2 * n))
        for weights in (value, slope)
    )


def simpson_weights(n: int, duration: float) -> Floats:
    """Weights (n,) of the composite Simpson rule on equal steps; of trapezoids if n is even."""
    h = duration / (n - 1)
    weights = np.full(n, h)
    if n % 2:
        weights[1:-1:2], weights[2:-1:2] = 4 * h / 3, 2 * h / 3
        weights[[0, -1]] = h / 3
    else:
        weights[[0, -1]] = h / 2
    return weights
