"""Redraws templates of thick units for their side walls, which do not turn with the faces."""

import numpy as np

from pipeline.tracking.fit.patch_correlation import Templates
from pipeline.tracking.fit.template import TemplateGrid, blurred_silhouette, template_weight
from pipeline.tracking.fit.template_cells import classify
from pipeline.tracking.geometry import Depth, SpecimenOutlines
from sim.core import Floats, Singles

_LEAST_SHIFT = 0.04
"""Movement of a back against its face from which its silhouette is drawn again, px."""


class SideWalls:
    """Redraws the silhouettes of units in their templates, in place.

    What a template shows of the board, where the walls then are, gets the shade of the face's rim.

    Args:
        specimen: the units.
        depth: their thickness, and the camera's place.
        grid: the nodes, with the silhouettes at rest.
        templates: as learned at rest.
        blur: standard deviation of the camera's blur, mm.
        pixel: size of a pixel, mm.
        kind: auto, dots, speckle or bare.
    """

    def __init__(
        self,
        specimen: SpecimenOutlines,
        depth: Depth,
        grid: TemplateGrid,
        templates: Templates,
        blur: float,
        pixel: float,
        kind: str,
    ) -> None:
        self._specimen, self._depth, self._grid = specimen, depth, grid
        self._blur, self._pixel, self._kind, self._templates = blur, pixel, kind, templates
        self._offset = depth.offset(specimen.centre, np.zeros((specimen.count, 3)))
        rest = np.stack([blurred_silhouette(grid, inside, blur) for inside in grid.inside])
        self._contrast = _fit_contrasts(rest, templates)
        self._board = templates.brightness - self._contrast[:, None, None] * rest

    def redraw(self, pose: Floats) -> None:
        """Draws the silhouettes of units (units, 3) whose backs have moved against the faces."""
        offset = self._depth.offset(self._specimen.centre, pose)
        moved = np.linalg.norm(offset - self._offset, axis=1) > _LEAST_SHIFT * self._pixel
        moved &= self._templates.reach > 0.0  # others were not seen at rest
        for unit in np.nonzero(moved)[0].tolist():
            outline = self._depth.silhouette(self._specimen.polygon(unit), offset[unit])
            inside = self._grid.signed_distance(outline)
            drawn = self._contrast[unit] * blurred_silhouette(self._grid, inside, self._blur)
            self._templates.brightness[unit] = self._board[unit] + drawn
            self._templates.weight[unit] = template_weight(
                inside, self._grid.joint[unit], self._blur, self._pixel, self._kind
            )
            classify(
                self._templates.brightness[unit],
                self._templates.weight[unit],
                self._templates.contrast[unit],
                self._templates.noise,
                self._templates.cells.kind[unit],
                self._templates.cells.span[unit],
            )
            self._offset[unit] = offset[unit]


def _fit_contrasts(silhouette: Singles, templates: Templates) -> Floats:
    """Brightness (units,) of silhouettes over what is around them, least squares by the weights."""
    weight = templates.weight
    total = np.maximum(weight.sum(axis=(1, 2)), 1e-9)
    mean = (weight * silhouette).sum(axis=(1, 2)) / total
    apart = silhouette - mean[:, None, None]
    return np.asarray(
        (weight * apart * templates.brightness).sum(axis=(1, 2))
        / np.maximum((weight * apart**2).sum(axis=(1, 2)), 1e-9)
    )
