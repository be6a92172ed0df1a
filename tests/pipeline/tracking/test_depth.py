"""Thick units, filmed in the virtual lab from 1 m: their side walls show off axis."""

import numpy as np
import pytest
import shapely

from pipeline.problem.sections import VirtualRecording
from pipeline.tracking.frames import Frame, import_video
from pipeline.tracking.geometry import Depth, estimate_depth, outlines_of_design
from pipeline.tracking.motion import track_video
from pipeline.tracking.reference_frame import RecordingSetup
from pipeline.virtual_lab import filming
from pipeline.virtual_lab.camera_pose import viewpoint
from pipeline.virtual_lab.face_marks import draw_marks
from pipeline.virtual_lab.film_scene import FilmScene
from tests.pipeline.virtual_lab.conftest import GRID

ASKED = VirtualRecording.model_validate(
    {"camera": {"image": [320, 320], "tilt": ["2 deg", "-1 deg"], "distortion": [0.01, 0.0]}}
)
MIDDLE = np.array([48.0, 40.0])  # that the camera looks at; the specimen is off axis


def filmed(frames: int) -> tuple[FilmScene, list[np.ndarray], list[Frame]]:
    specimen = outlines_of_design(import_video.design({**GRID, "grid": [5, 5]}))
    view = viewpoint(ASKED.camera, MIDDLE)
    none = np.empty((0, 2, 2), int)
    scene = FilmScene(specimen, none, draw_marks(specimen, "bare", ASKED.look, 0), ASKED.look, view)
    place = np.round(specimen.centre / 15)
    sign = np.where(place.sum(axis=1) % 2 == 0, -0.3, 0.3)
    full = np.column_stack([-0.04 * specimen.centre[:, 0], 0.02 * specimen.centre[:, 1], sign])
    poses = [share * full for share in np.linspace(0, 1, frames)]
    images = [
        filming.sensor_frame(scene, pose[None], 0.0, k, ASKED) for k, pose in enumerate(poses)
    ]
    return scene, poses, [Frame(k, k / 30, image) for k, image in enumerate(images)]


def test_walls_are_no_motion() -> None:
    scene, poses, frames = filmed(8)
    errors = []
    for setup in (RecordingSetup(8.0, 1000.0), RecordingSetup()):
        track = track_video(iter(frames), scene.specimen, 1 / 0.365, setup=setup)
        apart = (track.displacement - poses)[..., :2] / track.calibration.pixel
        errors.append(np.sqrt(np.mean(apart**2)))
    assert errors[0] < 0.03
    assert errors[0] < errors[1] / 2


def test_a_distance_tells_where_the_camera_stands() -> None:
    view = viewpoint(ASKED.camera, MIDDLE)
    found = estimate_depth(view.camera, MIDDLE, 8.0, 1000.0)
    np.testing.assert_allclose([*found.foot, found.height], view.eye, rtol=1e-3)


@pytest.mark.parametrize("offset", [(0.5, 0.2), (-0.4, 0.0)])
def test_silhouettes_of_convex_units_are_hulls_of_two_faces(offset: tuple[float, float]) -> None:
    polygon = np.array([[6.0, 2.0], [-2.0, 6.0], [-6.0, -2.0], [2.0, -6.0]])
    depth = Depth(8.0, np.zeros(2), 1000.0)
    back = depth.shrink * polygon + offset
    hull = shapely.convex_hull(shapely.multipoints(np.concatenate([polygon, back])))
    made = shapely.Polygon(depth.silhouette(polygon, np.array(offset)))
    assert shapely.area(shapely.symmetric_difference(made, hull)) < 1e-9
