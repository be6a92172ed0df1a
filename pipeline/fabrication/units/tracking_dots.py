"""Places the tracking dots of a unit, and the holes for the pins that align its layers."""

import math

import numpy as np
import shapely
from scipy.spatial import distance
from shapely import Polygon

from pipeline.fabrication.parts import Circle, Strokes
from pipeline.problem.sections import Fabrication, Markers
from pipeline.runtime import UserError

_RIM = 0.2  # mm between a dot and the rim of the unit
_CLEAR = 0.3  # mm between a hole and a letter
_GRID = 1e-3  # mm, of holes
_CHORD = 5e-3  # mm by which round offsets fall short
_SHARES = (1.0, 0.75, 0.5)  # of the set diameter
_SPREADS = np.array([1.0, 0.9, 0.8, 0.7, 0.6, 0.5])
_ANGLES = np.deg2rad(np.arange(0.0, 180.0, 5.0))


def dots(outline: Polygon, settings: Markers) -> tuple[Circle, ...]:
    """Places dots on a line through the centroid, spread as far as set or as there is room for.

    Where there is no room for several dots of half the set diameter, there is one.

    Returns:
        The dots; none if there is no room for one.
    """
    rooms = [
        (diameter, outline.buffer(-(diameter / 2 + _RIM)))
        for diameter in (share * settings.diameter for share in _SHARES)
    ]
    rooms = [(diameter, free) for diameter, free in rooms if not free.is_empty]
    if settings.count > 1:
        for diameter, free in rooms:
            if line := _line(free, outline, diameter, settings):
                return line
    return tuple(_one(free, outline, diameter) for diameter, free in rooms[:1])


def _line(
    free: shapely.Geometry, outline: Polygon, diameter: float, settings: Markers
) -> tuple[Circle, ...]:
    centre = np.array([outline.centroid.x, outline.centroid.y])
    least = 1.5 * diameter * (settings.count - 1)
    spreads = settings.spread * _SPREADS
    spread, angle = (
        grid.ravel() for grid in np.meshgrid(spreads[spreads >= least], _ANGLES, indexing="ij")
    )
    arm = spread[:, None] / 2 * np.column_stack([np.cos(angle), np.sin(angle)])
    shares = np.linspace(-1.0, 1.0, settings.count)
    places = centre + shares[None, :, None] * arm[:, None, :]
    shapely.prepare(free)
    fits = np.flatnonzero(shapely.contains_xy(free, places[..., 0], places[..., 1]).all(axis=1))
    if not len(fits):
        return ()
    widest = fits[spread[fits] == spread[fits[0]]]
    room = shapely.distance(shapely.multipoints(places[widest]), free.boundary)
    best = places[widest[np.argmax(np.round(room, 6))]]
    return tuple(Circle((float(x), float(y)), diameter) for x, y in best)


def _one(free: shapely.Geometry, outline: Polygon, diameter: float) -> Circle:
    spot = outline.centroid if free.contains(outline.centroid) else free.representative_point()
    return Circle((float(spot.x), float(spot.y)), diameter)


def pin_holes(outline: Polygon, written: Strokes, settings: Fabrication) -> tuple[Circle, ...]:
    """Places two holes as far apart as walls and letters allow; one or none without room.

    A wall around a hole is as thick as those around slots, between two holes as well.

    Raises:
        UserError: the holes are narrower than a layer is thick, which no laser cuts.
    """
    pin, wall, layer = settings.laser.pin, settings.minimum_wall, settings.laser_sheet_thickness
    if pin < layer:
        what = f"pins of {pin:g} mm in layers of {layer:.3g} mm: a laser cuts no hole so narrow"
        least = math.ceil(100 * layer - _GRID) / 100
        remedy = f"give at least {least:g} mm; a smaller aspect_ratio makes thinner layers"
        raise UserError(what, key="fabrication.laser.pin", value=f"{pin:g} mm", remedy=remedy)
    letters = shapely.MultiLineString(list(written)).buffer(pin / 2 + _CLEAR)
    room = outline.buffer(-(pin / 2 + wall + _CHORD)).difference(letters)
    if room.is_empty:
        return ()
    spots = np.unique(np.round(shapely.get_coordinates(room) / _GRID) * _GRID, axis=0)
    apart = distance.cdist(spots, spots)
    far = spots[list(np.unravel_index(apart.argmax(), apart.shape))]
    kept = far if apart.max() >= pin + wall else far[:1]
    return tuple(Circle((float(x), float(y)), pin) for x, y in kept)
