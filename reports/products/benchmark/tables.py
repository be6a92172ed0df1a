"""Describes points of a benchmark in rows: for the page and as CSV."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import xarray as xr

from reports.base import Table


class Failure(NamedTuple):
    """Describes a point without figures."""

    method: str
    setting: str
    task: str
    reason: str


def table(name: str, data: xr.Dataset) -> Table:
    """Returns every point of a benchmark, or every optimiser of a contest."""
    if "optimiser" in data.dims:
        return _contest(name, data)
    if "video" in data.dims:
        return _tracking(name, data)
    return _points(name, data)


def _tracking(name: str, data: xr.Dataset) -> Table:
    found = data.to_dataframe().reset_index()
    errors = found.pivot_table(
        "error", ["video", "tracker", "frame_rate", "lost", "cpu_time"], "dof"
    ).reset_index()
    columns = {
        "video": errors["video"],
        "tracker": errors["tracker"],
        "frame rate, Hz": errors["frame_rate"],
        "rms of ux, mm": errors["ux"],
        "rms of uy, mm": errors["uy"],
        "rms of theta, deg": np.rad2deg(errors["theta"]),
        "lost, share": errors["lost"],
        "time of a frame, s": errors["cpu_time"],
    }
    return Table(f"{name}.csv", "every video", {k: v.to_numpy() for k, v in columns.items()})


def _contest(name: str, data: xr.Dataset) -> Table:
    evaluated = np.isfinite(data["cpu_time"].values)
    last = np.maximum(evaluated.sum(axis=1) - 1, 0)
    rows = np.arange(len(last))
    columns = {
        "optimiser": data["optimiser"].values,
        "evaluations": evaluated.sum(axis=1),
        "time, s": data["cpu_time"].values[rows, last],
        "loss of the best feasible design, afresh": data["final_loss"].values,
        "KKT residual, mm": data["kkt_residual"].values[rows, last],
        "violation of the last design, mm": data["violation"].values[rows, last],
        "outcome": data["outcome"].values,
    }
    return Table(f"{name}.csv", "every optimiser", columns)


def _points(name: str, data: xr.Dataset) -> Table:
    """Returns times, spread, errors and work."""
    times = data["cpu_time"].values
    known = np.isfinite(times).any(axis=1)
    figures = np.full((4, len(times)), np.nan)
    figures[:, known] = [
        reduce(times[known], axis=1) for reduce in (np.nanmedian, np.nanmin, np.nanmax)
    ] + [np.isfinite(times[known]).sum(axis=1)]
    median, least, most, runs = figures
    columns = {
        **{name: data[name].values for name in ("method", "setting", "task", "units")},
        "time, s": median,
        "least, s": least,
        "most, s": most,
        "runs": runs,
        "compile, s": data["compile_time"].values,
        "peak, MiB": data["memory"].values / 2**20,
        **{
            f"error of {quantity}": data["error"].sel(quantity=quantity).values
            for quantity in data["quantity"].values
        },
        **{str(work): data["count"].sel(work=work).values for work in data["work"].values},
        "outcome": data["outcome"].values,
    }
    return Table(f"{name}.csv", "every point: times, errors, work", columns)


def rows(of: Table) -> Iterator[list[str]]:
    """Yields its rows for the page, figures to three digits."""
    for row in zip(*of.columns.values(), strict=True):
        yield [_cell(value) for value in row]


def _cell(value: object) -> str:
    if isinstance(value, float | np.floating):
        return "" if np.isnan(value) else f"{value:.3g}"
    return str(value)


def failures(data: xr.Dataset) -> list[Failure]:
    """Returns the points (or optimisers) that have no figures, with the reason."""
    if "outcome" not in data:
        return []
    (dim,) = data["outcome"].dims
    failed = data.isel({dim: np.flatnonzero(data["outcome"].values != "measured")})
    if "optimiser" in data.dims:
        pairs = zip(failed["optimiser"].values, failed["outcome"].values, strict=True)
        return [Failure(str(name), "", "design", str(reason)) for name, reason in pairs]
    names = ("method", "setting", "task", "outcome")
    return [Failure(*map(str, row)) for row in zip(*(failed[k].values for k in names), strict=True)]
