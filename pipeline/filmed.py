"""The recordings of the studies, as the workflow sees them: what each depends on.

A recording is a file experiments/STUDY/recordings/NAME.yaml. It names a video beside it, or tells
how the virtual lab films the study's own response.
"""

from __future__ import annotations

from pathlib import Path

from snakemake.iocontainers import Wildcards

from pipeline.environment import ROOT
from pipeline.errors import UserError
from pipeline.tracking.recording import Recording, load

RECORDINGS = "_recordings"
"""Ends the targets that render and track the recordings of a study."""


def recording_pages(study: str, root: Path = ROOT) -> list[str]:
    """The quality reports of all recordings of a study, such as fig2 or fig2@quick."""
    folder = root / "experiments" / study.partition("@")[0] / "recordings"
    names = sorted(path.stem for path in folder.glob("*.yaml"))
    return [f"results/{study}/recordings/{name}/index.html" for name in names]


def tracked(wildcards: Wildcards) -> dict[str, str]:
    """The files that tracking a recording depends on: its YAML, video, design, load cell."""
    asked = described(wildcards)
    study = f"results/{wildcards.name}{wildcards.preset}"
    if asked is None or asked.virtual is not None:
        stem = f"{study}/recordings/{wildcards.recording}"
        return {
            "recording": f"{stem}.yaml",
            "video": f"{stem}.mp4",
            "design": f"{study}/design.nc",
        }
    folder = Path(_source(wildcards)).parent
    beside = {"video": asked.video, "design": asked.design}
    if asked.load_cell is not None:
        beside["load_cell"] = asked.load_cell.file
    named = {key: str(folder / file) for key, file in beside.items() if file is not None}
    return {"recording": _source(wildcards), "design": f"{study}/design.nc", **named}


def described(wildcards: Wildcards) -> Recording | None:
    """The recording; None for one that cannot be read, of which the stage will tell why."""
    try:
        return load(ROOT / _source(wildcards))
    except UserError:
        return None


def _source(wildcards: Wildcards) -> str:
    return f"experiments/{wildcards.name}/recordings/{wildcards.recording}.yaml"
