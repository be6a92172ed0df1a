"""Samples forces that were logged beside a video at the times of its frames."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from pipeline.problem.fields import csv_columns, units
from pipeline.runtime import UserError
from pipeline.tracking.frames.recording import LoadCellLog
from sim.core import Floats


class ForceLog(NamedTuple):
    """Holds times (lines,) on the clock of the video's file, s, and forces of a load cell, N."""

    clock: Floats
    force: Floats


def read(path: Path, cell: LoadCellLog) -> ForceLog:
    """Reads the log of a load cell.

    Args:
        path: the file.
        cell: its columns, their sign, and the time of the video's first frame on its clock.

    Raises:
        UserError: it cannot be read, or runs backwards.
    """
    columns, dimensions = (cell.time, cell.force), (units.TIME, units.FORCE)
    clock, force = csv_columns.read_columns(path, columns, dimensions).T
    if len(clock) < 2:
        remedy = "give a log of the whole test"
        raise UserError("the log has one line", file=path, key=cell.force, remedy=remedy)
    if (np.diff(clock) <= 0).any():
        remedy = "sort it by time, each time once"
        raise UserError("the log's time does not ascend", file=path, key=cell.time, remedy=remedy)
    return ForceLog(clock - cell.offset, -force if cell.reversed else force)


def forces(log: ForceLog, time: Floats, resting: int = 0) -> Floats:
    """Returns the force (frames,) in N, linear between the log's lines, NaN beyond them.

    Where the log is finer than the video, it is averaged over the frame's interval first, so that
    no noise of the load cell is folded into the frames.

    Args:
        log: of the load cell.
        time: (frames,) since the file's first frame, s.
        resting: number of first frames whose mean force is zero; 0 leaves forces as logged.
    """
    inside = (time >= log.clock[0]) & (time <= log.clock[-1])
    force = np.where(inside, _smooth(log.clock, log.force, time), np.nan)
    return force - force[:resting].mean() if resting else force


def check(log: ForceLog, window: tuple[float, float], path: Path, cell: LoadCellLog) -> None:
    """Refuses a log that holds nothing of a window of the video's time, s, or not its zero.

    Raises:
        UserError: telling both spans of time.
    """
    start, end = window
    if cell.zero == "start" and log.clock[0] > start:
        raise UserError(
            f"the log starts at {log.clock[0]:.6g} s of the video's time, after the first frame"
            f" ({start:.6g} s), whose force is to be zero",
            file=path,
            key="load_cell.zero",
            value=cell.zero,
            remedy="let the window start later, where the specimen rests, or leave this key out",
        )
    if log.clock[-1] < start or log.clock[0] > end:
        raise UserError(
            f"the log (from {log.clock[0]:.6g} s to {log.clock[-1]:.6g} s of the video's time) and"
            f" the frames (from {start:.6g} s to {end:.6g} s) do not overlap",
            file=path,
            key="load_cell.offset",
            value=cell.offset,
            remedy="give the time of the video's first frame on the log's clock",
        )


def _smooth(clock: Floats, force: Floats, time: Floats) -> Floats:
    """Averages over an interval of a frame about each, or interpolates where the log is coarser."""
    interval = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    if interval <= 2 * float(np.median(np.diff(clock))):
        return np.interp(time, clock, force)
    area = np.concatenate([[0.0], np.cumsum(np.diff(clock) * (force[1:] + force[:-1]) / 2)])
    first = np.clip(time - interval / 2, clock[0], clock[-1])
    last = np.clip(time + interval / 2, clock[0], clock[-1])
    gained = np.interp(last, clock, area) - np.interp(first, clock, area)
    return gained / (last - first)
