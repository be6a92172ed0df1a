"""Sets the numbers on axes: powers of ten, minus signs, and none that is wider than its room."""

import re

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.ticker import FixedFormatter

WIDEST = 6.3
"""Width of a number beyond which its power of ten goes into the label of the axis, mm."""
WIDEST_OF_BAR = 5.5
"""The same of a bar of colours at the right edge of a figure, mm."""
_DIGIT, _OTHERS = 1.35, {".": 0.67, "−": 1.77}
"""Widths of the characters of numbers on axes, mm."""
DECADES = 1e3
"""Ratio of a logarithmic axis' limits above which powers of ten alone have numbers."""
_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_UNIT = re.compile(r"\(([^()]*)\)$")
_PREFIXED = {
    ("mm", -3): "µm", ("mm", -6): "nm", ("mm", 3): "m",
    ("N", -3): "mN", ("N", -6): "µN", ("N", 3): "kN", ("N", 6): "MN",
    ("N/m", -3): "mN/m", ("N/m", -6): "µN/m", ("N/m", 3): "kN/m", ("N/m", 6): "MN/m",
    ("s", -3): "ms", ("s", -6): "µs",
}  # fmt: skip
"""Units by unit and power of ten; powers of others are written out."""


def typeset(text: str) -> str:
    """Sets a number that Python has written: powers of ten, minus sign."""
    if "e" in text:
        mantissa, exponent = text.split("e")
        text = f"{mantissa} × {_ten_to(int(exponent))}"
    return text.replace("-", "−")


def is_power(value: float) -> bool:
    """Tests if a number is a power of ten."""
    return f"{value:.0e}".startswith("1e")


def scale_wide_numbers(axes: Axes, widest: float = WIDEST) -> int:
    """Takes the power of ten out of wide numbers on both axes, into their labels.

    It is called when the limits are final; `widest` is the room for a number, mm. A logarithmic
    axis of many decades has powers of ten.

    Returns:
        The exponent of what was taken out of the y axis.
    """
    _scale(axes.xaxis, widest)
    return _scale(axes.yaxis, widest)


def _scale(axis: Axis, widest: float) -> int:
    formatter = axis.get_major_formatter()
    low, high = np.sort(axis.get_view_interval())
    shown = [at for at in axis.get_majorticklocs() if low <= at <= high]
    if isinstance(formatter, FixedFormatter) or not np.any(shown):
        return 0
    if max(map(_width, formatter.format_ticks(shown))) <= widest and not formatter.get_offset():
        return 0
    if axis.get_scale() == "log" and high > DECADES * low:
        axis.set_major_formatter(lambda value, _: _power(value) if is_power(value) else "")
        return 0
    exponent = 3 * int(np.floor(np.log10(np.abs(shown).max()) / 3.0))
    if exponent == 0:
        axis.labelpad = 0.0
    else:
        axis.set_major_formatter(lambda value, _: typeset(f"{value / 10.0**exponent + 0.0:g}"))
        axis.set_label_text(_scaled_label(axis.get_label_text(), exponent))
    return exponent


def _width(number: str) -> float:
    return sum(_OTHERS.get(letter, _DIGIT) for letter in number)


def _scaled_label(label: str, exponent: int) -> str:
    """Puts a power of ten into a label, before its unit if it has one."""
    if (found := _UNIT.search(label)) is None:
        return f"{label} ({_ten_to(exponent)})"
    unit = _PREFIXED.get((found[1], exponent), f"{_ten_to(exponent)} {found[1]}")
    return f"{label[: found.start()]}({unit})"


def _power(value: float) -> str:
    return _ten_to(round(np.log10(value)))


def _ten_to(exponent: int) -> str:
    return f"10{str(exponent).translate(_SUPERSCRIPT)}"
