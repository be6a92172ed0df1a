"""Correlates rigid patches: Gauss-Newton on the pose of each unit in the specimen's plane.

The raw pixels of a frame are compared with the template of a unit, seen through the camera: no
frame is interpolated, so its noise is not either. Four photometric unknowns (gain, offset and its
slopes) go along with the three of the pose; weights of Geman and McClure take care of what does not
belong to the unit. Light scales what it falls on, so its slopes do too.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pipeline.runtime import compiled
from pipeline.tracking.fit.compared_pixels import FramePixels
from pipeline.tracking.fit.template_cells import TemplateCells
from sim.core import Floats, Mask, Singles

_POSE, _UNKNOWNS = 3, 7  # ux, uy, theta; gain, offset, slope in x, slope in y
_REPORTED = 5
"""Unknowns whose covariance is reported: the pose, and the light's slopes, which mimic shifts."""
WIDTH = _UNKNOWNS + 2 * _REPORTED**2 + 5


class Templates(NamedTuple):
    """Holds the appearance of the units in their own frames, and where they rest."""

    brightness: Singles  # (units, rows, columns) at the nodes, y up
    weight: Singles  # (units, rows, columns) of the nodes, zero outside the unit and near the rim
    half: float  # the grids reach from -half to half, mm
    step: float  # distance of the nodes, mm
    centre: Floats  # (units, 2) place at rest, mm
    contrast: Floats  # (units,) standard deviation of the brightness within the weight
    reach: Floats  # (units,) largest radius of the weight, mm
    noise: float  # standard deviation of the brightness' noise
    cells: TemplateCells  # between the nodes


class FitStart(NamedTuple):
    """Holds where the fits of a frame start, and what is known before.

    Attributes:
        state: (units, 7) pose and photometry.
        middle: (units, 2) pixel at the middle of each unit.
        radius: (units,) of the patch, px.
        scale: (units,) px/mm.
        full: (units,) information of a unit that is seen whole, zero if unknown.
        noise: (units,) residuals to expect, over the gain; zero if unknown.
        tight: (units,) scale of the robust weights in the end, whatever the residuals; zero to fit
            the photometry first and to let the residuals decide.
        drift: (units, 3) change of the pose from row to row of the frame, by a rolling shutter.
    """

    state: Floats
    middle: Floats
    radius: Floats
    scale: Floats
    full: Floats
    noise: Floats
    tight: Floats
    drift: Floats


class PoseFits(NamedTuple):
    """Holds poses found in a frame.

    Attributes:
        pose: (units, 3) displacement in mm and rotation in rad.
        photometry: (units, 4) gain, offset, and the gain's slopes over `half`.
        curvature: (units, 5, 5) covariance of the pose and of the light's slopes, for residuals of
            standard deviation one.
        scatter: (units, 5, 5) the same from the scores of blocks of pixels, which may be
            correlated within.
        noise: (units,) weighted standard deviation of the residuals.
        share: (units,) part of the information that robust weights and the image's edge left.
        blocks: (units,) number of blocks.
        last_step: (units,) length of the last step, px.
        information: (units,) sum of the squared gradients of the template, weighted.
    """

    pose: Floats
    photometry: Floats
    curvature: Floats
    scatter: Floats
    noise: Floats
    share: Floats
    blocks: Floats
    last_step: Floats
    information: Floats

    def copy(self) -> PoseFits:
        """Copies all arrays."""
        return PoseFits(*(values.copy() for values in self))

    def take(self, other: PoseFits, chosen: Mask) -> None:
        """Replaces the chosen units (units,) by those of another fit."""
        for values, new in zip(self, other, strict=True):
            values[chosen] = new[chosen]


@compiled
def fit_patches(
    scene: FramePixels,
    templates: Templates,
    start: FitStart,
    chosen: Mask,
    size: int,
    steps: int,
    out: Floats,
    n_chosen: int = 0,
) -> None:
    """Fits all chosen units; fills out (units, 62) in the order of `unpack`.

    Args:
        scene: the frame.
        templates: the units.
        start: where to start.
        chosen: (units,) which to fit.
        size: rows of a template's nodes, and columns.
        steps: largest number of full steps.
        out: filled; NaN where a unit cannot be fitted.
        n_chosen: number of units.
    """


def unpack(out: Floats) -> PoseFits:
    """Names the columns of `fit_patches`' output."""
    square = _REPORTED**2
    pose, light, white, blocks, rest = np.split(
        out, np.cumsum([_POSE, _UNKNOWNS - _POSE, square, square]), axis=1
    )
    shape = (len(out), _REPORTED, _REPORTED)
    return PoseFits(pose, light, white.reshape(shape), blocks.reshape(shape), *rest.T)
