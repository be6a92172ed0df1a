"""Projects the specimen at one instant to nested polygons with their shades.

Board; before it the side walls and the ligaments, which are one shade and therefore one region;
before these the faces; on the faces the marks. Each lies within the one before it, so exact
coverages with the differences of the shades add up to the picture.
"""

from typing import NamedTuple

import numpy as np
import shapely

from pipeline.problem.sections import UnitAppearance
from pipeline.tracking.geometry import SpecimenOutlines
from pipeline.virtual_lab.camera_pose import Viewpoint
from pipeline.virtual_lab.coverage import NestedPolygons
from pipeline.virtual_lab.face_marks import FaceMarks
from sim.core import Floats, Ints

_PIECE = 2.0  # longest piece of an edge, mm: the lens bends edges
_CORNERS = 32  # of a disc
_FLAT = 1e-12  # part of its hull's area that a convex unit may lack: rounding


class FilmScene(NamedTuple):
    """Holds what is filmed."""

    specimen: SpecimenOutlines  # the units
    ligament: Ints  # (ligaments, 2, 2) unit and vertex, as places in the specimen, at either end
    marks: FaceMarks  # on the faces
    appearance: UnitAppearance  # shades and thickness
    view: Viewpoint  # the camera


class _Layer(NamedTuple):
    points: Floats
    sizes: Ints
    shade: float


def nested_polygons(scene: FilmScene, pose: Floats) -> NestedPolygons:
    """Projects all polygons to pixels, with the shades they add to the board's.

    `pose` (units, 3) are displacements in mm and rotations in rad.
    """
    appearance = scene.appearance
    corners = _move_points(
        scene.specimen.outline, np.arange(len(pose)), pose, scene.specimen.centre
    )
    faces = _polygons(corners)
    layers = [
        _layer(_project_sides(scene, faces, corners), appearance.side - appearance.board),
        _layer(faces, appearance.face - appearance.side),
        _project_marks(scene, pose),
    ]
    sizes = np.concatenate([layer.sizes for layer in layers])
    return NestedPolygons(
        scene.view.camera.project(np.concatenate([layer.points for layer in layers])),
        np.concatenate([[0], np.cumsum(sizes)]),
        np.concatenate([np.full(len(layer.sizes), layer.shade) for layer in layers]),
    )


def _move_points(points: Floats, unit: Ints, pose: Floats, centre: Floats) -> Floats:
    """Moves points (n, m, 2) relative to the centroids of units (n,) with these."""
    cos, sin = np.cos(pose[unit, 2, None]), np.sin(pose[unit, 2, None])
    x, y = points[..., 0], points[..., 1]
    turned = np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)
    return np.asarray(turned + (centre + pose[:, :2])[unit, None])


def _polygons(corners: Floats) -> Floats:
    """Makes polygons (n,) of their corners (n, m, 2), NaN where there are fewer than m."""
    there = ~np.isnan(corners[..., 0])
    return np.asarray(
        shapely.polygons(shapely.linearrings(corners[there], indices=np.nonzero(there)[0]))
    )


def _project_sides(scene: FilmScene, faces: Floats, corners: Floats) -> Floats:
    """Unites faces, side walls and ligaments to one region of polygons."""
    parts = [faces]
    if depth := scene.appearance.thickness:
        parts = [_project_bodies(faces, corners, scene.view.behind(corners, depth))]
    if width := scene.appearance.ligament:
        end = corners[scene.ligament[..., 0], scene.ligament[..., 1]]
        parts.append(shapely.buffer(shapely.linestrings(end), width / 2, cap_style="flat"))
    return np.array([shapely.union_all(np.concatenate(parts))])


def _project_bodies(faces: Floats, corners: Floats, back: Floats) -> Floats:
    """Unites each unit's face with its back and with the walls between them on the faces' plane.

    Of a convex unit these are the hull of both ends: its back is its face, moved and scaled.
    """
    backs = _polygons(back)
    bodies = np.asarray(
        shapely.convex_hull(shapely.geometrycollections(np.stack([faces, backs], 1)))
    )
    convex = shapely.area(faces) > (1 - _FLAT) * shapely.area(shapely.convex_hull(faces))
    for unit in np.flatnonzero(~convex):
        there = ~np.isnan(corners[unit, :, 0])
        front, rear = corners[unit, there], back[unit, there]
        sides = [front, np.roll(front, -1, axis=0), np.roll(rear, -1, axis=0), rear]
        walls = shapely.convex_hull(shapely.multipoints(np.stack(sides, axis=1)))
        bodies[unit] = shapely.union_all([faces[unit], backs[unit], *walls])
    return bodies


def _layer(shapes: Floats, shade: float) -> _Layer:
    """Collects rings of polygons, counter-clockwise, holes the other way."""
    cut = shapely.orient_polygons(shapely.segmentize(shapes, _PIECE))
    rings = shapely.get_rings(shapely.get_parts(cut))
    sizes = shapely.get_num_coordinates(rings) - 1
    points = shapely.get_coordinates(rings)
    closing = np.cumsum(sizes + 1) - 1
    return _Layer(np.delete(points, closing, axis=0), sizes, shade)


def _project_marks(scene: FilmScene, pose: Floats) -> _Layer:
    """Draws the marks as polygons of their area."""
    marks = scene.marks
    angle = 2 * np.pi / _CORNERS * np.arange(_CORNERS)
    swell = np.sqrt(angle[1] / np.sin(angle[1]))
    circle = swell * np.column_stack([np.cos(angle), np.sin(angle)])
    discs = marks.centre[:, None] + marks.diameter[:, None, None] / 2 * circle
    places = _move_points(discs, marks.unit, pose, scene.specimen.centre)
    sizes = np.full(len(discs), _CORNERS)
    return _Layer(places.reshape(-1, 2), sizes, scene.appearance.mark - scene.appearance.face)
