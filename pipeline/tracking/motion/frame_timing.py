"""Finds dropped and duplicated frames by the motion itself."""

import numpy as np

from pipeline.tracking.frames import has_uneven_intervals
from sim.core import Floats, Ints, Mask, Reals

STEADY, DUPLICATE, DROPPED = range(3)
"""Timing of a frame: as the file says; shows the instant before again; a frame is missing."""

_TICK, _FEWEST = 0.6e-3, 4
"""Seconds by which a stamp is off where milliseconds are counted, about half of one; frames that
show it."""
_UNCHANGED, _MOST_CHANGED = 0.005, 0.05
"""Part of the pixels that change, at most, where nothing is coded anew, and where a codec codes a
picture again that it shows again."""
_CHANGE_RATIO = 0.25
"""The same over what changes in the frames before and after."""
_LONGEST_RUN = 4
"""Unchanged frames in a row that may repeat one; more show that nothing moves."""
_RETURN_RATIO = 0.6
"""Offset of the frames before and after, over the longer way, where motion turns back."""
_GAP_RATIO, _GAP_SHARE = 1.7, 0.1
"""An interval so many times the usual is a gap, if no more than this part of all are."""
_WINDOW = 4
_DEGREE = 4
_GAPS = (0, 1, 2, 3, 4, 5, 6, 8, 10)
"""Numbers of frames that may be missing, none first."""
_LEAST_STEP = 2.5
"""Steps must be so many standard uncertainties long on either side of a gap."""
_ROUGH = 3.0
"""Residual of smooth motion, in standard uncertainties, that a gap may be the reason of."""
_SMOOTH = 20.0
"""The same where the gap is allowed for, at most: what is rougher is a jolt."""
_SPEED_RATIO = 0.2
"""Least part of the steps after a gap that those before have, and the reverse: none where motion
sets in, ends or jumps."""
_JOLT_RATIO = 0.25
"""Squared residuals on either side of a gap, over those across it; motion is rough where more."""
_EXTRAPOLATION_ERROR = 0.5
"""Largest offset of a motion from what the speeds before and after a gap tell, over the way at the
higher of them."""
_IMPROVEMENT = 0.2
"""A gap must make the squared residuals of smooth motion so much smaller."""


def timing_faults(time: Floats, motion: Reals, sigma: Reals, changed: Floats) -> Ints:
    """Classifies the timing (frames,) of every frame.

    A frame that repeats the one before changes far fewer pixels than the frames before and after,
    in which the specimen moves. A gap stands in the stamps, or else the motion goes on smoothly
    after it, but only if the frames from there on are later than they say. Where the specimen is at
    rest or jolts, the stamps alone tell, unless most are alike.

    Args:
        time: (frames,) s, as the file says.
        motion: (frames, units, 3) poses, NaN where missing.
        sigma: (frames, units, 3) standard uncertainties.
        changed: (frames,) part of the pixels that differ from those of the frame before.
    """
    place = motion[..., :2].astype(float)
    noise = np.array(
        [np.nanmedian(told) if np.isfinite(told).any() else np.inf for told in sigma[..., :2]]
    )
    repeated = _duplicates(changed, place, noise)
    out = np.where(repeated, DUPLICATE, STEADY)
    if len(time) > 1 and np.median(np.diff(time)) > 0:
        steps = np.diff(time, prepend=2 * time[0] - time[1]) / np.median(np.diff(time))
        gap = steps > _GAP_RATIO
        if gap.mean() < _GAP_SHARE:
            out[gap] = DROPPED
        if not has_uneven_intervals(np.cumsum(np.where(gap, 1.0, steps))):
            steps = np.round(steps)
        steps[repeated & ~_replacing(steps, place, noise, repeated)] = 0.0
        out[_delayed(np.cumsum(steps), place, noise, repeated)] = DROPPED
    return out


def unrounded(time: Floats) -> Floats:
    """Returns times (frames,), s, that stamps of a steady rate, or with gaps, are rounded from.

    Some containers count milliseconds: what moves by 40 px a frame seems to jump by half a pixel.
    Stamps that are farther off than that from an even spacing are as the camera took them.
    """
    if len(time) < _FEWEST or np.median(np.diff(time)) <= 0:
        return time
    step = np.cumsum(np.round(np.diff(time, prepend=time[0]) / np.median(np.diff(time))))
    even = np.polyval(np.polyfit(step, time, 1), step)
    return even - even[0] if np.abs(even - time).max() < _TICK else time


def _duplicates(changed: Floats, place: Floats, noise: Floats) -> Mask:
    """Marks pictures (frames,) that are shown again, but for long runs of one."""
    out = np.zeros(len(changed), dtype=bool)
    still = changed < _UNCHANGED
    still[:1] = True  # nothing comes before the first
    starts = np.flatnonzero(~(still[1:] & still[:-1])) + 1
    runs = np.split(np.arange(len(changed)), starts)
    for before, run, after in zip(runs, runs[1:], runs[2:], strict=False):
        beside = min(changed[before[-1]], changed[after[0]]) if before[0] else 0.0
        most = float(changed[run].max())
        out[run] = (
            len(run) <= _LONGEST_RUN
            and most < min(_MOST_CHANGED, _CHANGE_RATIO * beside)
            and _goes_on(place[[run[0] - 2, run[0] - 1, after[0]]], noise[run[0]], most == 0)
        )
    return out


