import numpy as np
import pytest

from tests.pipeline.tracking.conftest import check_accuracy, tracked
from tests.tables import some


@pytest.mark.parametrize(
    ("name", "translation", "rotation"),
    some([("c_rigid_lossless", 0.007, 0.04), ("f_silhouette", 0.016, 0.09)], 1),
)
def test_errors_are_parts_of_a_pixel(name: str, translation: float, rotation: float) -> None:
    check_accuracy(name, translation, rotation)


def test_translations_have_no_bias_and_errors_their_stated_size() -> None:
    error = tracked("c_rigid_lossless").error[1:3]
    assert np.abs(error[..., :2].mean(axis=(0, 1))).max() < 0.001
    assert np.sqrt(np.mean(error[..., :2] ** 2)) < 0.005
    found = tracked("f_silhouette")
    scale = np.array([1 / found.track.calibration.pixel] * 2 + [180 / np.pi])
    standard = (found.error / (found.track.sigma * scale))[1:]
    assert (standard.std(axis=(0, 1)) > 0.5).all()
    assert (standard.std(axis=(0, 1)) < 2.0).all()
