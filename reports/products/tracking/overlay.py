"""Draws on a video what was found: units coloured by their motion, ids, lost ones hatched."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import cv2
import numpy as np
import xarray as xr
from matplotlib.colors import Colormap, to_rgb
from numpy.typing import NDArray

from pipeline.datasets import SYNTHETIC_LABEL
from pipeline.runtime import UserError
from pipeline.tracking.frames import Frame
from pipeline.tracking.geometry import Camera, SpecimenOutlines, camera_of, outlines_of_design
from reports.base import style
from sim.core import Floats, Image

SHOWN = ("displacement", "rotation")

_SHIFT = 4  # bits behind the point of cv2's coordinates
_OPACITY = 0.8
_BAND = 46  # px below the picture
_LARGE = 1000  # px: smaller pictures are doubled, so that ids can be read
_FONT = cv2.FONT_HERSHEY_SIMPLEX
_INK, _PAPER = (26, 26, 26), (255, 255, 255)
_LIGHT = 0.57  # lightness of OKLab on which both are told as well
_LOST = tuple(round(255 * part) for part in to_rgb(style.ALTERED))


class Painter(NamedTuple):
    """Draws a track on the frames of its video."""

    specimen: SpecimenOutlines  # the units that are present
    camera: Camera  # of the track
    pose: Floats  # (frames, units, 3), NaN where lost
    values: Floats  # (frames, units) what the colours show
    colours: NDArray[np.uint8]  # (256, 3) of the colour map
    limits: tuple[float, float]  # values at its ends
    label: str  # what the colours show, with its unit
    note: str  # words at the right end of the band
    scale: int  # how much larger the picture is drawn


def painter(track: xr.Dataset, shown: str) -> Painter:
    """Returns the painter of a track, which shows displacement (its size) or rotation."""
    specimen = of_track(track)
    there = np.isin(track["unit"].values, specimen.ids)
    pose = track["displacement"].transpose("time", "unit", "dof").values[:, there]
    if (camera := camera_of(track)) is None:
        raise UserError("the track has no camera", remedy="give one that was made of a video")
    if shown == "rotation":
        values, colours, label = np.rad2deg(pose[..., 2]), style.SIGNED, "rotation, deg"
    else:
        values, colours = np.hypot(pose[..., 0], pose[..., 1]), style.MAGNITUDE
        label = "displacement, mm"
    most = float(np.nanmax(np.abs(values), initial=1e-6))
    return Painter(
        specimen,
        camera,
        pose,
        values,
        _palette(colours),
        (-most if shown == "rotation" else 0.0, most),
        label,
        SYNTHETIC_LABEL if track.attrs["synthetic"] == "yes" else "",
        2 if max(camera.size) < _LARGE else 1,
    )


def of_track(track: xr.Dataset) -> SpecimenOutlines:
    """Returns the units of a track; who is joined to whom it does not say."""
    nobody = np.empty((0, 2), int)
    ends = ("ligament", "end")
    return outlines_of_design(
        track.assign(ligament_unit=(ends, nobody), ligament_vertex=(ends, nobody))
    )


def images(painted: Painter, frames: Iterable[Frame]) -> Iterator[Image]:
    """Yields the frames (rows, columns, 3) with everything drawn on them."""
    last = np.zeros_like(painted.pose[0])
    legend = _legend(painted)
    for index, frame in zip(range(len(painted.pose)), frames, strict=False):
        lost = np.isnan(painted.pose[index, :, 0])
        last = np.where(lost[:, None], last, painted.pose[index])
        size = [side * painted.scale for side in painted.camera.size]
        big = np.asarray(cv2.resize(frame.image, size), np.uint8)
        drawn = _units(painted, np.repeat(big[..., None], 3, axis=2), index, last)
        yield np.vstack([drawn, _with_status(painted, legend, frame, int(lost.sum()))])


def _palette(colours: Colormap) -> NDArray[np.uint8]:
    table = colours(np.linspace(0, 1, 256))[:, :3]
    return np.round(255 * np.asarray(table)).astype(np.uint8)


def _units(painted: Painter, image: Image, index: int, pose: Floats) -> Image:
    corners = _corners(painted, pose)
    places = _pixels(painted, painted.specimen.centre + pose[:, :2])
    low, high = painted.limits
    share = np.clip((painted.values[index] - low) / (high - low), 0, 1)
    over = image.copy()
    for unit, polygon in enumerate(corners):
        if np.isfinite(share[unit]):
            colour = painted.colours[round(255 * share[unit])].tolist()
            cv2.fillPoly(over, [polygon], colour, cv2.LINE_AA, _SHIFT)
    cv2.addWeighted(over, _OPACITY, image, 1 - _OPACITY, 0, image)
    for unit, polygon in enumerate(corners):
        lost = not np.isfinite(share[unit])
        if lost:
            _hatch(image, polygon)
        cv2.polylines(image, [polygon], True, _LOST if lost else _INK, 1, cv2.LINE_AA, _SHIFT)
    _ids(painted, image, places)
    return image


def _corners(painted: Painter, pose: Floats) -> list[NDArray[np.int32]]:
    """Returns outlines of the units in the picture, in cv2's fixed point."""
    out = []
    for unit in range(painted.specimen.count):
        cos, sin = np.cos(pose[unit, 2]), np.sin(pose[unit, 2])
        turned = painted.specimen.polygon(unit) @ np.array([[cos, sin], [-sin, cos]])
        out.append(_pixels(painted, painted.specimen.centre[unit] + pose[unit, :2] + turned))
    return out


