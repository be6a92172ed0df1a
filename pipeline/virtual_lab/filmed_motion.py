"""Samples a response at the instants that a video, and its load cell, show."""

import json
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline

from pipeline.problem.sections import VirtualLoadCell, VirtualRecording
from pipeline.runtime import UserError
from sim.core import Floats, Mask

_SMEAR_STEP = 0.3  # px between the instants of an exposure
_MOST_INSTANTS = 9
_NOISE_STREAM = 3
"""First word of the seed of a load cell's noise: no frame has it."""
_TURNING = ("torque", "rotation")


class FilmedMotion(NamedTuple):
    """Holds poses of the units that are present, over the frames."""

    time: Floats  # (frames,) of the video, at mid-exposure, s
    pose: Floats  # (frames, units, 3) at mid-exposure, mm and rad
    instants: Floats  # (frames, instants, units, 3) poses that each exposure averages


class FilmClock(NamedTuple):
    """Maps times of a video to times of the response."""

    frames: int  # number of them
    start: float  # of the response, s
    end: float  # of the response, s
    still: float  # rest at the video's start, s
    pace: float  # how fast the response's time goes

    def response_time(self, instant: Floats) -> Floats:
        """Maps instants of the video to times of the response, s."""
        moved = self.start + (instant - self.still) * self.pace
        return np.clip(moved, self.start, self.end)


def film_clock(given: Floats, asked: VirtualRecording) -> FilmClock:
    """Makes the clock of a video of a response with samples at the times ``given``, s.

    Raises:
        UserError: nothing is in the window.
    """
    end = given[-1] if asked.end is None else min(asked.end, given[-1])
    if end <= asked.start:
        what = "the response has ended by then"
        remedy = f"start before {given[-1]:g} s, and end after that"
        raise UserError(what, key="virtual.start", value=asked.start, remedy=remedy)
    pace = 1.0 if asked.duration is None else (end - asked.start) / asked.duration
    frames = 1 + int(np.floor((asked.still + (end - asked.start) / pace) * asked.rate + 1e-9))
    return FilmClock(frames, asked.start, end, asked.still, pace)


def sample_motion(one: xr.Dataset, present: Mask, asked: VirtualRecording) -> FilmedMotion:
    """Samples the motion of a response at one structure and case, or of a specimen, by the frames.

    Between the samples of the response, a cubic spline; before the start, its first state.
    `present` (units,) are there.

    Raises:
        UserError: nothing is in the window.
    """
    states = one["displacement"].transpose("time", "unit", "dof").values
    given = one["time"].values
    of_video = film_clock(given, asked)
    course = CubicSpline(given, states[:, present])
    time = np.arange(of_video.frames) / asked.rate

    def at(instant: Floats) -> Floats:
        return np.asarray(course(of_video.response_time(instant)))

    pose = at(time)
    count = _count_instants(pose, asked)
    offsets = ((np.arange(count) + 0.5) / count - 0.5) * asked.sensor.exposure
    return FilmedMotion(time, pose, at(time[:, None] + offsets))


def _count_instants(pose: Floats, asked: VirtualRecording) -> int:
    """Counts the instants that make an exposure smooth."""
    step = float(np.abs(np.diff(pose[..., :2], axis=0)).max(initial=0.0))
    smear = step * asked.rate * asked.sensor.exposure / asked.camera.pixel_size
    return int(np.clip(np.ceil(smear / _SMEAR_STEP), 1, _MOST_INSTANTS))


def load_cell_log(one: xr.Dataset, asked: VirtualRecording, cell: VirtualLoadCell) -> Floats:
    """Times and forces (lines, 2) of a load cell, on its own clock: s, N.

    A force is positive where the drive pushes along its direction. The log begins at zero of its
    clock and ends a little after the video.

    Raises:
        UserError: the video shows nothing of the response, or the drive has no direction.
    """
    if _displaces_nothing(one):
        what = "the drive turns its units and has no direction, along which a load cell would weigh"
        remedy = "leave load_cell out, or drive the problem by a displacement or a force"
        raise UserError(what, key="virtual.load_cell", remedy=remedy)
    angle = np.deg2rad(float(one["direction"]))
    given = one["time"].values
    force = one["drive_force"].transpose("time", "xy").values @ [np.cos(angle), np.sin(angle)]
    of_video = film_clock(given, asked)
    length = cell.offset + of_video.frames / asked.rate
    time = np.arange(int(np.ceil(length * cell.rate)) + 1) / cell.rate
    drive_force = np.interp(of_video.response_time(time - cell.offset), given, force)
    random = np.random.default_rng([_NOISE_STREAM, asked.seed])
    return np.column_stack([time, drive_force + cell.noise * random.standard_normal(len(time))])


def _displaces_nothing(one: xr.Dataset) -> bool:
    """Tests for a drive by a moment or a rotation, and for a motion that displaces nothing."""
    drive = json.loads(one.attrs["problem"]).get("drive", {})
    first = drive.get("drives", [drive])[0]
    return first.get("kind") in _TURNING or not one["drive_displacement"].values.any()
