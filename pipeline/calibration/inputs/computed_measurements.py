"""Describes computed measurements: the sections `virtual` of a calibration."""

from typing import Annotated

from pydantic import Field

from pipeline.problem.fields import Angle, Duration, Force, Frequency, Length, Samples, Section
from pipeline.problem.sections import NumericConstants

Amplitude = Annotated[Angle, Field(gt=0.0)]


class VirtualForces(Section):
    """A test that is computed.

    Attributes:
        end: displacement up to which it goes.
        points: along the way.
        noise: standard deviation of the load cell's white noise.
    """

    end: Length
    points: Samples = 40
    noise: Force


class VirtualDecay(Section):
    """A trace that is computed: a damped oscillation at the authors' frequency of one hinge.

    Attributes:
        amplitude: at the start.
        duration: of the trace.
        rate: of its readings.
        noise: standard deviation of the angles.
    """

    amplitude: Amplitude
    duration: Duration
    rate: Frequency = 960.0
    noise: Amplitude


class PoseError(Section):
    """Standard deviations.

    Attributes:
        displacement: of places.
        rotation: of rotations.
    """

    displacement: Length
    rotation: Amplitude


class VirtualTrack(Section):
    """A track that is computed.

    Attributes:
        rate: frames per second.
        noise: of every frame.
        bias: that stays with each unit.
        load: standard deviation of the noise of a load cell; without it there is none.
    """

    rate: Frequency
    noise: PoseError
    bias: PoseError | None = None
    load: Force | None = None


class ComputedMeasurements(Section):
    """True constants and noise of computed data.

    Attributes:
        truth: the true constants.
        cutoff_angle: the true one, where it is not that of `contact`.
        seed: of the noise.
    """

    truth: NumericConstants
    cutoff_angle: Angle | None = None
    seed: Annotated[int, Field(ge=0, strict=True)] = 0
