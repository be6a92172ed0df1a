"""Measured points as a dataset."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from benchmarks.harness.text_table import error_columns
from benchmarks.harness.work_precision import WorkPrecisionPoint
from sim.core import Floats

MEASURED = "measured"


def dataset(points: Sequence[WorkPrecisionPoint]) -> xr.Dataset:
    """The points as a dataset ``benchmark``, without its attributes."""
    outcomes = [point.outcome for point in points]
    quantities = error_columns(outcomes)
    misses = [{kind: one.error(kind) for kind in quantities} for one in outcomes]
    work = list(dict.fromkeys(name for one in outcomes for name in one.work))
    return xr.Dataset(
        {
            "own": ("point", np.array([point.own for point in points], dtype=np.int8)),
            "cpu_time": (("point", "run"), padded([one.cpu_s for one in outcomes])),
            "wall_time": (("point", "run"), padded([one.wall_s for one in outcomes])),
            "compile_time": ("point", np.array([one.compile_s for one in outcomes])),
            "memory": ("point", np.array([one.peak_mib * 2**20 for one in outcomes])),
            "error": (
                ("point", "quantity"),
                _by_name(misses, quantities),
            ),
            "count": (("point", "work"), _by_name([one.work for one in outcomes], work)),
            "outcome": ("point", [one.failure or MEASURED for one in outcomes]),
        },
        {
            "quantity": quantities,
            "work": work,
            "method": ("point", [point.method for point in points]),
            "setting": ("point", [point.setting for point in points]),
            "task": ("point", [point.task for point in points]),
            "units": ("point", [point.units for point in points]),
        },
    )


def padded(rows: Sequence[Sequence[float] | Floats]) -> Floats:
    """(n_rows, longest row), NaN where a row is shorter."""
    whole = np.full((len(rows), max(1, *map(len, rows))), np.nan)
    for line, row in zip(whole, rows, strict=True):
        line[: len(row)] = row
    return whole


def _by_name(rows: Sequence[Mapping[str, float]], names: Sequence[str]) -> Floats:
    return np.array([[row.get(name, np.nan) for name in names] for row in rows])
