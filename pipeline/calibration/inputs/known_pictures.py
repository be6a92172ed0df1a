"""Describes pictures of rigid parts that others tracked, and of a specimen at rest."""

from typing import Annotated, Self

from pydantic import Field, StringConstraints, model_validator

from pipeline.calibration.inputs.population import MeasurementSource
from pipeline.problem.fields import Angle, File, Length, Section, fault
from pipeline.problem.sections import Lattice

Inside = Annotated[str, StringConstraints(pattern=r"^[^/\\]+$")]
"""Name of a file in a folder."""
Pixels = Annotated[float, Field(ge=0.0, le=1e5)]
Point = tuple[Pixels, Pixels]


class RigidPart(Section):
    """One part that moves as a whole.

    Attributes:
        name: in words.
        centre: whose motion is told, in pixels of the first picture.
        outline: of its patch; all of it lies on the part.
    """

    name: str
    centre: Point
    outline: Annotated[tuple[Point, ...], Field(min_length=3)]


class RigidParts(Section):
    """Pictures of parts whose motion another program has tracked.

    Attributes:
        source: who took the pictures, and tracked.
        folder: of the pictures (PNG), which follow each other by name.
        first: the picture in which the parts lie at rest.
        parts: in the order of their numbers.
        reference: a CSV beside the pictures, with the other program's motion.
        columns: of it: number in the picture's name, number of the part, shift to the right and
            down in px, rotation in rad from right to down.
        program: name of the other program.
        accuracy: px and angle that its motion is good to; without it agreement is not judged.
    """

    source: MeasurementSource
    folder: File
    first: Inside
    parts: Annotated[tuple[RigidPart, ...], Field(min_length=1)]
    reference: Inside
    columns: tuple[str, str, str, str, str] = ("frame", "part", "u_px", "v_px", "rotation_rad")
    program: str = "the other program"
    accuracy: tuple[Annotated[Pixels, Field(gt=0.0)], Annotated[Angle, Field(gt=0.0)]] | None = None

    @property
    def bounds(self) -> tuple[float, float, float] | None:
        """Returns what motions are good to: px, px, rad."""
        return self.accuracy and (self.accuracy[0], *self.accuracy)

    @model_validator(mode="after")
    def _check_names(self) -> Self:
        names = [each.name for each in self.parts]
        if len(set(names)) < len(names):
            raise fault("two parts have one name", "name each part differently", "parts")
        return self


class SpecimenPicture(Section):
    """A picture of a specimen at rest.

    Attributes:
        source: who took it.
        file: the picture.
        lattice: its specimen.
        pixel_size: as those tell who took it; the specimen is found without it.
    """

    source: MeasurementSource
    file: File
    lattice: Lattice
    pixel_size: Length


class KnownPictures(Section):
    """Real pictures by which tracking is judged.

    Attributes:
        title: one line about them.
        doc: more lines.
        rigid_parts: parts that another program has tracked.
        specimen: a specimen to be found unaided.
        synthetic: whether any of the pictures was rendered, not taken.
    """

    title: str = ""
    doc: str = ""
    rigid_parts: RigidParts
    specimen: SpecimenPicture
    synthetic: bool = False
