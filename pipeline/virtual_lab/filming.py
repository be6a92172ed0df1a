"""Films a response: frames from shades to bytes, and the exact truth of what they show."""

from collections.abc import Callable, Iterator
from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np
import xarray as xr

from pipeline.posing import structure_variables
from pipeline.problem.sections import Lighting, VirtualRecording
from pipeline.runtime import UserError
from pipeline.tracking.geometry import outlines_of_design
from pipeline.virtual_lab.camera_pose import Viewpoint, viewpoint
from pipeline.virtual_lab.coverage import coverage_image, mean_polygons
from pipeline.virtual_lab.face_marks import draw_marks
from pipeline.virtual_lab.film_scene import FilmScene, nested_polygons
from pipeline.virtual_lab.filmed_motion import FilmedMotion, sample_motion
from sim.core import Floats, Image, Ints, Mask

FINER = 3
"""Pixels are divided so often on either side before the blur: it must not see the grid."""
_MAINS = 100.0  # Hz


class VirtualFilm(NamedTuple):
    """Holds all that is needed to render."""

    scene: FilmScene  # what is filmed
    motion: FilmedMotion  # of the units
    response: xr.Dataset  # what the structure does
    present: Mask  # (units,) which of them are there
    asked: VirtualRecording  # the set-up

    def images(self, tell: Callable[[], None] | None = None) -> Iterator[Image]:
        """Renders the frames, in sequence; ``tell`` is called after each."""
        for index, time in enumerate(self.motion.time):
            yield sensor_frame(self.scene, self.motion.instants[index], time, index, self.asked)
            if tell is not None:
                tell()


def prepare_film(
    one: xr.Dataset, structure: str, kind: str, asked: VirtualRecording
) -> VirtualFilm:
    """Prepares the film of a structure under one load case: a response at both, or a specimen.

    `kind` is dots, speckle or bare (as is "auto").

    Raises:
        UserError: the specimen is out of the picture, or nothing is in the window of time.
    """
    units = outlines_of_design(one)
    present = np.isin(one["unit"].values, units.ids)
    view = viewpoint(asked.camera, (units.centre.min(axis=0) + units.centre.max(axis=0)) / 2)
    corners = view.camera.project(units.centre)
    if (corners < 0).any() or (corners > np.array(asked.camera.image) - 1).any():
        width, height = np.ptp(units.centre, axis=0) + 2 * units.radius.max()
        what = f"the specimen of {width:.0f} mm x {height:.0f} mm does not fit into the picture"
        remedy = "give a larger pixel_size, or a larger image"
        raise UserError(what, key="virtual.camera", remedy=remedy)
    look = asked.look
    scene = FilmScene(
        units,
        _ligaments(one, structure, units.ids),
        draw_marks(units, kind, look, asked.seed),
        look,
        view,
    )
    return VirtualFilm(scene, sample_motion(one, present, asked), one, present, asked)


def select_structure(response: xr.Dataset, structure: str) -> xr.Dataset:
    """Selects one structure of a response.

    Raises:
        UserError: the response does not hold it.
    """
    held = response["structure"].values.tolist()
    if structure not in held:
        remedy = f"give one of: {', '.join(held)}"
        what = "the response holds no such structure"
        raise UserError(what, key="structure", value=structure, remedy=remedy)
    return response.sel(structure=structure)


def select_case(response: xr.Dataset, structure: str, case: int) -> xr.Dataset:
    """Selects one structure of a response under one of its load cases.

    Raises:
        UserError: the response does not hold it.
    """
    cases = response.sizes["case"]
    if not 0 <= case < cases:
        remedy = f"give a number from 0 to {cases - 1}"
        raise UserError("the response has no such case", key="case", value=case, remedy=remedy)
    return select_structure(response, structure).isel(case=case)


