"""Describes the motion of driven units: one model per kind, told apart by the key `kind`.

Driven units have all three degrees of freedom prescribed: the displacement follows the drive along
one direction per load case, the rotation is held (a time series prescribes all three).
"""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import Field, StringConstraints, model_validator

from pipeline.problem.fields import Angle, Delay, Duration, Frequency, Length, Ratio, Section, fault
from pipeline.problem.sections.selectors import Selector

_SUM_TOLERANCE = 1e-6


class _Directed(Section):
    """A drive along straight lines, one load case per direction.

    Attributes:
        kind: which of the drives this is.
        units: that are driven.
        amplitude: A, of their displacement.
        directions: of the displacement against x, counter-clockwise.
        weights: of the load cases in the loss, adding up to 1; equal ones by default.
    """

    units: Selector
    amplitude: Length
    directions: Annotated[tuple[Angle, ...], Field(min_length=1)]
    weights: tuple[Ratio, ...] | None = None

    @property
    def case_weights(self) -> tuple[float, ...]:
        """Computes the weight of each load case in the loss; equal ones where none are given."""
        return self.weights or (1.0 / len(self.directions),) * len(self.directions)

    @model_validator(mode="after")
    def _weights_match(self) -> Self:
        if self.weights is None:
            return self
        if len(self.weights) != len(self.directions):
            what = f"{len(self.weights)} weights for {len(self.directions)} directions"
            raise fault(what, "give one weight per direction, or none for equal ones", "weights")
        if not math.isclose(total := math.fsum(self.weights), 1.0, abs_tol=_SUM_TOLERANCE):
            what = f"the weights add up to {total:g}"
            raise fault(what, "scale them to add up to 1, or give none for equal ones", "weights")
        return self


class HarmonicDrive(_Directed):
    """A sin(2 pi f t) from the first instant, as the authors drive the shielding sample.

    Attributes:
        frequency: f.
    """

    kind: Literal["harmonic"]
    frequency: Frequency


class RampHarmonicDrive(_Directed):
    """A (1 + tanh((t - delay)/rise_time))/2 sin(2 pi f (t - delay)).

    Attributes:
        frequency: f.
        rise_time: half the time in which it grows from 12 % to 88 %.
        delay: until it has grown to one half.
    """

    kind: Literal["ramp_harmonic"]
    frequency: Frequency
    rise_time: Duration
    delay: Delay = 0.0


class PulseDrive(_Directed):
    """A exp(-((t - delay)/width)^2), a single push there and back.

    Attributes:
        width: half the time in which it is above 37 % of its peak.
        delay: until its peak; three widths or more, for it to begin at rest.
    """

    kind: Literal["pulse"]
    width: Duration
    delay: Duration


class TanhRampDrive(_Directed):
    """A (1 + tanh(6 (2 t/duration - 1)))/2, the authors' slow compression.

    Attributes:
        duration: of the ramp; a static path has no time, so that it only names the loads.
    """

    kind: Literal["tanh_ramp"]
    duration: Duration


class LinearRampDrive(_Directed):
    """A t/duration.

    Attributes:
        duration: of the ramp; a static path has no time, so that it only names the loads.
    """

    kind: Literal["linear_ramp"]
    duration: Duration


class TimeSeriesDrive(Section):
    """A measured motion (x, y, theta) of the driven units, read from a file beside the problem.

    The file is a CSV whose heading names the columns `time (s)`, `ux (mm)`, `uy (mm)` and
    `theta (rad)`, or other units of these kinds in the brackets; lines above it are comments. Times
    ascend from zero to the end of the horizon at least, where `horizon: { duration: 1 s }` gives
    it; the motion starts at rest, and between two lines it is interpolated linearly.

    Attributes:
        kind: which of the drives this is.
        units: that are driven.
        file: with the motion.
        sha256: of the file, which is refused if it has another.
    """

    kind: Literal["time_series"]
    units: Selector
    file: Annotated[str, StringConstraints(min_length=1)]
    sha256: Annotated[str, StringConstraints(pattern="^[0-9a-f]{64}$")] | None = None

    @property
    def case_weights(self) -> tuple[float, ...]:
        """Returns the weight of the one load case."""
        return (1.0,)


Drive = Annotated[
    HarmonicDrive
    | RampHarmonicDrive
    | PulseDrive
    | TanhRampDrive
    | LinearRampDrive
    | TimeSeriesDrive,
    Field(discriminator="kind"),
]
