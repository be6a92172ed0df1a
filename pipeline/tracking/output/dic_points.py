"""Converts displacements of points, as DIC systems export them, to motions of the units."""

from pathlib import Path
from typing import Annotated, Literal, NamedTuple

import numpy as np
import shapely
import xarray as xr
from pydantic import Field

from pipeline.datasets.tables import TABLES
from pipeline.problem.fields import Angle, Coordinate, Length, Section, csv_columns, units
from pipeline.problem.reading import load_section
from pipeline.runtime import UserError
from pipeline.tracking.geometry import (
    SpecimenOutlines,
    outlines_of_design,
    robust_motion,
    rotation_matrix,
)
from pipeline.tracking.output.subset_overlap import Residuals, inflate_sigma, subset_width
from pipeline.tracking.output.track_dataset import label_track, pose_variables
from sim.core import Floats, Ints, Mask

_LEAST_SIGMA = 1e-4  # mm, standard deviation of the best points
_FEWEST = 3  # points of a unit
_MOST_SAMPLES = 200  # of a unit at a time, that tell how far subsets overlap

ColumnName = Annotated[str, Field(min_length=1)]


class DicColumns(Section):
    """Names of the columns.

    Attributes:
        time: in the unit of its heading, or s.
        x: place at rest, likewise, or mm.
        y: likewise.
        ux: displacement, likewise, or mm.
        uy: likewise.
    """

    time: ColumnName = "time"
    x: ColumnName = "x"
    y: ColumnName = "y"
    ux: ColumnName = "u"
    uy: ColumnName = "v"


class DicExport(Section):
    """A file of points, and how its axes lie on the specimen.

    Attributes:
        title: one line about it.
        points: the CSV, as seen from this file: one line a point and time.
        columns: their names.
        origin: place of unit (0, 0)'s lattice point on the file's axes.
        rotation: of the specimen's x axis on the file's axes, counter-clockwise.
        flipped: whether the file's y axis points downwards.
        subset: side of the system's square subsets, which tells how far they overlap; by default as
            the points' errors tell.
        design: the design dataset, likewise; or --design.
        structure: which of the design's structures it is.
        synthetic: whether it was computed, not measured.
    """

    title: str = ""
    points: ColumnName
    columns: DicColumns = DicColumns()
    origin: tuple[Coordinate, Coordinate] = (0.0, 0.0)
    rotation: Angle = 0.0
    flipped: bool = False
    subset: Length | None = None
    design: ColumnName | None = None
    structure: Literal["intact", "altered", "cloaked"] = "cloaked"
    synthetic: bool = False


class DicPoints(NamedTuple):
    """Holds points in the specimen's frame, one row a point and time.

    Attributes:
        time: (rows,) s.
        place: (rows, 2) at rest, mm.
        displacement: (rows, 2) displacement, mm.
    """

    time: Floats
    place: Floats
    displacement: Floats


def load(path: Path) -> DicExport:
    """Loads the description in a YAML file.

    Raises:
        UserError: naming the file, the key, the value and the remedy.
    """
    return load_section(path, DicExport)


def read_points(path: Path, export: DicExport) -> DicPoints:
    """Reads the points of a file in the specimen's frame.

    Raises:
        UserError: the file cannot be read, or lacks a column.
    """
    names = export.columns
    columns = (names.time, names.x, names.y, names.ux, names.uy)
    dimensions = (units.TIME, *[units.LENGTH] * 4)
    table = csv_columns.read_columns(path, columns, dimensions)
    upright = np.array([1.0, -1.0 if export.flipped else 1.0])
    turn = rotation_matrix(export.rotation)
    place = (table[:, 1:3] - np.array(export.origin)) * upright @ turn
    return DicPoints(table[:, 0], place, table[:, 3:5] * upright @ turn)


