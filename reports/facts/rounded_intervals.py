"""Rounds numbers and the intervals that they lie in to the digits that these tell."""

import math
from collections.abc import Sequence

from reports.facts.fact_records import printed, worded
from sim.core import Floats

_DIGITS = 2
"""Of an interval's width."""
_LONGEST = 6
"""Places behind the point, beyond which powers of ten are written."""

Ends = Sequence[float] | Floats


def rounded(value: float, ends: Ends, unit: str = "1") -> str:
    """Rounds a number to two digits of an interval's width, zeros kept; to three without one."""
    low, high = ends
    width = abs(float(high) - float(low))
    if not (math.isfinite(value) and math.isfinite(width) and width > 0.0):
        return worded(value, unit, 3)
    places = _DIGITS - 1 - math.floor(math.log10(width))
    number = round(float(value), places) + 0.0  # no minus before zero
    if places <= _LONGEST:
        return printed(f"{number:.{max(places, 0)}f}", unit)
    size = math.floor(math.log10(abs(number))) if number else -places
    return printed(f"{number:.{size + places}e}", unit)


def span(ends: Ends, unit: str = "1") -> str:
    """Tells both ends of an interval in words, rounded by its width."""
    low, high = ends
    return f"{rounded(low, ends)} to {rounded(high, ends, unit)}"
