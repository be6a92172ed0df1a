"""Draws ids in a font of single strokes, to be engraved or embossed."""

from pathlib import Path

import numpy as np
import yaml

from pipeline.fabrication.parts import Strokes
from sim.core import Floats

_GLYPHS: dict[str, str] = yaml.safe_load(Path(__file__).with_suffix(".yaml").read_bytes())

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
