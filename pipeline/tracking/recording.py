"""The YAML file of a recording: which video shows which design, and how to read it."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from pydantic import Field, ValidationError

from pipeline.problem import yamlfile
from pipeline.problem.loading import told
from pipeline.problem.quantities import Delay, Duration, Length
from pipeline.problem.section import Section


class Window(Section):
    """The part of the video that is tracked; its first frame shows the specimen at rest."""

    start: Delay = 0.0
    end: Duration | None = None


class Recording(Section):
    """What was filmed.

    Attributes:
        title: one line about it.
        video: the file, as seen from the recording's own.
        design: the design dataset of the specimen, likewise.
        specimen: what the units show; `auto` finds out.
        pixel_size: roughly, in the specimen's plane; without it, the units are looked for in
            several sizes.
        window: of time, since the file's first frame.
        load_axis: what comparisons are drawn over.
        synthetic: whether the video was rendered, not filmed.
    """

    title: str = ""
    video: str = Field(min_length=1)
    design: str = Field(min_length=1)
    specimen: Literal["auto", "dots", "speckle", "bare"] = "auto"
    pixel_size: Length | None = None
    window: Window = Window()
    load_axis: Literal["time", "driven displacement"] = "time"
    synthetic: bool = False


def load(path: Path) -> Recording:
    """The recording in a YAML file.

    Raises:
        UserError: naming the file, the key, the value and the remedy.
    """
    document = yamlfile.read(path)
    try:
        return Recording.model_validate(document.data)
    except ValidationError as error:
        raise told(error, document, document.data, None) from error
