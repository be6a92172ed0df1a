"""Describes a sweep over direction and frequency of the drive as a map."""

import numpy as np
import xarray as xr

from pipeline.problem.sections import DIRECTIONS

MAPPED = {DIRECTIONS: "direction", "drive.frequency": "frequency"}
"""The parameters of a map, and the names of its axes."""


def frequency_map(sweep: xr.Dataset) -> xr.Dataset:
    """Returns the results of a sweep over its two axes (direction in deg, frequency in Hz).

    Points are where both lists of values cross, whatever the order of the cases.
    """
    axes, places = {}, []
    for key, name in MAPPED.items():
        values, place = np.unique(sweep["value"].sel(parameter=key).values, return_inverse=True)
        axes[name] = values
        places.append(place)
    size = [len(values) for values in axes.values()]
    made = xr.Dataset(coords=axes)
    for name in ("loss", "loss_altered", "min_void_angle", "status"):
        values = sweep[name].values
        spread = np.full(size, np.nan if values.dtype.kind == "f" else "", values.dtype)
        spread[tuple(places)] = values
        made[name] = (tuple(axes), spread, sweep[name].attrs)
    return made
