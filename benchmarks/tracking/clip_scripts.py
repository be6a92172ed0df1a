"""Scripts clips as labs film them: what leaves the picture, hands, little light, shutters."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import cv2
import numpy as np

from benchmarks.tracking.rendering import Covering, View
from sim.core import Floats, Mask, Singles

GRID = {
    "name": "wild",
    "grid": [9, 9],
    "spacing_mm": 15.0,
    "ligament_gap_mm": 2.3,
    "bias_angle_deg": 20.0,
}
RATE = 30.0
_SKIN = 140.0


class ClipScript(NamedTuple):
    """Scripts a clip: motions of specimen and camera, the view, things beside."""

    # (n, 2) of the whole, mm, and (n,) about its middle, rad, at times (n,) in s
    shift: Callable[[Floats], Floats] | None = None
    turn: Callable[[Floats], Floats] | None = None
    # (n,) of the specimen's own motion, from 0 to 1
    pace: Callable[[Floats], Floats] = lambda time: np.sin(2.4 * time) ** 2
    view: View = View()
    cover: Covering | None = None  # what else is in view
    # which units (n, units) at places (n, units, 2) in px these hide, at times
    hidden: Callable[[Floats, Floats], Mask] | None = None
    times: Floats = np.arange(24) / RATE  # (frames,) at which frames are taken, s
    stamps: Floats | None = None  # what the file says of them, if it is something else
    fault: tuple[int, ...] = ()  # frames before which some are missing, or that show one again
    film: tuple[str, str, int] | None = None  # codec, pixel format and crf
    follows: bool = False  # whether the camera's motion is to be taken out
    keys: Mapping[str, Any] = MappingProxyType({})  # of the recording
    grid: Mapping[str, Any] = MappingProxyType(GRID)  # the specimen's lattice


def _glide(length: float, there: float, angle: float = 0.0) -> Callable[[Floats], Floats]:
    """Moves to a place (mm, by an angle in deg from x) and back, in a time each."""
    way = length * np.array([np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))])
    return lambda time: 0.5 * (1 - np.cos(np.pi * time[:, None] / there)) * way


def _hand(image: Singles, time: float) -> None:
    reach = float(_hand_reach(np.array(time)))
    edge = [(0, 60), (45, 200), (20, 330), (50, 480), (0, 640)]
    points = [(0, 0), *((reach + x, y) for x, y in edge), (0, 640)]
    cv2.fillPoly(image, [np.array(points, np.int32) + np.array([9, 7], np.int32)], 80.0)
    cv2.fillPoly(image, [np.array(points, np.int32)], _SKIN)
    for at in range(0, int(reach), 23):
        cv2.circle(image, (at, 40 + 7 * at % 560), 9, _SKIN - 25.0, -1)


def _hand_reach(time: Floats) -> Floats:
    return np.asarray(300.0 * time / 0.8)


def _under_hand(place: Floats, times: Floats) -> Mask:
    return np.asarray(place[..., 0] < _hand_reach(times)[:, None] + 100)


def _bolts(image: Singles, time: float) -> None:
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


def _corner_hand(image: Singles, time: float) -> None:
    """Draws a fist with a cuff that comes in over the upper right corner."""
    x, y = _fist(np.array(time)).tolist()
    cv2.fillPoly(
        image, [np.array([(x, y - 50), (x + 60, y), (700, -60), (580, -120)], np.int32)], 95.0
    )
    cv2.circle(image, (round(x) + 8, round(y) + 6), 88, 110.0, -1, cv2.LINE_AA)
    cv2.circle(image, (round(x), round(y)), 85, _SKIN, -1, cv2.LINE_AA)
    for finger in range(4):
        cv2.ellipse(
            image,
            (round(x) - 50 + 30 * finger, round(y) + 60),
            (13, 34),
            10,
            0,
            360,
            _SKIN + 12.0,
            -1,
            cv2.LINE_AA,
        )


def _fist(time: Floats) -> Floats:
    way = np.minimum(time / 0.5, 1.0)
    return np.stack([690 - 190 * way, -40 + 190 * way], axis=-1)


def _under_fist(place: Floats, times: Floats) -> Mask:
    far = place - _fist(times)[:, None]
    near = np.linalg.norm(far, axis=-1) < 150
    cuff = (np.abs(far[..., 0] + far[..., 1]) < 190) & (far[..., 0] > 0)
    return np.asarray(near | cuff)


def _mains(image: Singles, time: float) -> None:
    """Dims rows as lamps on mains do, which flicker at 100 Hz while they are read."""
    row = np.arange(len(image)) / len(image)
    image *= (1 + 0.15 * np.sin(2 * np.pi * 100.7 * (time + 0.02 * row)))[:, None].astype(
        np.float32
    )


def _second(image: Singles, time: float) -> None:
    """Draws part of another specimen of the same units, which slides by itself."""
    fixed = np.sqrt(0.5) * 0.5 * (15 - 2.3) / np.cos(np.deg2rad(20.0)) * np.sqrt(2) * 4
    for column in range(4):
        for row in range(9):
            sign = 1 if (row + column) % 2 == 0 else -1
            turn = sign * np.deg2rad(20.0) + np.pi / 4 * np.arange(1, 9, 2)
            middle = np.array([648 + 60 * column, 81 + 60 * row + 40 * np.sin(3 * time)])
            corners = middle + fixed * np.stack([np.cos(turn), np.sin(turn)], axis=1)
            cv2.fillPoly(image, [np.round(corners * 16).astype(np.int32)], 30.0, cv2.LINE_AA, 4)


def _glare(image: Singles, time: float) -> None:
    """Adds the reflection of a lamp that wanders over the specimen."""
    rows, columns = np.indices(image.shape, np.float32)
    x, y = 200 + 300 * time, 250 + 120 * np.sin(4 * time)
    image += (230 * np.exp(-((columns - x) ** 2 + (rows - y) ** 2) / (2 * 45.0**2))).astype(
        np.float32
    )


def _under_glare(place: Floats, times: Floats) -> Mask:
    there = np.stack([200 + 300 * times, 250 + 120 * np.sin(4 * times)], axis=-1)
    return np.asarray(np.linalg.norm(place - there[:, None], axis=-1) < 150)


def _off_corner(time: Floats) -> Floats:
    """Leaves by the lower left corner until all is out, and returns."""
    return 150.0 * 0.5 * (1 - np.cos(np.pi * time[:, None] / 0.8)) * np.array([-1.0, -0.9])


def _steadied(time: Floats) -> Floats:
    """Sways as a phone does whose lens is steadied, mm."""
    x, y = 1.5 * np.sin(2 * np.pi * 0.6 * time), 0.05 * np.sin(2 * np.pi * 5.3 * time) - 1.0 * time
    return np.stack([x, y], axis=-1)


def _shaken(time: Floats) -> Floats:
    """Shakes as hands do: slow sway and tremor, mm."""
    return np.stack(
        [
            1.5 * np.sin(2 * np.pi * 0.6 * time) + 0.35 * np.sin(2 * np.pi * 8.3 * time + 1),
            -1.0 * time + 0.3 * np.sin(2 * np.pi * 9.1 * time),
        ],
        axis=-1,
    )


_JITTER = np.cumsum(
    np.r_[0.0, np.random.default_rng(3).choice([1, 1, 1, 1, 2, 4], 39)]
) / 30 + 0.004 * np.random.default_rng(4).uniform(-1, 1, 40)
_FAST = np.arange(30) / RATE


SCRIPTS: dict[str, ClipScript] = {
    "plain": ClipScript(),
    "plain_h264": ClipScript(film=("libx264", "yuv420p", 14)),
    "rests_first": ClipScript(pace=lambda t: np.sin(2.4 * np.maximum(t - 8.5 / RATE, 0)) ** 2),
    "soft_focus": ClipScript(view=View(blur=1.1)),
    "leaves_and_returns": ClipScript(shift=_glide(155.0, 0.8), times=_LONG),
    "leaves_slowly": ClipScript(shift=_glide(95.0, 1.6), times=_LONG),
    "hand": ClipScript(cover=_hand, hidden=_under_hand),
    "low_light": ClipScript(view=_DIM),
    "low_light_h264": ClipScript(view=_DIM, film=("libx264", "yuv420p", 18)),
    "motion_blur": ClipScript(pace=_swing, view=_QUICK, keys={"exposure": 0.025}),
    "motion_blur_untold": ClipScript(pace=_swing, view=_QUICK),
    "rolling_shutter": ClipScript(pace=_sway, view=View(readout=0.03), keys={"readout": 0.03}),
    "camera_drifts": ClipScript(
        shift=lambda t: np.stack([1.5 * t / 0.8, -0.4 * t], axis=-1),
        keys={"follows_supports": True},
        follows=True,
    ),
    "tripod_knocked": ClipScript(
        shift=lambda t: np.stack([6.0 * (t > 0.4), 3.0 * (t > 0.4)], axis=-1),
        keys={"follows_supports": True},
        follows=True,
    ),
    "fisheye": ClipScript(view=View(fisheye=True, distance=75.0, scale=4.6, tilt=0.01)),
    "uneven_10_bit": ClipScript(times=_UNEVEN, film=("libx265", "yuv420p10le", 12)),
    "stick_slip": ClipScript(pace=_stick, times=np.arange(40) / RATE),
    "gap_of_five": ClipScript(times=_gap(_LONG, 20, 5), stamps=_LONG, fault=(20,)),
    "gap_in_stamps": ClipScript(times=_gap(_LONG, 20, 5), fault=(20,)),
    "shown_again": ClipScript(times=_gap(_LONG, 20, -1), stamps=_LONG, fault=(20,)),
    "red_on_teal": ClipScript(film=("libx264", "yuv444p", 8)),
    "bolts_and_tape": ClipScript(cover=_bolts),
    "small_units_wide": ClipScript(
        view=View(size=(960, 720), scale=2.2),
        grid={**GRID, "grid": [26, 18], "ligament_gap_mm": 1.6, "bias_angle_deg": 12.0},
    ),
    "few_large_units": ClipScript(
        view=View(size=(800, 600), scale=5.0),
        grid={
            **GRID,
            "grid": [5, 3],
            "spacing_mm": 28.0,
            "ligament_gap_mm": 3.0,
            "bias_angle_deg": 30.0,
        },
    ),
    "hand_over_a_corner": ClipScript(
        pace=_swing, cover=_corner_hand, hidden=_under_fist, times=_FAST
    ),
    "mains_flicker": ClipScript(cover=_mains),
    "second_specimen": ClipScript(
        shift=lambda t: np.stack([0 * t - 30.0, 0 * t], axis=-1),
        view=View(size=(860, 640)),
        cover=_second,
    ),
    "glare": ClipScript(cover=_glare, hidden=_under_glare, times=_FAST),
    "shaken_and_rolling": ClipScript(
        shift=_shaken, view=View(readout=0.02), keys={"readout": 0.02}
    ),
    "returns_turned": ClipScript(
        shift=_off_corner,
        turn=lambda t: 2.6 * np.clip((t - 0.7) / 0.2, 0, 1),
        times=_LONG,
        grid={**GRID, "grid": [9, 8]},
    ),
    "turns_over_in_view": ClipScript(
        turn=lambda t: 5.0 * t, view=View(size=(800, 800)), times=_FAST
    ),
    "dropped_and_jittered": ClipScript(times=_JITTER - _JITTER[0]),
    "blurred_in_low_light": ClipScript(
        pace=_swing, view=View(exposure=0.03, noise=(14.0, 0.0)), times=_FAST
    ),
    "hand_held": ClipScript(
        shift=_shaken, keys={"follows_supports": True}, follows=True, times=_LONG
    ),
    "phone": ClipScript(
        shift=_steadied,
        pace=_sway,
        view=View(readout=0.02, exposure=0.008, size=(720, 720)),
        cover=_bolts,
        film=("libx264", "yuv420p", 21),
        times=_LONG,
        follows=True,
        keys={"follows_supports": True, "readout": 0.02, "exposure": 0.008},
    ),
}
SCRIPTS |= {
    "phone_for_8_s": SCRIPTS["phone"]._replace(
        view=View(readout=0.02, exposure=0.008, size=(1280, 720), scale=3.0),
        times=np.cumsum(np.r_[0.0, np.random.default_rng(6).choice([0.97, 1.0, 1.03], 239)]) / RATE,
        grid={**GRID, "grid": [15, 15]},
    ),
    "drifts_from_the_start": ClipScript(
        shift=lambda t: np.stack([0.02 * t, 0 * t], axis=-1), pace=lambda t: 0 * t, times=_LONG
    ),
    "fist_in_noise": SCRIPTS["hand_over_a_corner"]._replace(view=View(noise=(8.0, 0.12))),
    "returns_h264": SCRIPTS["leaves_and_returns"]._replace(film=("libx264", "yuv420p", 20)),
    "returns_fast": ClipScript(
        shift=_glide(140.0, 0.7), times=_LONG, film=("libx264", "yuv420p", 16)
    ),
    "returns_by_rows": ClipScript(
        shift=_glide(148.76, 0.71406, 265.62), times=_LONG, grid={**GRID, "grid": [8, 9]}
    ),
    "off_a_corner": ClipScript(shift=_off_corner, times=_LONG, film=("libx264", "yuv420p", 20)),
}
"""The clips by name."""