def _ligaments(response: xr.Dataset, structure: str, ids: Ints) -> Ints:
    """Lists unit and vertex (ligaments, 2, 2) at the ends of those that are there."""
    there = structure_variables.present_ligaments(response, structure)
    unit = np.searchsorted(ids, response["ligament_unit"].values[there])
    return np.stack([unit, response["ligament_vertex"].values[there]], axis=-1)


def assemble_truth(
    response: xr.Dataset, present: Mask, motion: FilmedMotion, view: Viewpoint
) -> xr.Dataset:
    """Makes the dataset ``truth``: displacements at mid-exposure, as a track would have them."""
    displacement = np.full((len(motion.time), len(present), 3), np.nan)
    displacement[:, present] = motion.pose
    variables = {
        "vertices": response["vertices"].transpose("unit", "vertex", "xy"),
        "displacement": (("time", "unit", "dof"), displacement),
        "camera_homography": (("row", "column"), view.camera.homography),
        "camera_centre": (("xy",), view.camera.centre),
        "camera_radial": (("power",), view.camera.radial),
        "camera_eye": (("xyz",), view.eye),
        "image_size": (("xy",), np.array(view.camera.size)),
    }
    coordinates = {
        **{name: response[name] for name in ("unit", "i", "j", "xy")},
        "time": (("time",), motion.time),
        "dof": (("dof",), ["ux", "uy", "theta"]),
    }
    made = xr.Dataset(variables, coordinates)
    return made.drop_vars([name for name in made.coords if name not in coordinates])


def sensor_frame(
    scene: FilmScene, instants: Floats, time: float, index: int, asked: VirtualRecording
) -> Image:
    """Renders the picture (rows, columns) that the sensor gives, 8 bit, at a time in s.

    The exposure averages `instants` (instants, units, 3); the noise of each frame is its own.
    """
    shades = shade_image(scene, instants, asked.sensor.blur)
    light = _illumination(asked.light, shades.shape)
    flicker = 1 + asked.light.flicker * np.sin(2 * np.pi * _MAINS * time)
    return _add_noise(np.clip(shades, 0, 1) * light * flicker, index, asked)


def shade_image(scene: FilmScene, instants: Floats, blur: float) -> Floats:
    """Renders the shade (rows, columns) of pixels behind the optics, without light and noise.

    Coverage and blur are linear, so the mean of `instants` (instants, units, 3) is blurred once.
    """
    columns, rows = scene.view.camera.size
    rings = mean_polygons([nested_polygons(scene, pose) for pose in instants])
    fine = rings._replace(points=(rings.points + 0.5) * FINER - 0.5)
    picture = coverage_image(fine, (rows * FINER, columns * FINER)).astype(np.float32)
    if blur > 0:
        edge = cv2.BORDER_REPLICATE
        blurred = cv2.GaussianBlur(picture, (0, 0), blur * FINER, borderType=edge)
        picture = np.asarray(blurred, np.float32)
    shades = cv2.resize(picture, (columns, rows), interpolation=cv2.INTER_AREA)
    return scene.appearance.board + np.asarray(shades, float)


@lru_cache(maxsize=1)
def _illumination(asked: Lighting, shape: tuple[int, ...]) -> Floats:
    """Brightness (rows, columns) of white."""
    rows, columns = shape
    v, u = np.meshgrid(np.linspace(1, -1, rows), np.linspace(-1, 1, columns), indexing="ij")
    tilted = 1 + asked.slope[0] * u + asked.slope[1] * v
    return asked.level * tilted * (1 - asked.falloff * (u**2 + v**2) / 2)


def _add_noise(light: Floats, index: int, asked: VirtualRecording) -> Image:
    """Adds shot noise (Gaussian, as for many electrons) and read noise, in steps of 8 bit."""
    sensor = asked.sensor
    electrons = light * sensor.full_well
    spread = np.sqrt(np.maximum(electrons, 0) + sensor.read_noise**2)
    random = np.random.default_rng([asked.seed, index])
    electrons += spread * random.standard_normal(light.shape, np.float32)
    return np.clip(np.round(255 / sensor.full_well * electrons), 0, 255).astype(np.uint8)
