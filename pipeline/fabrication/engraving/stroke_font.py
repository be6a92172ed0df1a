"""Draws ids in a font of single strokes, to be engraved or embossed."""

from __future__ import annotations

import numpy as np

from pipeline.fabrication.parts import Strokes
from sim.core import Floats

_GLYPHS = {
    "0": "01 05 16 36 45 41 30 10 01,12 34",
    "1": "14 26 20,10 30",
    "2": "05 16 36 45 44 00 40",
    "3": "06 46 23 33 42 41 30 10 01",
    "4": "30 36 02 42",
    "5": "46 06 03 33 42 41 30 10 01",
    "6": "45 36 16 05 01 10 30 41 42 33 13 02",
    "7": "06 46 10",
    "8": "13 04 05 16 36 45 44 33 13 02 01 10 30 41 42 33",
    "9": "01 10 30 41 45 36 16 05 04 13 33 44",
    "A": "00 04 26 44 40,02 42",
    "B": "00 06 36 45 44 33 03,33 42 41 30 00",
    "C": "45 36 16 05 01 10 30 41",
    "D": "00 06 26 44 42 20 00",
    "E": "46 06 00 40,03 33",
    "F": "46 06 00,03 33",
    "G": "45 36 16 05 01 10 30 41 43 23",
    "H": "00 06,40 46,03 43",
    "I": "10 30,16 36,20 26",
    "J": "01 10 30 41 46",
    "K": "00 06,46 02,13 40",
    "L": "06 00 40",
    "M": "00 06 23 46 40",
    "N": "00 06 40 46",
    "O": "01 05 16 36 45 41 30 10 01",
    "P": "00 06 36 45 44 33 03",
    "Q": "01 05 16 36 45 41 30 10 01,22 40",
    "R": "00 06 36 45 44 33 03,23 40",
    "S": "45 36 16 05 04 13 33 42 41 30 10 01",
    "T": "06 46,26 20",
    "U": "06 01 10 30 41 46",
    "V": "06 20 46",
    "W": "06 10 23 30 46",
    "X": "00 46,06 40",
    "Y": "06 23 46,23 20",
    "Z": "06 46 00 40",
    "a": "34 30,32 23 13 02 01 10 20 31",
    "b": "06 00,02 13 23 32 31 20 10 01",
    ".": "20 21",
    "-": "13 33",
}
"""Polylines of points (x, y) on a grid of 4 by 6; the zero is crossed."""

_WIDTH = 0.45  # of a letter over its height
ADVANCE = 0.7  # from letter to letter
STACK = 1.3  # from line to line, where letters stand below each other


def text_strokes(words: str, height: float, *, stacked: bool = False) -> Strokes:
    """Draws a line of text, or letters below each other, centred at the origin.

    Raises:
        KeyError: there is no such letter.
    """
    step = np.array([0.0, -STACK] if stacked else [ADVANCE, 0.0])
    scale = np.array([_WIDTH / 4, 1 / 6])
    strokes = [
        (grid_points(line) * scale + index * step) * height
        for index, letter in enumerate(words)
        for line in _GLYPHS[letter].split(",")
    ]
    full = step * (len(words) - 1) * height
    middle = (np.array([_WIDTH, 1.0]) * height + full) / 2
    return tuple(stroke - middle for stroke in strokes)


def grid_points(line: str) -> Floats:
    """Parses the points of a glyph's line, which are written as pairs of digits."""
    return np.array([[float(digit) for digit in point] for point in line.split()])


def text_extent(words: str, height: float, *, stacked: bool = False) -> tuple[float, float]:
    """Measures width and height of a text."""
    more = len(words) - 1
    if stacked:
        return _WIDTH * height, (1 + more * STACK) * height
    return (_WIDTH + more * ADVANCE) * height, height


def transformed(strokes: Strokes, angle: float, centre: tuple[float, float]) -> Strokes:
    """Turns strokes about the origin by an angle in rad, then moves them."""
    cosine, sine = np.cos(angle), np.sin(angle)
    turn = np.array([[cosine, sine], [-sine, cosine]])
    return tuple(stroke @ turn + np.array(centre) for stroke in strokes)
