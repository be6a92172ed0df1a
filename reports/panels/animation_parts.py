"""Builds parts of an animation from responses: clips of structures, colour fields, axes."""

from typing import Literal

import numpy as np
import xarray as xr

from reports.base import style
from reports.panels import measured_overlay
from reports.panels.animation_data import (
    ROUNDING,
    AnimationAxis,
    AnimationClip,
    ColourField,
    round_up,
)
from reports.study import StudyResults, from_dataset
from sim.core import Floats

_SIGNED = {
    "ux": (0, "u_x", "mm", 1.0),
    "uy": (1, "u_y", "mm", 1.0),
    "theta": (2, "θ", "°", 180.0 / np.pi),
}
_SPEEDS = {"¼ of real time": 0.25, "⅛": 0.125, "½": 0.5}


def structure_clip(
    label: str, study: StudyResults, name: str, motion: xr.DataArray | None = None
) -> AnimationClip:
    """Returns a structure of a study with its motion, or with another `motion` of its units."""
    part = study.response.sel(structure=name)
    moved = part["displacement"] if motion is None else motion
    values = moved.transpose("case", "time", "unit", "dof").values
    structure = from_dataset(part, study.problem.lattice.spacing)
    return AnimationClip(label, style.STRUCTURE_COLOURS[name], structure, values)


def with_recordings(
    clip: AnimationClip, study: StudyResults, name: str, along: Floats
) -> list[AnimationClip]:
    """Lists the recordings of a structure, taken at `along` (n_frames,), and its simulation."""
    own = [each for each in study.recordings if each.structure == name]
    return [*measured_overlay.clips(own, clip, along, study.problem.lattice.spacing), clip]


def case_labels(response: xr.Dataset) -> list[str]:
    """Labels the load cases by their angles, or by their numbers where these are alike."""
    labels = [f"α = {angle:g}°" for angle in response["direction"].values]
    alike = len(set(labels)) < len(labels)
    return [f"load {k}" for k in range(1, len(labels) + 1)] if alike else labels


def time_axis(times: Floats, *, real: bool = False) -> AnimationAxis:
    """Returns an axis of times in s, slowed down; at the `real` speed too where that is wanted."""
    return AnimationAxis("t", "s", times, 3, True, _SPEEDS | ({"real time": 1.0} if real else {}))


def size_field(motion: Floats, spacing: float) -> ColourField:
    """Returns the colours of |U|, U = (ux/s, uy/s, theta), for motions (..., 3)."""
    scale = (spacing, spacing, 1.0)
    most = round_up(float(np.nanmax(np.linalg.norm(motion / np.array(scale), axis=-1))))
    return ColourField("norm", "|U|", "", 1.0, "magnitude", (0.0, most), scale)


def turn_field(motion: Floats) -> ColourField:
    """Returns the colours of |theta| for motions (..., 3)."""
    most = round_up(float(np.degrees(np.nanmax(np.abs(motion[..., 2])))))
    return ColourField("turn", "|θ|", "°", 180.0 / np.pi, "magnitude", (0.0, most))


def signed_field(key: Literal["ux", "uy", "theta"], motion: Floats) -> ColourField:
    """Returns the colours of one displacement or of the rotation for motions (..., 3)."""
    column, label, unit, factor = _SIGNED[key]
    largest = float(np.nanmax(np.abs(motion[..., column])))
    shift = float(np.nanmax(np.abs(motion[..., :2])))
    if key != "theta" and largest < ROUNDING * shift:
        largest = shift  # across this way nothing moves
    most = round_up(factor * largest)
    return ColourField(key, label, unit, factor, "signed", (-most, most))
