"""Tabulates designs and their optimisation."""

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

Columns = dict[str, NDArray[Any]]


def vertices(design: xr.Dataset) -> Columns:
    """Returns one row a vertex, mm."""
    shape = design["vertices"].transpose("unit", "vertex", "xy").values
    initial = design["vertices_initial"].transpose("unit", "vertex", "xy").values
    unit, vertex = np.nonzero(~np.isnan(shape[..., 0]))
    return {
        **{name: design[name].values[unit] for name in ("unit", "i", "j", "region")},
        "vertex": vertex,
        "x_mm": shape[unit, vertex, 0],
        "y_mm": shape[unit, vertex, 1],
        "x_initial_mm": initial[unit, vertex, 0],
        "y_initial_mm": initial[unit, vertex, 1],
    }


def history(design: xr.Dataset) -> Columns:
    """Returns one row an evaluation."""
    loss = design["loss"].transpose("method", "evaluation").values
    cases = design["loss_case"].transpose("method", "evaluation", "case").values
    method, evaluation = np.nonzero(np.isfinite(loss))
    columns = {
        "method": design["method"].values[method],
        "evaluation": evaluation,
        "J": loss[method, evaluation],
    }
    names = [f"J_{angle:g}deg" for angle in design["direction"].values]
    if len(set(names)) < len(names):  # of several drives, or of one without a direction
        names = [f"J_load_{k}" for k in range(1, len(names) + 1)]
    for k, name in enumerate(names):
        columns[name] = cases[method, evaluation, k]
    for name in ("violation", "accepted"):
        values = design[name].transpose("method", "evaluation").values
        columns[name] = values[method, evaluation]
    return columns
