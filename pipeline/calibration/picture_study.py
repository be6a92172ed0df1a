"""Tracks parts in real pictures beside another program's result, and locates a real specimen."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from pipeline.calibration.inputs import KnownPictures, RigidParts, SpecimenPicture
from pipeline.problem.fields import csv_columns
from pipeline.runtime import UserError
from pipeline.tracking.detect import detect_lattice
from pipeline.tracking.frames import pictures, read_picture, read_pictures
from pipeline.tracking.geometry import SpecimenOutlines
from pipeline.tracking.motion import Patch, follow_patch
from sim.core import Floats
from sim.structure import Lattice

DOFS = ("ux", "uy", "theta")


class TrackedPart(NamedTuple):
    """Holds a part in a later picture, and its motion (3,) by the other program: px, px, rad."""

    frame: int
    part: int
    patch: Patch
    reference: Floats


def tracked_parts(asked: RigidParts, folder: Path) -> Iterator[TrackedPart]:
    """Yields every part in every later picture that the other program tells of.

    Raises:
        UserError: a file cannot be used.
    """
    place = folder / asked.folder
    table = place / asked.reference
    numbered = numbered_pictures(place)
    first = _number(place / asked.first)
    for frame, part, *motion in csv_columns.read_columns(table, asked.columns):
        if int(frame) == first:
            continue
        if int(frame) not in numbered or not 0 <= part < len(asked.parts):
            what = "a line tells of a picture or a part that is not there"
            remedy = "delete the line, add the picture, or describe the part"
            raise UserError(what, file=table, value=f"{frame:g}, {part:g}", remedy=remedy)
        one = asked.parts[int(part)]
        before, after = read_pictures(place / asked.first, numbered[int(frame)])
        patch = Patch(before, after, np.array(one.outline), np.array(one.centre))
        yield TrackedPart(int(frame), int(part), patch, np.array(motion))


def numbered_pictures(folder: Path) -> dict[int, Path]:
    """Lists the pictures of a folder by the number at the end of their names.

    Raises:
        UserError: there are none.
    """
    return {_number(path): path for path in pictures(folder)}


def _number(path: Path) -> int:
    digits = path.stem.rpartition("_")[2]
    return int(digits) if digits.isdigit() else -1


def study_pictures(asked: KnownPictures, folder: Path) -> xr.Dataset:
    """Makes the dataset ``pictures``; files are as seen from the folder.

    Raises:
        UserError: a file cannot be used, or the specimen is not found in its picture.
    """
    return xr.merge(
        [_track_parts(asked.rigid_parts, folder), _locate_specimen(asked.specimen, folder)]
    )


def _track_parts(asked: RigidParts, folder: Path) -> xr.Dataset:
    found = list(tracked_parts(asked, folder))
    frames = sorted({each.frame for each in found})
    shape = (len(asked.parts), len(frames), len(DOFS))
    reference, measured = np.full(shape, np.nan), np.full(shape, np.nan)
    for each in found:
        place = each.part, frames.index(each.frame)
        reference[place] = each.reference
        measured[place] = follow_patch(each.patch, include_edge=True)
    along = ("part", "frame", "dof")
    return xr.Dataset(
        {"reference": (along, reference), "measured": (along, measured)},
        {"part": [one.name for one in asked.parts], "frame": frames, "dof": list(DOFS)},
    )


def _locate_specimen(asked: SpecimenPicture, folder: Path) -> xr.Dataset:
    network = asked.lattice.network()
    shown = _outlines(network)
    path = folder / asked.file
    found = detect_lattice(read_picture(path), shown, None)[0]
    seen, blob = np.zeros(shown.count, np.int8), np.full((shown.count, 2), np.nan)
    seen[found.unit], blob[found.unit] = 1, found.blob
    corners = shown.centre[:, None] + shown.outline
    area = np.abs(np.linalg.det(found.camera.jacobian(shown.centre)))
    return xr.Dataset(
        {
            "seen": ("unit", seen),
            "blob": (("unit", "xy"), blob),
            "outline": (("unit", "vertex", "xy"), found.camera.project(corners)),
            "dark_spots": ((), found.blobs),
            "pixel_size": ((), float(1 / np.sqrt(np.median(area)))),
        },
        {
            "unit": network.id,
            "i": ("unit", network.index[:, 0]),
            "j": ("unit", network.index[:, 1]),
            "xy": ["x", "y"],
        },
    )


def _outlines(network: Lattice) -> SpecimenOutlines:
    corners = network.vertices.reshape(network.n_units, -1, 2)
    centre = corners.mean(axis=1)
    joined = np.zeros(network.n_vertices, bool)
    joined[network.ligaments] = True
    ends = network.ligament_units
    return SpecimenOutlines(
        network.id, centre, corners - centre[:, None], ends, joined.reshape(corners.shape[:2])
    )
