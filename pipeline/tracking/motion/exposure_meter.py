"""Measures the exposure of a camera by what the first quick motions blur."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sim.core import Floats, Mask

_EXPOSURES = np.linspace(0.0, 1.0, 9)
"""Exposures that are tried, over the interval of frames."""
_LEAST_MOTION, _LEAST_UNITS, _MOST_UNITS, _FRAMES = 5.0, 3, 16, 5
"""Motion from frame to frame that tells of the exposure, px; units that must make it, and that are
looked at, at most; frames."""
_SAMPLING_WIDTH = 2.5
"""Pixels over which the sampling of a template averages its noise already."""


class MotionBlur(NamedTuple):
    """Holds what a quick motion tells of the exposure."""

    time: float  # of the frame, s
    exposure: float  # which blurs as is seen, s
    speed: Floats  # (units,) by which it does, mm/s; NaN of those that are not quick


class ExposureMeter:
    """Estimates the exposure of a row by the blur of quick motions, where it is not given.

    Args:
        given: s, if it is known.
        noise: of the templates, levels.
        allowed: whether motions are to be asked where it is not given.

    Attributes:
        time: s; zero as long as it is not known.
        measuring: whether more motions are to be asked.
        blurs: by which it was measured, if it is not given.
    """

    def __init__(self, given: float | None, noise: float, allowed: bool) -> None:
        self.time = given or 0.0
        self.measuring = given is None and allowed
        self.blurs: list[MotionBlur] = []
        self._noise = noise

    def measure(
        self,
        time: float,
        interval: float,
        travel: Floats,
        pixel: float,
        found: Mask,
        residuals: Callable[[Mask], Floats],
    ) -> None:
        """Fits the exposure to residuals of the units that are quick enough.

        It is the median of what the first such frames tell. What a blur takes of the template's own
        noise, by the inverse of its length, is no sign of it.

        Args:
            time: of the frame, s.
            interval: since the frame before, s.
            travel: (units,) of the units in it, mm.
            pixel: its size, mm.
            found: (units,) those that may be asked.
            residuals: of some units, fitted with `time` as exposure, in gains.
        """
        travel = travel / pixel
        quick = found & (travel > _LEAST_MOTION)
        if quick.sum() < _LEAST_UNITS:
            return
        ids = np.flatnonzero(quick)
        quick[:] = False
        quick[ids[:: -(-len(ids) // _MOST_UNITS)]] = True
        left = []
        for part in _EXPOSURES:
            self.time = part * interval
            rest = residuals(quick) ** 2
            smoothed = self._noise**2 / np.sqrt(_SAMPLING_WIDTH**2 + (part * travel[quick]) ** 2)
            left.append(float(np.nanmean(rest - smoothed)))
        speed = np.where(quick, travel / interval, np.nan) * pixel
        self.blurs.append(MotionBlur(time, float(np.sqrt(_minimum(left))) * interval, speed))
        self.time = float(np.median([blur.exposure for blur in self.blurs]))
        self.measuring = len(self.blurs) < _FRAMES


def _minimum(left: list[float]) -> float:
    """Finds the square of the part at which residuals of ``_EXPOSURES`` are least.

    A blur's variance grows with the square of its length.
    """
    best = int(np.clip(np.argmin(left), 1, len(left) - 2))
    near = slice(best - 1, best + 2)
    bend, slope, _ = np.polyfit(_EXPOSURES[near] ** 2, left[near], 2)
    square = -0.5 * slope / bend if bend > 0 else _EXPOSURES[np.argmin(left)] ** 2
    return float(np.clip(square, 0.0, 1.0))
