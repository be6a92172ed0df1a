import numpy as np
import pytest
import shapely
from shapely import LineString, Polygon, box

from pipeline.fabrication.engraving import orientation_mark, place_id, text_extent, text_strokes
from pipeline.fabrication.engraving.id_placement import PlacedId
from pipeline.fabrication.parts import column_letters, labels
from pipeline.fabrication.units.tracking_dots import dots
from pipeline.problem.sections import Labels, Markers

WIDE = box(0.0, 0.0, 20.0, 12.0)
BAND = box(0.0, 0.0, 1.5, 25.0)


def test_text_fills_the_extent_that_it_claims() -> None:
    drawn = shapely.total_bounds([LineString(stroke) for stroke in text_strokes("H8", 3.0)])
    width, height = text_extent("H8", 3.0)
    assert drawn == pytest.approx([-width / 2, -height / 2, width / 2, height / 2])


@pytest.mark.parametrize("outline", [WIDE, BAND])
def test_id_lies_inside_even_a_band_narrower_than_a_letter_is_high(outline: Polygon) -> None:
    placed = place_id("H12", outline, outline, Labels())
    assert placed is not None
    strokes = shapely.union_all([LineString(stroke) for stroke in placed.strokes])
    assert outline.covers(strokes)
    assert max(np.ptp(strokes.bounds[::2]), np.ptp(strokes.bounds[1::2])) >= 2.0


def test_underside_is_the_mirror_image_and_the_arrow_points_up() -> None:
    placed = place_id("F7", WIDE, WIDE, Labels())
    assert placed is not None
    for top, below in zip(placed.strokes, placed.mirrored, strict=True):
        assert below[:, 1] == pytest.approx(top[:, 1])
        assert below[:, 0] == pytest.approx(20.0 - top[:, 0])
    stem, shaft = orientation_mark(WIDE, WIDE, placed, Labels())
    assert stem[1, 1] == max(stem[:, 1]) > stem[0, 1]
    assert shaft[1] == pytest.approx(stem[1])
    assert not placed.box.intersects(LineString(stem))


def test_a_ring_clears_the_letters_of_both_sides() -> None:
    outline = Polygon([(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)])
    above, below = (np.array([[0.2, y], [3.8, y]]) for y in (3.7, 3.5))
    (ring,) = orientation_mark(
        outline, outline, PlacedId((above,), (below,), outline, 1.0), Labels()
    )
    assert min(LineString(ring).distance(LineString(line)) for line in (above, below)) > 0.1
    assert ring[:, 1].min() > 2.0


def test_dots_lie_about_the_centroid_and_shrink_where_there_is_no_room() -> None:
    first, second = dots(WIDE, Markers())
    assert np.add(first.centre, second.centre) / 2 == pytest.approx([10.0, 6.0])
    assert np.hypot(*np.subtract(first.centre, second.centre)) == pytest.approx(6.0)
    assert {dot.diameter for dot in dots(BAND, Markers())} == {1.0}


def test_labels_are_unique() -> None:
    assert labels([(0, 0), (1, 0), (26, 11)]) == ["A1", "B1", "AA12"]
    assert labels([(0, 0), (0, 0), (1, 0)]) == ["A1a", "A1b", "B1a"]
    assert len({column_letters(column) for column in range(800)}) == 800
