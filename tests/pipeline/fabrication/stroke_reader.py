"""Reads the id that is engraved on a part from its strokes, against the shapes of its letters.

Strokes of known length and direction vote for one height and one turn of the text; then every
letter is looked for. Slots may cut through letters, so not all of a letter has to be there.
"""

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
import shapely
from shapely import LineString
from shapely.geometry.base import BaseGeometry

from pipeline.fabrication.engraving import text_strokes
from sim.core import Floats

_LEAST = 2.0  # mm, height of letters below which they cannot be read
_LEGIBLE = 0.6  # share of an id that has to be there
_WHOLE = 0.98  # of the strokes, with which no better height is looked for
_TURNED = 0.01  # rad; turns nearer to each other, or to half a turn, go together
_NEAR = 0.02  # mm from a stroke
_SAMPLE = 0.1  # mm
_SPECK = 0.15  # mm; shorter pieces are ends of letters
_HEIGHTS = (1.9, 12.0)  # mm, of letters
_TURNS, _SIZES = 1e-3, 2e-3  # rad and mm: votes so near to each other are one
_TURNS_KEPT, _SIZES_KEPT = 6, 3
_SPOTS_KEPT = 8
_AHEAD, _BELOW = 0.5, -0.9  # heights from letter to letter, at least
_MARK = 1.8  # mm, largest mark


def read(words: str, strokes: Sequence[Floats]) -> float | None:
    """Reads the height of an id, mm; None if the strokes do not show it and a mark beside it."""
    lines = [stroke - strokes[0][0] for stroke in strokes]  # the same wherever the text stands
    drawn = _segments(lines)
    glyphs = [text_strokes(letter, 1.0) for letter in words]
    whole = shapely.MultiLineString(lines)
    shapely.prepare(whole)
    best, most, upright = None, _LEGIBLE, 0.0
    for size, turn in _ballots(drawn, np.concatenate([_segments(glyph) for glyph in glyphs])):
        if best is not None and (most > _WHOLE or abs(np.sin(turn - upright)) > _TURNED):
            break  # no better one is to be expected, upright or upside down
        spin = size * np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        letters = [[stroke @ spin for stroke in glyph] for glyph in glyphs]
        found, share = _read(letters, drawn, whole, spin)
        if share > most and _is_mark(whole.difference(found.buffer(2 * _NEAR))):
            best, most, upright = size, share, turn
    return best


def _is_mark(rest: BaseGeometry) -> bool:
    """Tests that the strokes that belong to no letter can be one small mark."""
    pieces = [piece for piece in shapely.get_parts(rest) if piece.length > _SPECK]
    if not pieces:
        return False
    x0, y0, x1, y1 = shapely.total_bounds(pieces)
    return bool(max(x1 - x0, y1 - y0) < _MARK)


def _segments(strokes: Sequence[Floats]) -> Floats:
    """Lists starts and ends (n, 2, 2)."""
    return np.concatenate([np.stack([stroke[:-1], stroke[1:]], axis=1) for stroke in strokes])


def _ballots(drawn: Floats, known: Floats) -> Iterator[tuple[float, float]]:
    """Yields heights and turns of the text, those with most votes first; of cut strokes, turns."""
    ours, theirs = (pair[:, 1] - pair[:, 0] for pair in (drawn, known))
    ratio = (ours[:, 0] + 1j * ours[:, 1])[:, None] / (theirs[:, 0] + 1j * theirs[:, 1])[None]
    votes = np.concatenate([ratio.ravel(), -ratio.ravel()])  # strokes may be drawn backwards
    turns = np.round(np.angle(votes) / _TURNS)
    sizes = np.round(np.abs(votes) / _SIZES)
    possible = (np.abs(votes) > _HEIGHTS[0]) & (np.abs(votes) < _HEIGHTS[1])
    for turn in _commonest(turns, _TURNS_KEPT):
        for size in _commonest(sizes[possible & (turns == turn)], _SIZES_KEPT):
            yield size * _SIZES, turn * _TURNS
        yield _LEAST, turn * _TURNS


def _commonest(votes: Floats, count: int) -> list[float]:
    """Lists the values with most votes, the largest of those with as many first."""
    kinds, counts = np.unique(votes, return_counts=True)
    return [float(kind) for kind in kinds[np.lexsort((-kinds, -counts))[:count]]]


def _read(
    letters: Sequence[Sequence[Floats]], drawn: Floats, whole: shapely.Geometry, spin: Floats
) -> tuple[shapely.Geometry, float]:
    """Finds the letters where they stand, in reading order, and the share of them that is there."""
    lengths = [shapely.MultiLineString(letter).length for letter in letters]
    offers = [_spots(letter, drawn, whole) for letter in letters]
    if not all(len(places) for places, _ in offers):
        return shapely.MultiLineString(), 0.0
    upright = [places @ np.linalg.inv(spin) for places, _ in offers]
    weights = [there * length for (_, there), length in zip(offers, lengths, strict=True)]
    taken, weight = _in_order(upright, weights)
    lines = [
        stroke + places[at]
        for at, letter, (places, _) in zip(taken, letters, offers, strict=False)
        for stroke in letter
    ]
    return shapely.MultiLineString(lines), weight / sum(lengths)


def _spots(
    letter: Sequence[Floats], drawn: Floats, whole: shapely.Geometry
) -> tuple[Floats, Floats]:
    """Finds where a letter may be (n, 2), and how much of it is there (n,); the best places."""
    own = _segments(letter)
    both = np.concatenate([drawn, drawn[:, ::-1]])
    ours, theirs = both[:, 1] - both[:, 0], own[:, 1] - own[:, 0]
    lengths = np.linalg.norm(theirs, axis=-1)
    aside = ours[:, None, 0] * theirs[None, :, 1] - ours[:, None, 1] * theirs[None, :, 0]
    reach = (ours[:, None] * theirs[None]).sum(axis=-1) / lengths
    fits = (np.abs(aside) < _NEAR * lengths) & (reach > _SAMPLE) & (reach < lengths + _NEAR)
    places = np.concatenate([(both[:, None] - own[None])[fits][:, end] for end in (0, 1)])
    places = np.unique(np.round(places, 2), axis=0)
    points = shapely.get_coordinates(shapely.segmentize([LineString(s) for s in letter], _SAMPLE))
    near = shapely.dwithin(whole, shapely.points(places[:, None] + points[None]), 2 * _NEAR)
    there = near.mean(axis=1)
    order = np.argsort(-there, kind="stable")[:_SPOTS_KEPT]
    return places[order], there[order]


def _in_order(places: Sequence[Floats], weights: Sequence[Floats]) -> tuple[list[int], float]:
    """Finds the heaviest choice of a place (n, 2) for each letter, on a line or one by one."""
    choices: list[tuple[list[int], float]] = [([], 0.0)]
    for below in (False, True):
        sums, before = weights[0], []
        for (first, second), weight in zip(pairwise(places), weights[1:], strict=True):
            steps = second[None] - first[:, None]
            follows = steps[..., 1] < _BELOW if below else steps[..., 0] > _AHEAD
            ways = np.where(follows, sums[:, None], -np.inf)
            before.append(ways.argmax(axis=0))
            sums = ways.max(axis=0) + weight
        taken = [int(sums.argmax())]
        for way in reversed(before):
            taken.append(int(way[taken[-1]]))
        choices.append((taken[::-1], float(sums.max())))
    return max(choices, key=lambda choice: choice[1])
