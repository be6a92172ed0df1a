"""Describes data of the page's animated player, for any motion of rigid units.

The player (templates/player.js) shows one or several structures side by side, deformed at true
size, and knows nothing of what moves them. Its data is one JSON object:

    axis        {name, unit, values, digits, loops, shown, saved}: what the slider runs over. Time
                of a dynamic study, or the load (a displacement, a strain) of a static one:
                `values` (n_frames,) may be unevenly spaced, between them the motion is
                interpolated linearly; `shown` of `saved` frames are there.
    speeds      [{label, rate}]: axis units per second of playback; the first is the default.
    cases       [label]: what the load menu offers (angles, amplitudes; one entry: no menu);
    start       the case shown first.
    structures  [{name, colour, centroid (n_units, 2), arm (n_vertices, 2), owner (n_vertices,),
                ligaments (n_ligaments, 2) vertex numbers, pads, driven, marker}]
                with polygons contiguous in `arm`, mm from their centroid; pads: [[x, y]] of each
                outline under clamped units; marker: a unit or null.
    motion      [structure][case] -> {step: [3], data}: `data` (n_frames, n_units, 3) int16;
                displacement = step * data in mm, mm, rad; -32768 stands for "no data". Null where
                there is none at all of a case: the structure is not shown.
    residual    [structure][case] likewise: measured less simulated, for structures that were
                filmed; null for others. The view "residual" colours by it.
    fields      [{key, label, unit, factor, scale (3,), map, limits, residual}]: what may colour
                the units. key "norm" is |u / scale|, "turn" |theta|, else ux, uy or theta; shown
                times `factor`; `residual` are the limits of the residual's colours, or null.
    maps        {name: 256 x 3 uint8}; circles [{x, y, radius, colour}], all in mm.

Arrays are base64 of little-endian float32, int32, int16 or uint8, decoded without a library.
"""

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.colors import Colormap
from numpy.typing import NDArray

from reports.base import style
from reports.panels.structure_drawing import pads
from reports.study import DRIVEN, RigidUnits, deformed
from sim.core import Floats

MOST_STEPS = 200
"""Steps between frames that a page carries; more are thinned."""
LARGEST_MOTION = 3_000_000
"""Bytes that the quantised motion of all structures and cases may take before base64."""

ROUNDING = 1e-9
"""Below which a displacement or a rotation is rounding; as a share, one beside another."""
NO_DATA = -32768
LARGEST_LEVEL = 32767


@dataclass(frozen=True)
class AnimationAxis:
    """Holds what the slider runs over: values (n_frames,) in `unit`, `digits` decimals."""

    name: str
    unit: str
    values: Floats
    digits: int
    loops: bool
    speeds: Mapping[str, float]


@dataclass(frozen=True)
class AnimationClip:
    """Describes one structure with its motion (n_cases, n_frames, n_units, 3) in mm, mm, rad.

    `residual`, of the same shape, is what a measured motion is more than the simulated one.
    """

    name: str
    colour: str
    structure: RigidUnits
    motion: Floats
    marker: int | None = None
    residual: Floats | None = None

    @property
    def weight(self) -> int:
        """Returns numbers that it takes a frame."""
        held = [self.motion] if self.residual is None else [self.motion, self.residual]
        return sum(case[0].size for motion in held for case in motion if _known(case))


@dataclass(frozen=True)
class ColourField:
    """Describes a scalar that colours the units; `limits` in the unit shown, after `factor`."""

    key: str
    label: str
    unit: str
    factor: float
    colours: str
    limits: tuple[float, float]
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class DashedDisc:
    """Describes a dashed circle, mm."""

    x: float
    y: float
    radius: float
    colour: str


