"""Defines a set of measurements as the estimator sees it, whatever its kind."""

from dataclasses import dataclass, field, replace
from typing import Literal, Protocol

import numpy as np

from pipeline.calibration.inputs import ConstantName, Constants
from sim.core import Floats, Ints

Kind = Literal["force_displacement", "free_decay", "track"]

_UNSEEN = 1e-8

LEAST_LINES = 5
"""Lines of a file of readings that any fit needs."""
ELASTIC: tuple[ConstantName, ...] = (
    "axial_stiffness",
    "shear_stiffness",
    "bending_stiffness",
    "contact_cutoff",
)
"""Constants that equilibria depend on."""


@dataclass(frozen=True)
class MeasuredValues:
    """Holds the measured values of one set."""

    name: str  # of the set
    kind: Kind  # of the set
    abscissa: Floats  # (n,) displacement in mm, or time in s
    values: Floats  # (n,) forces in N, angles in rad, or displacements in mm and rad
    sigma: Floats  # (n,) standard deviations, or their ratios only
    known: bool  # whether the standard deviations hold as they are
    # (n,) which course each value belongs to; of a track, 3 unit + dof, the load cell's last
    channel: Ints = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    # (n,) standard deviation of what a channel's values have in common besides; infinite where it
    # is unknown, so that a channel's mean tells nothing
    bias: Floats = field(default_factory=lambda: np.zeros(0))
    # (n, r) orthonormal directions of whitened values in which a common cause, such as the noise of
    # the drive, scatters them besides
    axes: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    # (r,) standard deviation along them by that cause alone
    spread: Floats = field(default_factory=lambda: np.zeros(0))
    # (m, r) what of the m independent causes each is made of
    mixture: Floats = field(default_factory=lambda: np.zeros((0, 0)))
    remarks: tuple[str, ...] = ()  # what a reader should know of the set, a sentence each

    def whitened(self, deviation: Floats) -> Floats:
        """Scales deviations (n, ...) to numbers of unit variance, without correlation.

        The covariance in a channel is D + b^2 1 1', with D the squared ``sigma``: its inverse root
        takes from D^-1/2 x a part of the component along D^-1/2 1.
        """
        return self._less_common(self._less_mean((deviation.T / self.sigma).T))

    def transposed(self, white: Floats) -> Floats:
        """Applies the transpose of ``whitened`` to whitened numbers (n,)."""
        return self._less_mean(self._less_common(white)) / self.sigma

    def with_common(self, causes: Floats) -> "MeasuredValues":
        """Adds the effect of independent causes on the values, (n, m) per standard deviation.

        The covariance of whitened values is then 1 + C C': along the axes of C they are divided by
        what it is there.
        """
        white = self._less_mean((causes.T / self.sigma).T)
        square, turn = np.linalg.eigh(white.T @ white)
        seen = square > _UNSEEN * max(float(square[-1]), 1.0)
        spread = np.sqrt(square[seen])
        return replace(
            self, axes=white @ turn[:, seen] / spread, spread=spread, mixture=turn[:, seen]
        )

    def causes(self, deviation: Floats) -> Floats:
        """Estimates the causes (m, ...) of deviations (n, ...), in standard deviations."""
        along = self.axes.T @ self._less_mean((deviation.T / self.sigma).T)
        return np.asarray(self.mixture @ (along.T * self.spread / (1 + self.spread**2)).T)

    def unexplained(self, causes: Floats) -> Floats:
        """Multiplies causes (m, ...) by their covariance once the values are known, 1 before."""
        known = self.spread**2 / (1 + self.spread**2)
        return causes - self.mixture @ (known * (self.mixture.T @ causes).T).T

    def _less_common(self, white: Floats) -> Floats:
        if not len(self.spread):
            return white
        part = 1 - 1 / np.sqrt(1 + self.spread**2)
        return white - self.axes @ (part * (self.axes.T @ white).T).T

    def _less_mean(self, scaled: Floats) -> Floats:
        """Removes from multiples (n, ...) of ``sigma`` what a bias of their channels explains."""
        if not len(self.bias):
            return scaled
        weight = 1 / self.sigma
        size = np.bincount(self.channel, weight**2)[self.channel]
        part = 1 - 1 / np.sqrt(1 + self.bias**2 * size)
        flat = scaled.reshape(len(scaled), -1)
        along = np.stack([np.bincount(self.channel, weight * column) for column in flat.T], axis=1)
        taken = (part * weight / size)[:, None] * along[self.channel]
        return (flat - taken).reshape(scaled.shape)

    @property
    def channels(self) -> Ints:
        """(n,) the channel of each value; one where there is only one."""
        return self.channel if len(self.channel) else np.zeros(len(self.values), dtype=np.int64)

    @property
    def unbiased(self) -> int:
        """Number of means that tell nothing."""
        return len(np.unique(self.channel[np.isinf(self.bias)])) if len(self.bias) else 0


class Experiment(Protocol):
    """Combines measurements with a model of them."""

    @property
    def measured(self) -> MeasuredValues:
        """Returns the measurements."""
        ...

    @property
    def depends_on(self) -> tuple[ConstantName, ...]:
        """Returns the constants that the measurements depend on."""
        ...

    @property
    def nuisance_start(self) -> Floats:
        """(n_own,) unknowns of this set alone to start from."""
        ...

    @property
    def nuisance_scale(self) -> Floats:
        """(n_own,) changes of them that are about as visible as one of a constant by e."""
        ...

    def predict(self, constants: Constants, nuisance: Floats) -> Floats:
        """Predicts the measurements (n,) without errors.

        Raises:
            SimulationError: there is no such state.
        """
        ...
