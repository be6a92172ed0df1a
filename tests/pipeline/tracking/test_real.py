"""Pictures of a real specimen: bare units of 24 x 16 on a bright board, with their overlays."""

from pathlib import Path

import cv2
import numpy as np

from pipeline.runtime import ROOT
from pipeline.tracking.detect import detect_lattice, orientation_text
from pipeline.tracking.detect.blobs import find_blobs
from pipeline.tracking.frames import import_video
from pipeline.tracking.geometry import outlines_of_design
from tests.pipeline.tracking.conftest import CLIPS
from tests.pipeline.virtual_lab.conftest import GRID

AT_REST = ROOT / "experiments/validation/photographs/specimen_at_rest.png"
SHOWN = outlines_of_design(import_video.design({**GRID, "grid": [24, 16]}))
PIXEL = 0.365 / 0.66  # mm: of the camera, and of the picture made smaller


def picture(path: Path) -> np.ndarray:
    return np.asarray(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE))


def test_units_at_rest_are_found_in_their_places() -> None:
    found = detect_lattice(picture(AT_REST), SHOWN, None)[0]
    assert not found.bright
    assert len(found.unit) > 0.8 * SHOWN.count
    assert orientation_text(found.camera) == "upright"
    area = np.abs(np.linalg.det(found.camera.jacobian(SHOWN.centre)))
    np.testing.assert_allclose(np.sqrt(np.median(area)), 1 / PIXEL, rtol=0.05)
    apart = found.camera.project(SHOWN.centre[found.unit]) - found.blob
    assert np.sqrt(np.mean(apart**2)) * PIXEL < 0.1 * SHOWN.pitch


def test_most_units_in_motion_stand_apart() -> None:
    image = picture(CLIPS / "real/focusing_dynamic_frame_overlay_quads.png")
    found = find_blobs(image, SHOWN, 1 / PIXEL, bright=False)
    assert 0.6 * SHOWN.count < len(found) < 1.1 * SHOWN.count
    assert (np.ptp(found, axis=0) > 0.7 * np.ptp(SHOWN.centre, axis=0) / PIXEL).all()
