from pathlib import Path

import numpy as np
import pytest

from pipeline.calibration import study_pictures
from pipeline.calibration.inputs import KnownPictures
from pipeline.calibration.picture_study import tracked_parts
from pipeline.problem.reading import load_section
from pipeline.runtime import ROOT, UserError
from pipeline.tracking.motion import find_motion, fit_motion

FOLDER = ROOT / "experiments/validation"
ASKED = load_section(FOLDER / "pictures.yaml", KnownPictures)


@pytest.mark.slow
def test_parts_move_as_another_program_has_them_and_the_specimen_is_found() -> None:
    made = study_pictures(ASKED, FOLDER)
    apart = (made["measured"] - made["reference"]).values
    assert apart.shape == (3, 11, 3)
    rms = np.sqrt((apart**2).mean(axis=1))
    assert rms[:, :2].max() < 0.03  # px
    assert rms[:, 2].max() < 0.002  # rad
    assert made["seen"].sum() > 0.85 * made.sizes["unit"]
    np.testing.assert_allclose(made["pixel_size"], ASKED.specimen.pixel_size, rtol=0.05)


@pytest.mark.slow
def test_pixels_at_the_edge_tell_of_the_rotation_of_a_small_part() -> None:
    lever = [each for each in tracked_parts(ASKED.rigid_parts, FOLDER) if each.part == 1][:4]

    def turned(*, whole: bool) -> float:
        error = []
        for each in lever:
            start = find_motion(each.patch)
            assert start is not None
            error.append(fit_motion(each.patch, start, include_edge=whole)[2] - each.reference[2])
        return float(np.sqrt(np.mean(np.square(error))))

    assert turned(whole=True) < 0.5 * turned(whole=False)


def test_a_patch_without_features_is_not_found() -> None:
    patch = next(tracked_parts(ASKED.rigid_parts, FOLDER)).patch
    assert find_motion(patch._replace(after=np.zeros_like(patch.after))) is None


def test_a_line_about_no_picture_is_refused(tmp_path: Path) -> None:
    parts = ASKED.rigid_parts
    for name in (parts.first, "frame_4875.png"):
        (tmp_path / name).write_bytes((FOLDER / parts.folder / name).read_bytes())
    table = tmp_path / "reference.csv"
    table.write_text(",".join(parts.columns) + "\n4875,0,1,1,0\n4999,0,1,1,0\n")
    posed = parts.model_copy(update={"folder": "."})
    with pytest.raises(UserError, match="4999, 0") as caught:
        list(tracked_parts(posed, tmp_path))
    assert caught.value.file == str(table)
