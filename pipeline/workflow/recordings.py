"""Lists the recordings of the studies and the files that each depends on.

A recording is a file experiments/STUDY/recordings/NAME.yaml. It names a video beside it, or tells
how the virtual lab films the study's own response.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pipeline.runtime import WORK, UserError
from pipeline.tracking import frames

if TYPE_CHECKING:
    from snakemake.iocontainers import Wildcards

    from pipeline.tracking.frames import Recording

RECORDINGS = "_recordings"
"""Ends the targets that render and track the recordings of a study."""


def recording_pages(study: str, root: Path = WORK) -> list[str]:
    """Lists the quality reports of all recordings of a study, such as fig2 or fig2@quick."""
    folder = root / "experiments" / study.partition("@")[0] / "recordings"
    names = sorted(path.stem for path in folder.glob("*.yaml"))
    return [f"results/{study}/recordings/{name}/index.html" for name in names]


def shown_recordings(study: str, root: Path = WORK) -> list[str]:
    """Lists the recordings that the report of a study, or of a preset of it, shows.

    One that was filmed takes the place of those that are virtual and show the same structure under
    the same load case. One that cannot be read is shown too: its stage will tell why.
    """
    name, _, preset = study.partition("@")
    folder = root / "experiments" / name / "recordings"
    found = {path.stem: _read(path) for path in sorted(folder.glob("*.yaml"))}
    shown = {
        stem: asked
        for stem, asked in found.items()
        if asked is None or not preset or preset in asked.presets
    }
    filmed = {_shows(asked) for asked in shown.values() if asked and asked.virtual is None}
    return [
        stem
        for stem, asked in shown.items()
        if asked is None or asked.virtual is None or _shows(asked) not in filmed
    ]


def _shows(asked: Recording) -> tuple[str, int]:
    return asked.structure, asked.case


def comparisons(wildcards: Wildcards) -> list[str]:
    """Lists the datasets of the recordings that the report of a study shows."""
    study = f"{wildcards.name}{wildcards.preset}"
    names = shown_recordings(study)
    return [f"results/{study}/recordings/{name}/comparison.nc" for name in names]


def compared(wildcards: Wildcards) -> dict[str, str | list[str]]:
    """Names the recording's YAML that a comparison depends on, as it is tracked."""
    return {"recording": tracked(wildcards)["recording"]}


def tracked(wildcards: Wildcards) -> dict[str, str | list[str]]:
    """Lists the files that tracking depends on: YAML, video, design, load cell.

    Of a folder of pictures also these, as one that is written anew leaves the folder as it was.
    """
    asked = described(wildcards)
    study = f"results/{wildcards.name}{wildcards.preset}"
    if asked is None or asked.virtual is not None:
        stem = f"{study}/recordings/{wildcards.recording}"
        files: dict[str, str | list[str]] = {
            "recording": f"{stem}.yaml",
            "video": f"{stem}.mp4",
            "design": f"{study}/design.nc",
        }
        weighed = asked is not None and asked.virtual is not None and asked.virtual.load_cell
        return files | {"load_cell": f"{stem}_load.csv"} if weighed else files
    folder = Path(_source(wildcards)).parent
    beside = {"video": asked.video, "design": asked.design}
    if asked.load_cell is not None:
        beside["load_cell"] = asked.load_cell.file
    named = {key: str(folder / file) for key, file in beside.items() if file is not None}
    pictures = _pictures(folder / str(asked.video))
    return {
        "recording": _source(wildcards),
        "design": f"{study}/design.nc",
        **named,
        **({"pictures": pictures} if pictures else {}),
    }


def _pictures(video: Path) -> list[str]:
    """Lists the pictures of a video that is a folder, from where the project lies."""
    try:
        found = frames.pictures(WORK / video) if (WORK / video).is_dir() else []
    except UserError:  # there are none, as its stage will tell
        found = []
    return [str(video / path.name) for path in found]


def filmed(wildcards: Wildcards) -> str:
    """Names what a virtual recording shows: its specimen, or the study's own response."""
    asked = described(wildcards)
    study = f"results/{wildcards.name}{wildcards.preset}"
    if asked is None or asked.virtual is None or asked.virtual.specimen is None:
        return f"{study}/response.nc"
    return f"{study}/recordings/{wildcards.recording}_specimen.nc"


def described(wildcards: Wildcards) -> Recording | None:
    """Reads the recording; None where it cannot be read, of which the stage will tell why."""
    return _read(WORK / _source(wildcards))


def _read(path: Path) -> Recording | None:
    try:
        return frames.load_recording(path)
    except UserError:
        return None


def _source(wildcards: Wildcards) -> str:
    return f"experiments/{wildcards.name}/recordings/{wildcards.recording}.yaml"
