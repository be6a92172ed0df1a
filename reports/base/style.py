"""Describes one plotting style for every figure: millimetres, fonts, colours, reproducible files.

Figures are laid out in millimetres from the top-left corner of the page, so a panel has the size
that it will have in print. Colour maps are straight in lightness and even in OKLab (Ottosson
2020), hence readable in grey and with any colour vision. Saved files carry no date.
"""

import io
import logging
import re
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from string import ascii_lowercase
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Colormap, ListedColormap, to_rgb
from matplotlib.figure import Figure
from matplotlib.font_manager import fontManager
from matplotlib.text import Annotation
from matplotlib.ticker import LogLocator, NullFormatter

from reports.base.axis_numbers import DECADES, is_power, typeset
from sim.core import Floats

LOG = logging.getLogger(__name__)

TWO_COLUMNS = 178.0
"""Width of a journal's two columns, mm."""

MM_PER_INCH = 25.4

INTACT, ALTERED, CLOAKED = "#1a1a1a", "#e07b00", "#6f3fa0"
STRUCTURE_COLOURS = {"intact": INTACT, "reference": INTACT, "altered": ALTERED, "cloaked": CLOAKED}
METHOD_COLOURS = {"sqp": CLOAKED, "mma": "#1d7f78"}
GREY, PALE = "#6b6f75", "#d4d7db"

RC = mpl.rc_params_from_file(Path(__file__).with_name("paper.mplstyle"), use_default_template=False)
TEXT, SMALL, TITLE = RC["font.size"], RC["legend.fontsize"], RC["axes.titlesize"]
PANEL = 9.0
"""Font sizes in points: labels, ticks and notes, titles, panel letters."""

FALLBACKS = (
    "Noto Sans CJK SC", "Noto Sans CJK JP", "Noto Sans SC", "Source Han Sans SC",
    "Source Han Sans CN", "WenQuanYi Micro Hei", "WenQuanYi Zen Hei", "Microsoft YaHei", "SimHei",
    "PingFang SC", "PingFang HK", "Hiragino Sans GB", "Heiti TC", "STHeiti", "Hiragino Sans",
    "Yu Gothic", "Malgun Gothic", "Apple SD Gothic Neo", "Arial Unicode MS", "Droid Sans Fallback",
    "Unifont",
)  # fmt: skip
"""Fonts of Linux, Windows and macOS with Chinese, Japanese or Korean characters."""
_NO_GLYPH = re.compile(r"Glyph (\d+) .*missing from font")

_METADATA: dict[str, dict[str, str | None]] = {
    "pdf": {"Creator": "metacloak", "Producer": None, "CreationDate": None},
    "svg": {"Creator": "metacloak", "Date": None},
    "png": {"Software": None},
}

_TO_LMS = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
_TO_LAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)


def tinted(colour: str, white: float) -> tuple[float, ...]:
    """Mixes a colour with a share of white."""
    return tuple((1.0 - white) * part + white for part in to_rgb(colour))


def oklab(rgb: Floats) -> Floats:
    """Returns OKLab coordinates (..., 3) of sRGB colours (..., 3) in [0, 1]."""
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    return np.cbrt(linear @ _TO_LMS.T) @ _TO_LAB.T


