"""Forces that were logged beside a video, at the times of its frames."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.errors import UserError
from pipeline.tracking import columns
from pipeline.tracking.arrays import Floats
from pipeline.tracking.recording import LoadCell


def forces(path: Path, cell: LoadCell, time: Floats) -> Floats:
    """The force (frames,) in N at the frames, linear between the log's lines, NaN beyond them.

    Where the log is finer than the video, it is averaged over the frame's interval first, so that
    no noise of the load cell is folded into the frames.

    Args:
        path: the log.
        cell: its columns, and the time of the file's first frame on its clock.
        time: (frames,) since the file's first frame, s.

    Raises:
        UserError: the log cannot be read, runs backwards, or holds nothing of the video.
    """
    clock, force = columns.read(path, (cell.time, cell.force)).T
    clock = clock - cell.offset
    if (np.diff(clock) <= 0).any():
        remedy = "sort it by time, each time once"
        raise UserError("the log's time does not ascend", file=path, key=cell.time, remedy=remedy)
    if clock[-1] < time[0] or clock[0] > time[-1]:
        raise UserError(
            f"the log (from {clock[0]:.6g} s to {clock[-1]:.6g} s of the video's time) and the"
            f" frames (from {time[0]:.6g} s to {time[-1]:.6g} s) do not overlap",
            file=path,
            key="load_cell.offset",
            value=cell.offset,
            remedy="give the time of the video's first frame on the log's clock",
        )
    inside = (time >= clock[0]) & (time <= clock[-1])
    return np.where(inside, _smooth(clock, force, time), np.nan)


def _smooth(clock: Floats, force: Floats, time: Floats) -> Floats:
    """Means over an interval of a frame about each, or plain values where the log is coarser."""
    interval = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    if interval <= 2 * float(np.median(np.diff(clock))):
        return np.interp(time, clock, force)
    area = np.concatenate([[0.0], np.cumsum(np.diff(clock) * (force[1:] + force[:-1]) / 2)])
    first = np.clip(time - interval / 2, clock[0], clock[-1])
    last = np.clip(time + interval / 2, clock[0], clock[-1])
    gained = np.interp(last, clock, area) - np.interp(first, clock, area)
    return gained / (last - first)
