"""Numbers of shims can be read on the plan: large enough, and clear of all else that is written."""

import numpy as np
import pytest
import shapely

from pipeline.fabrication.papers.assembly_plan import _DIGIT, _NUMBER, number_places
from pipeline.fabrication.papers.pdf_paper import POINT
from sim.core import Floats

SIZE = (3.4, 2.4)


def test_a_digit_is_high_enough_on_paper() -> None:
    assert _DIGIT[1] * _NUMBER / POINT >= 1.8


@pytest.mark.parametrize("spacing", [2.0, 5.0])
def test_numbers_of_close_shims_cover_neither_each_other_nor_ids(spacing: float) -> None:
    middles = {k: np.array([spacing * (k % 3), spacing * (k // 3)]) for k in range(9)}
    paths = {k: np.add(middle, [[-1.0, 0.0], [1.0, 0.0]]) for k, middle in middles.items()}
    taken = [(-2.0, 0.5, 2.0, 2.5)]
    found = number_places(middles, dict.fromkeys(middles, SIZE), paths, taken)
    boxes = [box_around(np.array(spot)) for spot in found.values()] + [shapely.box(*taken[0])]
    shared = [a.intersection(b).area for k, a in enumerate(boxes) for b in boxes[:k]]
    assert max(shared) < 1e-9
    if spacing == 5.0:  # with room each stands by its own shim, on the line of no other
        for number, spot in found.items():
            assert np.linalg.norm(np.array(spot) - middles[number]) < 3.0
            box = box_around(np.array(spot))
            lines = (shapely.LineString(path) for k, path in paths.items() if k != number)
            assert not any(line.intersects(box) for line in lines)


def box_around(spot: Floats) -> shapely.Polygon:
    half = np.array(SIZE) / 2
    return shapely.box(*(spot - half), *(spot + half))
