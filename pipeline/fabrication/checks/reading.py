"""Reads the id that is engraved on a part from its strokes, against the shapes of its letters.

Strokes of known length and direction vote for one height and one turn of the text; then every
letter is looked for. Slots may cut through letters, so not all of a letter has to be there.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import LineString

from pipeline.fabrication.font import text

Floats = NDArray[np.float64]

LEGIBLE = 0.6
"""Share of an id's strokes that has to be there."""

_WHOLE = 0.98  # of the strokes, with which no better reading is looked for
_NEAR = 0.02  # mm from a stroke
_SAMPLE = 0.1  # mm
_HEIGHTS = (1.9, 12.0)  # mm, of letters
_TURNS, _SIZES = 1e-3, 2e-3  # rad and mm: votes so near to each other are one
_BALLOTS = 20
_SPOTS_KEPT = 8
_MARK = 1.8  # mm, largest mark


def height(words: str, strokes: Sequence[Floats]) -> float | None:
    """Height of the letters of an id, mm; None if the strokes do not show it and a mark beside it.

    Args:
        words: the id.
        strokes: polylines (n, 2), mm: the id and the mark that tells how it stands.
    """
    drawn = _segments(strokes)
    glyphs = [text(letter, 1.0) for letter in words]
    whole = shapely.MultiLineString([stroke for stroke in strokes if len(stroke) > 1])
    best, most = None, LEGIBLE
    for size, turn in _ballots(drawn, np.concatenate([_segments(glyph) for glyph in glyphs])):
        spin = size * np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        letters = [[stroke @ spin for stroke in glyph] for glyph in glyphs]
        found, share = _read(letters, drawn, whole, spin)
        if share > most and _is_mark(whole.difference(found.buffer(2 * _NEAR))):
            best, most = size, share
        if most > _WHOLE:
            break
    return best


def _is_mark(rest: shapely.Geometry) -> bool:
    """Whether the strokes that belong to no letter can be one small mark."""
    if rest.is_empty:
        return False
    x0, y0, x1, y1 = rest.bounds
    return bool(max(x1 - x0, y1 - y0) < _MARK)


def _segments(strokes: Sequence[Floats]) -> Floats:
    """(n, 2, 2) starts and ends."""
    return np.concatenate([np.stack([stroke[:-1], stroke[1:]], axis=1) for stroke in strokes])


def _ballots(drawn: Floats, known: Floats) -> list[tuple[float, float]]:
    """Heights and turns of the text with most votes."""
    ours, theirs = (pair[:, 1] - pair[:, 0] for pair in (drawn, known))
    ratio = (ours[:, 0] + 1j * ours[:, 1])[:, None] / (theirs[:, 0] + 1j * theirs[:, 1])[None]
    votes = np.concatenate([ratio.ravel(), -ratio.ravel()])  # strokes may be drawn backwards
    sizes = np.abs(votes)
    votes = votes[(sizes > _HEIGHTS[0]) & (sizes < _HEIGHTS[1])]
    rounded = np.column_stack([np.abs(votes) / _SIZES, np.angle(votes) / _TURNS]).round()
    kinds, counts = np.unique(rounded, axis=0, return_counts=True)
    best = kinds[np.argsort(-counts, kind="stable")[:_BALLOTS]]
    return [(float(size) * _SIZES, float(turn) * _TURNS) for size, turn in best]


def _read(
    letters: Sequence[Sequence[Floats]], drawn: Floats, whole: shapely.Geometry, spin: Floats
) -> tuple[shapely.Geometry, float]:
    """The letters where they stand, in reading order, and the share of them that is there."""
    offers = [_spots(letter, drawn, whole) for letter in letters]
    lengths = np.array([shapely.MultiLineString(letter).length for letter in letters])
    best, most = np.zeros((0, 2)), 0.0
    for chosen in product(*offers):
        share = float(np.dot([there for there, _ in chosen], lengths) / lengths.sum())
        spots = np.array([spot for _, spot in chosen])
        if share > most and _ordered(spots @ np.linalg.inv(spin)):
            best, most = spots, share
    lines = [one + at for at, letter in zip(best, letters, strict=False) for one in letter]
    return shapely.MultiLineString(lines), most


def _spots(
    letter: Sequence[Floats], drawn: Floats, whole: shapely.Geometry
) -> list[tuple[float, Floats]]:
    """Where a letter may be, and how much of it is there; the best places.

    A stroke of the letter, or what a slot leaves of it, is drawn from its start or to its end.
    """
    own = _segments(letter)
    both = np.concatenate([drawn, drawn[:, ::-1]])
    ours, theirs = both[:, 1] - both[:, 0], own[:, 1] - own[:, 0]
    lengths = np.linalg.norm(theirs, axis=-1)
    aside = ours[:, None, 0] * theirs[None, :, 1] - ours[:, None, 1] * theirs[None, :, 0]
    reach = (ours[:, None] * theirs[None]).sum(axis=-1) / lengths
    fits = (np.abs(aside) < _NEAR * lengths) & (reach > _SAMPLE) & (reach < lengths + _NEAR)
    places = np.concatenate([(both[:, None] - own[None])[fits][:, end] for end in (0, 1)])
    places = np.unique(np.round(places, 2), axis=0)
    points = np.concatenate([shapely.get_coordinates(_finely(one)) for one in letter])
    near = shapely.distance(shapely.points(places[:, None] + points[None]), whole) < 2 * _NEAR
    order = np.argsort(-near.mean(axis=1), kind="stable")[:_SPOTS_KEPT]
    return [(float(near[at].mean()), places[at]) for at in order]


def _finely(stroke: Floats) -> shapely.Geometry:
    return shapely.segmentize(LineString(stroke), _SAMPLE)


def _ordered(centres: Floats) -> bool:
    """Whether letters follow each other to the right or downwards, in heights."""
    steps = np.diff(centres, axis=0)
    return bool((steps[:, 0] > 0.5).all() or (steps[:, 1] < -0.9).all())
