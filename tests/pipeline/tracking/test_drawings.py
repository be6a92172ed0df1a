"""Drawings over pictures keep their pixels, are known as our own, and have the same bytes again."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from pipeline.tracking.frames import is_own_drawing, write_drawing


@pytest.mark.parametrize("turned", [False, True])
def test_a_drawing_is_known_by_its_text(tmp_path: Path, turned: bool) -> None:
    drawn = np.random.default_rng(1).integers(0, 256, (40, 60, 3), dtype=np.uint8)
    picture = drawn.transpose(1, 0, 2) if turned else drawn
    first, second, other = (tmp_path / f"{name}.png" for name in "abc")
    write_drawing(picture, first)
    write_drawing(picture, second)
    np.testing.assert_array_equal(cv2.imread(str(first)), picture)
    assert first.read_bytes() == second.read_bytes()
    assert is_own_drawing(first)
    cv2.imwrite(str(other), picture)
    assert not is_own_drawing(other)