def track(design: xr.Dataset, seen: DicPoints, subset: float | None = None) -> xr.Dataset:
    """Makes the dataset ``track`` of points: a robust rigid fit for each unit and time.

    A unit's motion is taken from the points that lie on it at rest. Its uncertainty follows from
    how far they are from moving rigidly, and from how far a DIC system's subsets overlap.

    Args:
        design: as built.
        seen: the points.
        subset: side of the subsets, mm; by default as neighbours' errors tell.

    Raises:
        UserError: hardly a unit bears points enough to tell its motion.
    """
    specimen = outlines_of_design(design)
    unit = _containing_unit(specimen, seen.place)
    time, frame = np.unique(seen.time, return_inverse=True)
    groups = _group_rows(frame * specimen.count + unit, unit >= 0)
    bearing = len({int(unit[rows[0]]) for rows in groups})
    if bearing < max(3, specimen.count // 10):
        low, high = seen.place.min(axis=0), seen.place.max(axis=0)
        raise UserError(
            f"{bearing} of {specimen.count} units bear points enough, {_FEWEST} or more at a time;"
            f" all reach from ({low[0]:.1f}, {low[1]:.1f}) to ({high[0]:.1f}, {high[1]:.1f}) mm"
            " of the specimen",
            key="origin",
            remedy="give origin, rotation and flipped so that the points lie on the units,"
            f" and export {_FEWEST} or more on each",
        )
    motion = np.full((len(time), specimen.count, 3), np.nan)
    sigma = np.full_like(motion, np.nan)
    fits = [
        ((frame[rows[0]], unit[rows[0]]), seen.place[rows] - specimen.centre[unit[rows[0]]], rows)
        for rows in groups
    ]
    samples, step = [], -(-len(fits) // _MOST_SAMPLES)
    for number, (at, before, rows) in enumerate(fits):
        motion[at], sigma[at], rest = _fit_pose(before, before + seen.displacement[rows])
        if number % step == 0:
            samples.append(Residuals(before, rest))
    if subset is None:
        widest = max(np.ptp(specimen.polygon(k), axis=0).max() for k in range(specimen.count))
        subset = subset_width(samples, float(widest))
    factors: dict[bytes, Floats] = {}  # points mostly stay where they are
    for at, before, _ in fits:
        if (place := before.tobytes()) not in factors:
            factors[place] = inflate_sigma(before, subset)
        sigma[at] *= factors[place]
    return _dataset(design, time - time[0], motion, sigma)


def _group_rows(key: Ints, on_unit: Mask) -> list[Ints]:
    """Groups rows on units by their key, where there are enough for a pose."""
    order = np.argsort(key, kind="stable")
    order = order[on_unit[order]]
    groups = np.split(order, np.flatnonzero(np.diff(key[order])) + 1)
    return [rows for rows in groups if len(rows) >= _FEWEST]


def _containing_unit(specimen: SpecimenOutlines, place: Floats) -> Ints:
    """Finds the unit (rows,) that contains each point at rest, -1 for none."""
    faces = [
        shapely.Polygon(specimen.centre[unit] + specimen.polygon(unit))
        for unit in range(specimen.count)
    ]
    points, units = shapely.STRtree(faces).query(shapely.points(place), predicate="within")
    out = np.full(len(place), -1)
    out[points] = units
    return out


def _fit_pose(before: Floats, after: Floats) -> tuple[Floats, Floats, Floats]:
    """Fits pose and standard uncertainty (3,) to points relative to the centroid at rest.

    Also returns what is left of each point's motion (n, 2).
    """
    turn, shift, weight = robust_motion(before, after, _LEAST_SIGMA)
    rest = after - before @ rotation_matrix(-turn) - shift
    count = weight.sum()
    middle = weight @ before / count
    arm = weight @ ((before - middle) ** 2).sum(axis=1)
    freedom = max(2 * count - 3, 1.0)
    variance = max(float(weight @ (rest**2).sum(axis=1)) / freedom, _LEAST_SIGMA**2)
    lever = middle[::-1] ** 2  # the centroid lies aside from the middle of the points
    place = variance * (1 / count + lever / arm)
    return np.array([*shift, turn]), np.sqrt([*place, variance / arm]), rest


def _dataset(design: xr.Dataset, time: Floats, motion: Floats, sigma: Floats) -> xr.Dataset:
    present = np.isfinite(design["vertices"].values[:, 0, 0])
    hidden = TABLES["track"]["quality"].flags["hidden"]
    quality = np.where(np.isfinite(motion[..., 0]), 0, hidden).astype(np.int8)
    variables = {
        **pose_variables(present, motion, sigma, quality),
        "timing": (("time",), np.zeros(len(time), np.int8)),
        "frame": (("time",), np.arange(len(time))),
        "load_force": (("time",), np.full(len(time), np.nan)),
        "camera_homography": (("row", "column"), np.full((3, 3), np.nan)),
        "camera_centre": (("xy",), np.full(2, np.nan)),
        "camera_radial": (("power",), np.full(2, np.nan)),
        "camera_residual": (("unit", "xy"), np.full((len(present), 2), np.nan)),
        "image_size": (("xy",), np.zeros(2, int)),
        "blur": ((), np.nan),
    }
    return label_track(design, time, variables)
