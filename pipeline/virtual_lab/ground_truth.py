"""What a rendered video shows, exactly, as a dataset."""

from __future__ import annotations

import numpy as np
import xarray as xr

from pipeline.virtual_lab.camera_pose import Viewpoint
from pipeline.virtual_lab.filmed_motion import FilmedMotion
from sim.core import Mask


def assemble_truth(
    response: xr.Dataset, present: Mask, motion: FilmedMotion, view: Viewpoint
) -> xr.Dataset:
    """The dataset ``truth``: displacements at mid-exposure, as a track would have them.

    Args:
        response: of one structure under one load case.
        present: (units,) which are there.
        motion: what was filmed of them.
        view: the camera.
    """
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
