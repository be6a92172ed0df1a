"""Measures how long tracking takes from a file: to the first frame, and a frame from then on."""

import resource
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.tracking import wild_clips
from benchmarks.tracking.clip_scripts import GRID, RATE, ClipScript
from benchmarks.tracking.rendering import View
from pipeline.tracking.frames import read_frames
from pipeline.tracking.motion import track_video

_UNITS = GRID | {"grid": [15, 15]}
_LARGE, _WIDE = View(size=(1024, 1024), scale=4.25), View(size=(3840, 2160), scale=9.2)
_MOVES = 120.0
"""Frames a second that the motion is filmed with; stamps are those of a slow replay."""
_SHORT = 3
"""Frames of a clip that compiled loops are loaded with first."""
CLIPS = {
    "1 Mpx, H.264": (_LARGE, ("libx264", "yuv420p", 14), 48),
    "1 Mpx, FFV1": (_LARGE, ("ffv1", "gray", 0), 48),
    "4K, H.264": (_WIDE, ("libx264", "yuv420p", 14), 9),
}
"""Views, codecs and numbers of frames."""


def table(folder: Path) -> str:
    """Renders and tracks clips of 225 units; returns the lines of their table.

    Seconds of processor hold on a busy machine; frames a second by the clock are those of this one.
    The memory is the most of this process so far.
    """
    lines = [
        "| 225 bare units | first frame, s of processor | decoding, ms of processor a frame |"
        " with the fit | frames/s by the clock | x, y px | memory, MB |",
        "|---|---|---|---|---|---|---|",
    ]
    for place, (name, (view, codec, frames)) in enumerate(CLIPS.items()):
        count = np.arange(frames)
        script = ClipScript(
            grid=_UNITS, view=view, times=count / _MOVES, stamps=count / RATE, film=codec
        )
        path = folder / f"speed_{place}.mkv"
        clip = wild_clips.film_clip(script, path)
        begin = time.process_time()
        decoded = sum(1 for _ in read_frames(path))
        decoding = (time.process_time() - begin) / decoded
        track_video(iter(clip.frames[:_SHORT]), clip.specimen, clip.scale)
        clock, spent = [time.perf_counter()], [time.process_time()]

        def tell(clock: list[float] = clock, spent: list[float] = spent) -> None:
            clock.append(time.perf_counter())
            spent.append(time.process_time())

        track = track_video(read_frames(path), clip.specimen, clip.scale, tell)
        each = (spent[-1] - spent[1]) / (len(spent) - 2)
        rate = (len(clock) - 2) / (clock[-1] - clock[1])
        memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        lines.append(
            f"| {name} | {spent[1] - spent[0]:.1f} | {1000 * decoding:.1f} | {1000 * each:.1f} |"
            f" {rate:.0f} | {wild_clips.errors(clip, track).rms:.4f} | {memory:.0f} |"
        )
    return "\n".join(lines)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as made:
        print(table(Path(made)))
