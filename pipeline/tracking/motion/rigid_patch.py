"""Finds how one rigid patch moved between two pictures, from features to a fit of its pixels.

Lengths are pixels, x to the right and y down, pixel centres at whole numbers; rotations are from x
to y.
"""

from typing import NamedTuple

import cv2
import numpy as np
from shapely import Polygon

from pipeline.tracking.fit import PoseFitter, TemplateGrid, learn_templates
from pipeline.tracking.geometry import Camera, SpecimenOutlines, rotation_matrix
from sim.core import Floats, Image

_MARGIN = 24
"""Distance from the outline within which features count, px."""
_REACH = 2.0
"""Between two features that agree, px."""
_LEAST, _RATIO = 4, 0.8
_BLUR = 0.3
"""Standard deviation of the camera's, px."""
_FADE = 1.75
"""Distance within an outline at which half of a template's weight has faded in, px."""


class Patch(NamedTuple):
    """Holds a patch of the first of two pictures."""

    before: Image  # the pictures (rows, columns)
    after: Image  # likewise
    outline: Floats  # (n, 2) in the first one
    centre: Floats  # (2,) whose motion is told


def square(centre: Floats, side: int) -> Floats:
    """Returns the corners (4, 2) of a square of pixels about a centre (2,), px."""
    return centre + 0.5 * (side - 1) * np.array([[-1.0, -1], [1, -1], [1, 1], [-1, 1]])


def transform_outline(outline: Floats, centre: Floats, motion: Floats) -> Floats:
    """Moves an outline (n, 2) by shift and rotation (3,) about a centre (2,), px and rad."""
    return centre + motion[:2] + (outline - centre) @ rotation_matrix(motion[2]).T


def find_motion(patch: Patch) -> Floats | None:
    """Finds shift and rotation (3,) roughly by features; None if too few agree.

    Features and their matches are SIFT's (Lowe, IJCV 60 (2004) 91), the motion RANSAC's.
    """
    sift, mask = cv2.SIFT.create(), np.zeros_like(patch.before)
    cv2.fillPoly(mask, [np.round(patch.outline).astype(np.int32)], 255)
    about = cv2.dilate(mask, np.ones((_MARGIN, _MARGIN), np.uint8))
    first, described = sift.detectAndCompute(patch.before, about)
    second, others = sift.detectAndCompute(patch.after, None)
    if min(len(first), len(second)) < _LEAST:
        return None
    pairs = cv2.BFMatcher(cv2.NORM_L2).knnMatch(described, others, k=2)
    good = [near for near, next_ in pairs if near.distance < _RATIO * next_.distance]
    if len(good) < _LEAST:
        return None
    start = np.array([first[one.queryIdx].pt for one in good])
    end = np.array([second[one.trainIdx].pt for one in good])
    matrix, kept = cv2.estimateAffinePartial2D(start, end, ransacReprojThreshold=_REACH)
    if np.ndim(matrix) < 2 or kept.sum() < _LEAST:
        return None
    turn = float(np.arctan2(matrix[1, 0], matrix[0, 0]))
    return np.append(matrix[:, :2] @ patch.centre + matrix[:, 2] - patch.centre, turn)


def follow_patch(patch: Patch, *, include_edge: bool = False) -> Floats:
    """Finds shift and rotation (3,) unaided, however far they are; NaN if too little is seen.

    Args:
        patch: the patch.
        include_edge: as of `fit_motion`.
    """
    start = find_motion(patch)
    return (
        np.full(3, np.nan) if start is None else fit_motion(patch, start, include_edge=include_edge)
    )


def fit_motion(patch: Patch, start: Floats, *, include_edge: bool = False) -> Floats:
    """Fits shift and rotation (3,) by correlation of the pixels; NaN where that fails.

    Args:
        patch: the patch.
        start: (3,) near the motion.
        include_edge: whether pixels at the very edge count as well, for patches that lie within a
            part; by default their weight fades out, since what is beyond may move otherwise.
    """
    rows, columns = patch.before.shape
    camera = Camera(np.eye(3), np.array([columns, rows]) / 2 - 0.5, np.zeros(2), (columns, rows))
    outline = patch.outline - patch.centre
    if include_edge:
        wider = Polygon(outline).buffer(_FADE, join_style="mitre")
        outline = np.array(wider.exterior.coords)[:-1]
    if cv2.contourArea(outline.astype(np.float32), oriented=True) < 0:
        outline = outline[::-1]
    nothing = np.empty((0, 2), int), np.zeros((1, len(outline)), bool)
    shown = SpecimenOutlines(np.array([0]), patch.centre[None], outline[None], *nothing)
    grid = TemplateGrid(shown, 1.0, 4.0)
    fitter = PoseFitter(camera, learn_templates(patch.before, camera, grid, _BLUR, 1.0, "speckle"))
    _, photometry = fitter.start(1.0)
    return np.asarray(fitter.fit(patch.after, start[None], photometry).pose[0])
