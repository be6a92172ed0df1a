"""Predicts the noise of a planned set-up: short clips are rendered, tracked, and compared."""

import itertools
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
import xarray as xr

from pipeline.problem.sections import Codec, VirtualRecording
from pipeline.runtime import UserError
from pipeline.tracking.frames import read_frames
from pipeline.tracking.motion import track_video
from pipeline.tracking.reference_frame import RecordingSetup
from pipeline.virtual_lab.filmed_motion import film_clock
from pipeline.virtual_lab.filming import VirtualFilm, prepare_film, select_case
from pipeline.virtual_lab.video_writer import encode_video
from sim.core import Floats, Reals

LEAST = 16
REST_FRAMES = 6  # frames before the motion
_DEG = 180 / np.pi


class PlannedSetup(NamedTuple):
    """Holds one set-up: what is filmed and how."""

    specimen: str
    setup: VirtualRecording
    pitch: float

    @property
    def columns(self) -> Mapping[str, str]:
        """Describes the set-up in columns of a table."""
        camera, codec = self.setup.camera, self.setup.codec
        look = self.setup.look
        markers = {"dots": look.dots.diameter, "speckle": look.speckle.diameter}
        return {
            "specimen": self.specimen,
            "px_per_pitch": f"{self.pitch / camera.pixel_size:.3g}",
            "mm_per_px": f"{camera.pixel_size:.3g}",
            "image": "x".join(map(str, camera.image)),
            "fps": f"{self.setup.rate:g}",
            "exposure_ms": f"{1000 * self.setup.sensor.exposure:.3g}",
            "codec": codec.name if codec.name == "ffv1" else f"{codec.name} crf {codec.crf}",
            "marker_mm": f"{markers.get(self.specimen, 0):g}",
        }


class ExpectedNoise(NamedTuple):
    """Holds errors and stated uncertainties (3,) of a set-up in px, px and deg."""

    rmse: Floats  # root mean square of the error of x, y and rotation
    sigma: Floats  # median of the stated standard uncertainty
    lost: float  # part of the units and frames that were not found
    pixel: float  # size of a pixel, mm

    @property
    def columns(self) -> Mapping[str, str]:
        """Describes the noise in columns of a table."""
        named = {"rmse": self.rmse, "sigma": self.sigma}
        told: dict[str, str] = {}
        for name, (x, y, turn) in named.items():
            shift = np.hypot(x, y) / np.sqrt(2)
            told |= {f"{name}_px": f"{shift:.3g}", f"{name}_mm": f"{shift * self.pixel:.3g}"}
            told[f"{name}_deg"] = f"{turn:.3g}"
        return told | {"lost_percent": f"{100 * self.lost:.3g}"}


class SetupOptions(NamedTuple):
    """Holds values to try in every combination; none leaves the base's own."""

    specimens: tuple[str, ...]  # dots, speckle or bare
    scales: tuple[float, ...]  # pixels per pitch; the image grows along
    rates: tuple[float, ...]  # frames per second
    codecs: tuple[str, ...]  # names, as for `codec`
    markers: tuple[float, ...]  # diameters of dots or speckles, mm


def setup_combinations(base: PlannedSetup, options: SetupOptions) -> list[PlannedSetup]:
    """Combines the options in every way; no exposure is longer than a frame lasts.

    Raises:
        UserError: a value that makes no sense.
    """
    for values in (options.scales, options.rates, options.markers):
        if any(not 0 < value < np.inf for value in values):
            remedy = "give numbers greater than zero"
            raise UserError("not a set-up that can be tried", value=list(values), remedy=remedy)
    columns = (
        options.specimens or (base.specimen,),
        options.scales or (base.pitch / base.setup.camera.pixel_size,),
        options.rates or (base.setup.rate,),
        [codec(name) for name in options.codecs] or (base.setup.codec,),
        options.markers or (None,),
    )
    return [_combine(base, *values) for values in itertools.product(*columns)]


def codec(name: str) -> Codec:
    """Parses a codec such as ffv1, h264, h264-intra or h264:28 (constant rate factor).

    Raises:
        UserError: no such name.
    """
    kind, _, quality = name.replace("-", " ").partition(":")
    try:
        return Codec.model_validate({"name": kind, "crf": int(quality or 14)})
    except ValueError as error:
        remedy = "give ffv1, h264, h264-intra, or with a rate factor from 0 to 51, as h264:28"
        raise UserError("no such codec", key="--codec", value=name, remedy=remedy) from error


def _combine(
    base: PlannedSetup,
    specimen: str,
    scale: float,
    rate: float,
    chosen: Codec,
    marker: float | None,
) -> PlannedSetup:
    camera, look = base.setup.camera, base.setup.look
    pixel = base.pitch / scale
    image = tuple(2 * round(side * camera.pixel_size / pixel / 2) for side in camera.image)
    if marker is not None:
        kinds = {"dots": look.dots, "speckle": look.speckle}
        look = look.model_copy(
            update={k: v.model_copy(update={"diameter": marker}) for k, v in kinds.items()}
        )
    sensor = base.setup.sensor
    exposure = min(sensor.exposure, 1 / rate)
    update = {
        "sensor": sensor.model_copy(update={"exposure": exposure}),
        "camera": camera.model_copy(update={"pixel_size": pixel, "image": image}),
        "rate": rate,
        "codec": chosen,
        "look": look,
    }
    return PlannedSetup(specimen, base.setup.model_copy(update=update), base.pitch)


def expected_noise(
    response: xr.Dataset, structure: str, case: int, choice: PlannedSetup, count: int
) -> ExpectedNoise:
    """Renders a clip of so many frames, tracks it, and compares with its truth.

    Raises:
        UserError: the response cannot be filmed so, or the units are not found.
    """
    if count < LEAST:
        raise UserError("too few frames", key="--frames", value=count, remedy=f"give {LEAST}")
    one = select_case(response, structure, case)
    clip = _shorten(choice.setup, one["time"].values, count)
    film = prepare_film(one, structure, choice.specimen, clip)
    camera = choice.setup.camera
    known = RecordingSetup(choice.setup.look.thickness, camera.distance)
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"clip{choice.setup.codec.suffixes[0]}"
        encode_video(path, film.images(), choice.setup.rate, choice.setup.codec, {})
        units = film.scene.specimen
        track = track_video(read_frames(path), units, 1 / camera.pixel_size, setup=known)
    return _evaluate_noise(film, track.displacement, track.sigma)


def _shorten(setup: VirtualRecording, given: Floats, count: int) -> VirtualRecording:
    """Clips the set-up to a few frames at rest and then the motion's beginning, at its pace.

    The response has samples at the times `given`, s.
    """
    resting = min(REST_FRAMES, count // 2)
    whole = film_clock(given, setup)
    end = min(whole.start + (count - 1 - resting) / setup.rate * whole.pace, whole.end)
    length = (end - whole.start) / whole.pace
    shown = {"still": resting / setup.rate, "end": end, "duration": length}
    return setup.model_copy(update=shown)


def _evaluate_noise(film: VirtualFilm, found: Reals, sigma: Reals) -> ExpectedNoise:
    pixel = film.asked.camera.pixel_size
    scale = np.array([1 / pixel, 1 / pixel, _DEG])
    pose = film.motion.pose[: len(found)]
    error = (found - (pose - pose[0])) * scale  # a track counts from its first frame
    return ExpectedNoise(
        np.sqrt(np.nanmean(error**2, axis=(0, 1))),
        np.nanmedian(sigma * scale, axis=(0, 1)),
        float(np.isnan(error[..., 0]).mean()),
        pixel,
    )
