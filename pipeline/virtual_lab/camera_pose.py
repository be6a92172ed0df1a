"""Poses the camera of the virtual lab before the specimen's plane."""

from typing import NamedTuple

import numpy as np

from pipeline.problem.sections import CameraView
from pipeline.tracking.geometry import Camera
from sim.core import Floats


class Viewpoint(NamedTuple):
    """Holds a camera in front of the specimen."""

    camera: Camera  # of the plane of the units' faces
    eye: Floats  # (3,) centre of projection in the specimen's frame, z towards the camera, mm

    def behind(self, points: Floats, depth: float) -> Floats:
        """Projects points so far behind the faces' plane to places (..., 2) on it, mm."""
        foot, height = self.eye[:2], self.eye[2]
        return foot + (points - foot) * (height / (height + depth))


def viewpoint(asked: CameraView, middle: Floats) -> Viewpoint:
    """Poses the camera that looks at ``middle`` (2,) of the specimen, mm.

    A pinhole with radial distortion: the focal length follows from distance and pixel size. It
    leans over by the tilt about x, then y, and is rolled about its axis.
    """
    turn = _turn(asked.roll, 2) @ _turn(asked.tilt[1], 1) @ _turn(asked.tilt[0], 0)
    rotation = np.diag([1.0, -1.0, -1.0]) @ turn
    target = np.append(middle, 0.0)
    shift = np.array([0.0, 0.0, asked.distance]) - rotation @ target
    columns, rows = asked.image
    centre = (np.array([columns, rows]) - 1) / 2
    focal = asked.distance / asked.pixel_size
    inner = np.array([[focal, 0.0, centre[0]], [0.0, focal, centre[1]], [0.0, 0.0, 1.0]])
    homography = inner @ np.column_stack([rotation[:, :2], shift])
    camera = Camera(
        homography / homography[2, 2], centre, np.array(asked.distortion), (columns, rows)
    )
    return Viewpoint(camera, -rotation.T @ shift)


def _turn(angle: float, axis: int) -> Floats:
    cos, sin = np.cos(angle), np.sin(angle)
    out = np.eye(3)
    first, second = (axis + 1) % 3, (axis + 2) % 3
    out[first, first] = out[second, second] = cos
    out[first, second], out[second, first] = -sin, sin
    return out
