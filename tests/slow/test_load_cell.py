"""The load cell of a track tells the scale of the stiffness."""

import shutil
from pathlib import Path

from pipeline import datasets
from tests.pipeline.calibration.specimens import described, synthesised
from tests.pipeline.calibration.test_loads import (
    SPECIMENS,
    START,
    WANTED,
    assert_inside,
    found_from,
    track,
)


def test_the_load_cell_of_a_track_tells_the_scale(tmp_path: Path) -> None:
    shutil.copy(SPECIMENS / "squeezed.yaml", tmp_path)
    path = synthesised(tmp_path, described([track()], WANTED, material=START))
    file = tmp_path / "data/motion.nc"
    seen = datasets.read(file, "track")
    seen["load_force"] += 0.3
    datasets.write(seen, file, "track", seen.attrs)
    found = found_from(path, tmp_path)
    assert_inside(found, {"shear_stiffness": 1.19, "bending_stiffness": 1.5})
    assert (found["standard_error"] < 0.1).all()
    assert found["newton_step"] < 0.05
