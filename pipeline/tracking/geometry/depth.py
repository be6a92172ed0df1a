"""Projects the side walls of thick units: backs, and silhouettes that hide the board.

A point behind the faces' plane is seen nearer to the camera's foot, by its depth over its distance.
So a silhouette is the face with what is swept on the way to the back: it does not turn with the
unit, and that would be taken for a motion of the face.
"""

from typing import NamedTuple

import numpy as np
import shapely

from pipeline.tracking.geometry.camera import Camera
from sim.core import Floats

_ITERATIONS = 4


class Depth(NamedTuple):
    """Holds the thickness of the units and the place of the camera."""

    thickness: float  # mm
    foot: Floats  # (2,) of the camera on the faces' plane, mm
    height: float  # of the camera above it, mm

    @property
    def shrink(self) -> float:
        """Returns the size of a back against its face."""
        return self.height / (self.height + self.thickness)

    def offset(self, centre: Floats, pose: Floats) -> Floats:
        """Returns the way (units, 2) from face to back centroid as seen, in the unit's frame, mm.

        Args:
            centre: (units, 2) at rest.
            pose: (units, 3).
        """
        there = (self.shrink - 1) * (centre + pose[:, :2] - self.foot)
        cos, sin = np.cos(pose[:, 2]), np.sin(pose[:, 2])
        x, y = there.T
        return np.stack([cos * x + sin * y, cos * y - sin * x], axis=1)

    def silhouette(self, polygon: Floats, offset: Floats) -> Floats:
        """Outlines (n, 2) a unit with its walls, counter-clockwise.

        Args:
            polygon: (vertices, 2) of the face about its centroid.
            offset: (2,) of the back.
        """
        back = self.shrink * polygon + offset
        walls = np.stack([polygon, np.roll(polygon, -1, 0), np.roll(back, -1, 0), back], axis=1)
        hulls = shapely.convex_hull(shapely.multipoints(walls))
        whole = shapely.union_all([shapely.Polygon(polygon), shapely.Polygon(back), *hulls])
        ring = shapely.get_coordinates(shapely.get_exterior_ring(shapely.orient_polygons(whole)))
        return np.asarray(ring[:-1])


def estimate_depth(camera: Camera, middle: Floats, thickness: float, distance: float) -> Depth:
    """Estimates the place of a camera at a known distance from the specimen's middle (2,).

    The homography alone tells the focal length badly when the camera looks straight on; with the
    distance it tells the pose well.
    """
    scale = float(camera.px_per_mm(middle[None])[0])
    axis, focal = (np.array(camera.size) - 1) / 2, scale * distance
    camera_centre = np.array([*middle, distance])
    for _ in range(_ITERATIONS):
        camera_centre = _projection_centre(camera.homography, axis, focal)
        focal *= distance / float(np.linalg.norm(camera_centre - [*middle, 0.0]))
    return Depth(thickness, camera_centre[:2], abs(float(camera_centre[2])))


def _projection_centre(homography: Floats, axis: Floats, focal: float) -> Floats:
    """Computes the projection centre (3,) of a camera with this focal length, px."""
    inner = np.array([[focal, 0.0, axis[0]], [0.0, focal, axis[1]], [0.0, 0.0, 1.0]])
    columns = np.linalg.inv(inner) @ homography
    columns *= 2 / (np.linalg.norm(columns[:, 0]) + np.linalg.norm(columns[:, 1]))
    left, _, right = np.linalg.svd(columns[:, :2], full_matrices=False)
    first, second = (left @ right).T
    rotation = np.column_stack([first, second, np.cross(first, second)])
    return np.asarray(-rotation.T @ columns[:, 2])
