import numpy as np
import pytest

from tests.pipeline.tracking.conftest import check_accuracy, tracked


@pytest.mark.parametrize(
    ("name", "translation", "rotation"),
    [("c_rigid_lossless", 0.007, 0.04), ("f_silhouette", 0.016, 0.09)],
)
def test_units_are_tracked_to_a_fraction_of_a_pixel(
    name: str, translation: float, rotation: float
) -> None:
    check_accuracy(name, translation, rotation)


def test_translations_without_loss_have_no_bias() -> None:
    error = tracked("c_rigid_lossless").error[1:3]
    assert np.abs(error[..., :2].mean(axis=(0, 1))).max() < 0.001
    assert np.sqrt(np.mean(error[..., :2] ** 2)) < 0.005


def test_the_uncertainty_is_of_the_size_of_the_error() -> None:
    found = tracked("f_silhouette")
    scale = np.array([1 / found.track.calibration.pixel] * 2 + [180 / np.pi])
    standard = (found.error / (found.track.sigma * scale))[1:]
    assert (standard.std(axis=(0, 1)) > 0.5).all()
    assert (standard.std(axis=(0, 1)) < 2.0).all()
