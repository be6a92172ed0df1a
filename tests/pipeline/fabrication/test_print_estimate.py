"""Print time and filament of parts by hand; tests/clients compares whole plates with a slicer."""

import pytest
from shapely import box

from pipeline.fabrication.parts import Layer, PrintedPart
from pipeline.fabrication.plates import STRAND, estimate_print


def block(side: float, height: float = 6.0) -> PrintedPart:
    return PrintedPart("A1", (Layer(box(0.0, 0.0, side, side), 0.0, height),))


def test_a_solid_block_takes_its_volume() -> None:
    found = estimate_print([block(30.0)], 1.0)
    assert found.filament * STRAND == pytest.approx(30.0**2 * 6.0, rel=0.01)


def test_infill_saves_what_is_far_from_top_and_bottom() -> None:
    """Inside three perimeters, but for three layers of 0.3 mm at both ends."""
    inside = (30.0 - 6 * 0.3856) ** 2 * (6.0 - 6 * 0.3)
    solid, sparse = (estimate_print([block(30.0)], share) for share in (1.0, 0.25))
    saved = (solid.filament - sparse.filament) * STRAND
    assert saved == pytest.approx(0.75 * inside, rel=0.01)
    assert sparse.seconds < solid.seconds


@pytest.mark.parametrize("side", [0.3, 1.0, 2.2])
def test_a_part_without_an_inside_is_its_perimeters(side: float) -> None:
    one, other = (estimate_print([block(side)], share) for share in (0.0, 1.0))
    assert one == other
    assert one.seconds > 0.0


def test_a_plate_takes_what_its_parts_take() -> None:
    one, two = estimate_print([block(10.0)], 0.5), estimate_print([block(10.0)] * 2, 0.5)
    assert two == pytest.approx((2 * one.seconds, 2 * one.filament))
