"""Solves the two quadratic programs of a feasible SQP step by daqp (Arnström et al. 2022).

An active-set method ends in the minimiser itself, to rounding, where an interior one comes near it;
daqp is plain C without code for one processor or another, so its steps are those of any x86-64.
"""

from dataclasses import dataclass

import daqp
import numpy as np
import scipy.linalg
import scipy.sparse as sp

from sim.core import Floats

SOLVED = 1
"""Exit flag of a minimiser that meets the tolerances."""

TOLERANCE = 1e-10
"""Violation that a constraint may have, in its own unit per length of its row."""

ITERATIONS = 20
"""Most iterations, for each variable and constraint: every one enters or leaves a few times."""


@dataclass(frozen=True)
class Quadratic:
    """Holds the solution of a quadratic program."""

    step: Floats  # (n,) the minimiser
    multipliers: Floats  # (m,) of the lower limits, >= 0; of several that coincide, one has all


def dense_step(
    hessian: Floats,
    gradient: Floats,
    matrix: sp.csr_array,
    least: Floats,
    lower: Floats,
    upper: Floats,
    unit: float = 1.0,
) -> Quadratic | None:
    """Minimises gradient.d + d.hessian.d / 2 subject to matrix d >= least and lower <= d <= upper.

    The solver's tolerances are absolute, for what is minimised in multiples of `unit`. Returns None
    if there is no such d or the solver does not converge.
    """
    # hessian / unit = R' R and z = R d leave |z|^2 / 2 + z.R^-T gradient / unit
    try:
        root = scipy.linalg.cholesky(hessian / unit)
    except np.linalg.LinAlgError:  # rounding has left the model of a steep loss indefinite
        return None
    inverse, _ = scipy.linalg.lapack.dtrtri(root)
    # most of the bounds that hold a step of even curvature hold this one too
    even = np.clip(gradient / -np.median(np.diag(hessian)), lower, upper)
    rows = np.vstack([inverse, matrix @ inverse])
    limits = _limits(least, lower, upper)
    found = _nearest(inverse.T @ gradient / -unit, rows, *limits, start=root @ even)
    if found is None:
        return None
    step = np.clip(inverse @ found.step, lower, upper)  # which it keeps to rounding
    return Quadratic(step, unit * found.multipliers[len(step) :])


def shortest_step(
    target: Floats, matrix: sp.csr_array, least: Floats, lower: Floats, upper: Floats
) -> Quadratic | None:
    """Finds the d closest to ``target`` subject to matrix d >= least and lower <= d <= upper.

    Constraints are local and few of them hold the step: those that the step without them misses
    are added until none is missed, so that a program is as large as what is near its solution.
    """
    step = np.clip(target, lower, upper)
    multipliers, added = np.zeros(len(least)), np.zeros(len(least), dtype=bool)
    while (missed := (matrix @ step < least - TOLERANCE) & ~added).any():
        added |= missed
        rows = matrix[added]
        moved = np.unique(rows.indices)
        limits = _limits(least[added], lower[moved], upper[moved])
        found = _nearest(target[moved], rows[:, moved].toarray(), *limits, start=step[moved])
        if found is None:
            return None
        step[moved] = np.clip(found.step, lower[moved], upper[moved])  # kept to rounding
        multipliers[added] = found.multipliers[len(moved) :]
    return Quadratic(step, multipliers)


def _limits(least: Floats, lower: Floats, upper: Floats) -> tuple[Floats, Floats]:
    """Joins the limits of the variables and of the constraints."""
    return np.concatenate([lower, least]), np.concatenate([upper, np.full(len(least), np.inf)])


def _nearest(
    target: Floats, matrix: Floats, least: Floats, most: Floats, start: Floats | None = None
) -> Quadratic | None:
    """Finds the step closest to ``target`` subject to least <= matrix step <= most.

    Limits that the matrix has no rows for, the first ones, are those of the step itself.
    """
    step, _, outcome, more = daqp.solve(
        np.eye(len(target)),
        -target,
        np.ascontiguousarray(matrix),
        most,
        least,
        primal_start=start,
        primal_tol=TOLERANCE,
        iter_limit=ITERATIONS * (len(target) + len(least)),
    )
    if outcome != SOLVED:
        return None
    return Quadratic(np.array(step), np.maximum(-np.array(more["lam"]), 0.0))


def reachable(values: Floats, jacobian: sp.csr_array, reach: float) -> np.ndarray:
    """Finds the linearised constraints that some step of at most ``reach`` could violate."""
    steepest = np.asarray(abs(jacobian).sum(axis=1)).ravel()
    return np.flatnonzero((steepest > 0) & (values < reach * steepest))
