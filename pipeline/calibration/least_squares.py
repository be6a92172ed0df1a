"""Fits the logarithms of the constants by weighted least squares, over all sets at once.

The columns of the Jacobian are central differences: with a handful of unknowns they cost a few
solves more than the adjoint's one gradient, but a whole Jacobian gives Gauss-Newton's steps and the
covariance; and they cover the cut-off of contact, by which the adjoint does not differentiate. The
adjoint's exact gradient is what the solution is checked by (``uncertainty``).
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from pipeline.calibration.experiments import Experiment
from pipeline.calibration.inputs import ConstantName, Constants
from sim.core import Floats, SimulationError

STEP = 1e-4
"""Of the central differences, in logarithms and in scales of a set's own unknowns."""
REACH = np.log(30.0)
"""Constants are looked for within a factor of 30 of where they start."""
CONVERGED = 0.01
"""Levels of noise that change by less are final."""
ITERATIONS = 6


class FitModel(NamedTuple):
    """Combines the wanted constants with all sets."""

    begin: Constants  # constants to start from
    names: tuple[ConstantName, ...]  # the wanted ones
    experiments: Sequence[Experiment]  # all sets

    @property
    def start(self) -> Floats:
        """(n_unknowns,) logarithms of the constants, then every set's own unknowns."""
        nuisance = [each.nuisance_start for each in self.experiments]
        return np.concatenate([self.begin.logs(self.names), *nuisance])

    @property
    def scale(self) -> Floats:
        """(n_unknowns,) of their changes."""
        nuisance = [each.nuisance_scale for each in self.experiments]
        return np.concatenate([np.ones(len(self.names)), *nuisance])

    @property
    def set_of_row(self) -> np.ndarray:
        """(n,) the set that each measured value belongs to."""
        return np.repeat(
            np.arange(len(self.experiments)),
            [len(each.measured.values) for each in self.experiments],
        )

    def constants(self, unknowns: Floats) -> Constants:
        """Returns the specimen's constants at some unknowns."""
        return self.begin.at(self.names, unknowns[: len(self.names)])

    @property
    def nuisance(self) -> list[slice]:
        """Locates every set's own unknowns."""
        ends = np.cumsum(
            [len(self.names), *(len(each.nuisance_start) for each in self.experiments)]
        )
        return [slice(first, last) for first, last in pairwise(ends)]

    def predictions(self, unknowns: Floats) -> list[Floats]:
        """Predicts every set's measurements.

        Raises:
            SimulationError: there is no such state.
        """
        constants = self.constants(unknowns)
        pairs = zip(self.experiments, self.nuisance, strict=True)
        return [each.predict(constants, unknowns[nuisance]) for each, nuisance in pairs]

    def residual(self, unknowns: Floats) -> Floats:
        """Computes whitened residuals (n,)."""
        pairs = zip(self.experiments, self.predictions(unknowns), strict=True)
        return np.concatenate(
            [each.measured.whitened(found - each.measured.values) for each, found in pairs]
        )

    def jacobian(self, unknowns: Floats) -> Floats:
        """Differentiates the whitened residuals by central differences (n, n_unknowns)."""
        blocks = []
        for each, nuisance in zip(self.experiments, self.nuisance, strict=True):
            seen = [k for k, name in enumerate(self.names) if name in each.depends_on]
            block = np.zeros((len(each.measured.values), len(unknowns)))
            for k in (*seen, *range(nuisance.start, nuisance.stop)):
                step = np.zeros_like(unknowns)
                step[k] = STEP * self.scale[k]
                ahead, behind = (
                    each.predict(self.constants(at), at[nuisance])
                    for at in (unknowns + step, unknowns - step)
                )
                block[:, k] = (ahead - behind) / (2 * step[k])
            blocks.append(each.measured.whitened(block))
        return np.concatenate(blocks)


class Fit(NamedTuple):
    """Holds the solution, each set's rows already divided by the level of its noise."""

    model: FitModel  # what was fitted
    unknowns: Floats  # (n_unknowns,) where the sum of squares is least
    level: Floats  # (n_sets,) factor on every set's standard deviations
    residual: Floats  # (n,) whitened
    jacobian: Floats  # (n, n_unknowns) of the whitened residual
    bounds: Floats  # (n_unknowns, 2) within which it was looked for


def fit_least_squares(model: FitModel, initial: Floats | None = None) -> Fit:
    """Finds the constants that fit best, from `initial` on, or from the start.

    Levels of noise that are not known follow from the residuals of their sets, and weigh the sets
    against one another; they are found in turns with the constants.

    Raises:
        SimulationError: the measured states cannot be simulated from the start on.
    """
    rows, begin = model.set_of_row, model.start
    unknowns = begin if initial is None else initial
    reach = np.full(len(begin), np.inf)
    reach[: len(model.names)] = REACH
    bounds = np.stack([begin - reach, begin + reach], axis=1)
    level = _level(model, model.residual(unknowns), np.zeros((len(rows), 1)))
    for _ in range(ITERATIONS):
        unknowns = _solve(model, unknowns, level[rows], bounds)
        residual, jacobian = model.residual(unknowns), model.jacobian(unknowns)
        found = _level(model, residual, jacobian / level[rows, None])
        settled = np.ptp(np.log(found / level)) < CONVERGED
        level = found
        if settled:
            break
    within = level[rows]
    return Fit(model, unknowns, level, residual / within, jacobian / within[:, None], bounds)


def _solve(model: FitModel, start: Floats, level: Floats, bounds: Floats) -> Floats:
    """Solves for the least sum of squares at given levels (n,) of noise."""
    first = model.residual(start)
    wall = 10 * float(np.linalg.norm(first / level)) + 1.0

    def residual(unknowns: Floats) -> Floats:
        try:
            return model.residual(unknowns) / level
        except SimulationError:  # a trial step too far: the trust region shrinks
            return np.full(len(first), wall)

    found = least_squares(
        residual,
        start,
        jac=lambda unknowns: model.jacobian(unknowns) / level[:, None],
        bounds=tuple(bounds.T),
        x_scale=model.scale,
        xtol=1e-6,
        ftol=1e-8,
        gtol=1e-8,
        max_nfev=60,
    )
    return np.asarray(found.x)


def _level(model: FitModel, residual: Floats, jacobian: Floats) -> Floats:
    """Computes root mean squares (n_sets,) of whitened residuals, over the freedom left."""
    basis = np.linalg.svd(jacobian, full_matrices=False)[0] if jacobian.any() else jacobian
    taken = (basis**2).sum(axis=1)
    level = np.ones(len(model.experiments))
    for k, each in enumerate(model.experiments):
        mine = model.set_of_row == k
        if not each.measured.known:
            freedom = mine.sum() - taken[mine].sum() - each.measured.unbiased
            level[k] = np.sqrt((residual[mine] ** 2).sum() / max(freedom, 1.0))
    return np.where(level > 0, level, 1.0)
