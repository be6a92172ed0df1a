"""Tabulates designs and their optimisation."""

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

Columns = dict[str, NDArray[Any]]


def headed(name: str, unit: str) -> str:
    """Heads a column by its quantity and unit, if it has one."""
    return name if unit == "1" else f"{name}_{unit.replace(' ', '').replace('°', 'deg')}"


def headed_columns(data: xr.Dataset, *names: str) -> Columns:
    """Tabulates variables of a dataset, flattened, under headings with their units."""
    return {
        headed(name, data[name].attrs.get("units", "1")): data[name].values.ravel()
        for name in names
    }


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
    unit = design["loss"].attrs.get("units", "1")
    columns = {
        "method": design["method"].values[method],
        "evaluation": evaluation,
        headed("J", unit): loss[method, evaluation],
    }
    names = [f"J_{angle:g}deg" for angle in design["direction"].values]
    if len(set(names)) < len(names):  # of several drives, or of one without a direction
        names = [f"J_load_{k}" for k in range(1, len(names) + 1)]
    for k, name in enumerate(names):
        columns[headed(name, unit)] = cases[method, evaluation, k]
    for name in ("violation", "accepted"):
        values = design[name].transpose("method", "evaluation").values
        columns[name] = values[method, evaluation]
    return columns
