"""The key `virtual.specimen` of a recording: in what the specimen differs from its design."""

from typing import Annotated

from pydantic import Field

from pipeline.problem.fields import (
    Angle,
    Coordinate,
    Delay,
    Finite,
    Force,
    Frequency,
    Positive,
    Section,
)
from pipeline.problem.sections.prediction import Tolerances


class DriveFaults(Section):
    """In what the drive differs from the one that was asked for.

    Attributes:
        gain: factor of its amplitude.
        turn: by which its direction is off, counter-clockwise.
        cross: how far it leaves its line to the left at the largest displacement, over that; it
            grows with the square of the displacement, as on an arc.
        tilt: rotation of the driven units together about their middle, at the largest displacement.
        drift: of their middle along x and y, until the end.
        delay: after which it starts.
    """

    gain: Positive = 1.0
    turn: Angle = 0.0
    cross: Finite = 0.0
    tilt: Angle = 0.0
    drift: tuple[Coordinate, Coordinate] = (0.0, 0.0)
    delay: Delay = 0.0


class SpecimenFaults(Tolerances):
    """A specimen that is drawn within tolerances, and driven as labs do: by one displacement.

    Attributes:
        drive: in what the drive differs from the planned one.
        unload: whether a static load is taken off again, as fast as it was put on.
        seed: of the draws.
    """

    drive: DriveFaults = DriveFaults()
    unload: bool = False
    seed: Annotated[int, Field(ge=0, strict=True)] = 0


class VirtualLoadCell(Section):
    """A load cell at the drive, which logs what pushes along the drive's direction.

    Attributes:
        rate: of the log.
        noise: standard deviation of each value.
        offset: time of the video's first frame on the log's clock.
    """

    rate: Frequency = 50.0
    noise: Force = 0.02
    offset: Delay = 0.0
