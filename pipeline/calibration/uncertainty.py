"""What is known of the errors of a fit, and what the data cannot tell."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from pipeline.calibration.constants import Constants
from pipeline.calibration.description import Name
from pipeline.calibration.estimate import Fit
from pipeline.calibration.field import Field
from pipeline.calibration.forces import ForceTest
from sim.arrays import Floats

_TINY = 1e-9
_SMALL = 1e-5


class Uncertainty(NamedTuple):
    """Errors of the wanted constants' logarithms.

    Attributes:
        covariance: (n_names, n_names), the inverse of the information: the Cramer-Rao bound of the
            stated, or estimated, noise.
        newton: largest step that Newton's method would still take by the adjoint's gradient, in
            standard errors; how far the solution is from the least sum of squares.
    """

    covariance: Floats
    newton: float


def uncertainty(fit: Fit) -> Uncertainty:
    """The errors of a fit.

    Raises:
        SimulationError: an equilibrium on the way is not stable.
    """
    wanted = slice(len(fit.model.names))
    inverse = inverted(fit.jacobian)
    by_adjoint = fit.jacobian.T @ fit.residual
    by_adjoint[wanted] = gradient(fit)
    step = inverse @ by_adjoint
    bound = np.sqrt(np.diag(inverse))
    return Uncertainty(inverse[wanted, wanted], float(np.abs(step / bound)[wanted].max()))


def inverted(jacobian: Floats) -> Floats:
    """Inverse of the information J'J; huge, not infinite, where the data tell nothing."""
    size = np.maximum(np.linalg.norm(jacobian, axis=0), _TINY)
    _, singular, right = np.linalg.svd(jacobian / size, full_matrices=False)
    scaled = right.T / np.maximum(singular, _TINY)
    return np.asarray((scaled @ scaled.T) / np.outer(size, size))


def gradient(fit: Fit) -> Floats:
    """Derivatives (n_names,) of half the sum of squares, by the adjoint where there is one."""
    model = fit.model
    constants, slopes = model.constants(fit.unknowns), _slopes(fit)
    total = np.zeros(len(model.names))
    by_columns = np.array([name == "contact_cutoff" for name in model.names])
    for k, each in enumerate(model.experiments):
        mine = model.set_of_row == k
        column = fit.jacobian[mine, : len(total)].T @ fit.residual[mine]
        if not isinstance(each, ForceTest | Field):
            total += column
            continue
        bar = each.measured.transposed(fit.residual[mine]) / fit.level[k]
        by_numbers = each.pulled_back(constants, bar)
        total += np.where(by_columns, column, by_numbers @ slopes)
    return total


def _slopes(fit: Fit) -> Floats:
    """(5, n_names) derivatives of the specimen's numbers by the logarithms of the constants."""
    model, logs = fit.model, fit.unknowns[: len(fit.model.names)]
    return slopes(model.begin, model.names, logs, lambda constants: constants.numbers)


def slopes(
    begin: Constants, names: Sequence[Name], logs: Floats, of: Callable[[Constants], Floats]
) -> Floats:
    """Derivatives (m, n_names) of numbers (m,) of a specimen by logarithms of its constants."""
    columns = []
    for step in _SMALL * np.eye(len(logs)):
        ahead, behind = (of(begin.at(names, logs + sign * step)) for sign in (1, -1))
        columns.append((ahead - behind) / (2 * _SMALL))
    return np.stack(columns, axis=1)
