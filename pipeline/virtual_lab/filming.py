"""A recording of a response, rendered: the frames and what they show."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
import xarray as xr

from pipeline.posing import structure_variables
from pipeline.problem.sections import VirtualRecording
from pipeline.runtime import UserError
from pipeline.tracking.geometry import outlines_of_design
from pipeline.virtual_lab import sensor
from pipeline.virtual_lab.camera_pose import viewpoint
from pipeline.virtual_lab.face_marks import draw_marks
from pipeline.virtual_lab.film_scene import FilmScene
from pipeline.virtual_lab.filmed_motion import FilmedMotion, sample_motion
from sim.core import Image, Ints, Mask


class VirtualFilm(NamedTuple):
    """All that is needed to render.

    Attributes:
        scene: what is filmed.
        motion: of the units.
        response: what the structure does.
        present: (units,) which of them are there.
        asked: the set-up.
    """

    scene: FilmScene
    motion: FilmedMotion
    response: xr.Dataset
    present: Mask
    asked: VirtualRecording

    def images(self, tell: Callable[[], None] | None = None) -> Iterator[Image]:
        """The frames, in sequence; ``tell`` is called after each."""
        for index, time in enumerate(self.motion.time):
            yield sensor.sensor_frame(
                self.scene, self.motion.instants[index], time, index, self.asked
            )
            if tell is not None:
                tell()


def prepare_film(
    one: xr.Dataset, structure: str, kind: str, asked: VirtualRecording
) -> VirtualFilm:
    """Everything for the film of a structure under one load case.

    Args:
        one: a response at one structure and one case, or a specimen.
        structure: intact, altered or cloaked.
        kind: dots, speckle or bare (as is "auto").
        asked: the set-up.

    Raises:
        UserError: the specimen is out of the picture, or nothing is in the window of time.
    """
    units = outlines_of_design(one)
    present = np.isin(one["unit"].values, units.ids)
    view = viewpoint(asked.camera, (units.centre.min(axis=0) + units.centre.max(axis=0)) / 2)
    corners = view.camera.project(units.centre)
    if (corners < 0).any() or (corners > np.array(asked.camera.image) - 1).any():
        width, height = np.ptp(units.centre, axis=0) + 2 * units.radius.max()
        raise UserError(
            f"the specimen of {width:.0f} mm x {height:.0f} mm does not fit into the picture",
            key="virtual.camera",
            remedy="give a larger pixel_size, or a larger image",
        )
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
    """One structure of a response.

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
    """One structure of a response under one of its load cases.

    Raises:
        UserError: the response does not hold it.
    """
    cases = response.sizes["case"]
    if not 0 <= case < cases:
        remedy = f"give a number from 0 to {cases - 1}"
        raise UserError("the response has no such case", key="case", value=case, remedy=remedy)
    return select_structure(response, structure).isel(case=case)


def _ligaments(response: xr.Dataset, structure: str, ids: Ints) -> Ints:
    """Unit and vertex (ligaments, 2, 2) at the ends of those that are there."""
    there = structure_variables.present_ligaments(response, structure)
    unit = np.searchsorted(ids, response["ligament_unit"].values[there])
    return np.stack([unit, response["ligament_vertex"].values[there]], axis=-1)
