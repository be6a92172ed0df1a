"""Draws marks on the faces of the units: dots, speckle, or nothing."""

from typing import NamedTuple

import numpy as np
import shapely

from pipeline.fabrication.units import tracking_dots
from pipeline.problem.sections import Speckle, UnitAppearance
from pipeline.tracking.geometry import SpecimenOutlines
from sim.core import Floats, Ints

_GAP = 0.25  # least distance of two speckles, in diameters
_TRIES = 12  # for each speckle that would fit
_RIM_WIDTH = 0.15  # mm between a speckle and the rim of the face


class FaceMarks(NamedTuple):
    """Discs on the faces."""

    unit: Ints  # (marks,) on which unit, as a place in the specimen
    centre: Floats  # (marks, 2) relative to the unit's centroid at rest, mm
    diameter: Floats  # (marks,) mm


def draw_marks(
    specimen: SpecimenOutlines, kind: str, appearance: UnitAppearance, seed: int
) -> FaceMarks:
    """Draws the marks of all units of a kind of specimen: dots, speckle or bare."""
    of_unit = {"dots": _dots, "speckle": _speckle}.get(kind)
    found = (
        []
        if of_unit is None
        else [
            (unit, *disc)
            for unit in range(specimen.count)
            for disc in of_unit(
                specimen.polygon(unit), appearance, np.random.default_rng([seed, unit])
            )
        ]
    )
    table = np.array(found, float).reshape(-1, 4)
    return FaceMarks(table[:, 0].astype(np.int64), table[:, 1:3], table[:, 3])


Disc = tuple[float, float, float]


def _dots(outline: Floats, appearance: UnitAppearance, random: np.random.Generator) -> list[Disc]:
    del random
    return [
        (*circle.centre, circle.diameter)
        for circle in tracking_dots.dots(shapely.Polygon(outline), appearance.dots)
    ]


def _speckle(
    outline: Floats, appearance: UnitAppearance, random: np.random.Generator
) -> list[Disc]:
    """Discs thrown at random that keep apart from those before, until there are enough."""
    asked: Speckle = appearance.speckle
    face = shapely.Polygon(outline)
    free = face.buffer(-(asked.diameter / 2 + _RIM_WIDTH))
    wanted = int(asked.density * face.area / (np.pi / 4 * asked.diameter**2))
    low, high = outline.min(axis=0), outline.max(axis=0)
    thrown = random.uniform(low, high, (_TRIES * wanted, 2))
    thrown = thrown[shapely.contains_xy(free, thrown[:, 0], thrown[:, 1])]
    kept = np.empty((0, 2))
    for place in thrown:
        if len(kept) == wanted:
            break
        if (np.hypot(*(kept - place).T) > (1 + _GAP) * asked.diameter).all():
            kept = np.vstack([kept, place])
    return [(float(x), float(y), asked.diameter) for x, y in kept]