def kept_frames(n_frames: int, n_values: int) -> NDArray[np.int64]:
    """Finds frames that fit the page at `n_values` int16 numbers each: every k-th, and the last."""
    room = max(1, min(MOST_STEPS, LARGEST_MOTION // (2 * n_values) - 2))
    stride = max(1, -(-(n_frames - 1) // room))
    return np.union1d(np.arange(0, n_frames, stride), n_frames - 1)


@dataclass(frozen=True)
class Animation:
    """Tells what plays: structures side by side under their load cases, along one axis."""

    axis: AnimationAxis  # what the slider runs over
    cases: Sequence[str]  # labels of the load cases
    clips: Sequence[AnimationClip]  # the structures with their motions
    fields: Sequence[ColourField]  # what may colour them, the default first
    discs: Sequence[DashedDisc] = ()  # circles on all of them
    start: int = 0  # the case shown first
    pad: float = 0.0  # side of the squares under clamped units, mm


def payload(reel: Animation) -> dict[str, Any]:
    """Returns the player's data as an object ready for JSON; frames are thinned to fit the page."""
    axis, clips = reel.axis, reel.clips
    frames = kept_frames(len(axis.values), sum(clip.weight for clip in clips))
    return {
        "axis": {
            "name": axis.name,
            "unit": axis.unit,
            "digits": axis.digits,
            "loops": axis.loops,
            "shown": len(frames),
            "saved": len(axis.values),
            "values": encoded(axis.values[frames], "<f4"),
        },
        "speeds": [{"label": label, "rate": rate} for label, rate in axis.speeds.items()],
        "cases": list(reel.cases),
        "start": reel.start,
        "structures": [_structure(clip, reel.pad) for clip in clips],
        "motion": [_cases(clip.motion, frames) for clip in clips],
        "residual": [_cases(clip.residual, frames) for clip in clips],
        "fields": [_field(field, clips) for field in reel.fields],
        "maps": {name: _levels(COLOUR_MAPS[name]) for name in sorted(COLOUR_MAPS)},
        "circles": [vars(disc) for disc in reel.discs],
    }


def round_up(value: float) -> float:
    """Returns the next value of one significant digit, or two where the first is 1.

    It is 1 where the value is none but rounding, which colours should not magnify.
    """
    if value < ROUNDING:
        return 1.0
    step = 10.0 ** np.floor(np.log10(value))
    step = step / 10.0 if value / step < 2.0 else step
    return float(np.round(np.ceil(value / step - 1e-9) * step, 12))


COLOUR_MAPS: dict[str, Colormap] = {"magnitude": style.MAGNITUDE, "signed": style.SIGNED}


def encoded(values: NDArray[Any], dtype: str) -> str:
    """Returns base64 of an array in C order, in the little-endian type `dtype`."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=dtype).tobytes()).decode("ascii")


def quantisation_error(data: Mapping[str, Any]) -> tuple[float, float]:
    """Returns largest rounding error of the motion in mm and in rad: half a step."""
    steps = np.array([case["step"] for clip in data["motion"] for case in clip if case])
    return 0.5 * float(steps[:, :2].max()), 0.5 * float(steps[:, 2].max())


def _known(motion: Floats) -> bool:
    return bool(np.isfinite(motion).any())


def _cases(motion: Floats | None, frames: NDArray[np.int64]) -> list[dict[str, Any] | None]:
    """Returns every case of a motion, None where nothing of it is known."""
    if motion is None:
        return []
    return [_quantised(case[frames]) if _known(case) else None for case in motion]


def _quantised(motion: Floats) -> dict[str, Any]:
    known = np.isfinite(motion)
    largest = np.abs(np.where(known, motion, 0.0)).max(axis=(0, 1))
    step = largest / LARGEST_LEVEL
    divisor = np.where(step > 0, step, 1.0)
    levels = np.where(known, np.rint(np.where(known, motion, 0.0) / divisor), NO_DATA)
    return {"step": [float(value) for value in step], "data": encoded(levels, "<i2")}


def _structure(clip: AnimationClip, pad: float) -> dict[str, Any]:
    structure = clip.structure
    present = ~np.isnan(structure.vertices[..., 0])
    number = np.cumsum(present).reshape(present.shape) - 1
    arm = (deformed(structure) - structure.centroid[:, None])[present]
    ends = number[structure.ligament_unit, structure.ligament_vertex]
    return {
        "name": clip.name,
        "colour": clip.colour,
        "centroid": encoded(structure.centroid, "<f4"),
        "arm": encoded(arm, "<f4"),
        "owner": encoded(np.nonzero(present)[0], "<i4"),
        "ligaments": encoded(ends, "<i4"),
        "pads": [[ring.round(3).tolist() for ring in rings] for rings in pads(structure, pad)],
        "driven": np.flatnonzero(structure.support == DRIVEN).tolist(),
        "marker": clip.marker,
    }


def _field(field: ColourField, clips: Sequence[AnimationClip]) -> dict[str, Any]:
    residuals = [clip.residual for clip in clips if clip.residual is not None]
    return {
        "key": field.key,
        "label": field.label,
        "unit": field.unit,
        "factor": field.factor,
        "scale": list(field.scale),
        "map": field.colours,
        "limits": list(field.limits),
        "residual": _limits(field, residuals) if residuals else None,
    }


def _limits(field: ColourField, residuals: Sequence[Floats]) -> list[float]:
    """Returns limits of colours that hold all but the largest hundredth of the residuals."""
    values = np.concatenate([scalar(field, motion).ravel() for motion in residuals])
    known = np.abs(values[np.isfinite(values)])
    most = round_up(float(np.quantile(known, 0.99)) if known.size else 0.0)
    return [0.0 if field.limits[0] >= 0 else -most, most]


def scalar(field: ColourField, motion: Floats) -> Floats:
    """Tells what a field shows of motions (..., 3) in mm, mm, rad."""
    if field.key == "norm":
        size: Floats = np.linalg.norm(motion / np.array(field.scale), axis=-1)
        return field.factor * size
    shown = field.factor * motion[..., {"ux": 0, "uy": 1, "theta": 2, "turn": 2}[field.key]]
    return np.abs(shown) if field.key == "turn" else shown


def _levels(colours: Colormap) -> str:
    rgba = colours(np.linspace(0.0, 1.0, 256))
    return encoded(np.rint(255 * rgba[:, :3]), "<u1")
