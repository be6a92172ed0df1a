"""Measures the exposure of a camera by what the first quick motions blur."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from sim.core import Floats, Mask

_PARTS = np.linspace(0.0, 1.0, 9)
"""Exposures that are tried, over the interval of frames."""
_TELLING, _FEW, _MANY, _ENOUGH = 5.0, 3, 16, 5
"""Motion from frame to frame that tells of the exposure, px; units that must make it, and that are
looked at, at most; frames."""
_MIXED = 2.5
"""Pixels over which the sampling of a template averages its noise already."""


class MotionBlur(NamedTuple):
    """Holds what a quick motion tells of the exposure."""

    time: float  # of the frame, s
    exposure: float  # which blurs as is seen, s
    speed: Floats  # (units,) by which it does, mm/s; NaN of those that are not quick


class ExposureMeter:
    """Holds the exposure of a row: as it is told, or as motions tell.

    Args:
        told: s, if it is known.
        noise: of the templates, levels.
        allowed: whether motions are to be asked where it is not told.

    Attributes:
        time: s; zero as long as it is not known.
        open: whether more motions are to be asked.
        blurs: by which it was measured, if it is not told.
    """

    def __init__(self, told: float | None, noise: float, allowed: bool) -> None:
        self.time = told or 0.0
        self.open = told is None and allowed
        self.blurs: list[MotionBlur] = []
        self._noise = noise

    def measure(
        self,
        time: float,
        interval: float,
        way: Floats,
        pixel: float,
        found: Mask,
        residuals: Callable[[Mask], Floats],
    ) -> None:
        """Takes the exposure that leaves the least residuals of the units that are quick enough.

        It is the median of what the first such frames tell. What a blur takes of the template's own
        noise, by the inverse of its length, is no sign of it.

        Args:
            time: of the frame, s.
            interval: since the frame before, s.
            way: (units,) that the units went in it, mm.
            pixel: its size, mm.
            found: (units,) those that may be asked.
            residuals: of some units, fitted with `time` as exposure, in gains.
        """
        way = way / pixel
        quick = found & (way > _TELLING)
        if quick.sum() < _FEW:
            return
        ids = np.flatnonzero(quick)
        quick[:] = False
        quick[ids[:: -(-len(ids) // _MANY)]] = True
        left = []
        for part in _PARTS:
            self.time = part * interval
            rest = residuals(quick) ** 2
            smoothed = self._noise**2 / np.sqrt(_MIXED**2 + (part * way[quick]) ** 2)
            left.append(float(np.nanmean(rest - smoothed)))
        speed = np.where(quick, way / interval, np.nan) * pixel
        self.blurs.append(MotionBlur(time, float(np.sqrt(_least(left))) * interval, speed))
        self.time = float(np.median([blur.exposure for blur in self.blurs]))
        self.open = len(self.blurs) < _ENOUGH


def _least(left: list[float]) -> float:
    """Finds the square of the part at which residuals of ``_PARTS`` are least.

    A blur's variance grows with the square of its length.
    """
    best = int(np.clip(np.argmin(left), 1, len(left) - 2))
    near = slice(best - 1, best + 2)
    bend, slope, _ = np.polyfit(_PARTS[near] ** 2, left[near], 2)
    square = -0.5 * slope / bend if bend > 0 else _PARTS[np.argmin(left)] ** 2
    return float(np.clip(square, 0.0, 1.0))
