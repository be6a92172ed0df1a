"""The section `virtual` of a recording: what is filmed in the virtual lab, and with what."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from pipeline.problem.fields import (
    Angle,
    Delay,
    Duration,
    Finite,
    Frequency,
    Gap,
    Length,
    Positive,
    Ratio,
    Section,
    fault,
)
from pipeline.problem.sections.fabrication import Markers
from pipeline.problem.sections.virtual_specimen import SpecimenFaults, VirtualLoadCell

Shade = Annotated[float, Field(ge=0.0, le=1.0)]
Size = Annotated[int, Field(ge=64, le=8192, strict=True)]
_ROUNDING = 1e-9


class CameraView(Section):
    """The camera.

    Attributes:
        pixel_size: in the plane of the faces, at the middle of the specimen.
        image: columns and rows.
        distance: from the middle of the specimen.
        tilt: about x, then y.
        roll: about the camera's axis.
        distortion: second and fourth power of the radius, in halves of the image's longer side.
    """

    pixel_size: Length = 0.365
    image: tuple[Size, Size] = (768, 768)
    distance: Length = 1000.0
    tilt: tuple[Angle, Angle] = (0.0, 0.0)
    roll: Angle = 0.0
    distortion: tuple[Finite, Finite] = (0.0, 0.0)


class Speckle(Section):
    """Random dots that do not touch.

    Attributes:
        diameter: of a dot.
        density: the part of the face that they may fill.
    """

    diameter: Length = 1.2
    density: Annotated[float, Field(gt=0.0, le=0.5)] = 0.35


class UnitAppearance(Section):
    """Looks of the units.

    Attributes:
        face: shade of their faces, from black to white.
        mark: of dots or speckle on them.
        side: of their side walls and of the ligaments.
        board: of what is behind them.
        thickness: of the units; their side walls show where the camera looks at them askance.
        ligament: width of a ligament as seen; zero shows none.
        dots: where they are dotted.
        speckle: where they are speckled.
    """

    face: Shade = 0.04
    mark: Shade = 0.9
    side: Shade = 0.07
    board: Shade = 0.85
    thickness: Gap = 8.0
    ligament: Gap = 0.2
    dots: Markers = Markers()
    speckle: Speckle = Speckle()


class Lighting(Section):
    """The light.

    Attributes:
        level: brightness of white in the middle, of the sensor's range.
        slope: change from left to right, and from bottom to top, relative.
        falloff: loss at the image's far corners, relative.
        flicker: amplitude of 100 Hz.
    """

    level: Shade = 0.9
    slope: tuple[Finite, Finite] = (0.05, -0.03)
    falloff: Shade = 0.1
    flicker: Shade = 0.0


class Sensor(Section):
    """Optics and sensor.

    Attributes:
        exposure: of a frame, centred about its time; no longer than a frame lasts.
        blur: standard deviation of the optics' blur, px.
        full_well: electrons at the end of the range.
        read_noise: electrons.
    """

    exposure: Delay = 0.001
    blur: Ratio = 0.6
    full_well: Positive = 10000.0
    read_noise: Ratio = 8.0


class Codec(Section):
    """Storage of the video.

    Attributes:
        name: ffv1 loses nothing.
        crf: constant rate factor of h264.
    """

    name: Literal["h264", "h264 intra", "ffv1"] = "h264"
    crf: Annotated[int, Field(ge=0, le=51, strict=True)] = 14

    @property
    def suffixes(self) -> tuple[str, ...]:
        """Of the names of files that can hold it."""
        return (".mkv", ".mp4") if self.name == "ffv1" else (".mp4", ".mkv")


class VirtualRecording(Section):
    """A recording that is rendered: from the study's own response, or from a specimen's.

    Attributes:
        specimen: in what the specimen differs from its design; without it, in nothing.
        rate: frames per second.
        still: how long the specimen rests before it moves.
        start: time of the response from which it moves on.
        end: time of the response at which the video ends.
        duration: of the motion in the video; by default as long as in the response.
        camera: where it stands, and how it sees.
        look: of the units.
        light: on them.
        sensor: of the camera, with its optics.
        codec: of the file.
        load_cell: at the drive, if there is one.
        seed: of noise and speckle.
    """

    specimen: SpecimenFaults | None = None

    rate: Frequency = 100.0
    still: Delay = 0.1
    start: Delay = 0.0
    end: Duration | None = None
    duration: Duration | None = None
    camera: CameraView = CameraView()
    look: UnitAppearance = UnitAppearance()
    light: Lighting = Lighting()
    sensor: Sensor = Sensor()
    codec: Codec = Codec()
    load_cell: VirtualLoadCell | None = None
    seed: Annotated[int, Field(ge=0, strict=True)] = 0

    @model_validator(mode="after")
    def _exposed_in_time(self) -> Self:
        if self.sensor.exposure * self.rate > 1.0 + _ROUNDING:
            what = f"an exposure of {self.sensor.exposure:g} s is longer than a frame lasts"
            remedy = f"give {1 / self.rate:.3g} s at most, or a lower virtual.rate"
            raise fault(what, remedy, "sensor", "exposure")
        return self
