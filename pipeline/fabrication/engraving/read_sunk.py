"""Reads the id that is sunk into the underside of a printed unit from the area that is missing.

How high and at what turn its letters stand is known from the drawing of the same unit. On a raster
each letter is laid, seen from below, wherever it may stand: it should run where the unit is sunk,
may run where slots leave no unit, and may not run over the plain underside.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import shapely
from shapely import LineString, affinity
from shapely.geometry.base import BaseGeometry

from pipeline.fabrication.engraving.read_strokes import LEGIBLE, Reading, span
from pipeline.fabrication.engraving.reading_order import in_order
from pipeline.fabrication.engraving.stroke_font import text
from sim.core import Floats

_STEP = 0.1  # mm, of the raster
_RIM = 0.25  # mm of a unit where letters may be cut
_BARE = 0.1  # of a letter, that may run over the plain underside
_PEN = 0.55  # mm, widest stroke
_APART = 3  # steps between two places of a letter
_KEPT = 16  # places of a letter that are looked at
_BLOT = 0.08  # mm^2; smaller pieces are rims of letters
_MARK = 2.4  # mm, largest mark with its pen
_LITTLE = 2.0  # mm^2; a mark that runs into letters, and rims of letters that slots cut


class _Raster(NamedTuple):
    """Points in rows (y) and columns (x): which are sunk, which plain, and the first of them."""

    sunk: Floats
    plain: Floats
    corner: Floats


def shows(words: str, underside: BaseGeometry, outline: BaseGeometry, pose: Reading) -> bool:
    """Whether an id is sunk, and no more beside it than a mark.

    Args:
        words: the id.
        underside: what is left of the unit where letters are sunk, seen from the top, mm.
        outline: of the unit above them.
        pose: of the same id where it is engraved on the top.
    """
    sunk = _level(outline.difference(underside), pose.turn)
    plain = outline.buffer(-_RIM).intersection(underside)
    raster = _raster(sunk, _level(plain, pose.turn))
    letters = [[stroke * pose.height for stroke in text(letter, 1.0)] for letter in words]
    offers = [_places(letter, raster) for letter in letters]
    lengths = np.array([shapely.MultiLineString(letter).length for letter in letters])
    weights = [
        (found[:, 2] - found[:, 3]) * length for found, length in zip(offers, lengths, strict=True)
    ]
    taken, _ = in_order([found[:, :2] / pose.height for found in offers], weights)
    if not taken:
        return False
    chosen = np.array([found[at] for found, at in zip(offers, taken, strict=True)])
    there, bare = lengths @ chosen[:, 2] / lengths.sum(), chosen[:, 3].max()
    places = zip(letters, chosen[:, :2], strict=True)
    lines = [stroke + at for letter, at in places for stroke in letter]
    rest = sunk.difference(shapely.MultiLineString(lines).buffer(_PEN / 2 + _STEP))
    return bool(there >= LEGIBLE and bare <= _BARE and (_is_mark(rest) or rest.area <= _LITTLE))


def _is_mark(rest: BaseGeometry) -> bool:
    """Whether what belongs to no letter is one small mark, or none that letters leave alone."""
    pieces = [piece for piece in shapely.get_parts(rest) if piece.area > _BLOT]
    return not pieces or span(pieces) < _MARK


def _level(area: BaseGeometry, turn: float) -> BaseGeometry:
    """An area seen from below, turned so that letters are upright."""
    below = affinity.scale(area, xfact=-1.0, origin=(0.0, 0.0))
    return affinity.rotate(below, turn, origin=(0.0, 0.0), use_radians=True)


def _raster(sunk: BaseGeometry, plain: BaseGeometry) -> _Raster:
    x0, y0, x1, y1 = sunk.bounds
    x, y = np.meshgrid(np.arange(x0, x1 + _STEP, _STEP), np.arange(y0, y1 + _STEP, _STEP))
    values = [shapely.contains_xy(area, x, y).astype(float) for area in (sunk, plain)]
    return _Raster(values[0], values[1], np.array([x0, y0]))


def _places(letter: Sequence[Floats], raster: _Raster) -> Floats:
    """Where a letter may stand: x, y, and the shares of it that are sunk and plain (n, 4)."""
    lines = [shapely.segmentize(LineString(stroke), _STEP) for stroke in letter]
    points = np.round(shapely.get_coordinates(lines) / _STEP).astype(int)
    points = np.unique(points, axis=0)
    reach = np.abs(points).max(axis=0)
    around = [(2 * far, 2 * far) for far in reach[::-1]]
    sunk, plain = (np.pad(values, around) for values in raster[:2])
    rows, columns = np.subtract(sunk.shape, 2 * reach[::-1])
    value = sunk - plain + _depth(sunk)
    fit = np.zeros((rows, columns))
    for x, y in points + reach:
        fit += value[y : y + rows, x : x + columns]
    found = []
    for row, column in _peaks(fit):
        x, y = (points + reach + [column, row]).T
        place = raster.corner + (np.array([column, row]) - reach) * _STEP
        found.append([*place, sunk[y, x].mean(), plain[y, x].mean()])
    return np.array(found)


def _depth(sunk: Floats) -> Floats:
    """How far from its rim the points of an area lie, mm: a pen's path is where it is deepest."""
    from scipy.ndimage import distance_transform_edt

    depth: Floats = distance_transform_edt(sunk, sampling=_STEP)
    return depth


def _peaks(height: Floats) -> Iterator[tuple[int, int]]:
    """Row and column of the highest peaks."""
    left = height.copy()
    for _ in range(_KEPT):
        row, column = (int(at) for at in np.unravel_index(left.argmax(), left.shape))
        yield row, column
        rows, columns = (slice(max(0, at - _APART), at + _APART + 1) for at in (row, column))
        left[rows, columns] = -np.inf
