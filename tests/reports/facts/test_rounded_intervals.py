import math

import pytest

from reports.facts import rounded, span


@pytest.mark.parametrize(
    ("value", "ends", "unit", "shown", "told"),
    [
        (21.19812, (21.18977, 21.20612), "mm", "21.198 mm", "21.190 to 21.206 mm"),
        (0.009711, (0.00857, 0.0111), "mm", "0.0097 mm", "0.0086 to 0.0111 mm"),
        (-59.5, (-59.5312, -59.4301), "%", "−59.50 %", "−59.53 to −59.43 %"),
        (2.0, (1.9604, 2.0304), "deg", "2.000°", "1.960 to 2.030°"),
        (5234.0, (4100.0, 6300.0), "1", "5200", "4100 to 6300"),
        (-1e-4, (-0.02, 0.05), "1", "0.000", "−0.020 to 0.050"),
        (1.0e-7, (0.9e-7, 1.23e-7), "1", "1.00 × 10⁻⁷", "9.0 × 10⁻⁸ to 1.23 × 10⁻⁷"),
        (1.23456, (math.nan, math.nan), "mm", "1.23 mm", "nan to nan mm"),
        (1.23456, (1.23456, 1.23456), "mm", "1.23 mm", "1.23 to 1.23 mm"),
    ],
)
def test_numbers_have_two_digits_of_the_width(
    value: float, ends: tuple[float, float], unit: str, shown: str, told: str
) -> None:
    assert rounded(value, ends, unit) == shown
    assert span(ends, unit) == told
