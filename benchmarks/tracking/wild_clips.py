"""Makes clips as labs film them: a specimen that leaves, hands, little light, rolling shutters."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import cv2
import numpy as np

from benchmarks.tracking.rendering import (
    Covering,
    Motion,
    Renderer,
    View,
    eight_bit,
    pose_bound,
    write_video,
)
from pipeline.tracking.frames import Frame, import_video, read_frames
from pipeline.tracking.geometry import SpecimenOutlines, outlines_of_design
from pipeline.tracking.motion import Track, track_video
from pipeline.tracking.reference_frame import RecordingSetup
from sim.core import Floats, Mask, Singles

GRID = {
    "name": "wild",
    "grid": [9, 9],
    "spacing_mm": 15.0,
    "ligament_gap_mm": 2.3,
    "bias_angle_deg": 20.0,
}
RATE = 30.0
_WRONG, _TURNED = 0.5, np.deg2rad(3.0)
"""Errors from which a pose is grossly wrong, px and rad."""
_SKIN, _TEAL, _RED = 140.0, (150.0, 140.0, 30.0), (45.0, 68.0, 220.0)  # blue, green, red


class WildClip(NamedTuple):
    """Holds a clip and what is true of it.

    Attributes:
        frames: all of them.
        specimen: what they show.
        scale: px/mm, roughly.
        truth: (frames, units, 3) displacement at the frames' times, mm and rad.
        visible: (frames, units) units that are whole in view.
        fault: (frames,) whether frames before are missing, or the one before is shown again.
        keys: of the recording, that tell of camera and shutter.
        held: (units,) which are clamped.
    """

    frames: list[Frame]
    specimen: SpecimenOutlines
    scale: float
    truth: Floats
    visible: Mask
    fault: Mask
    keys: Mapping[str, Any]
    held: Mask


class _Script(NamedTuple):
    """Scripts a clip: motions of specimen and camera, the view, things beside."""

    shift: Callable[[Floats], Floats] | None = None
    pace: Callable[[Floats], Floats] = lambda time: np.sin(2.4 * time) ** 2
    view: View = View()
    cover: Covering | None = None
    hidden: Callable[[Floats, Floats], Mask] | None = None
    times: Floats = np.arange(24) / RATE
    stamps: Floats | None = None
    fault: tuple[int, ...] = ()
    film: tuple[str, str, int] | None = None
    follows: bool = False
    keys: Mapping[str, Any] = MappingProxyType({})


class Errors(NamedTuple):
    """Holds the errors of a track.

    Attributes:
        rms: of places that are wholly in view, px.
        turn: likewise of rotations, deg.
        gross: number of poses that are called good and are wrong.
        good: number of those that are called good.
        lost: part of what is wholly in view that is missing.
        honesty: (3,) root mean square of error over sigma.
        found, false: faults of timing.
    """

    rms: float
    turn: float
    gross: int
    good: int
    lost: float
    honesty: Floats
    found: int
    false: int


def tracked(clip: WildClip) -> Track:
    """Tracks a clip with the keys of its recording."""
    setup = RecordingSetup(held=clip.held, **clip.keys)
    return track_video(iter(clip.frames), clip.specimen, clip.scale, setup=setup)


def errors(clip: WildClip, track: Track) -> Errors:
    """Compares a track with the truth of its clip."""
    error = track.displacement.astype(float) - clip.truth
    known = np.isfinite(error).all(axis=-1)
    wrong = (np.abs(error) > np.append(np.full(2, _WRONG * track.calibration.pixel), _TURNED)).any(
        axis=-1
    )
    seen = known & clip.visible
    later = seen & (np.arange(len(seen)) > 0)[:, None]
    flagged = track.timing != 0
    return Errors(
        float(np.sqrt(np.mean(error[seen][:, :2] ** 2))) / track.calibration.pixel,
        float(np.rad2deg(np.sqrt(np.mean(error[seen][:, 2] ** 2)))),
        int((known & wrong).sum()),
        int(known.sum()),
        float((clip.visible & ~known).sum() / clip.visible.sum()),
        np.sqrt(np.mean((error[later] / track.sigma[later]) ** 2, axis=0)),
        int((flagged & clip.fault).sum()),
        int((flagged & ~clip.fault).sum()),
    )


def table(folder: Path) -> str:
    """Makes and tracks all clips; returns the lines of their table."""
    lines = [
        "| clip | rms px (bound) | rms deg (bound) | gross and silent | lost % |"
        " error/sigma x, y, rotation | faults found, false |",
        "|---|---|---|---|---|---|---|",
    ]
    for name in SCRIPTS:
        clip = make(name, folder)
        found = errors(clip, tracked(clip))
        least, turn = bound(name)
        honest = " ".join(f"{value:.2f}" for value in found.honesty)
        lines.append(
            f"| {name.replace('_', ' ')} | {found.rms:.4f} ({least:.4f}) |"
            f" {found.turn:.3f} ({turn:.3f}) | {found.gross} of"
            f" {found.good} | {100 * found.lost:.1f} | {honest} |"
            f" {found.found} of {int(clip.fault.sum())}, {found.false} |"
        )
    return "\n".join(lines)


def bound(name: str) -> tuple[float, float]:
    """Computes the bound of Cramer and Rao of displacements in a clip, px and deg, uncoded.

    It is of the sensor's noise alone, in the last frame and in the first, from which the motion
    counts; specimens that rest in several frames may stay below it, what a codec costs is above.
    """
    script, shown = SCRIPTS[name], specimen()
    _, seen = _motions(shown, script)
    ends = script.times[[0, -1]]
    found = [pose_bound(shown, seen, script.view, float(time), script.cover) for time in ends]
    whole = _in_view(shown, script, ends, seen)[..., None]
    square = np.mean(np.square(found), axis=1, where=whole)
    x, y, turn = square.sum(axis=0) * (1 - 1 / len(script.times))  # the first frame has no error
    return float(np.sqrt((x + y) / 2)) * script.view.scale, float(np.rad2deg(np.sqrt(turn)))


def specimen() -> SpecimenOutlines:
    """Makes the units: 9 x 9 squares."""
    return outlines_of_design(import_video.design(GRID))


def make(name: str, folder: Path, frames: int | None = None) -> WildClip:
    """Renders a clip of the catalogue, or its first frames; a folder holds what has a codec."""
    script, shown = SCRIPTS[name], specimen()
    times = script.times[:frames]
    own, seen = _motions(shown, script)
    renderer = Renderer(shown, seen, script.view, script.cover)
    images: list[Singles] = []
    for before, time in zip(np.r_[-1.0, times], times, strict=False):
        images.append(images[-1] if time == before else renderer.frame(time))
    stamps = times if script.stamps is None else script.stamps[: len(times)]
    visible = _in_view(shown, script, times, seen)
    fault = np.zeros(len(times), bool)
    fault[[one for one in script.fault if one < len(times)]] = True
    truth = own(times) if script.follows else seen(times)
    return WildClip(
        list(_filmed(images, stamps, script, folder / f"{name}.mkv")),
        shown,
        script.view.scale,
        truth - truth[0],
        visible,
        fault,
        script.keys,
        _held(shown),
    )


def _in_view(shown: SpecimenOutlines, script: _Script, times: Floats, seen: Motion) -> Mask:
    """Tells which units (times, units) are whole in view."""
    view, middle = script.view, shown.centre.mean(axis=0)
    place = view.project(shown.centre + seen(times)[..., :2] - middle)
    reach = shown.radius * view.scale
    far = np.array(view.size) - 1 - reach[:, None]
    visible = np.asarray(((place > reach[:, None]) & (place < far)).all(axis=-1))
    return visible if script.hidden is None else visible & ~script.hidden(place, times)


def _held(shown: SpecimenOutlines) -> Mask:
    return np.asarray(shown.centre[:, 1] < 1.0)


def _motions(shown: SpecimenOutlines, script: _Script) -> tuple[Motion, Motion]:
    """Returns the specimen's motion about its clamped bottom row, and with the camera's own."""
    place = shown.centre - shown.centre.mean(axis=0)
    sign = np.where(np.round(shown.centre.sum(axis=1) / 15) % 2 == 0, 1.0, -1.0)
    above = np.minimum(shown.centre[:, 1] / 60, 1.0)

    def own(time: Floats) -> Floats:
        pace = np.asarray(script.pace(time))[:, None]
        x = above * (-0.03 * pace * place[:, 0] + 2.0 * pace)
        y = above * -0.02 * pace * shown.centre[:, 1]
        return np.stack([x, y, above * sign * 0.25 * pace], axis=-1)

    def seen(time: Floats) -> Floats:
        moved = own(time)
        if script.shift is not None:
            moved[..., :2] += script.shift(time)[:, None]
        return moved

    return own, seen


def _filmed(images: list[Singles], stamps: Floats, script: _Script, path: Path) -> Iterator[Frame]:
    if script.film is None:
        for index, (image, time) in enumerate(zip(images, stamps, strict=True)):
            yield Frame(index, float(time), eight_bit(image))
        return
    codec, pixels, crf = script.film
    shown: list[np.ndarray] = [eight_bit(image) for image in images]
    if pixels.endswith("10le"):
        shown = [np.clip(np.round(image * 257), 0, 65535).astype(np.uint16) for image in images]
    if pixels == "yuv444p":
        share = [(image[..., None] - 30) / 175 for image in images]
        mixed = [np.array(_RED) + part * (np.array(_TEAL) - _RED) for part in share]
        shown = [eight_bit(np.asarray(colour, np.float32)) for colour in mixed]
    write_video(path, shown, list(stamps), codec, pixels, crf)
    yield from read_frames(path)


def _glide(length: float, there: float) -> Callable[[Floats], Floats]:
    """Moves to a place (mm, along x) and back, in a time each."""
    return lambda time: np.stack(
        [length * 0.5 * (1 - np.cos(np.pi * time / there)), 0 * time], axis=-1
    )


def _hand(image: Singles, time: float) -> None:
    reach = float(_hand_reach(np.array(time)))
    points = [
        (0, 0),
        (reach, 60),
        (reach + 45, 200),
        (reach + 20, 330),
        (reach + 50, 480),
        (reach, 640),
        (0, 640),
    ]
    cv2.fillPoly(image, [np.array(points, np.int32) + np.array([9, 7], np.int32)], 80.0)
    cv2.fillPoly(image, [np.array(points, np.int32)], _SKIN)
    for at in range(0, int(reach), 23):
        cv2.circle(image, (at, 40 + 7 * at % 560), 9, _SKIN - 25.0, -1)


def _hand_reach(time: Floats) -> Floats:
    return np.asarray(300.0 * time / 0.8)


def _under_hand(place: Floats, times: Floats) -> Mask:
    return np.asarray(place[..., 0] < _hand_reach(times)[:, None] + 100)


def _bolts(image: Singles, time: float) -> None:
    """Draws bolts, tape and a shadow beside the units."""
    del time
    for x, y, radius in ((30, 30, 17), (612, 28, 19), (28, 610, 18), (610, 612, 17), (20, 330, 15)):
        cv2.circle(image, (x, y), radius, 35.0, -1, cv2.LINE_AA)
    cv2.fillPoly(image, [np.array([(300, 0), (372, 0), (360, 30), (310, 28)], np.int32)], 60.0)
    image[:, 600:] *= 0.7


def _stick(time: Floats) -> Floats:
    """Rests for three frames, slips in the next."""
    frame = time * RATE
    return np.asarray(0.08 * (np.floor(frame / 4) + np.clip(frame % 4 - 3, 0, 1)))


def _gap(time: Floats, after: int, missing: int) -> Floats:
    return np.asarray(np.round(RATE * time + missing * (np.arange(len(time)) >= after)) / RATE)


_SMALL = np.arange(24) / RATE
_LONG = np.arange(48) / RATE
_UNEVEN = np.cumsum(np.r_[0.0, np.random.default_rng(5).choice([1, 1, 2, 3], 23)]) / 60
_QUICK = View(exposure=0.025)
_DIM = View(noise=(18.0, 0.0))


def _swing(time: Floats) -> Floats:
    return np.asarray(np.sin(2 * np.pi * 2.0 * time) ** 2)


def _sway(time: Floats) -> Floats:
    return np.asarray(np.sin(2 * np.pi * 1.2 * time) ** 2)


SCRIPTS: dict[str, _Script] = {
    "plain": _Script(),
    "plain_h264": _Script(film=("libx264", "yuv420p", 14)),
    "rests_first": _Script(pace=lambda t: np.sin(2.4 * np.maximum(t - 8.5 / RATE, 0)) ** 2),
    "soft_focus": _Script(view=View(blur=1.1)),
    "leaves_and_returns": _Script(_glide(155.0, 0.8), times=_LONG),
    "leaves_slowly": _Script(_glide(95.0, 1.6), times=_LONG),
    "hand": _Script(cover=_hand, hidden=_under_hand),
    "low_light": _Script(view=_DIM),
    "low_light_h264": _Script(view=_DIM, film=("libx264", "yuv420p", 18)),
    "motion_blur": _Script(pace=_swing, view=_QUICK, keys={"exposure": 0.025}),
    "motion_blur_untold": _Script(pace=_swing, view=_QUICK),
    "rolling_shutter": _Script(pace=_sway, view=View(readout=0.03), keys={"readout": 0.03}),
    "camera_drifts": _Script(
        lambda t: np.stack([1.5 * t / 0.8, -0.4 * t], axis=-1),
        keys={"follows_supports": True},
        follows=True,
    ),
    "tripod_knocked": _Script(
        lambda t: np.stack([6.0 * (t > 0.4), 3.0 * (t > 0.4)], axis=-1),
        keys={"follows_supports": True},
        follows=True,
    ),
    "fisheye": _Script(view=View(fisheye=True, distance=75.0, scale=4.6, tilt=0.01)),
    "uneven_10_bit": _Script(times=_UNEVEN, film=("libx265", "yuv420p10le", 12)),
    "stick_slip": _Script(pace=_stick, times=np.arange(40) / RATE),
    "gap_of_five": _Script(times=_gap(_LONG, 20, 5), stamps=_LONG, fault=(20,)),
    "gap_in_stamps": _Script(times=_gap(_LONG, 20, 5), fault=(20,)),
    "shown_again": _Script(times=_gap(_LONG, 20, -1), stamps=_LONG, fault=(20,)),
    "red_on_teal": _Script(film=("libx264", "yuv444p", 8)),
    "bolts_and_tape": _Script(cover=_bolts),
}
"""The clips by name."""