def srgb(lab: Floats) -> Floats:
    """Returns SRGB colours (..., 3), clipped to [0, 1], of OKLab coordinates (..., 3)."""
    linear = ((lab @ np.linalg.inv(_TO_LAB).T) ** 3) @ np.linalg.inv(_TO_LMS).T
    linear = np.clip(linear, 0.0, 1.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def colour_map(name: str, anchors: Sequence[str], levels: int = 256) -> Colormap:
    """Finds colour map through `anchors` with equal OKLab distance between neighbouring levels."""
    return ListedColormap(_even_path(anchors, levels), name=name).with_extremes(bad="white")


def two_sided(name: str, low: Sequence[str], high: Sequence[str]) -> Colormap:
    """Returns colour map of two even halves that meet in the first anchor of both."""
    halves = [_even_path(anchors, 129) for anchors in (low, high)]
    return ListedColormap(
        np.concatenate([halves[0][:0:-1], halves[1][1:]]), name=name
    ).with_extremes(bad="white")


def _even_path(anchors: Sequence[str], levels: int) -> Floats:
    corners = oklab(np.array([to_rgb(anchor) for anchor in anchors]))
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    way = np.concatenate([[0.0], np.cumsum(lengths)]) / lengths.sum()
    at = np.linspace(0.0, 1.0, levels)
    path = np.column_stack([np.interp(at, way, corners[:, k]) for k in range(3)])
    return srgb(path)


MAGNITUDE = colour_map("magnitude", ["#eceff1", "#8cc4d2", "#2f86b4", "#17427f", "#0c1538"])
"""From rest (pale) to large (dark): |U|, J and other sizes."""

SIGNED = two_sided("signed", ["#efefee", "#5b9fce", "#0d3b70"], ["#efefee", "#d9895f", "#6d1d0b"])
"""Symmetric about zero (pale): u_x, u_y, theta."""


@contextmanager
def styled() -> Iterator[None]:
    """Matplotlib's settings of this style, on top of its defaults, whatever the user's own are.

    What the style's font lacks is taken from the first font here that has it.
    """
    with mpl.rc_context(), _missing_glyphs():
        mpl.rcdefaults()
        mpl.rcParams.update(RC)
        here = set(fontManager.get_font_names())
        mpl.rcParams["font.family"] += [name for name in FALLBACKS if name in here]
        yield


@contextmanager
def _missing_glyphs() -> Iterator[None]:
    """Warns once of characters that no font has, in the place of a warning for each."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.filterwarnings("always", _NO_GLYPH.pattern)
        yield
    missing: dict[str, None] = {}
    for each in caught:
        if found := _NO_GLYPH.match(str(each.message)):
            missing[chr(int(found[1]))] = None
        else:
            warnings.warn_explicit(each.message, each.category, each.filename, each.lineno)
    if missing:
        LOG.warning(
            "no font here has %s: boxes stand for them in pictures; install a font that has them,"
            " such as Noto Sans CJK (Debian: fonts-noto-cjk), then remove %s",
            "".join(missing),
            f"{mpl.get_cachedir()}/fontlist-*.json",
        )


def page(height: float, width: float = TWO_COLUMNS) -> Figure:
    """Makes an empty figure of width x height mm."""
    return Figure(figsize=(width / MM_PER_INCH, height / MM_PER_INCH))


def place(figure: Figure, left: float, top: float, width: float, height: float) -> Axes:
    """Returns axes whose frame lies `left`, `top` mm from the page's top-left corner."""
    inches_wide, inches_high = figure.get_size_inches()
    page_width, page_height = inches_wide * MM_PER_INCH, inches_high * MM_PER_INCH
    bottom = page_height - top - height
    return figure.add_axes(
        (left / page_width, bottom / page_height, width / page_width, height / page_height)
    )


def write(figure: Figure, left: float, top: float, text: str, **style: str | float) -> None:
    """Writes text whose top-left corner lies `left`, `top` mm from the page's top-left corner."""
    inches_wide, inches_high = figure.get_size_inches()
    settings: dict[str, Any] = {"ha": "left", "va": "top"} | style
    x, y = left / (inches_wide * MM_PER_INCH), 1 - top / (inches_high * MM_PER_INCH)
    figure.text(x, y, text, **settings)


def literal(text: str) -> str:
    """Returns the words of a user as they stand: a dollar begins no formula."""
    return text.replace("$", r"\$")


def write_upwards(figure: Figure, left: float, top: float, text: str, **style: str | float) -> None:
    """Writes text that runs upwards; `left`, `top` mm are the middle of its right side."""
    settings: dict[str, Any] = {"ha": "right", "va": "center", "multialignment": "center"}
    write(figure, left, top, text, **(settings | {"rotation": 90, "fontsize": TEXT} | style))


def note(
    axes: Axes,
    at: tuple[float, float],
    text: str,
    shift: tuple[float, float] = (0, 1.5),
    **style: str | float | tuple[str, str],
) -> Annotation:
    """Writes a small text beside a point, `shift` points from it."""
    settings: dict[str, Any] = {"ha": "center", "va": "bottom", "fontsize": SMALL} | style
    return axes.annotate(text, at, xytext=shift, textcoords="offset points", **settings)


def log_values(axes: Axes) -> None:
    """Makes the y axis logarithmic, with plain numbers; what is not positive is left out.

    Over more than three decades these alone have numbers: all would be many, and long.
    """

    def number(value: float, _: float) -> str:
        low, high = axes.get_ylim()
        named = high <= DECADES * low or is_power(value)
        return typeset(f"{value:g}").removeprefix("1 × ") if named else ""

    axes.set_yscale("log", nonpositive="mask")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0), numticks=12))
    axes.yaxis.set_major_formatter(number)
    axes.yaxis.set_minor_formatter(NullFormatter())


def short_numbers(axes: Axes) -> None:
    """Takes the power of ten out of numbers on the y axis that are all small, or large."""
    axes.ticklabel_format(axis="y", style="sci", scilimits=(-2, 4))


def numbered_letter(number: int) -> str:
    """Returns the letter of a panel by its number from zero: a to z, then aa, ab and so on."""
    first, last = divmod(number, len(ascii_lowercase))
    return (numbered_letter(first - 1) if first else "") + ascii_lowercase[last]


def letter(figure: Figure, left: float, top: float, name: str, title: str = "") -> None:
    """Draws bold panel letter, and its title beside it."""
    write(figure, left, top, name, fontsize=PANEL, fontweight="bold")
    write(figure, left + 4.2, top + 0.45, title, fontsize=TITLE)


def save(figure: Figure, stem: Path, dpi: int = 300) -> list[Path]:
    """Writes stem.pdf, stem.svg and stem.png; the same figure gives the same bytes."""
    paths = []
    for suffix, metadata in _METADATA.items():
        path = stem.with_suffix(f".{suffix}")
        drawn = io.BytesIO()  # a full disk must not meet the compressor of a PDF
        figure.savefig(drawn, format=suffix, dpi=dpi, metadata=metadata)
        path.write_bytes(drawn.getvalue())
        paths.append(path)
    return paths
