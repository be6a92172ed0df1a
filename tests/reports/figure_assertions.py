"""What a drawn figure shows: its texts, and where they are."""

import io
from itertools import combinations

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox


def drawn(made: Figure) -> Figure:
    """The figure, laid out."""
    FigureCanvasAgg(made).print_raw(io.BytesIO())  # type: ignore[no-untyped-call]
    return made


def texts(made: Figure) -> list[Text]:
    """Texts that are visible."""
    found = made.findobj(lambda artist: isinstance(artist, Text) and artist.get_visible())
    return [text for text in found if isinstance(text, Text) and text.get_text().strip()]


def words(made: Figure) -> set[str]:
    """What they say."""
    return {text.get_text() for text in texts(made)}


def shown(made: Figure) -> list[tuple[str, Bbox]]:
    """Texts with their extents in pixels, but for ticks beyond the axes or of hidden axes."""
    every = [axes for parent in made.axes for axes in (parent, *parent.child_axes)]
    clipped = {
        id(label)
        for axes in every
        for axis in (axes.xaxis, axes.yaxis)
        for tick in axis.get_major_ticks() + axis.get_minor_ticks()
        if not (axes.axison and _within(tick.get_loc(), axis.get_view_interval()))
        for label in (tick.label1, tick.label2)
    }
    kept = [text for text in texts(made) if id(text) not in clipped and text.get_text() != "DRAFT"]
    return [(text.get_text(), text.get_window_extent()) for text in kept]


def _within(value: float, limits: tuple[float, float]) -> bool:
    low, high = np.sort(limits)
    slack = 1e-9 * (high - low)
    return bool(low - slack <= value <= high + slack)


def assert_legible(made: Figure) -> None:
    """No text is cut by the page or overlaps another; type and size are a journal's."""
    boxes = shown(made)
    for text, box in boxes:
        inside = box.x0 >= 0 and box.y0 >= 0 and box.x1 <= made.bbox.x1 and box.y1 <= made.bbox.y1
        assert inside, text
    for (first, a), (second, b) in combinations(boxes, 2):
        assert not a.overlaps(b.shrunk(0.9, 0.9)), (first, second)
    assert {text.get_fontsize() for text in texts(made)} <= {6.0, 7.0, 7.5, 9.0, 110.0}
    width, height = made.get_size_inches() * 25.4
    assert abs(width - 178.0) < 1e-9
    assert height < 235.0
