"""Accepts fits by the units' appearance in the first frame; gives reasons of missing units."""

import numpy as np

from pipeline.runtime import Picture
from pipeline.tracking.fit import PoseFits, Templates
from sim.core import Floats, Ints, Mask

GOOD, OUT_OF_FRAME, HIDDEN, GLARE, POOR_FIT, STRAYED = range(6)
"""Quality of a unit in a frame, and the reason why it is missing."""
SHARE = 0.35
"""Least part of a unit's information that a fit needs; less if photometry and place are known."""
SHARE_KNOWN = 0.18

_LONGEST_LAST_STEP = 0.3
"""Last Gauss-Newton step of a fit that found its place, px."""
_PARTLY_SEEN, _SHADED = 0.6, (0.06, 0.15)
"""Brightness of a unit that is seen as before: changes of slopes from which its fit has to be
better, and from which one that is seen in part, less than so much, is none."""
_GAIN = (0.12, 4.0)
"""Gain, against the first frame's, between which a unit can be seen."""
_BLURRED_SHARE = 0.7
"""Part of a unit that has to be seen where its motion may have blurred it."""
_FADED = 0.4
"""Gain, against the first frame's, of what is no longer the unit but something before it."""
_WHITE, _GLARE_SHARE = 234.0, 0.4
"""Level from which pixels are saturated, which in a video may be 235; part of them in glare."""
_LARGEST_RESIDUAL = 0.15
"""Residuals of a good fit, in contrasts of the unit; or so many times the first frame's: """
_RESIDUAL_RATIO = 4.0


class ReferenceAppearance:
    """Holds gains and residuals of units in the first frame.

    Args:
        fits: of the first frame.
        templates: of the units.
        sensor_noise: residuals to expect of the sensor's noise, levels.
        seen: (units,) which are not hidden in the first frame; others have no reference.

    Attributes:
        noise: (units,) residuals, in gains.
    """

    def __init__(
        self, fits: PoseFits, templates: Templates, sensor_noise: float, seen: Mask
    ) -> None:
        gain = np.abs(fits.photometry[:, 0])
        relative = fits.noise / gain
        usual = np.nanmedian(relative)
        self._gain = np.where(np.isfinite(gain), gain, 1.0)
        noise = np.fmax(np.where(np.isfinite(relative), relative, usual), usual)
        self.noise = np.maximum(noise, sensor_noise / self._gain)
        self._limit = np.maximum(
            _RESIDUAL_RATIO * self.noise, _LARGEST_RESIDUAL * templates.contrast
        )
        self._seen = seen
        white = ((templates.brightness >= _WHITE) * templates.weight).sum(axis=(1, 2))
        self._white = white / np.maximum(templates.weight.sum(axis=(1, 2)), 1e-9)

    def accepted(
        self, fits: PoseFits, photometry: Floats, share: float, quick: Mask | None
    ) -> Mask:
        """Accepts fits (units,); the less of a unit is seen, the better its fit has to be.

        `photometry` is that of the frame before; `quick` units may be blurred by their motion.
        """
        gain = fits.photometry[:, 0]
        relative = gain / self._gain
        seen = np.minimum(fits.share, 1.0)
        shaded = np.linalg.norm((fits.photometry - photometry)[:, 2:], axis=1)
        part = np.where(shaded < _SHADED[0], 0.5 * (1 + seen), seen)
        with np.errstate(invalid="ignore", divide="ignore"):
            fitting = fits.noise / np.abs(gain) < self._limit * part
        settled = fits.last_step < _LONGEST_LAST_STEP * seen**2
        if quick is not None:
            fitting &= ~(quick & (seen < _BLURRED_SHARE))
        settled &= (seen > _PARTLY_SEEN) | (shaded < _SHADED[1])
        lit = (relative > _GAIN[0]) & (relative < _GAIN[1]) & (fits.share > share)
        return np.isfinite(fits.pose[:, 0]) & settled & fitting & lit & self._seen

    def reasons(self, fits: PoseFits, good: Mask, inside: Mask, white: Floats) -> Ints:
        """Classifies each unit as `good`, or by the reason why it is missing.

        `inside` are in view; `white` is the part of their pixels that is saturated.
        """
        relative = fits.photometry[:, 0] / self._gain
        reasons = np.full(len(good), HIDDEN)
        reasons[np.isfinite(fits.pose[:, 0]) & (fits.share > SHARE)] = POOR_FIT
        reasons[(relative < _FADED) & (fits.photometry[:, 1] > 0)] = HIDDEN
        reasons[white > self._white + _GLARE_SHARE] = GLARE
        reasons[~self._seen] = HIDDEN
        reasons[~inside] = OUT_OF_FRAME
        reasons[good] = GOOD
        return reasons


def white_share(image: Picture, middle: Floats, reach: Floats) -> Floats:
    """Measures the part of saturated pixels in squares about places (units, 2), px.

    Args:
        image: the frame.
        middle: of the squares; what lies outside the frame has none.
        reach: (units,) half a side.
    """
    share = np.zeros(len(middle))
    low = np.maximum(np.floor(middle - reach[:, None]), 0).astype(int)
    high = np.maximum(np.ceil(middle + reach[:, None]) + 1, 0).astype(int)
    for unit, ((left, top), (right, bottom)) in enumerate(zip(low, high, strict=True)):
        part = image[top:bottom, left:right]
        share[unit] = np.mean(part >= _WHITE) if part.size else 0.0
    return share
