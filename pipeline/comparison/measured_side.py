"""Selects frames and units of a track to compare, and turns them into the design's frame."""

import math
from typing import NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from pipeline.comparison.alignment import LEAST_FRAMES, too_few_frames
from pipeline.comparison.registration import Registration, measure_places, register
from pipeline.posing import CLAMPED, DRIVEN
from pipeline.runtime import UserError
from pipeline.tracking.geometry import difference_of_vertices, outlines_of_design
from pipeline.tracking.output import distinct_frames, drive_displacement, driven_units
from sim.core import Floats, Ints, Mask

MOST_FRAMES = 600
LEAST_PER_PERIOD = 8
COMPARED, HELD, PUSHED, ABSENT, LOST = range(5)

_ZERO_SHARE = 0.05  # of the range of forces, by which one at rest may differ from zero
_NOISE_RATIO = 4.0  # standard deviations, likewise
_NORMAL = 0.6745  # median of absolute normal numbers
_SEEN_SHARE = 0.5  # of the frames, or a unit counts as lost


class Measurement(NamedTuple):
    """Holds the measured side, in the design's frame."""

    frames: Ints  # (n_frames,) numbers of those that are compared, in the track
    time: Floats  # (n_frames,) on the track's clock, s
    displacement: Floats  # (n_frames, n_units, 3) mm and rad, NaN where not measured
    sigma: Floats  # (n_frames, n_units, 3) its uncertainty
    use: NDArray[np.int8]  # (n_units,) whether the unit is compared
    centre: Floats  # (n_units, 2) at rest by the design, mm; NaN for those that are absent
    registration: Registration  # of the units at rest
    track: xr.Dataset  # the whole of it, turned into the design's frame
    drive: Floats  # (n_frames, 2) mean displacement at the drive, mm; NaN while none is seen
    force: Floats  # (n_frames,) of the load cell, N; NaN without

    @property
    def compared(self) -> Mask:
        """Marks the units (n_units,) that are compared."""
        return np.asarray(self.use == COMPARED)

    def select(self, kept: Ints) -> "Measurement":
        """Selects frames (n,) of those that are compared."""
        displacement = self.displacement[kept]
        return self._replace(
            frames=self.frames[kept],
            time=self.time[kept],
            displacement=displacement,
            sigma=self.sigma[kept],
            use=_mark_lost(displacement, np.where(self.use == LOST, COMPARED, self.use)),
            drive=self.drive[kept],
            force=self.force[kept],
        )


def prepare_measurement(
    track: xr.Dataset, design: xr.Dataset, leading: Ints | None = None
) -> Measurement:
    """Prepares the measured side of a comparison: a track, and the design as built.

    Its frames are all but duplicates.

    The units `leading` are those whose displacement is the drive's; by default all that are driven.

    Raises:
        UserError: the track is not of this design, shows no driven units, or is too short.
    """
    check_track(track, design, leading)
    centre = _centres(design)
    found = register(centre, measure_places(track, centre))
    motion = found.upright(track["displacement"].values.astype(float))
    turned = track.assign(displacement=(track["displacement"].dims, motion))
    frames = distinct_frames(track)
    shown = turned.isel(time=frames)
    displacement = shown["displacement"].values
    return Measurement(
        frames=frames,
        time=shown["time"].values,
        displacement=displacement,
        sigma=shown["sigma"].values.astype(float),
        use=_mark_lost(displacement, _unit_use(design)),
        centre=centre,
        registration=found,
        track=turned,
        drive=drive_displacement(displacement, design, leading),
        force=shown["load_force"].values,
    )


