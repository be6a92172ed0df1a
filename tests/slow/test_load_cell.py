"""The load cell of a track tells the scale of the stiffness."""

import shutil
from pathlib import Path

from pipeline import datasets
from tests.pipeline.calibration import test_loads
from tests.pipeline.calibration.specimens import described, synthesised


def test_the_load_cell_of_a_track_tells_the_scale(tmp_path: Path) -> None:
    shutil.copy(test_loads.SPECIMENS / "squeezed.yaml", tmp_path)
    path = synthesised(
        tmp_path, described([test_loads.track()], test_loads.WANTED, material=test_loads.START)
    )
    file = tmp_path / "data/motion.nc"
    seen = datasets.read(file, "track")
    seen["load_force"] += 0.3
    datasets.write(seen, file, "track", seen.attrs)
    found = test_loads.found_from(path, tmp_path)
    test_loads.assert_inside(found, {"shear_stiffness": 1.19, "bending_stiffness": 1.5})
    assert (found["standard_error"] < 0.1).all()
    assert found["newton_step"] < 0.05
