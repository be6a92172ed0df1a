"""Describes the analysis of small vibrations: the section `spectrum`."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from pipeline.problem.fields import Count, Frequency, Section, fault

Compression = Annotated[float, Field(ge=0.0, lt=1.0)]


class Band(Section):
    """Equally spaced frequencies, both ends included.

    Attributes:
        start: the first.
        stop: the last.
        points: how many.
    """

    start: Frequency = Field(alias="from")
    stop: Frequency = Field(alias="to")
    points: Count = 201

    @model_validator(mode="after")
    def _upwards(self) -> Self:
        if self.stop <= self.start:
            what = f"the band ends at {self.stop:g} Hz, where it starts at {self.start:g} Hz"
            raise fault(what, "let it end above its start")
        return self


class Spectrum(Section):
    """Linear analysis about rest and, in a static study, about the full load of every load case.

    Attributes:
        modes: how many of the lowest of each structure.
        transmission: frequencies of a small harmonic motion of the driven units.
        compressions: of the unit cell along x before waves are sent through it, as shares of its
            length; the stress across is relieved.
        waves: wave vectors on each side of the triangle in the Brillouin zone.
    """

    modes: Count = 12
    transmission: Band
    compressions: tuple[Compression, ...] = (0.0, 0.03)
    waves: Count = 40