def _pixels(painted: Painter, points: Floats) -> NDArray[np.int32]:
    large = (painted.camera.project(points) + 0.5) * painted.scale - 0.5
    return np.round(large * (1 << _SHIFT)).astype(np.int32)


def _hatch(image: Image, polygon: NDArray[np.int32]) -> None:
    mask = np.zeros(image.shape[:2], np.uint8)
    cv2.fillPoly(mask, [polygon], 1, cv2.LINE_8, _SHIFT)
    rows, columns = np.nonzero(mask)
    striped = (rows + columns) % 8 < 2
    image[rows[striped], columns[striped]] = _LOST


def _ids(painted: Painter, image: Image, places: NDArray[np.int32]) -> None:
    pitch = np.sqrt(np.median(painted.specimen.area))
    size = float(np.linalg.norm(painted.camera.jacobian(painted.specimen.centre[:1])[0, :, 0]))
    height = 0.011 * pitch * size * painted.scale
    for number, (x, y) in zip(painted.specimen.ids, places >> _SHIFT, strict=True):
        text = str(number)
        (wide, high), _ = cv2.getTextSize(text, _FONT, height, 1)
        at = (int(x - wide / 2), int(y + high / 2))
        ink, rim = _inks(image[max(y - high, 0) : y + high, max(x - wide, 0) : x + wide])
        cv2.putText(image, text, at, _FONT, height, rim, 3, cv2.LINE_AA)
        cv2.putText(image, text, at, _FONT, height, ink, 1, cv2.LINE_AA)


def _inks(under: Image) -> tuple[tuple[int, int, int], tuple[int, int, int]]:
    """Returns the colours of letters and of their rims on what is light, or dark."""
    if not under.size or style.oklab(under.mean(axis=(0, 1)) / 255)[0] > _LIGHT:
        return _INK, _PAPER
    return _PAPER, _INK


def _legend(painted: Painter) -> Image:
    """Returns the band below the picture: colour bar and what it shows."""
    band = np.full((_BAND, painted.camera.size[0] * painted.scale, 3), 255, np.uint8)
    bar = np.repeat(painted.colours[None], 14, axis=0)
    low, high = (f"{limit:.3g}" for limit in painted.limits)
    start = 16 + cv2.getTextSize(low, _FONT, 0.45, 1)[0][0]
    band[16:30, start : start + 256] = bar
    cv2.rectangle(band, (start, 16), (start + 255, 29), _INK, 1)
    _write(band, low, 8)
    _write(band, f"{high}   {painted.label}", start + 264)
    return band


def _with_status(painted: Painter, legend: Image, frame: Frame, lost: int) -> Image:
    band = legend.copy()
    words = [f"frame {frame.index}", f"{frame.time:.3f} s", f"{lost} lost", painted.note]
    text = "   ".join(word for word in words if word)
    wide = cv2.getTextSize(text, _FONT, 0.45, 1)[0][0]
    _write(band, text, band.shape[1] - wide - 10)
    return band


def _write(band: Image, text: str, left: int) -> None:
    cv2.putText(band, text, (left, 28), _FONT, 0.45, _INK, 1, cv2.LINE_AA)
