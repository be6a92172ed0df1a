"""Describes points of a benchmark in rows: for the page and as CSV."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
import xarray as xr

from reports.base import Table


def table(name: str, data: xr.Dataset) -> Table:
    """Returns every point of a benchmark, or every optimiser of a contest."""
    if "optimiser" in data.dims:
        return _optimiser_table(name, data)
    if "video" in data.dims:
        return _tracking(name, data)
    columns = {column: values.to_numpy() for column, values in points(data).items()}
    return Table(f"{name}.csv", "every point: times, errors, work", columns)


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


def _optimiser_table(name: str, data: xr.Dataset) -> Table:
    evaluated = np.isfinite(data["cpu_time"].to_numpy())
    last = np.maximum(evaluated.sum(axis=1) - 1, 0)
    rows = np.arange(len(last))
    columns = {
        "optimiser": data["optimiser"].to_numpy(),
        "evaluations": evaluated.sum(axis=1),
        "time, s": data["cpu_time"].to_numpy()[rows, last],
        "loss of the best feasible design, afresh": data["final_loss"].to_numpy(),
        "KKT residual, mm": data["kkt_residual"].to_numpy()[rows, last],
        "violation of the last design, mm": data["violation"].to_numpy()[rows, last],
        "outcome": data["outcome"].to_numpy(),
    }
    return Table(f"{name}.csv", "every optimiser", columns)


def points(data: xr.Dataset) -> pd.DataFrame:
    """Tabulates every point of a benchmark: times, spread, errors and work."""
    times = data["cpu_time"].to_numpy()
    known = np.isfinite(times).any(axis=1)
    figures = np.full((4, len(times)), np.nan)
    figures[:, known] = [
        reduce(times[known], axis=1) for reduce in (np.nanmedian, np.nanmin, np.nanmax)
    ] + [np.isfinite(times[known]).sum(axis=1)]
    errors, work = data["error"], data["count"]
    columns = {
        **{name: data[name].to_numpy() for name in ("method", "setting", "task", "units")},
        **dict(zip(("time, s", "least, s", "most, s", "runs"), figures, strict=True)),
        "compile, s": data["compile_time"].to_numpy(),
        "peak, MiB": data["memory"].to_numpy() / 2**20,
        **{f"error of {name}": errors.sel(quantity=name) for name in data["quantity"].to_numpy()},
        **{str(name): work.sel(work=name) for name in data["work"].to_numpy()},
        "outcome": data["outcome"].to_numpy(),
    }
    return pd.DataFrame({name: np.asarray(column) for name, column in columns.items()})


def measured(data: xr.Dataset, task: str | None = None) -> pd.DataFrame:
    """Selects the points that have figures: all, or those of a task."""
    found = points(data)
    return found[(found["outcome"] == "measured") & (found["task"] == (task or found["task"]))]


def rows(of: Table) -> Iterator[list[str]]:
    """Yields its rows for the page, figures to three digits."""
    for row in zip(*of.columns.values(), strict=True):
        yield [_cell(value) for value in row]


def _cell(value: object) -> str:
    if isinstance(value, float | np.floating):
        return "" if np.isnan(value) else f"{value:.3g}"
    return str(value)


def failures(data: xr.Dataset) -> list[tuple[str, ...]]:
    """Tells method, setting, task and reason of the points (or optimisers) without figures."""
    if "outcome" not in data:
        return []
    (dim,) = data["outcome"].dims
    failed = data.isel({dim: np.flatnonzero(data["outcome"] != "measured")})
    if "optimiser" in data.dims:
        failed = failed.rename(optimiser="method").assign(setting="", task="design")
    told = (np.broadcast_to(failed[k], failed.sizes[failed["outcome"].dims[0]]) for k in _TOLD)
    return [tuple(map(str, row)) for row in zip(*told, strict=True)]


_TOLD = ("method", "setting", "task", "outcome")
