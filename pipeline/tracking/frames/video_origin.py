"""Whether a video was rendered: the virtual lab says so in the file."""

from __future__ import annotations

from pathlib import Path

SYNTHETIC_LABEL = "SYNTHETIC"
"""Stands in the title or comment of a video that was rendered."""


def rendered(video: Path) -> bool:
    """Whether the file's own metadata call the video synthetic; a folder of pictures has none.

    A file that cannot be read counts as filmed: reading its frames tells what is wrong.
    """
    import av

    if not video.is_file():
        return False
    try:
        with av.open(str(video)) as container:
            return any(SYNTHETIC_LABEL in text for text in container.metadata.values())
    except av.FFmpegError:
        return False