def check_track(track: xr.Dataset, design: xr.Dataset, leading: Ints | None = None) -> None:
    """Refuses a track that is not of a design, in which no driven unit is seen, or that is short.

    Raises:
        UserError: telling which.
    """
    if not np.array_equal(track["unit"].values, design["unit"].values):
        raise _mismatch(f"it has {track.sizes['unit']} units, the design {design.sizes['unit']}")
    if told := difference_of_vertices(track["vertices"].values, design["vertices"].values):
        raise _mismatch(told)
    seen = np.isfinite(track["displacement"].values[:, driven_units(design, leading), 0]).any(
        axis=1
    )
    if not seen.any():
        what = "no driven unit is seen in any frame: there is nothing to align with"
        remedy = "film the driven units too, or give a window that shows them"
        raise UserError(what, key="window", remedy=remedy)
    if seen.sum() < LEAST_FRAMES:
        raise too_few_frames(int(seen.sum()))


def untared_force(force: Floats, resting: Mask) -> float:
    """Finds the median of a load cell's force (frames,) at rest, N; NaN for one that is zero there.

    It is zero within a share of the force's range, and within noise.
    """
    known = np.isfinite(force)
    if not (known & resting).any():
        return np.nan
    at_rest = force[known & resting]
    least = max(
        _ZERO_SHARE * float(np.ptp(force[known])), _NOISE_RATIO * _noise(at_rest, force[known])
    )
    found = float(np.median(at_rest))
    return found if abs(found) > least else np.nan


def _noise(at_rest: Floats, all_readings: Floats) -> float:
    """Estimates a force's standard deviation by second differences: at rest, if it is so long."""
    readings = at_rest if len(at_rest) >= LEAST_FRAMES else all_readings
    bends = np.abs(np.diff(readings, 2))
    return float(np.median(bends)) / (_NORMAL * math.sqrt(6.0)) if len(bends) else 0.0


def _mismatch(why: str) -> UserError:
    return UserError(
        f"the track is not of this study's design: {why}",
        key="design",
        remedy="give the recording the `structure` that was filmed, and leave out `design`; or"
        " compare it in the study of its own design",
    )


def select_frames(time: Floats, period: float) -> Ints:
    """Selects frames to compare, by number: all of them, or of many those within the response.

    These are thinned to at most `MOST_FRAMES`.

    Args:
        time: (frames,) of the response, s; NaN beyond its ends.
        period: of the drive, s; NaN without.

    Raises:
        UserError: too few of them would be left in a period.
    """
    if len(time) <= MOST_FRAMES:
        return np.arange(len(time))
    within = np.flatnonzero(time >= 0.0)
    every = -(-len(within) // MOST_FRAMES)
    kept = within[::every]
    if every > 1 and (left := period / float(np.median(np.diff(time[kept])))) < LEAST_PER_PERIOD:
        raise UserError(
            f"{len(within)} frames show the response, of which {MOST_FRAMES} are compared:"
            f" {left:.2g} in a period of the drive, where {LEAST_PER_PERIOD} are wanted",
            key="window",
            remedy="give a window that ends after fewer periods, and track it again",
        )
    return kept


def _centres(design: xr.Dataset) -> Floats:
    specimen = outlines_of_design(design)
    out = np.full((design.sizes["unit"], 2), np.nan)
    out[np.isin(design["unit"].values, specimen.ids)] = specimen.centre
    return out


def _unit_use(design: xr.Dataset) -> NDArray[np.int8]:
    """Classifies the use (units,) of units as if all were seen."""
    support = design["support"].values
    absent = np.isnan(design["vertices"].values[:, 0, 0])
    conditions = [absent, support == CLAMPED, support == DRIVEN]
    return np.asarray(np.select(conditions, [ABSENT, HELD, PUSHED], COMPARED), dtype=np.int8)


def _mark_lost(motion: Floats, use: NDArray[np.int8]) -> NDArray[np.int8]:
    """Marks as lost the units to be compared that are seldom seen."""
    return np.where((use == COMPARED) & ~often_seen(motion), LOST, use).astype(np.int8)


def often_seen(motion: Floats) -> Mask:
    """Marks the units (units,) whose motion (frames, units, 3) is known in enough of the frames."""
    return np.asarray(np.isfinite(motion).all(axis=2).mean(axis=0) >= _SEEN_SHARE)