def _goes_on(place: Floats, noise: float, same: bool) -> bool:
    """Tests whether units move before and after a run of frames, and do not turn back in it.

    At a turning point two pictures are nearly the same; where they are the same in all pixels, one
    is shown again.

    Args:
        place: (3, units, 2) in the frame before the one that is repeated, in that one, and after.
        noise: standard uncertainty of a place.
        same: whether all pixels are the same.
    """
    near = place[:, np.isfinite(place).all(axis=(0, 2))]
    if not near.size:
        return False
    before, after, across = (
        float(np.sqrt(np.mean((near[end] - near[start]) ** 2)))
        for start, end in ((0, 1), (1, 2), (0, 2))
    )
    moves = min(before, after) > _LEAST_STEP * noise
    return moves and (same or across > _RETURN_RATIO * max(before, after))


def _replacing(steps: Floats, place: Floats, noise: Floats, repeated: Mask) -> Mask:
    """Marks repeated frames (frames,) in place of ones that are lost: the next come when they say.

    Others are put between frames, so that the next come later.
    """
    out = np.zeros(len(place), dtype=bool)
    shown = np.flatnonzero(~repeated)
    inserted = np.cumsum(np.where(repeated, 0.0, steps))
    for middle in range(_WINDOW, len(shown) - _WINDOW + 1):
        run = np.arange(shown[middle - 1] + 1, shown[middle])
        window = shown[middle - _WINDOW : middle + _WINDOW]
        near = _seen_throughout(place[window])
        if len(run) and near.size:
            after = np.arange(len(window)) >= _WINDOW
            late = float(steps[run].sum())
            rough, smooth = (
                _roughness(inserted[window] + more * after, near) for more in (0.0, late)
            )
            out[run] = smooth < _IMPROVEMENT * rough and np.sqrt(rough) > _ROUGH * noise[run[0]]
    return out


def _seen_throughout(place: Floats) -> Floats:
    """Returns coordinates (frames, n) of units that are seen in all frames."""
    flat = place.reshape(len(place), -1)
    return flat[:, np.isfinite(flat).all(axis=0)]


def _delayed(clock: Floats, place: Floats, noise: Floats, repeated: Mask) -> Mask:
    """Finds frames that come later than their clock (frames,) says, in usual intervals."""
    out = np.zeros(len(place), dtype=bool)
    shown = np.nonzero(~repeated)[0]
    for middle in range(_WINDOW, len(shown) - _WINDOW + 1):
        window = shown[middle - _WINDOW : middle + _WINDOW]
        near = _seen_throughout(place[window])
        after = np.arange(len(window)) >= _WINDOW
        rough = (
            [_roughness(clock[window] + gap * after, near) for gap in _GAPS] if near.size else []
        )
        if (
            rough
            and _moves_steadily(near, noise[shown[middle]])
            and np.sqrt(rough[0]) > _ROUGH * noise[shown[middle]]
        ):
            most = min(_IMPROVEMENT * rough[0], (_SMOOTH * noise[shown[middle]]) ** 2)
            sides = [_roughness(clock[window[part]], near[part], 2) for part in (~after, after)]
            extrapolates = _extrapolates(near, _GAPS[int(np.argmin(rough))])
            out[shown[middle]] = (
                min(rough) < most and max(sides) < _JOLT_RATIO * rough[0] and extrapolates
            )
    return out


def _moves_steadily(motion: Floats, noise: float) -> bool:
    """Tests motions (frames, n) for steps above the noise, of about one speed in both halves."""
    steps = np.sqrt(np.mean(np.diff(motion, axis=0) ** 2, axis=1))
    half = len(motion) // 2
    before, after = np.median(steps[: half - 1]), np.median(steps[half:])
    return bool(min(before, after) > max(_SPEED_RATIO * max(before, after), _LEAST_STEP * noise))


def _extrapolates(motion: Floats, missing: int) -> bool:
    """Tests whether speeds on both sides of a gap extrapolate motions (frames, n) across it.

    A polynomial joins any two straight ways smoothly if only the gap is long enough.
    """
    half = len(motion) // 2
    before, across, after = np.diff(motion, axis=0)[half - 2 : half + 1]
    off = across - (missing + 1) * (before + after) / 2
    quickest = max(np.linalg.norm(before), np.linalg.norm(after))
    return bool(np.linalg.norm(off) < _EXTRAPOLATION_ERROR * (missing + 1) * quickest)


def _roughness(clock: Floats, motion: Floats, degree: int = _DEGREE) -> float:
    """Computes the mean square residual of polynomials in time through motions (frames, n)."""
    basis = np.linalg.qr(np.vander((clock - clock.mean()) / np.ptp(clock), degree + 1))[0]
    rest = motion - basis @ (basis.T @ motion)
    return float(np.mean(rest**2))
