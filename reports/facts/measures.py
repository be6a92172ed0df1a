"""Reduces the datasets of a study to numbers: reductions, peak-to-peak values, symmetry."""

import numpy as np
import shapely
import xarray as xr

from reports.study import CLOAK, SOURCE, ReportScene, RigidUnits
from sim.core import Floats

LAST_SAMPLE = 1.0 + 1e-9
"""Slack on the end of a time window, so that rounding does not drop its last sample."""


def magnitude(displacement: xr.DataArray, scale: Floats) -> xr.DataArray:
    """Finds |U| of the dimensionless displacement U = (ux/s, uy/s, theta), any dims but dof."""
    divisors = xr.DataArray(scale, dims="dof", coords={"dof": displacement["dof"]})
    squares: xr.DataArray = (displacement / divisors) ** 2
    return squares.sum("dof") ** 0.5


def mean_magnitude(response: xr.Dataset, scene: ReportScene, until: float) -> xr.DataArray:
    """Averages |U| (structure, case) over region of interest and time [0, until] (trapezoids)."""
    window = response["displacement"].sel(time=slice(None, until * LAST_SAMPLE))
    inside = response["roi"].values.astype(bool)
    size = magnitude(window.isel(unit=inside), scene.scale).mean("unit")
    duration = float(size["time"][-1] - size["time"][0])
    integral: xr.DataArray = size.integrate("time")
    return integral / duration


def reduction(values: xr.DataArray) -> float:
    """Returns 1 - cloaked/altered of values (structure,)."""
    return 1.0 - float(values.sel(structure="cloaked")) / float(values.sel(structure="altered"))


def nearest_case(response: xr.Dataset, direction: float) -> int:
    """Returns index of the load case whose direction is nearest to `direction` in degrees."""
    return int(np.argmin(np.abs(response["direction"].values - direction)))


def case_direction(response: xr.Dataset, direction: float) -> float:
    """Returns direction in degrees of the load case that is nearest to `direction`."""
    return float(response["direction"].values[nearest_case(response, direction)])


def peak_to_peak(series: xr.DataArray, until: float) -> xr.DataArray:
    """Returns peak-to-peak value over the time [0, until]."""
    window = series.sel(time=slice(None, until * LAST_SAMPLE))
    return window.max("time") - window.min("time")


def asymmetry(structure: RigidUnits, middle: tuple[float, float]) -> Floats:
    """Finds how far (n,) in mm cloak vertices are from the design turned by 90° about `middle`.

    Each unit is turned onto the unit whose lattice point it meets; its vertices are paired with
    that unit's in order, from the start that fits best. Zero for a four-fold symmetric design.
    """
    centre = np.array(middle)
    turned_site = _quarter_turn(structure.site, centre)
    gaps = np.linalg.norm(turned_site[:, None] - structure.site[None], axis=2)
    partner = gaps.argmin(axis=1)
    inside = np.flatnonzero(np.isin(structure.region, (CLOAK, SOURCE)))
    turned = _quarter_turn(structure.vertices, centre)
    return np.concatenate(
        [_best_fit(turned[unit], structure.vertices[partner[unit]]) for unit in inside]
    )


def _quarter_turn(points: Floats, centre: Floats) -> Floats:
    away = points - centre
    return centre + np.stack([-away[..., 1], away[..., 0]], axis=-1)


def _best_fit(polygon: Floats, other: Floats) -> Floats:
    """Distances between the vertices of two polygons, over the start that makes them least."""
    first, second = (shape[~np.isnan(shape[:, 0])] for shape in (polygon, other))
    if len(first) != len(second):
        return np.full(len(first), np.inf)
    tries = [
        np.linalg.norm(first - np.roll(second, start, axis=0), axis=1)
        for start in range(len(second))
    ]
    return min(tries, key=lambda distances: float(distances.sum()))


def porosity(structure: RigidUnits, middle: tuple[float, float], low: float, high: float) -> float:
    """Returns open share of the ring between two distances (mm) from `middle`, by geometry."""
    disc = shapely.Point(middle)
    ring = disc.buffer(high, quad_segs=64).difference(disc.buffer(low, quad_segs=64))
    polygons = [polygon[~np.isnan(polygon[:, 0])] for polygon in structure.vertices]
    units = shapely.union_all([shapely.Polygon(polygon) for polygon in polygons])
    return 1.0 - float(ring.intersection(units).area / ring.area)


def site_radius(structure: RigidUnits, middle: tuple[float, float], region: int) -> float:
    """Finds largest distance in mm of a unit's initial lattice point in `region` from `middle`."""
    members = structure.site[structure.region == region]
    return float(np.linalg.norm(members - np.array(middle), axis=1).max()) if len(members) else 0.0


def first_within(history: Floats, best: float, share: float) -> int:
    """Returns first evaluation after which `share` of the way from the start to `best` is done."""
    target = history[0] - share * (history[0] - best)
    return int(np.argmax(np.fmin.accumulate(history) <= target))
