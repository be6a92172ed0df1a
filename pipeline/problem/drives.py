"""What moves the driven units: one model per kind of drive, told apart by the key `kind`.

Driven units have all three degrees of freedom prescribed: the displacement follows the drive along
one direction per load case, the rotation is held (a time series prescribes all three).
"""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self

from pydantic import Field, StringConstraints, model_validator

from pipeline.problem.quantities import Angle, Delay, Duration, Frequency, Length, Ratio, fault
from pipeline.problem.section import Section
from pipeline.problem.selection import Selector

_SUM_TOLERANCE = 1e-6


class _Directed(Section):
    """A drive along straight lines, one load case per direction."""

    units: Selector
    amplitude: Length
    directions: Annotated[tuple[Angle, ...], Field(min_length=1)]
    weights: tuple[Ratio, ...] | None = None

    @property
    def case_weights(self) -> tuple[float, ...]:
        """The weight of each load case in the loss; equal ones where none are given."""
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


class Harmonic(_Directed):
    """A sin(2 pi f t) from the first instant, as the authors drive the shielding sample."""

    kind: Literal["harmonic"]
    frequency: Frequency


class RampHarmonic(_Directed):
    """A (1 + tanh((t - delay)/rise_time))/2 sin(2 pi f (t - delay))."""

    kind: Literal["ramp_harmonic"]
    frequency: Frequency
    rise_time: Duration
    delay: Delay = 0.0


class TanhRamp(_Directed):
    """A (1 + tanh(6 (2 t/duration - 1)))/2, the authors' slow compression."""

    kind: Literal["tanh_ramp"]
    duration: Duration


class LinearRamp(_Directed):
    """A t/duration."""

    kind: Literal["linear_ramp"]
    duration: Duration


class TimeSeries(Section):
    """A measured motion (x, y, theta) of the driven units, read from a file beside the problem."""

    kind: Literal["time_series"]
    units: Selector
    file: Annotated[str, StringConstraints(min_length=1)]
    sha256: Annotated[str, StringConstraints(pattern="^[0-9a-f]{64}$")] | None = None

    @property
    def case_weights(self) -> tuple[float, ...]:
        """One load case."""
        return (1.0,)


Drive = Annotated[
    Harmonic | RampHarmonic | TanhRamp | LinearRamp | TimeSeries, Field(discriminator="kind")
]
