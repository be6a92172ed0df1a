"""Estimates the errors of a fit, and the constants that its data do not tell."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from pipeline.calibration.experiments import ForceTest, FullFieldExperiment
from pipeline.calibration.inputs import ConstantName, Constants
from pipeline.calibration.least_squares import Fit
from sim.core import Floats

_TINY = 1e-9
_SMALL = 1e-5
_STEP = 1e-3
_LEAST = 0.1
"""Of the information, which drives that are not known can lessen to this part."""


class Uncertainty(NamedTuple):
    """Holds errors of the wanted constants' logarithms."""

    covariance: Floats  # (n_names, n_names)
    # (n_names, n_names), the inverse of the information: the Cramer-Rao bound of the covariance, at
    # the stated, or estimated, noise
    bound: Floats
    # largest step that Newton's method would still take by the adjoint's gradient, in standard
    # errors; how far the solution is from the least sum of squares
    newton: float


def estimate_errors(fit: Fit) -> Uncertainty:
    """Returns the errors of a fit.

    The covariance is H^-1 J'J H^-1 (Huber 1967), with H the second derivatives of half the sum of
    squares. Without drives, H is J'J but for residuals that add up to nothing, and taken as such.

    Raises:
        SimulationError: an equilibrium on the way is not stable.
    """
    wanted = slice(len(fit.model.names))
    inverse = invert_information(fit.jacobian)
    by_adjoint = fit.jacobian.T @ fit.residual
    by_adjoint[wanted] = adjoint_gradient(fit)
    step = inverse @ by_adjoint
    bound = np.sqrt(np.diag(inverse))
    covariance = _inflate(inverse, drive_information(fit))[wanted, wanted]
    newton = float(np.abs(step / bound)[wanted].max())
    return Uncertainty(covariance, inverse[wanted, wanted], newton)


def _inflate(inverse: Floats, lost: Floats) -> Floats:
    """Inflates a covariance for the loss of a part of the information whose inverse it was."""
    if not lost.any():
        return inverse
    root = np.linalg.cholesky(inverse)
    part, turn = np.linalg.eigh(np.eye(len(inverse)) - root.T @ lost @ root)
    axes = root @ turn / np.maximum(part, _LEAST)
    return np.asarray(axes @ axes.T)


def drive_information(fit: Fit) -> Floats:
    """Computes the part of the second derivatives that drives known by measurement alone take.

    Which motion of the driven units explains the residuals best is another one at other constants:
    as p(theta, u) is the prediction and P the covariance of the drive's changes u once the free
    units are known, (dp/dtheta . dp/du + rho . d2p/dtheta du) P (the same)' is taken from
    dp/dtheta . dp/dtheta, with rho the weighted residuals. Products without rho are in J'J.

    Returns:
        (n_unknowns, n_unknowns), of half the sum of squares.

    Raises:
        SimulationError: a step failed, or an equilibrium is not stable.
    """
    lost = np.zeros((len(fit.unknowns), len(fit.unknowns)))
    for k, each in enumerate(fit.model.experiments):
        if isinstance(each, FullFieldExperiment) and len(each.measured.spread):
            lost += _drive_information(fit, k, each)
    return lost


def _drive_information(fit: Fit, k: int, each: FullFieldExperiment) -> Floats:
    model, level = fit.model, fit.level[k]
    rho = each.measured.transposed(fit.residual[model.set_of_row == k]) * level
    explained = np.zeros((len(each.changes), len(fit.unknowns)))
    turned = np.zeros_like(explained)
    for column, name in enumerate(model.names):
        if name not in each.depends_on:
            continue
        step = _STEP * np.eye(1, len(fit.unknowns), column)[0]
        ends = [model.constants(fit.unknowns + sign * step) for sign in (1, -1)]
        ahead, behind = (each.predict(end, np.zeros(0)) for end in ends)
        explained[:, column] = each.measured.causes((ahead - behind) / (2 * _STEP))
        ahead, behind = (each.pull_back_to_noise(end, rho) for end in ends)
        turned[:, column] = (ahead - behind) / (2 * _STEP)
    mixed = explained.T @ turned
    return (mixed + mixed.T + turned.T @ each.measured.unexplained(turned)) / level**2


def invert_information(jacobian: Floats) -> Floats:
    """Inverts the information J'J; huge, not infinite, where the data tell nothing."""
    size = np.maximum(np.linalg.norm(jacobian, axis=0), _TINY)
    _, singular, right = np.linalg.svd(jacobian / size, full_matrices=False)
    scaled = right.T / np.maximum(singular, _TINY)
    return np.asarray((scaled @ scaled.T) / np.outer(size, size))


def adjoint_gradient(fit: Fit) -> Floats:
    """Computes derivatives (n_names,) of half the sum of squares, by the adjoint where possible."""
    model = fit.model
    constants, slopes = model.constants(fit.unknowns), _slopes(fit)
    total = np.zeros(len(model.names))
    by_columns = np.array([name == "contact_cutoff" for name in model.names])
    for k, each in enumerate(model.experiments):
        mine = model.set_of_row == k
        column = fit.jacobian[mine, : len(total)].T @ fit.residual[mine]
        if not isinstance(each, ForceTest | FullFieldExperiment):
            total += column
            continue
        bar = each.measured.transposed(fit.residual[mine]) / fit.level[k]
        by_numbers = each.pull_back(constants, bar)
        total += np.where(by_columns, column, by_numbers @ slopes)
    return total


def _slopes(fit: Fit) -> Floats:
    """Differentiates the specimen's numbers by the logarithms of the constants (5, n_names)."""
    model, logs = fit.model, fit.unknowns[: len(fit.model.names)]
    return slopes(model.begin, model.names, logs, lambda constants: constants.numbers)


def slopes(
    begin: Constants, names: Sequence[ConstantName], logs: Floats, of: Callable[[Constants], Floats]
) -> Floats:
    """Differentiates numbers (m,) of a specimen by logarithms of its constants (m, n_names)."""
    columns = []
    for step in _SMALL * np.eye(len(logs)):
        ahead, behind = (of(begin.at(names, logs + sign * step)) for sign in (1, -1))
        columns.append((ahead - behind) / (2 * _SMALL))
    return np.stack(columns, axis=1)
