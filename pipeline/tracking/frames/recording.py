"""Defines the YAML file of a recording: a video, the design that it shows, how to read it."""

from pathlib import Path
from typing import Annotated, Any, Literal, Self

import yaml
from pydantic import Field, model_validator

from pipeline.problem.fields import (
    Angle,
    Delay,
    Duration,
    Finite,
    Frequency,
    Gap,
    Length,
    Section,
    exactly_one,
    fault,
)
from pipeline.problem.reading import load_section
from pipeline.problem.sections import VirtualRecording


class Window(Section):
    """The part of the video that is tracked; its first frame shows the specimen at rest.

    Attributes:
        start: since the file's first frame.
        end: likewise; by default that of the file.
    """

    start: Delay = 0.0
    end: Duration | None = None

    @model_validator(mode="after")
    def _check_order(self) -> Self:
        if self.end is not None and self.end <= self.start:
            what = f"it ends at {self.end:g} s, where it starts at {self.start:g} s"
            raise fault(what, "let it end after it starts")
        return self


class LoadCellLog(Section):
    """Forces that were logged beside the video, with a clock of their own.

    Those with which the drive pushes or pulls along its own direction are to be positive.

    Attributes:
        file: a CSV with a heading, as seen from the recording's own file.
        time: name of the column of times, in the unit of its heading, or s.
        force: name of the column of forces, likewise, or N.
        offset: time of the video's first frame on the log's clock, s.
        reversed: whether the cell counts the other way, such as compression negative.
        zero: of forces: as they are, or their mean over the frames in which the specimen rests
            where the tracked part of the video starts.
    """

    file: str = Field(min_length=1)
    time: str = "time"
    force: str = "force"
    offset: Finite = 0.0
    reversed: bool = False
    zero: Literal["file", "start"] = "file"


class Recording(Section):
    """Subject of the video.

    Attributes:
        title: one line about it.
        video: the file, as seen from the recording's own, or a folder of pictures.
        sha256: of the video, which is refused if it has another; a rendered one has it.
        virtual: how it is rendered, in place of a video.
        design: the design dataset of the specimen, likewise; a study's own need not be named.
        structure: which of the design's structures it is.
        case: number of the study's load case that it was under.
        presets: of the study whose report shows it too: those of its lattice.
        specimen: what the units show; `auto` finds out.
        pixel_size: roughly, in the specimen's plane; without it, the units are looked for in
            several sizes.
        thickness: of the units, if their side walls show: bare ones a few millimetres thick do.
        camera_distance: from the specimen's middle; without it, thick units tell it roughly.
        turned: how far the specimen is turned in the picture, counter-clockwise, where its lattice
            does not tell.
        mirrored: whether it is seen from behind, likewise.
        frame_rate: of a folder of pictures or a bare stream (.h264, .hevc, .mjpeg), which have no
            times of their own; of a video, it replaces the times in the file, as where a high-speed
            recording plays slowly.
        exposure: of a frame, whose blur of quick motions is allowed for, but where side walls show;
            without it, that blur tells it.
        readout: of a rolling shutter, from the first row of a frame to the last; with it, every
            unit gets the time of its own row.
        camera: whether it stands still, or what the clamped units do together is its own motion.
        window: of time, since the file's first frame.
        load_axis: what courses are drawn over; a track holds both.
        load_cell: forces logged beside it.
        synthetic: whether the video was rendered, not filmed.
    """

    title: str = ""
    video: Annotated[str, Field(min_length=1)] | None = None
    sha256: Annotated[str, Field(pattern="^[0-9a-f]{64}$")] | None = None
    virtual: VirtualRecording | None = None
    design: Annotated[str, Field(min_length=1)] | None = None
    structure: Literal["intact", "altered", "cloaked"] = "cloaked"
    case: Annotated[int, Field(ge=0, strict=True)] = 0
    presets: tuple[str, ...] = ()
    specimen: Literal["auto", "dots", "speckle", "bare"] = "auto"
    pixel_size: Length | None = None
    thickness: Gap = 0.0
    camera_distance: Length | None = None
    turned: Angle | None = None
    mirrored: bool | None = None
    frame_rate: Frequency | None = None
    exposure: Delay | None = None
    readout: Delay = 0.0
    camera: Literal["fixed", "follows supports"] = "fixed"
    window: Window = Window()
    load_axis: Literal["time", "driven displacement"] = "time"
    load_cell: LoadCellLog | None = None
    synthetic: bool = False

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        exactly_one(self, "video", "virtual")
        return self

    @model_validator(mode="after")
    def _check_virtual(self) -> Self:
        """Refuses what differs from the section `virtual`, which alone tells it there."""
        if self.virtual is None:
            return self
        for key, what in (
            ("readout", "the virtual camera reads all rows at once"),
            ("sha256", "no video is there yet that it could be of"),
            ("design", "what is rendered has the design that the command names"),
        ):
            if getattr(self, key):
                raise fault(what, "leave it out beside virtual", key)
        camera, look = self.virtual.camera, self.virtual.look
        own = {
            "pixel_size": (camera.pixel_size, "camera.pixel_size"),
            "thickness": (look.thickness, "look.thickness"),
            "camera_distance": (camera.distance, "camera.distance"),
            "frame_rate": (self.virtual.rate, "rate"),
            "load_cell": (None, "load_cell"),
        }
        for key, (value, place) in own.items():
            if getattr(self, key) not in (value, type(self).model_fields[key].default):
                what = f"of a video that is rendered, virtual.{place} tells it"
                raise fault(what, f"leave it out, or write it in virtual.{place}", key)
        return self


def load_recording(path: Path) -> Recording:
    """Loads the recording in a YAML file.

    Raises:
        UserError: naming the file, the key, the value and the remedy.
    """
    return load_section(path, Recording)


def recording_yaml(values: dict[str, Any], comments: tuple[str, ...] = ()) -> str:
    """Writes the YAML of a recording, after lines of comment.

    Args:
        values: keys and their values, as they stand in the file; those that are None are left out.
        comments: without their `#`.
    """
    given = {key: value for key, value in values.items() if value is not None}
    lines = [f"# {comment}" for comment in comments]
    return "\n".join(
        [*lines, yaml.safe_dump(given, sort_keys=False, allow_unicode=True, width=100)]
    )
