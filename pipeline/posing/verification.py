"""Assembles the dataset of structures that were simulated in other ways."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

AS_RUN = "as run"


class CheckResult(NamedTuple):
    """Holds the extremes of a structure's load cases under one check; fields as in the dataset."""

    loss: float
    departure: float
    min_void_angle: float
    gap: float
    overlaps: int
    contact_pairs: int
    unstable: int = 0
    error: float = np.nan
    time_step: float = np.nan


NOTHING = CheckResult(np.nan, np.nan, np.nan, np.nan, 0, 0)

Rows = Mapping[str, Mapping[str, CheckResult]]


def assemble_verification(found: Rows, status: Mapping[str, str]) -> xr.Dataset:
    """Assembles the dataset ``verification``; structures without a result have a reason."""
    import xarray as xr

    structures = list(found[AS_RUN])
    rows = [
        [found[name][each] if name in found else NOTHING for each in structures] for name in status
    ]
    columns = {
        field: np.array([[getattr(numbers, field) for numbers in row] for row in rows])
        for field in CheckResult._fields
    }
    return xr.Dataset(
        {name: (("check", "structure"), values) for name, values in columns.items()}
        | {"status": (("check",), list(status.values()))},
        {"check": list(status), "structure": structures},
    )
