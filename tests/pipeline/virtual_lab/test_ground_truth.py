"""What is rendered is where the truth says, and noise aside nothing else is seen."""

import numpy as np
import pytest
import shapely
import yaml

from pipeline.problem.sections import CameraView, UnitAppearance
from pipeline.tracking.geometry import SpecimenOutlines
from pipeline.virtual_lab import coverage, filming
from pipeline.virtual_lab.camera_pose import viewpoint
from pipeline.virtual_lab.coverage import NestedPolygons
from pipeline.virtual_lab.face_marks import draw_marks
from pipeline.virtual_lab.film_scene import FilmScene
from pipeline.virtual_lab.filming import VirtualFilm

CAMERA = """
{ image: [64, 64], pixel_size: 0.5 mm, distance: 60 mm, tilt: [6 deg, -8 deg],
  distortion: [0.02, 0.01] }
"""
SAMPLES = 16
DEPTH = 8.0


def test_a_pixel_is_covered_by_what_lies_in_it() -> None:
    random = np.random.default_rng(5)
    angle = np.sort(random.uniform(0, 2 * np.pi, 7))
    corner = np.array([5.3, 4.1]) + 4.9 * np.column_stack([np.cos(angle), -np.sin(angle)])
    nested = NestedPolygons(corner, np.array([0, 7]), np.array([1.0]))
    made = coverage.coverage_image(nested, (9, 11))
    column, row = np.meshgrid(np.arange(11), np.arange(9))
    pixels = shapely.box(column - 0.5, row - 0.5, column + 0.5, row + 0.5)
    covered = shapely.area(shapely.intersection(pixels, shapely.Polygon(corner)))
    np.testing.assert_allclose(made, covered, atol=1e-12)


CONVEX = ((5.0, 1.0), (-1.5, 5.5), (-6.0, -1.0), (1.0, -6.0))
DART = ((5.0, 1.0), (-1.5, 5.5), (-6.0, -1.0), (-1.0, -0.5), (1.0, -6.0))


def one_unit(look: UnitAppearance, corners: tuple[tuple[float, float], ...] = CONVEX) -> FilmScene:
    corner = np.array(corners)
    nowhere = np.empty((0, 2), int), np.zeros((1, len(corner)), bool)
    specimen = SpecimenOutlines(np.array([0]), np.array([[2.0, 1.0]]), corner[None], *nowhere)
    asked = CameraView.model_validate(yaml.safe_load(CAMERA))
    view = viewpoint(asked, np.array([12.0, 5.0]))
    discs = draw_marks(specimen, "dots", look, 0)
    return FilmScene(specimen, np.empty((0, 2, 2), int), discs, look, view)


def sampled(scene: FilmScene, pose: np.ndarray) -> np.ndarray:
    """The same picture by rays: 16 x 16 to a pixel, through the prism behind the face."""
    columns, rows = scene.view.camera.size
    across = (np.arange(columns * SAMPLES) + 0.5) / SAMPLES - 0.5
    pixel = np.stack(np.meshgrid(across, across), axis=-1)
    front = scene.view.camera.unproject(pixel)
    eye = scene.view.eye
    back = front + (front - eye[:2]) * DEPTH / eye[2]
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    turn = np.array([[cos, sin], [-sin, cos]])
    place = scene.specimen.centre[0] + pose[:2]
    face = shapely.Polygon(scene.specimen.polygon(0) @ turn + place)
    shapely.prepare(face)
    near = np.linalg.norm(front - place, axis=-1) < 12
    shade = np.full(pixel.shape[:2], scene.appearance.board)
    rays = shapely.linestrings(np.stack([front[near], back[near]], axis=1))
    within = np.where(shapely.intersects(face, rays), scene.appearance.side, scene.appearance.board)
    on_face = shapely.contains_xy(face, front[near][:, 0], front[near][:, 1])
    shade[near] = np.where(on_face, scene.appearance.face, within)
    for centre, diameter in zip(scene.marks.centre, scene.marks.diameter, strict=True):
        disc = np.linalg.norm(front - (centre @ turn + place), axis=-1) < diameter / 2
        shade[disc] = scene.appearance.mark
    return shade.reshape(rows, SAMPLES, columns, SAMPLES).mean(axis=(1, 3))


@pytest.mark.parametrize("corners", [CONVEX, DART], ids=["convex", "dart"])
def test_the_picture_is_true_to_a_fraction_of_a_hundredth_of_a_pixel(
    corners: tuple[tuple[float, float], ...],
) -> None:
    """Against rays through the prism: walls, dots, perspective and distortion."""
    look = UnitAppearance.model_validate({"face": 0.6, "mark": 0.0, "side": 0.3, "board": 1.0})
    scene = one_unit(look, corners)
    pose = np.array([0.37, -0.21, 0.5])
    made, exact = filming.shade_image(scene, pose[None, None], 0.0), sampled(scene, pose)
    assert np.isclose(exact, look.side).sum() > 20  # the walls are seen
    assert len(scene.marks.unit) == 2
    slope = np.gradient(made)
    for axis in (0, 1):
        shift = (slope[axis] * (exact - made)).sum() / (slope[axis] ** 2).sum()
        assert abs(shift) < 0.005
    assert np.sqrt(np.mean((made - exact) ** 2)) < 0.005


def test_blur_does_not_move_anything() -> None:
    """Blurred on a grid three times as fine, or nine times: the same picture."""
    scene = one_unit(UnitAppearance())
    pose = np.array([[[0.1, 0.2, -0.3]]])
    made = filming.shade_image(scene, pose, 0.5)
    usual, filming.FINER = filming.FINER, 9
    try:
        finer = filming.shade_image(scene, pose, 0.5)
    finally:
        filming.FINER = usual
    slope = np.gradient(made)
    for axis in (0, 1):
        assert abs((slope[axis] * (finer - made)).sum() / (slope[axis] ** 2).sum()) < 0.002


def test_an_exposure_is_the_mean_of_its_instants() -> None:
    scene = one_unit(UnitAppearance())
    poses = np.array([[[0.1, 0.2, -0.3]], [[0.6, 0.1, -0.2]], [[1.1, 0.0, -0.1]]])
    alone = [filming.shade_image(scene, pose[None], 0.5) for pose in poses]
    exposed = filming.shade_image(scene, poses, 0.5)
    np.testing.assert_allclose(exposed, np.mean(alone, axis=0), atol=1e-6)  # singles
    assert np.abs(alone[0] - alone[2]).max() > 0.1


def test_noise_is_that_of_the_electrons(film: VirtualFilm) -> None:
    scene, asked = film.scene, film.asked
    poses = film.motion.instants[0]
    still = [filming.sensor_frame(scene, poses, 0.0, index, asked) for index in range(2)]
    change = still[1][:20, :20].astype(float) - still[0][:20, :20]
    level = still[0][:20, :20].mean()
    counted = asked.sensor.full_well / 255
    expected = np.sqrt(2 * (level * counted + asked.sensor.read_noise**2)) / counted
    assert 0.85 < change.std() / expected < 1.15
