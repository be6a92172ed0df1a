"""Films the scripts of clips as labs film them, tracks them, and compares with the truth."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from benchmarks.tracking.clip_scripts import GRID, SCRIPTS, ClipScript
from benchmarks.tracking.rendering import Motion, Renderer, eight_bit, pose_bound, write_video
from pipeline.tracking.frames import Frame, import_video, read_frames
from pipeline.tracking.geometry import SpecimenOutlines, outlines_of_design
from pipeline.tracking.motion import Track, track_video
from pipeline.tracking.reference_frame import RecordingSetup
from sim.core import Floats, Mask, Singles

_WRONG, _TURNED = 0.5, np.deg2rad(3.0)
"""Errors from which a pose is grossly wrong, px and rad."""
_TEAL, _RED = (150.0, 140.0, 30.0), (45.0, 68.0, 220.0)  # blue, green, red


class WildClip(NamedTuple):
    """Holds a clip and what is true of it."""

    frames: list[Frame]  # all of them
    specimen: SpecimenOutlines  # what they show
    scale: float  # px/mm, roughly
    truth: Floats  # (frames, units, 3) displacement at the frames' times, mm and rad
    visible: Mask  # (frames, units) units that are whole in view
    fault: Mask  # (frames,) whether frames before are missing, or the one before is shown again
    keys: Mapping[str, Any]  # of the recording, that tell of camera and shutter
    held: Mask  # (units,) which are clamped


class Errors(NamedTuple):
    """Holds the errors of a track."""

    rms: float  # of places that are wholly in view, px
    turn: float  # likewise of rotations, deg
    gross: int  # number of poses that are called good and are wrong
    good: int  # number of those that are called good
    lost: float  # part of what is wholly in view that is missing
    sigma_ratio: Floats  # (3,) root mean square of error over sigma
    found: int  # faults of timing
    false: int


def track_clip(clip: WildClip) -> Track:
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


def table(folder: Path) -> Iterator[str]:
    """Makes and tracks all clips; yields the lines of their table as they are known."""
    yield (
        "| clip | rms px (bound) | rms deg (bound) | gross and silent | lost % |"
        " error/sigma x, y, rotation | faults found, false |"
    )
    yield "|---" * 7 + "|"
    for name in SCRIPTS:
        clip = make_clip(name, folder)
        found = errors(clip, track_clip(clip))
        least, turn = bound(name)
        honest = " ".join(f"{value:.2f}" for value in found.sigma_ratio)
        yield (
            f"| {name.replace('_', ' ')} | {found.rms:.4f} ({least:.4f}) |"
            f" {found.turn:.3f} ({turn:.3f}) | {found.gross} of"
            f" {found.good} | {100 * found.lost:.1f} | {honest} |"
            f" {found.found} of {int(clip.fault.sum())}, {found.false} |"
        )


def bound(name: str) -> tuple[float, float]:
    """Computes the bound of Cramer and Rao of displacements in a clip, px and deg, uncoded.

    It is of the sensor's noise alone, in the last frame and in the first, from which the motion
    counts; specimens that rest in several frames may stay below it, what a codec costs is above.
    """
    script = SCRIPTS[name]
    shown = specimen(script.grid)
    _, seen = _motions(shown, script)
    ends = script.times[[0, -1]]
    found = [pose_bound(shown, seen, script.view, float(time), script.cover) for time in ends]
    whole = _in_view(shown, script, ends, seen)[..., None]
    square = np.mean(np.square(found), axis=1, where=whole)
    x, y, turn = square.sum(axis=0) * (1 - 1 / len(script.times))  # the first frame has no error
    return float(np.sqrt((x + y) / 2)) * script.view.scale, float(np.rad2deg(np.sqrt(turn)))


def specimen(grid: Mapping[str, Any] = GRID) -> SpecimenOutlines:
    """Makes the units: squares, usually 9 x 9."""
    return outlines_of_design(import_video.design(dict(grid)))


def make_clip(name: str, folder: Path, frames: int | None = None) -> WildClip:
    """Renders a clip of the catalogue, or its first frames; a folder holds what has a codec."""
    return film_clip(SCRIPTS[name], folder / f"{name}.mkv", frames)


def film_clip(script: ClipScript, path: Path, frames: int | None = None) -> WildClip:
    """Renders a clip, or its first frames; what has a codec goes through a file."""
    shown = specimen(script.grid)
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
        list(_film_through_file(images, stamps, script, path)),
        shown,
        script.view.scale,
        truth - truth[0],
        visible,
        fault,
        script.keys,
        np.asarray(shown.centre[:, 1] < 1.0),
    )


def _in_view(shown: SpecimenOutlines, script: ClipScript, times: Floats, seen: Motion) -> Mask:
    view, middle = script.view, shown.centre.mean(axis=0)
    place = view.project(shown.centre + seen(times)[..., :2] - middle)
    reach = shown.radius * view.scale
    far = np.array(view.size) - 1 - reach[:, None]
    visible = np.asarray(((place > reach[:, None]) & (place < far)).all(axis=-1))
    return visible if script.hidden is None else visible & ~script.hidden(place, times)


def _motions(shown: SpecimenOutlines, script: ClipScript) -> tuple[Motion, Motion]:
    """Returns the specimen's motion about its clamped bottom row, and with the camera's own."""
    place = shown.centre - shown.centre.mean(axis=0)
    sign = np.where(np.round(shown.centre.sum(axis=1) / shown.pitch) % 2 == 0, 1.0, -1.0)
    above = np.minimum(2 * shown.centre[:, 1] / shown.centre[:, 1].max(), 1.0)

    def own(time: Floats) -> Floats:
        pace = np.asarray(script.pace(time))[:, None]
        x = above * (-0.03 * pace * place[:, 0] + 2.0 * pace)
        y = above * -0.02 * pace * shown.centre[:, 1]
        return np.stack([x, y, above * sign * 0.25 * pace], axis=-1)

    def seen(time: Floats) -> Floats:
        moved = own(time)
        if script.turn is not None:
            turn = script.turn(time)
            moved[..., 2] += turn[:, None]
            there = place + moved[..., :2]
            cos, sin = np.cos(turn)[:, None], np.sin(turn)[:, None]
            moved[..., 0] = cos * there[..., 0] - sin * there[..., 1] - place[:, 0]
            moved[..., 1] = sin * there[..., 0] + cos * there[..., 1] - place[:, 1]
        if script.shift is not None:
            moved[..., :2] += script.shift(time)[:, None]
        return moved

    return own, seen


def _film_through_file(
    images: list[Singles], stamps: Floats, script: ClipScript, path: Path
) -> Iterator[Frame]:
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
