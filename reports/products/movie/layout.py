"""Tells where everything stands in the frames of a movie, and what does not move in them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from numpy.typing import NDArray

from reports.base import style
from reports.panels import COLOUR_MAPS, Animation, AnimationClip, ColourField
from sim.core import Image

WIDTH, HEIGHT = 1280, 720
"""Of a frame, pixels."""
DPI = 144
TOP, BOTTOM, SIDE, BAR = 84, 34, 44, 100
"""Bands of a frame that hold words and the bar of colours, pixels."""
MOST_COLUMNS = 4


class MovieCell(NamedTuple):
    """Describes one structure under one load case, at `row` and `column`."""

    clip: AnimationClip
    case: int
    row: int
    column: int


@dataclass(frozen=True)
class MovieLayout:
    """Describes the cells, and how millimetres become pixels in them."""

    cells: list[MovieCell]  # what moves
    shape: tuple[int, int]  # rows and columns
    pixels: tuple[float, float]  # size of a cell
    scale: float  # pixels per mm
    corner: NDArray[np.float64]  # (2,) lowest x and highest y that a cell shows, mm
    above: float  # room between a cell's top and its structure, pixels

    def origin(self, cell: MovieCell) -> NDArray[np.float64]:
        """Tells where a cell's corner lies in the frame (x, y), pixels."""
        return np.array(
            [SIDE + cell.column * self.pixels[0], TOP + cell.row * self.pixels[1]], dtype=float
        )


def layout(reel: Animation) -> MovieLayout:
    """Places load cases in columns and structures in rows; of a single case, side by side."""
    several = len(reel.cases) > 1
    columns = len(reel.cases) if several else min(len(reel.clips), MOST_COLUMNS)
    cells = [
        MovieCell(clip, case, *((k, case) if several else divmod(k, columns)))
        for k, clip in enumerate(reel.clips)
        for case in range(len(reel.cases))
        if np.isfinite(clip.motion[case]).any()
    ]
    rows = 1 + max(cell.row for cell in cells)
    pixels = ((WIDTH - SIDE - BAR) / columns, (HEIGHT - TOP - BOTTOM) / rows)
    low, high = _extent(reel.clips)
    tall = 0.96 if several else 0.88  # leaves room for the name above it
    size = high - low
    scale = min(0.96 * pixels[0] / size[0], tall * pixels[1] / size[1])
    spare = (np.array(pixels) / scale - size) / 2
    corner = np.array([low[0] - spare[0], high[1] + spare[1]])
    return MovieLayout(cells, (rows, columns), pixels, scale, corner, float(spare[1] * scale))


def _extent(clips: Sequence[AnimationClip]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    points = np.concatenate([clip.structure.vertices.reshape(-1, 2) for clip in clips])
    return np.nanmin(points, axis=0) - 4.0, np.nanmax(points, axis=0) + 4.0


def background(reel: Animation, placed: MovieLayout, title: str, note: str) -> Image:
    """Returns a frame (rows, columns, 3) with the words and the bar of colours."""
    with style.styled():
        figure = Figure(figsize=(WIDTH / DPI, HEIGHT / DPI), dpi=DPI)
        _write(
            figure, 14, 12, style.literal(title), fontsize=style.PANEL, fontweight="bold", va="top"
        )
        _write(figure, 14, HEIGHT - 8, note, fontsize=style.SMALL, va="bottom", color=style.GREY)
        _names(figure, reel, placed)
        _bar(figure, reel.fields[0])
        return rendered(figure)


def rendered(figure: Figure) -> Image:
    """Returns pixels (rows, columns, 3) of a figure."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()  # type: ignore[no-untyped-call]
    pixels = canvas.buffer_rgba()  # type: ignore[no-untyped-call]
    return np.asarray(pixels)[..., :3].copy()


def _names(figure: Figure, reel: Animation, placed: MovieLayout) -> None:
    several = len(reel.cases) > 1
    wide, high = placed.pixels
    for column, label in enumerate(reel.cases if several else ()):
        x = SIDE + (column + 0.5) * wide
        _write(figure, x, TOP - 8, label, ha="center", va="bottom", fontsize=style.TITLE)
    for cell in placed.cells:
        x, y = placed.origin(cell)
        told: dict[str, Any] = {"color": cell.clip.colour, "fontsize": style.TEXT}
        if not several:
            at = (x + wide / 2, y + placed.above - 2)
            _write(figure, *at, cell.clip.name, ha="center", va="bottom", **told)
    for row, clip in enumerate(reel.clips if several else ()):
        words = clip.name.replace(", ", ",\n")
        y = TOP + (row + 0.5) * high
        _write(
            figure, SIDE / 2, y, words, rotation=90, ha="center", va="center", color=clip.colour,
            multialignment="center", fontsize=style.SMALL,
        )  # fmt: skip


def _bar(figure: Figure, field: ColourField) -> None:
    left, top, high = WIDTH - BAR + 14, TOP + 40, HEIGHT - TOP - BOTTOM - 80
    axes = figure.add_axes((left / WIDTH, 1 - (top + high) / HEIGHT, 14 / WIDTH, high / HEIGHT))
    colours = ScalarMappable(Normalize(*field.limits), COLOUR_MAPS[field.colours])
    unit = f" ({field.unit})" if field.unit else ""
    figure.colorbar(colours, cax=axes).set_label(field.label.replace("u_y", "$u_y$") + unit)
    axes.tick_params(length=2)


def _write(figure: Figure, x: float, y: float, text: str, **told: str | float) -> None:
    settings: dict[str, Any] = dict(told)
    figure.text(x / WIDTH, 1 - y / HEIGHT, text, **settings)
