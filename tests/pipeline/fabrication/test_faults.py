from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from shapely import LineString, Point, box

from pipeline.fabrication.readback import Fault, stop
from pipeline.fabrication.readback.faults import PICTURES
from pipeline.runtime import UserError

THIN = Fault(
    "unit C7",
    "the slot at vertex 2 leaves a wall of 0.56 mm, less than 0.8 mm",
    "minimum_wall",
    "lower it",
    Path("print/units/C7.stl"),
    (box(0.0, 0.0, 12.0, 9.0),),
    LineString([(1.0, 1.0), (1.5, 1.0)]),
)


def test_a_fault_names_the_unit_the_parameter_and_the_picture(tmp_path: Path) -> None:
    with pytest.raises(UserError) as raised:
        stop([THIN], tmp_path / "faults")
    told = str(raised.value)
    assert told.startswith("unit C7: the slot at vertex 2 leaves a wall of 0.56 mm")
    assert "fabrication.minimum_wall" in told
    assert "print/units/C7.stl" in told
    picture = tmp_path / "faults/fault_1.png"
    assert str(picture) in told
    with Image.open(picture) as image:
        pixels = np.asarray(image.convert("RGB"))
    assert pixels.shape == (600, 600, 3)
    assert ((pixels[..., 0] > 180) & (pixels[..., 1] < 90)).sum() > 20


def test_many_faults_make_one_message_and_few_pictures(tmp_path: Path) -> None:
    faults = [replace(THIN, part=f"unit A{n}", spot=Point(n, n)) for n in range(1, 21)]
    stop([], tmp_path)
    with pytest.raises(UserError) as raised:  # of a whole file: without a picture
        stop([replace(THIN, around=(), spot=None)], tmp_path)
    assert "see" not in str(raised.value)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(UserError) as raised:
        stop(faults, tmp_path)
    told = "(20 faults in all: unit A1, unit A2, unit A3, unit A4, unit A5, ...)"
    assert told in str(raised.value)
    assert len(list(tmp_path.glob("*.png"))) == PICTURES
