"""The two quadratic programs of a feasible SQP step, by piqp (Schwan et al. 2023)."""

from dataclasses import dataclass, replace

import numpy as np
import piqp
import scipy.sparse as sp

from sim.core import Floats


@dataclass(frozen=True)
class Quadratic:
    """Solution of a quadratic program."""

    step: Floats  # (n,) the minimiser
    multipliers: Floats  # (m,) of the constraints, >= 0


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
    solver = _tuned(piqp.DenseSolver())
    solver.setup(
        np.asfortranarray(hessian / unit),
        gradient / unit,
        G=np.asfortranarray(matrix.toarray()) if len(least) else None,
        h_l=least if len(least) else None,
        x_l=lower,
        x_u=upper,
    )
    found = _solution(solver, len(least))
    return found and replace(found, multipliers=unit * found.multipliers)


def shortest_step(
    target: Floats, matrix: sp.csr_array, least: Floats, lower: Floats, upper: Floats
) -> Quadratic | None:
    """Finds the d closest to ``target`` subject to matrix d >= least and lower <= d <= upper."""
    solver = _tuned(piqp.SparseSolver())
    solver.setup(
        sp.csc_matrix(sp.identity(len(target))),
        -target,
        G=sp.csc_matrix(matrix) if len(least) else None,
        h_l=least if len(least) else None,
        x_l=lower,
        x_u=upper,
    )
    return _solution(solver, len(least))


def _tuned(solver: piqp.DenseSolver | piqp.SparseSolver) -> piqp.DenseSolver | piqp.SparseSolver:
    solver.settings.eps_abs = 1e-10
    solver.settings.eps_rel = 1e-10
    solver.settings.check_duality_gap = False
    return solver


def _solution(solver: piqp.DenseSolver | piqp.SparseSolver, count: int) -> Quadratic | None:
    if solver.solve() != piqp.PIQP_SOLVED:
        return None
    found = solver.result
    multipliers = np.maximum(np.array(found.z_l), 0.0) if count else np.zeros(0)
    return Quadratic(np.array(found.x), multipliers)


def reachable(values: Floats, jacobian: sp.csr_array, reach: float) -> np.ndarray:
    """Finds the linearised constraints that some step of at most ``reach`` could violate."""
    steepest = np.asarray(abs(jacobian).sum(axis=1)).ravel()
    return np.flatnonzero((steepest > 0) & (values < reach * steepest))
